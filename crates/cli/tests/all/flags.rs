//! Every flag of `converge` on every study: honoured, or refused.
//! And the command in a report is the one that makes its numbers.
#![cfg(unix)]

use crate::common::{PROGRAM, folder, linelit, path, read, smallest, succeeded, text};
use crate::study_plans::without_times;
use linelit_papers::{Study, studies, study};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Flags that a study honours or refuses together, with a value of each, and the name under which a
/// record has it.
type Group = &'static [(&'static str, &'static str, &'static str)];

const MEASURED: Group = &[
    ("--estimators", "point-area,line-area", "estimators"),
    ("--samplers", "halton", "samplers"),
    ("--lights", "one:power", "lights"),
    ("--spheres", "facets", "spheres"),
    ("--samples", "2,3", "samples"),
    ("--trials", "3", "trials"),
    ("--pixels", "3x2", "pixels"),
];
/// The seeds of trials come behind the first one: they wrap around.
const LAST_SEED: &str = "18446744073709551615";
const SEED: Group = &[("--seed", LAST_SEED, "seed")];
const BUDGET: Group = &[("--time-budget", "1e-9", "time budget")];
const FILES: Group = &[("--root", "/", ""), ("--allow-outside", "", "")];
const READING: Group = &[("--strict", "", "")];
const ALWAYS: Group = &[
    ("--threads", "1", ""),
    ("--out", "", ""),
    ("--fresh", "", ""),
    ("--json", "", ""),
];
const GROUPS: [Group; 6] = [MEASURED, SEED, BUDGET, FILES, READING, ALWAYS];

/// A flag with its value, if it has one.
fn words<'a>(&(flag, value, _): &(&'a str, &'a str, &str)) -> Vec<&'a str> {
    let words = [flag, value].into_iter();
    words.filter(|word| !word.is_empty()).collect()
}

/// The words that name a study, and a scene of a file where it has none of its own.
fn named<'a>(name: &'a str, scene: &'a Path) -> Vec<&'a str> {
    match name {
        SCENE => vec![path(scene)],
        _ if study(name, None).is_none() => vec![name, path(scene)],
        _ => vec![name],
    }
}

/// The row of scenes of one's own.
const SCENE: &str = "SCENE.pbrt";

/// Runs `converge` on a study at its smallest size.
fn converge(dir: &Path, study: &[&str], more: &[&str]) -> (Option<i32>, String, String) {
    let out = dir.join("out");
    let words = [
        &["converge"],
        study,
        &["--smallest", "--out", path(&out)],
        more,
    ]
    .concat();
    let output = linelit(&words);
    let said = text(&output.stderr);
    assert!(
        output.status.code() == Some(0) || output.stdout.is_empty(),
        "{words:?}"
    );
    (output.status.code(), text(&output.stdout), said)
}

/// That a study refuses a flag, and says so before anything is done.
fn refuses(dir: &Path, study: &[&str], flag: &(&str, &str, &str)) {
    let fresh = dir.join("untouched");
    let line = [&["converge"], study, &["--smallest", "--out", path(&fresh)]].concat();
    let output = linelit(&[line, words(flag)].concat());
    let said = text(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(2),
        "{study:?} {}: {said}",
        flag.0
    );
    assert!(said.contains(flag.0) && said.contains(": "), "{said}");
    assert!(!fresh.exists(), "{study:?} {}", flag.0);
}

/// A record's numbers, as text.
fn numbers(json: &str) -> Value {
    let mut value = serde_json::from_str(json).unwrap();
    without_times(&mut value);
    value
}

/// What a convergence study says of itself when all flags of a group are given.
fn recorded(dir: &Path, study: &[&str]) {
    let plan = dir.join("plan");
    let flags: Vec<&str> = MEASURED.iter().chain(SEED).flat_map(words).collect();
    let to = ["--smallest", "-o", path(&plan)];
    succeeded(&[&["plan", "converge"], study, &to, &flags[..]].concat());
    let plan_text = fs::read_to_string(plan.join("plan.json")).unwrap();
    let said: Value = serde_json::from_str(&plan_text).unwrap();
    let settings = &said["settings"];
    for (_, value, key) in MEASURED {
        assert_eq!(settings["settings"][key], *value, "{study:?}: {settings}");
    }
    let words = settings["converge"].as_array().unwrap();
    assert!(
        words.contains(&Value::from(format!("--seed={LAST_SEED}"))),
        "{words:?}"
    );
    fs::remove_dir_all(plan).unwrap();
}

/// Kinds of studies, and whether each refuses a group of flags.
const KINDS: [(&str, [bool; 6]); 3] = [
    (
        "convergence, on built-in scenes",
        [false, false, false, true, false, false],
    ),
    ("convergence, on scenes of files", [false; 6]),
    (
        "claims and drawings",
        [true, false, true, true, false, false],
    ),
];

/// That a study honours and refuses flags as its kind does.
fn check(dir: &Path, name: &str, scene: &Path) {
    let study_words = named(name, scene);
    let files = name == SCENE || study_words.len() > 1;
    let found = (name != SCENE).then(|| study(name, Some(path(scene))).unwrap());
    let pictures = matches!(found, Some(Study::Findings(_)));
    let kind = if pictures { 2 } else { usize::from(files) };
    if !pictures {
        recorded(dir, &study_words);
    }
    for (group, refused) in GROUPS.iter().zip(KINDS[kind].1) {
        for flag in group.iter().filter(|_| refused) {
            refuses(dir, &study_words, flag);
        }
    }
}

/// The table of `docs/studies.md` is what the program does.
#[test]
fn every_flag_is_honoured_or_refused() {
    let dir = folder("flags-table");
    let scene = dir.join("scene.pbrt");
    fs::copy("tests/cornell/v4.pbrt", &scene).unwrap();
    for name in studies().map(|(name, _)| name).chain([SCENE]) {
        check(&dir, name, &scene);
    }
    let mut table = String::from("| study |");
    for group in GROUPS {
        let flags: Vec<String> = group.iter().map(|(flag, ..)| format!("`{flag}`")).collect();
        table += &format!(" {} |", flags.join(", "));
    }
    table += &format!("\n|{}\n", "---|".repeat(1 + GROUPS.len()));
    for (kind, refused) in KINDS {
        let cells = refused.map(|r| if r { "refused" } else { "yes" });
        table += &format!("| {kind} | {} |\n", cells.join(" | "));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = fs::read_to_string(root.join("../../docs/studies.md")).unwrap();
    assert!(docs.contains(&table), "docs/studies.md lacks\n{table}");
}

/// A scene of a triangle and a ball that shine, so that choosing among lights and how they are seen
/// matter.
fn two_lights(dir: &Path) -> PathBuf {
    let scene = dir.join("two.pbrt");
    let light = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 9 9 9 ] ";
    let quad =
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -1 3 0 1 3 0 0 3 1 ]";
    let ball = "Translate 2 2 0 Shape \"sphere\" \"float radius\" 0.5";
    let floor = "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \
                 \"point3 P\" [ -9 0 -9 -9 0 9 9 0 9 9 0 -9 ]";
    let block = "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \
                 \"point3 P\" [ -1 1 -1 1 1 -1 0 1 1 ]";
    let camera = "LookAt 0 6 9 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 40";
    fs::write(
        &scene,
        format!(
            "{camera}\nWorldBegin\n{light}{quad} AttributeEnd\n{light}{ball} AttributeEnd\n\
             {floor}\n{block}\n"
        ),
    )
    .unwrap();
    scene
}

/// A column of a record's rows.
fn column(value: &Value, key: &str) -> Vec<Value> {
    let rows = value["rows"].as_array().unwrap().iter();
    rows.map(|row| row[key].clone()).collect()
}

/// Each flag of a convergence study changes what is measured as it says, and nothing else does.
#[test]
fn flags_change_what_is_measured() {
    let dir = folder("flags-measured");
    let scene = two_lights(&dir);
    let own = [
        "--estimators",
        "point-solid-angle",
        "--samplers",
        "stratified",
        "--json",
    ];
    let run = |more: &[&str]| -> Value {
        let (code, said, error) = converge(&dir, &[path(&scene)], &[&own[..], more].concat());
        assert_eq!(code, Some(0), "{more:?}: {error}");
        numbers(&said)
    };
    let base = run(&[]);
    for flag in MEASURED.iter().chain(SEED).filter(|f| !own.contains(&f.0)) {
        let found = run(&words(flag));
        assert_ne!(column(&found, "mse"), column(&base, "mse"), "{}", flag.0);
        let said = &found["settings"][flag.2];
        let seed = flag.2 == "seed" && found["seed"] == u64::MAX;
        assert!(seed || *said == flag.1, "{}: {said}", flag.0);
    }
    assert_eq!(column(&run(&["--trials", "3"]), "trials"), [3, 3]);
    assert_eq!(column(&run(&["--samples", "2,3"]), "samples"), [2, 3]);
    assert_eq!(
        column(&run(&["--pixels", "600,400;700,420"]), "pixels"),
        ["600,400;700,420"; 2]
    );
    // The rest changes no number.
    for group in [FILES, READING, ALWAYS] {
        for flag in group.iter().filter(|f| !["--out", "--json"].contains(&f.0)) {
            assert_eq!(run(&words(flag)), base, "{}", flag.0);
        }
    }
}

/// Estimators and patterns are the requested ones, what the budget leaves out is said, and strictly
/// what is only worth a word is an error.
#[test]
fn flags_say_what_is_measured() {
    let dir = folder("flags-said");
    let scene = two_lights(&dir);
    let own = |flag: &str, value: &str| {
        let words = ["--json", flag, value];
        let (_, said, _) = converge(&dir, &[path(&scene)], &words);
        numbers(&said)
    };
    let by = own("--estimators", "point-area,line-area");
    assert_eq!(by["settings"]["estimators"], "point-area,line-area");
    assert_eq!(column(&by, "estimator")[..2], ["point-area"; 2]);
    assert!(
        column(&own("--samplers", "halton"), "sampler")
            .iter()
            .all(|s| s == "halton")
    );
    let (late, _, why) = converge(&dir, &[path(&scene)], &["--time-budget", "1e-9"]);
    assert!(late == Some(1) && why.contains("the time budget"), "{why}");
    let odd = format!(
        "{}\nShape \"heightfield\"\n",
        fs::read_to_string(&scene).unwrap()
    );
    fs::write(&scene, odd).unwrap();
    for (flags, code) in [(&[][..], 0), (&["--strict"], 1)] {
        let (found, _, said) = converge(&dir, &[path(&scene)], flags);
        assert_eq!(found, Some(code), "{said}");
    }
}

/// Pages of claims and drawings: seeds change their numbers, the largest too, but where nothing
/// is random; threads and how scenes are read do not; what they print as JSON is what they leave.
#[test]
fn studies_of_pictures_honour_what_they_do_not_refuse() {
    let dir = folder("flags-pictures");
    for (name, _) in studies() {
        let Some(Study::Findings(_)) = study(name, None) else {
            continue;
        };
        let file = format!("{name}.json");
        let kept = |folder: &Path| {
            let mut kept = read(folder, &file);
            without_rates(&mut kept);
            kept
        };
        let run = |more: &[&str]| {
            let (code, said, error) = converge(&dir, &[name], &[&["--json"], more].concat());
            assert_eq!(code, Some(0), "{name} {more:?}: {error}");
            let said: Value = serde_json::from_str(&said).unwrap();
            assert_eq!(read(&dir.join("out"), &file), said, "{name}");
            kept(&dir.join("out"))
        };
        let base = kept(&smallest(name).folder);
        let reading = ["--strict"];
        let same = [&["--fresh", "--threads", "3"][..], &reading].concat();
        assert_eq!(run(&same), base, "{name}");
        // Drawings alone, and times alone.
        if !["billen-fig5", "peters-table1", "salesin-fig4"].contains(&name) {
            assert_ne!(run(&["--seed", LAST_SEED]), base, "{name}");
        }
    }
}

/// Takes away what is a time, a rate, or a ratio of times.
fn without_rates(value: &mut Value) {
    let timed = ["second", "rate", "ns per", "ns_per", "over area"];
    match value {
        // A claim about a time, and how many claims have which verdict.
        Value::Object(map) if map.get("timed") == Some(&Value::Bool(true)) => map.clear(),
        Value::Object(map) => {
            let verdicts = ["confirmed", "consistent", "stronger", "weaker", "refuted"];
            map.retain(|key, _| !verdicts.contains(&key.as_str()));
            map.retain(|key, _| !timed.iter().any(|word| key.contains(word)));
            map.values_mut().for_each(without_rates);
        }
        Value::Array(list) => list.iter_mut().for_each(without_rates),
        _ => {}
    }
}

/// A shell that finds the program under its name.
fn shell(command: &str, dir: &Path) {
    let bin: PathBuf = Path::new(PROGRAM).parent().unwrap().to_owned();
    let output = Command::new("sh")
        .args(["-c", command])
        .env("PATH", format!("{}:/usr/bin:/bin", path(&bin)))
        .current_dir(dir)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{command}: {}",
        text(&output.stderr)
    );
}

/// The command in a report, run by a shell, repeats its numbers to the bit: with words that a shell
/// would read otherwise, of a named study, and of a plan that was merged.
#[test]
fn the_command_of_a_report_repeats_it() {
    let dir = folder("flags-command");
    let out = dir.join("it's $HOME; (a) report");
    let lines = "line-area[orientation=fixed:0.25],point-area";
    let study = [
        "converge",
        "cornell-box-small",
        "--smallest",
        "--estimators",
        lines,
        "--pixels",
        "100,200;130,220",
        "--seed",
        "5",
        "--lights",
        "one:power",
    ];
    let read = |folder: &Path| {
        let json = fs::read_to_string(folder.join("results.json")).unwrap();
        let value: Value = serde_json::from_str(&json).unwrap();
        let command = value["command"].as_str().unwrap().to_owned();
        (numbers(&json), command)
    };
    let again = |study: &[&str]| {
        succeeded(study);
        let (first, command) = read(&out);
        fs::remove_dir_all(&out).unwrap();
        shell(&command, &dir);
        assert_eq!(read(&out), (first.clone(), command), "{study:?}");
        first
    };
    let whole = again(&[&study[..], &["--out", path(&out)]].concat());
    assert!(!whole["rows"].as_array().unwrap().is_empty());
    again(&[
        "converge",
        "salesin-fig5",
        "--smallest",
        "--out",
        path(&out),
    ]);

    // Of a plan: without `--out`, so that the report comes into the folder where it is run.
    let (plan, merged) = (dir.join("plan"), dir.join("merged"));
    let words = [&["plan"], &study[..], &["--strict", "-o", path(&plan)]].concat();
    succeeded(&words);
    succeeded(&["run", path(&plan)]);
    succeeded(&["merge", path(&plan), "-o", path(&merged)]);
    let (numbers, command) = read(&merged);
    assert!(command.ends_with(" --strict"), "{command}");
    assert_eq!(numbers, whole);
    shell(&command, &dir);
    assert_eq!(read(&dir.join("out")).0, whole, "{command}");
}

/// The same of pictures, where the command stands on the page alone.
#[test]
fn the_command_of_a_page_of_pictures_repeats_it() {
    let dir = folder("flags-pictures-command");
    let out = dir.join("it's $HOME; (a) report");
    let study = [
        "converge",
        "shirley",
        "--smallest",
        "--seed",
        "3",
        "--out",
        path(&out),
    ];
    succeeded(&study);
    let rows = || fs::read_to_string(out.join("shirley.json")).unwrap();
    let (first, page) = (rows(), fs::read_to_string(out.join("report.html")).unwrap());
    let (_, rest) = page.split_once("<pre><code>").unwrap();
    let (command, _) = rest.split_once("</code>").unwrap();
    fs::remove_dir_all(&out).unwrap();
    shell(
        &command
            .replace("&quot;", "\"")
            .replace("&#39;", "'")
            .replace("&amp;", "&"),
        &dir,
    );
    assert_eq!(rows(), first);
}

/// Studies are named with what each costs, by `--list` and where no study is meant.
#[test]
fn studies_are_named_with_their_costs() {
    let listed = linelit(&["converge", "--list"]);
    assert!(listed.status.success());
    let said = text(&listed.stdout);
    assert_eq!(said, text(&linelit(&["list", "studies"]).stdout));
    for (name, about) in studies() {
        let line = said
            .lines()
            .find(|l| l.starts_with(&format!("{name} ")))
            .unwrap();
        assert!(line.ends_with(about), "{line}");
        let unit = |u: &&str| line.contains(&format!(" {u} CPU  "));
        assert!(["s", "min", "h"].iter().any(unit), "{line}");
    }
    let json: Value =
        serde_json::from_slice(&linelit(&["converge", "--list", "--json"]).stdout).unwrap();
    let listed = json.as_array().unwrap();
    assert_eq!(listed.len(), studies().count());
    for study in listed {
        let seconds = study["cpu_seconds"].as_f64();
        assert!(seconds.is_some_and(|seconds| seconds > 0.0), "{study}");
        let name = study["name"].as_str().unwrap();
        assert_eq!(seconds, linelit_papers::processor_seconds(name), "{study}");
    }
    let strange = linelit(&["converge", "bananas"]);
    assert_eq!(strange.status.code(), Some(1));
    let error = text(&strange.stderr);
    assert!(
        error.contains("cornell-box-large") && error.contains(said.trim_end()),
        "{error}"
    );
    for (slip, meant) in [
        ("billen-order", "billen-orders"),
        ("salesin-fg7", "salesin-fig7"),
    ] {
        let error = text(&linelit(&["converge", slip]).stderr);
        assert!(
            error.contains(&format!("did you mean the study `{meant}`?")),
            "{error}"
        );
    }
}
