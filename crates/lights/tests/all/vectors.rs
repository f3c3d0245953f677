//! The techniques against reference vectors of 25 digits.

use crate::reference::{self, Rows};
use linelit_testkit::public::page;

/// Holds what a file of vectors is about to it; packages are without.
fn held(file: &str, compare: fn(&str) -> Rows) {
    let path = format!("crates/testkit/vectors/{file}");
    if let Some(vectors) = page(env!("CARGO_MANIFEST_DIR"), &path) {
        compare(&vectors).assert();
    }
}

#[test]
fn linear_lights() {
    held("e_linear_sampling.json", reference::linear_lights);
}

#[test]
fn polygons() {
    held("d_polygon.json", reference::polygons);
}

#[test]
fn solid_angle_lines() {
    held("f_solid_angle_lines.json", reference::solid_angle_lines);
}
