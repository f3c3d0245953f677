//! The commands of the workshop, started as `cargo xtask` starts them.

use linelit_testkit::folder::Folder;
use std::process::{Command, Output};

fn workshop(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_workshop"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn usage_errors_exit_with_two() {
    for arguments in [
        &["bench", "equal-time", "--samples", "2,1"][..],
        &["bench", "nothing"],
        &["bench", "speed"],
        &["load-all", "scenes", "--seconds", "-1"],
        &["render", "cornell-box", "-o", "x.exr"],
    ] {
        let output = workshop(arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn benches_print_their_tables() {
    let words = "bench equal-time --scene floating-quad --rounds 1 --samples 1 --json \
                 --resolution 2x2 --estimators point-area,line-analytic";
    let output = workshop(&words.split_ascii_whitespace().collect::<Vec<_>>());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(!value.as_array().unwrap().is_empty(), "{value}");
}

/// On a scene whose closed form is complete no noise is left in the reference, and a rival without
/// noise is one only if it takes no more than a quarter longer.
#[test]
fn choices_are_judged_against_other_methods() {
    let words = "bench choice --scenes floating-quad --rounds 1 --samples 1,4 --json \
                 --resolution 4x4";
    let output = workshop(&words.split_ascii_whitespace().collect::<Vec<_>>());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let cells = value["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 2, "{value}");
    for cell in cells {
        let pair = |name: &str| [0, 1].map(|k| cell[name][k].as_f64().unwrap());
        let [time, mse] = ["us_pixel", "mse"].map(pair);
        let products = [0, 1].map(|k| time[k] * mse[k].max(1e-8));
        let ratio = cell["ratio"].as_f64().unwrap();
        assert!(
            (ratio * products[1] / products[0] - 1.0).abs() < 1e-12,
            "{cell}"
        );
        assert!(mse[1] > 0.0 || time[1] <= 1.25 * time[0], "{cell}");
        assert!(
            cell["rival"] != "hybrid" && cell["is_rough"] == false,
            "{cell}"
        );
    }
}

#[test]
fn a_program_that_reports_no_seconds_is_named() {
    let itself = env!("CARGO_BIN_EXE_workshop");
    for (program, problem) in [("/no/program", "starting"), (itself, "rendered no picture")] {
        let output = workshop(&["bench", "speed", "--against", program, "--runs", "1"]);
        assert_eq!(output.status.code(), Some(1));
        let said = text(&output.stderr);
        assert!(said.contains(program) && said.contains(problem), "{said}");
    }
}

#[test]
fn every_file_of_a_folder_is_loaded_and_rendered() {
    let dir = Folder::new("load-all");
    let inner = dir.join("inner");
    std::fs::create_dir_all(&inner).unwrap();
    let (good, bad) = (dir.join("good.obj"), inner.join("bad.ply"));
    std::fs::write(&good, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::fs::write(&bad, "ply\nformat ascii 1.0\nelement vertex x\n").unwrap();
    std::fs::write(dir.join("notes.txt"), "no scene").unwrap();
    let output = workshop(&["load-all", dir.to_str().unwrap()]);
    let out = text(&output.stdout);
    assert!(output.status.success(), "{out}{}", text(&output.stderr));
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 2, "{out}");
    assert_eq!(lines[0], "good.obj: ok, 1 triangle, 0 lights, 1 warning");
    assert!(lines[1].starts_with("inner/bad.ply: error: `x` is not a number of rows ("));
    assert!(lines[1].ends_with("bad.ply:3:1)"), "{out}");

    // A file without any time fails, and so does the whole command.
    let output = workshop(&["load-all", dir.to_str().unwrap(), "--seconds", "1e-9"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("FAILED: took more than "));
}
