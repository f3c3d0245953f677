//! The words of the command line: lists, help, completions, and the messages about unknown words.

use crate::common::{folder, linelit, names, path, succeeded, text};
use linelit_estimators::{Estimator, KnownKind, LightKind, Technique};
use linelit_samplers::SamplerKind;

fn said(arguments: &[&str]) -> String {
    let output = succeeded(arguments);
    text(&output.stdout)
}

/// Other commands accept all names that `list` prints.
#[test]
fn what_is_listed_is_understood() {
    let all = said(&["list"]);
    let all_json: serde_json::Value = serde_json::from_str(&said(&["list", "--json"])).unwrap();
    for (what, count) in [
        ("scenes", 19),
        ("studies", 32),
        ("estimators", 17),
        ("samplers", SamplerKind::ALL.len()),
    ] {
        let json: serde_json::Value =
            serde_json::from_str(&said(&["list", what, "--json"])).unwrap();
        let rows = json.as_array().unwrap();
        assert_eq!(rows.len(), count, "{what}");
        assert_eq!(json, all_json[what]);
        let lines = said(&["list", what]);
        for (row, line) in rows.iter().zip(lines.lines()) {
            let [name, about] = ["name", "about"].map(|key| row[key].as_str().unwrap());
            assert!(line.starts_with(name) && line.ends_with(about), "{line}");
            assert!(all.contains(&format!("  {line}\n")), "{line}");
            match what {
                "scenes" => drop(linelit_scenes::SceneLocation::find(name).unwrap()),
                "studies" => assert!(
                    linelit_papers::study(name, Some("plates")).is_some(),
                    "{name}"
                ),
                "estimators" => drop(name.parse::<Estimator>().unwrap()),
                _ => drop(name.parse::<SamplerKind>().unwrap()),
            }
        }
        assert_eq!(lines.lines().count(), count);
    }
}

const DIFFUSE: &str = "diffuse";
const LOBES: &str = "lobes of Phong";
const COSINES: &str = "narrow transformed cosines";
const NOTHING: &str = "nothing known";

/// Returns the method of a technique for a kind of light and of reflection; exactly one row has it.
fn does<'a>(rows: &'a serde_json::Value, cell: [&str; 3]) -> &'a str {
    let [technique, light, reflection] = cell;
    let has = |row: &serde_json::Value, key: &str, name: &str| {
        let names = row[key].as_array().unwrap();
        names.iter().any(|n| n == name)
    };
    let found: Vec<_> = rows
        .as_array()
        .unwrap()
        .iter()
        .filter(|row| {
            row["technique"] == technique
                && has(row, "lights", light)
                && has(row, "reflections", reflection)
        })
        .collect();
    assert_eq!(found.len(), 1, "{cell:?}");
    found[0]["does"].as_str().unwrap()
}

/// Each technique has one method for each kind of light and of reflection, and no scene is needed
/// to list it.
#[test]
fn methods_are_listed_without_a_scene() {
    let rows = said(&["list", "methods", "--json"]);
    let rows: serde_json::Value = serde_json::from_str(&rows).unwrap();
    for technique in Technique::all() {
        for (_, light) in LightKind::ALL {
            for (reflection, _) in KnownKind::ALL {
                let _ = does(&rows, [technique.name(), &light.to_string(), reflection]);
            }
        }
    }
    let over = "closed form over the visible part of the light";
    let along = "closed form along 16 lines";
    let rays = "16 points as `point-proxy`, a shadow ray each";
    let by_angle = "16 points as `point-solid-angle`, a shadow ray each";
    for (technique, light, reflection, expected) in [
        ("line-analytic", "polygon", "Gaussians", along),
        ("exact", "polygon", LOBES, over),
        (
            "line-analytic",
            "cylinder",
            COSINES,
            "quadrature along 16 lines",
        ),
        ("exact", "disk", DIFFUSE, over),
        ("line-area", "line", LOBES, over),
        ("point-proxy", "polygon", NOTHING, rays),
        ("point-proxy", "sphere", NOTHING, by_angle),
        ("point-ltc", "polygon", NOTHING, by_angle),
        ("point-ltc", "polygon", DIFFUSE, by_angle),
        ("point-ltc", "cylinder", LOBES, by_angle),
    ] {
        assert_eq!(does(&rows, [technique, light, reflection]), expected);
    }
    let text = said(&["list", "methods"]);
    for line in [
        format!("line-analytic\n  polygon; {DIFFUSE}, {LOBES}: {over} where nothing is between, else {along}\n"),
        format!("  line; {DIFFUSE}, {LOBES}, Gaussians: {over}\n"),
        "point-bsdf\n  polygon, textured polygon, sphere, disk, cylinder, sky; any reflection: 16 points as `point-bsdf`, a shadow ray each\n".to_owned(),
    ] {
        assert!(text.contains(&line), "{line}\n{text}");
    }
}

#[test]
fn near_misses_are_answered() {
    for (line, status, near) in [
        ("rendr plates", 2, "'render'"),
        ("render plates -o x.exr --smaples 4", 2, "'--samples'"),
        (
            "render plates -o x.exr --estimator line-analitic",
            2,
            "`line-analytic`",
        ),
        (
            "render plates -o x.exr --light-estimator 0=point-bsfd",
            2,
            "`point-bsdf`",
        ),
        ("render plates -o x.exr --sampler sobl", 2, "'sobol'"),
        (
            "render plates -o x.exr --lights one:unifrm",
            2,
            "'one:uniform'",
        ),
        ("render plates -o x.exr --spheres facet", 2, "'facets'"),
        (
            "converge --estimators point-area,point-aera",
            2,
            "`point-area`",
        ),
        ("converge --samplers stratifed", 2, "`stratified`"),
        ("converge shirly", 1, "`shirley`"),
        ("converge plates stirps", 1, "`strips`"),
        ("info conell-box", 1, "`cornell-box`"),
        ("list scense", 2, "'scenes'"),
        ("statsu plan", 2, "'status'"),
        ("plan rendr plates -o x", 2, "'render'"),
        ("plan render plates -o x --script slrum", 2, "'slurm'"),
    ] {
        let output = linelit(&line.split(' ').collect::<Vec<_>>());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{line}: {said}");
        let asked = said.contains("did you mean") || said.contains("similar");
        assert!(asked && said.contains(near), "{line}: {said}");
    }
    let said = text(&linelit(&["info", "bananas"]).stderr);
    assert!(
        !said.contains("did you mean") && said.contains("triangle-soup-small"),
        "{said}"
    );
}

#[test]
fn help_shells_and_readers_hear_of_all_commands() {
    let help = said(&["help"]);
    assert_eq!(help, said(&["--help"]));
    let (bash, page) = (said(&["completions", "bash"]), said(&["man"]));
    let dir = folder("man");
    assert!(said(&["man", path(&dir)]).is_empty());
    let pages = names(&dir);
    let commands = help.split("Commands:\n").nth(1).unwrap();
    let commands = commands.lines().map_while(|line| line.strip_prefix("  "));
    let commands: Vec<_> = commands.filter(|l| !l.starts_with("help ")).collect();
    // The commands that `cargo xtask` passes on and lists in its help.
    let list = format!("{}/../../xtask/src/program.txt", env!("CARGO_MANIFEST_DIR"));
    let list = std::fs::read_to_string(list).unwrap();
    assert_eq!(list.lines().collect::<Vec<_>>(), commands, "program.txt");
    assert!(commands.len() >= 12, "{commands:?}");
    // The subcommands of `plan` have pages of their own.
    let below = pages
        .iter()
        .filter(|page| page.starts_with("linelit-plan-"));
    assert_eq!(pages.len(), 1 + commands.len() + below.count(), "{pages:?}");
    assert!(pages.iter().any(|page| page == "linelit-plan-render.1"));
    for line in commands {
        let (command, _about) = line.split_once(' ').unwrap();
        assert!(
            bash.contains(&format!("linelit__subcmd__{command}")),
            "{command}"
        );
        assert!(page.contains(&format!("linelit\\-{command}(1)")), "{page}");
        let page = std::fs::read_to_string(dir.join(format!("linelit-{command}.1"))).unwrap();
        assert!(page.contains("Examples:"), "{command}");
    }
    // Values of options are completed, too.
    assert!(bash.contains("multijitter") && bash.contains("one:estimate"));
}
