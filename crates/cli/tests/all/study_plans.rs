//! Convergence studies as plans: the numbers are the same however the units are distributed and
//! whichever processes are killed; and the errors of unsuitable plans.
#![cfg(unix)]
#![allow(clippy::print_stdout, reason = "what a test did is said when it fails")]

use crate::common::{folder, linelit, names, path, signalled, small_study, succeeded, text};
use linelit_samplers::{Sampler, SamplerKind};
use rustix::process::Signal;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Instant;

/// Columns and keys of times, processors and commands.
const TIMES: [&str; 9] = [
    "cpu_seconds",
    "cpu_error",
    "wall_seconds",
    "processor",
    "load_seconds",
    "build_seconds",
    "command",
    "seconds",
    "threads",
];

/// `results.csv` and `results.json` without times; `slopes.csv` as it is.
fn numbers(folder: &Path) -> (Vec<Vec<String>>, Value, String) {
    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let csv = read("results.csv");
    let mut lines = csv.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let kept = |line: &str| -> Vec<String> {
        // No name of these studies has a comma.
        assert!(!line.contains('"'), "{line}");
        let fields = columns.iter().zip(line.split(','));
        let kept = fields.filter(|(name, _)| !TIMES.contains(name));
        kept.map(|(_, field)| field.to_owned()).collect()
    };
    let mut json: Value = serde_json::from_str(&read("results.json")).unwrap();
    without_times(&mut json);
    (lines.map(kept).collect(), json, read("slopes.csv"))
}

/// Removes the values that differ from run to run.
pub(crate) fn without_times(value: &mut Value) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !TIMES.contains(&key.as_str()));
            map.values_mut().for_each(without_times);
        }
        Value::Array(list) => list.iter_mut().for_each(without_times),
        _ => {}
    }
}

/// Plans the same study.
fn plan(study: &[&str], to: &Path) {
    let at = study.iter().position(|word| *word == "--out").unwrap();
    let words = [&["plan"], &study[..at], &study[at + 2..], &["-o", path(to)]].concat();
    succeeded(&words);
}

fn run(plan: &Path, more: &[&str]) -> Output {
    linelit(&[&["run", path(plan), "--threads", "1"], more].concat())
}

/// Merges a plan into a folder next to it, and reads the results.
fn merged(plan: &Path) -> (Vec<Vec<String>>, Value, String) {
    let to = plan.with_extension("merged");
    succeeded(&["merge", path(plan), "-o", path(&to)]);
    numbers(&to)
}

/// Runs a plan in this many processes, one after the other in an order from a seed. Each computes
/// only the units of its shard.
fn run_in_shards(plan: &Path, count: u32, seed: u64) {
    let keys = Sampler::new(SamplerKind::Independent, seed).points([0, 0], 0, count);
    let mut order: Vec<u32> = (1..=count).collect();
    order.sort_by(|a, b| keys.get_1d(a - 1).total_cmp(&keys.get_1d(b - 1)));
    for shard in order {
        let shard = format!("{shard}/{count}");
        let output = run(plan, &["--shard", &shard]);
        assert!(output.status.success(), "{shard}: {}", text(&output.stderr));
    }
}

fn shards_change_nothing(study: &[&str], dir: &Path, out: &Path) {
    succeeded(study);
    let whole = numbers(out);
    assert!(!whole.0.is_empty());
    for count in [1, 2, 7, 64] {
        let folder = dir.join(format!("plan-{count}"));
        plan(study, &folder);
        run_in_shards(&folder, count, count.into());
        assert_eq!(merged(&folder), whole, "{count}");
    }
}

#[test]
fn any_number_of_shards_is_one_study() {
    let dir = folder("study-shards");
    let out = dir.join("out");
    shards_change_nothing(&small_study("cornell-box", &out), &dir, &out);
}

#[test]
#[ignore = "long: the default study five times"]
fn any_number_of_shards_is_the_default_study() {
    let dir = folder("study-default");
    let out = dir.join("out");
    shards_change_nothing(&["converge", "--out", path(&out)], &dir, &out);
}

#[test]
fn single_pixels_and_galleries_are_planned() {
    let dir = folder("study-gallery");
    let out = dir.join("out");
    // Two pixels; six pictures of one sample a pixel.
    for name in ["salesin-fig5", "salesin-fig3"] {
        let study = ["converge", name, "--smallest", "--out", path(&out)];
        succeeded(&study);
        let quoted = fs::read_to_string(out.join("results.csv")).unwrap();
        assert!(quoted.lines().count() > 2, "{quoted}");
        let folder = dir.join(name);
        plan(&study, &folder);
        run_in_shards(&folder, 3, 1);
        let to = dir.join("merged");
        succeeded(&["merge", path(&folder), "-o", path(&to)]);
        let json = |folder: &Path| -> Value {
            let text = fs::read_to_string(folder.join("results.json")).unwrap();
            let mut json = serde_json::from_str(&text).unwrap();
            without_times(&mut json);
            json
        };
        assert_eq!(json(&to), json(&out), "{name}");
        assert_eq!(
            json(&to)["gallery"].as_array().unwrap().is_empty(),
            name == "salesin-fig5"
        );
    }
}

/// A study of some seconds in several units.
fn longer_study(out: &Path) -> Vec<&str> {
    let mut words = vec!["converge", "cornell-box", "--out", path(out)];
    words.extend([
        "--pixels",
        "16x16",
        "--trials",
        "4",
        "--samples",
        "1,4,16,64",
    ]);
    words.extend(["--estimators", "point-area,line-area,line-analytic"]);
    words.extend(["--samplers", "stratified,sobol,independent"]);
    words
}

/// A study is interrupted and then killed. The same command continues it, and the numbers are those
/// of an undisturbed study.
fn goes_on(study: &[&str], out: &Path) {
    succeeded(study);
    let whole = numbers(out);
    let plan = out.join(".linelit-plan");
    let stopped = signalled(study, &plan, Signal::INT);
    assert_eq!(stopped.status.code(), Some(75), "{}", text(&stopped.stderr));
    let killed = signalled(study, &plan, Signal::KILL);
    assert_eq!(killed.status.code(), None, "{}", text(&killed.stderr));
    let done = succeeded(study);
    for going in [killed, done] {
        let said = text(&going.stderr);
        assert!(
            said.contains("going on with an interrupted study"),
            "{said}"
        );
    }
    assert_eq!(numbers(out), whole, "{study:?}");
    assert!(!plan.exists());
}

/// The default study, which has two scenes, and studies of one and of five, smaller.
#[test]
fn the_same_command_goes_on_whatever_the_number_of_scenes() {
    let dir = folder("study-scenes");
    let out = dir.join("out");
    let scenes = [
        "cornell-box-small",
        "floating-quad",
        "grid-planes-small",
        "cornell-box-large",
        "window",
    ];
    // A single scene needs more measurements, so that a third of them is left after two signals.
    for (count, samplers) in [
        (0, "sobol"),
        (1, "independent,stratified,sobol"),
        (5, "sobol"),
    ] {
        let mut study = vec!["converge", "--out", path(&out), "--pixels", "8x8"];
        study.extend([
            "--trials",
            "2",
            "--samples",
            "1,4,16",
            "--samplers",
            samplers,
        ]);
        study.extend(["--estimators", "point-area,line-area,line-analytic,hybrid"]);
        study.extend(&scenes[..count]);
        goes_on(&study, &out);
    }
}

#[test]
fn an_interrupted_study_goes_on() {
    let dir = folder("study-interrupted");
    let out = dir.join("out");
    let (study, kept) = (longer_study(&out), out.join(".linelit-plan"));
    let start = Instant::now();
    succeeded(&study);
    println!("{:.1} s", start.elapsed().as_secs_f64());
    let whole = numbers(&out);
    let page = |out: &Path| fs::read_to_string(out.join("report.html")).unwrap();
    assert!(!page(&out).contains("unfinished") && !out.join(".linelit-plan").exists());

    let stopped = signalled(&study, &kept, Signal::INT);
    assert_eq!(stopped.status.code(), Some(75), "{}", text(&stopped.stderr));
    assert!(text(&stopped.stderr).contains("the same command goes on"));
    // The complete study from before stays.
    assert_eq!(numbers(&out), whole);
    let part = out.join("unfinished");
    let (rows, json, _) = numbers(&part);
    let left_out = json["left_out"].as_array().unwrap();
    assert!(json["unfinished"] == true && !left_out.is_empty());
    assert_eq!(rows.len() + left_out.len(), whole.0.len());
    // The numbers that exist have the same bits as in the complete study.
    assert!(rows.iter().all(|row| whole.0.contains(row)));
    let page = page(&part);
    assert!(page.contains("(unfinished)") && page.contains("it was interrupted before"));

    // Another study is not begun in its place, and no part is lost.
    let mut other = study.clone();
    other.extend(["--seed", "7"]);
    let refused = linelit(&other);
    let why = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{why}");
    assert!(
        why.contains("--seed=0") && why.contains("--fresh begins anew"),
        "{why}"
    );

    let killed = signalled(&study, &kept, Signal::KILL);
    assert_eq!(killed.status.code(), None);
    assert!(out.join(".linelit-plan/plan.json").exists());
    let done = linelit(&study);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stderr).contains("going on with an interrupted study"));
    assert_eq!(numbers(&out), whole);
    assert!(!out.join(".linelit-plan").exists() && !part.exists());

    // When it begins anew, it does not mention the earlier parts.
    signalled(&study, &kept, Signal::KILL);
    other.push("--fresh");
    let done = linelit(&other);
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(!text(&done.stderr).contains("going on"));
    assert_ne!(numbers(&out).0, whole.0);
}

#[test]
fn a_broken_part_is_named_and_computed_again() {
    let dir = folder("study-broken");
    let (out, folder) = (dir.join("out"), dir.join("plan"));
    let study = small_study("cornell-box", &out);
    plan(&study, &folder);
    assert!(run(&folder, &[]).status.success());
    let whole = merged(&folder);
    let parts = folder.join("parts");
    for name in names(&parts) {
        let file = parts.join(&name);
        let good = fs::read(&file).unwrap();
        let mut bad = good.clone();
        let middle = bad.len() / 2;
        bad[middle] ^= 1;
        fs::write(&file, &bad).unwrap();
        let refused = linelit(&["merge", path(&folder), "-o", path(&out)]);
        let why = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(75), "{why}");
        assert!(why.contains(&name), "{why}");
        let again = run(&folder, &[]);
        assert!(again.status.success() && text(&again.stderr).contains(&name));
    }
    assert_eq!(merged(&folder), whole);
}

/// A scene in a file of its own.
fn scene(dir: &Path, name: &str) -> PathBuf {
    let file = dir.join(name);
    fs::copy("tests/cornell/v4.pbrt", &file).unwrap();
    file
}

#[test]
fn what_is_no_plan_and_scenes_that_changed_are_refused() {
    let dir = folder("study-refused");
    let out = dir.join("out");
    let refused = |words: &[&str], status: i32, says: &str| {
        let output = linelit(words);
        let why = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{why}");
        assert!(why.contains(says), "{why}");
    };
    let folder = dir.join("plan");
    refused(
        &["plan", "converge", "shirley", "-o", path(&folder)],
        2,
        "cannot be planned",
    );
    assert!(!folder.exists());

    let file = scene(&dir, "room.pbrt");
    let study = small_study(path(&file), &out);
    plan(&study, &folder);
    let built_in = dir.join("built-in");
    plan(&small_study("cornell-box", &out), &built_in);
    let mut changed = fs::read_to_string(&file).unwrap();
    changed.push_str("# a word\n");
    fs::write(&file, changed).unwrap();
    refused(
        &["run", path(&folder)],
        1,
        "has changed since the plan was made",
    );
    fs::remove_file(&file).unwrap();
    refused(&["run", path(&folder)], 1, "room.pbrt");
    refused(
        &["merge", path(&built_in), "--exposure", "1"],
        2,
        "are for plans of pictures",
    );
}
