//! These tests compare the techniques with reference vectors of 25 digits.
#![allow(clippy::print_stdout, reason = "a table is printed")]

use crate::reference::{self, Rows};
use linelit_testkit::program::arguments;
use linelit_testkit::public::page;
use std::path::Path;

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

/// Evaluates one file.
type Run = fn(&str) -> Rows;

/// Prints the median and worst error of each quantity of a folder: `cargo xtask vectors DIR`.
#[test]
#[ignore = "long: by itself it prints the vectors that the crate has"]
fn print() {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../testkit/vectors");
    let arguments = arguments(&[own]);
    let folder = arguments.first().expect("a folder");
    let files: [(&str, Run); 3] = [
        ("d_polygon.json", reference::polygons),
        ("e_linear_sampling.json", reference::linear_lights),
        ("f_solid_angle_lines.json", reference::solid_angle_lines),
    ];
    println!(
        "{:26} {:12} {:>6} {:>9} {:>9} {:>10}  class",
        "file", "quantity", "cases", "median", "worst", "tolerance"
    );
    let mut holds = true;
    for (name, run) in files {
        let text = std::fs::read_to_string(Path::new(folder).join(name)).expect(name);
        for mut row in run(&text).0 {
            row.errors.sort_by(f64::total_cmp);
            let (count, worst) = (row.errors.len(), row.errors.last().copied().unwrap_or(0.0));
            let median = row.errors.get(count / 2).copied().unwrap_or(0.0);
            let kept = if row.ratio <= 1.0 { "kept" } else { "EXCEEDED" };
            println!(
                "{name:26} {:12} {count:6} {median:9.1e} {worst:9.1e} {kept:>10}  {}",
                row.what, row.tag
            );
            holds &= row.ratio <= 1.0;
        }
    }
    assert!(holds, "a row is above its tolerance");
}
