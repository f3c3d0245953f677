//! The output folder of a study, from outside: locks, remaining files, and messages.
#![cfg(unix)]

use crate::common::{
    PROGRAM, folder, late_study, linelit, names, path, small_study, succeeded, text,
};
use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn a_broken_second_scene_is_found_before_the_first_is_measured() {
    let dir = folder("second");
    let broken = dir.join("broken.pbrt");
    fs::write(
        &broken,
        "WorldBegin\nShape \"sphere\" \"float radius\" [ x ]\n",
    )
    .unwrap();
    let away = dir.join("away.pbrt");
    let light = "Camera \"perspective\"\nWorldBegin\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\n\
                 Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" \
                 [ 0 0 -5  1 0 -5  0 1 -5 ]\nAttributeEnd\n";
    fs::write(&away, light).unwrap();
    for (second, why) in [
        (path(&broken), "broken.pbrt:2"),
        (path(&away), "the camera sees nothing"),
        ("no-such-scene", "no scene `no-such-scene`"),
    ] {
        let out = dir.join("out");
        // Measuring the first would take hours.
        let mut arguments = vec!["converge", "cornell-box", second, "--out", path(&out)];
        arguments.extend(["--samples", "65536", "--trials", "1000"]);
        let output = linelit(&arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(why), "{said}");
        assert!(!out.exists());
    }
}

#[test]
fn one_process_writes_a_folder() {
    let dir = folder("two");
    let out = dir.join("out");
    succeeded(&small_study("cornell-box", &out));
    let before = fs::read(out.join("results.json")).unwrap();
    let mut first = Command::new(PROGRAM)
        .args(["converge", "cornell-box", "--out", path(&out)])
        .args(["--samples", "65536", "--trials", "1000"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lock = out.join(".linelit-lock");
    let patience = Instant::now();
    let number = first.id().to_string();
    while fs::read_to_string(&lock).ok().as_ref() != Some(&number) {
        assert!(patience.elapsed() < Duration::from_secs(60));
        sleep(Duration::from_millis(5));
    }
    let refused = linelit(&small_study("plates", &out));
    let said = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(
        said.contains(&format!("process {number} is writing")),
        "{said}"
    );
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(fs::read(out.join("results.json")).unwrap(), before);
    // The lock ends with its process, and the plots of an earlier study are removed.
    succeeded(&small_study("floating-quad", &out));
    let plots = names(&out.join("plots"));
    assert!(
        plots.iter().all(|p| p.starts_with("floating-quad-")),
        "{plots:?}"
    );
    assert!(!lock.exists());
}

#[test]
fn what_a_time_budget_leaves_out_is_said() {
    let dir = folder("budget");
    let out = dir.join("out");
    let output = succeeded(&late_study(&out));
    let said = text(&output.stderr);
    // Before it would begin, and at the end.
    let before = "note: cornell-box: point-area (stratified) with 65536 samples of 0..";
    assert!(said.starts_with(before), "{said}");
    assert!(said.contains(" is left out: it would take "), "{said}");
    let what = "spent before 2 of 4 measurements on cornell-box, which are left out: \
                point-area (stratified) with 65536 samples; \
                point-solid-angle (stratified) with 65536 samples.";
    assert!(said.contains(what), "{said}");
    let study: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(study["rows"].as_array().unwrap().len(), 2);
    assert_eq!(study["left_out"].as_array().unwrap().len(), 2);
    assert_eq!(study["left_out"][1]["samples"], 65536);
    assert_eq!(study["settings"]["time budget"], "60 s");
    let seconds = study["seconds"].as_f64().unwrap();
    assert!(seconds < 60.0, "{seconds}");
    // The commit is the program's, even if the repository has changed since.
    assert_eq!(study["commit"], env!("LINELIT_COMMIT"));
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains(what), "{page}");

    let whole = linelit(&small_study("cornell-box", &out));
    assert!(!text(&whole.stderr).contains("left out"));
    let study = fs::read_to_string(out.join("results.json")).unwrap();
    assert!(study.contains("\"left_out\": []"), "{study}");
}

#[test]
fn a_time_budget_that_holds_nothing_is_an_error() {
    let dir = folder("no-budget");
    let out = dir.join("out");
    let study = small_study("cornell-box", &out);
    succeeded(&study);
    let before = fs::read(out.join("results.json")).unwrap();
    let late = linelit(&[&study[..], &["--seed", "7", "--time-budget", "1e-9"]].concat());
    let said = text(&late.stderr);
    assert_eq!(late.status.code(), Some(1), "{said}");
    assert!(
        late.stdout.is_empty() && said.contains("no measurement fits"),
        "{said}"
    );
    // The earlier study stays, and another one can follow: no file of the interrupted one remains.
    assert_eq!(fs::read(out.join("results.json")).unwrap(), before);
    succeeded(&[&study[..], &["--seed", "8", "--time-budget", "1e9"]].concat());
    assert_ne!(fs::read(out.join("results.json")).unwrap(), before);
}

#[test]
fn every_time_is_measured_and_has_an_error() {
    let dir = folder("times");
    let mut arguments = small_study("salesin-fig5", &dir);
    arguments.truncate(4);
    arguments.extend([
        "--trials",
        "2",
        "--samples",
        "1,2",
        "--threads",
        "1",
        "--json",
    ]);
    let output = succeeded(&arguments);
    let study: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = study["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 36);
    for row in rows {
        let [time, error] = ["cpu_seconds", "cpu_error"].map(|k| row[k].as_f64().unwrap());
        // A trial of one pixel takes a microsecond or more; the kernel's ticks are of four
        // milliseconds, and read 0.
        assert!(time > 1e-8, "{row}");
        // How large an error is depends on what else runs.
        assert!(error > 0.0, "{row}");
    }
}
