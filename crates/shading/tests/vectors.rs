//! The reference vectors of `tests/vectors` (25 digits) against the crate.

#[path = "common/reference.rs"]
mod reference;

use std::path::Path;

#[test]
fn reference_vectors_are_met() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors");
    let report = reference::run(&folder).expect("the files are part of the crate");
    assert!(report.holds(), "\n{}", report.table());
}

#[test]
fn a_folder_without_vectors_is_an_error() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    assert!(reference::run(&folder).is_err());
}
