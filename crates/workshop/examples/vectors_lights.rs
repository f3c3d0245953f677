//! Evaluates the sampling techniques on every file of reference vectors in a folder that concerns
//! them, prints the median and worst error of each quantity, and exits 1 if a case exceeds the
//! tolerance that its conditioning derives.
//!
//! `cargo run --release -p linelit-workshop --no-default-features --example vectors_lights --
//! crates/testkit/vectors`
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "an example prints"
)]

#[path = "../../lights/tests/all/reference.rs"]
mod reference;

use reference::Rows;
use std::path::Path;
use std::process::ExitCode;

/// Evaluates one file.
type Run = fn(&str) -> Rows;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: vectors DIR");
        return ExitCode::from(2);
    };
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
        let text = match std::fs::read_to_string(Path::new(&folder).join(name)) {
            Ok(text) => text,
            Err(e) => {
                eprintln!("{name}: {e}");
                return ExitCode::FAILURE;
            }
        };
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
    if holds {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
