//! These tests compare the crate with reference vectors of 25 digits, except for the field
//! `b.point`, since the crate has no lines of points.
#![allow(clippy::print_stdout, reason = "a table is printed")]

use crate::reference;
use linelit_testkit::program::arguments;
use std::path::Path;

#[test]
fn reference_vectors_are_met() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testkit/vectors");
    let report = reference::run(&folder).expect("the files are part of the crate");
    assert!(report.holds(), "\n{}", report.table());
}

#[test]
fn a_folder_without_vectors_is_an_error() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    assert!(reference::run(&folder).is_err());
}

/// Files that are no vectors, or lack something, are named with what is wrong.
#[test]
fn malformed_files_are_errors_and_not_panics() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("malformed-vectors");
    std::fs::create_dir_all(&folder).expect("the target folder takes folders");
    let file = folder.join("x.json");
    for (text, complaint) in [
        ("", "x.json"),
        ("{\"schema\":\"a_ribbon_diffuse\"}", "cases"),
        (
            "{\"schema\":\"of ours\",\"cases\":[{\"tag\":\"t\"}]}",
            "unknown schema",
        ),
        (
            "{\"schema\":\"a_ribbon_diffuse\",\"cases\":[{\"tag\":\"t\",\"p0\":[1,2]}]}",
            "p0",
        ),
        ("{\"schema\":\"a_ribbon_diffuse\",\"cases\":[7]}", "case 0"),
    ] {
        std::fs::write(&file, text).expect("the folder takes files");
        let error = reference::run(&folder).expect_err(text);
        assert!(
            error.contains(complaint) && error.contains("x.json"),
            "{text}: {error}"
        );
    }
}

/// Prints the worst and the median error for each file and class of a folder: `cargo xtask vectors
/// DIR`.
#[test]
#[ignore = "long: by itself it prints the vectors that the crate has"]
fn print() {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../testkit/vectors");
    let arguments = arguments(&[own]);
    let folder = arguments.first().expect("a folder");
    // What is wrong with a case is said once, below.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let report = reference::run(Path::new(folder));
    std::panic::set_hook(hook);
    let report = report.expect("a folder of vectors");
    print!("{}", report.table());
    assert!(report.holds(), "a row is above its bound");
}
