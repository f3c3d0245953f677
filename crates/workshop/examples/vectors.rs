//! Evaluates the crate on every file of reference vectors in a folder, prints the worst and the
//! median error for each file and class, and exits 1 above the stated bounds or if a file cannot be
//! read.
//!
//! `cargo run --release -p linelit-workshop --no-default-features --example vectors --
//! crates/testkit/vectors`
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "printing is what the program is for"
)]

#[path = "../../shading/tests/all/reference.rs"]
mod reference;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: vectors DIR");
        return ExitCode::from(2);
    };
    // What is wrong with a case is said once, below.
    std::panic::set_hook(Box::new(|_| {}));
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
