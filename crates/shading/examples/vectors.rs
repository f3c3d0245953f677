//! Evaluates the crate on every file of reference vectors in a folder, prints the worst and the
//! median error for each file and class, and exits 1 above the stated bounds.
//!
//! `cargo run --release -p linelit-shading --example vectors -- crates/shading/tests/vectors`
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

#[path = "../tests/common/reference.rs"]
mod reference;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: vectors DIR");
        return ExitCode::from(2);
    };
    match reference::run(Path::new(&folder)) {
        Ok(report) => {
            print!("{}", report.table());
            if report.holds() {
                ExitCode::SUCCESS
            } else {
                ExitCode::FAILURE
            }
        }
        Err(message) => {
            eprintln!("vectors: {message}");
            ExitCode::FAILURE
        }
    }
}
