//! `bench`: what takes how long.

mod equal_time;
mod mis;

use crate::args::{Bench, BenchArgs};
use anyhow::Result;
use linelit_cli::output::Output;

/// Runs a benchmark.
pub(crate) fn run(what: &Bench, out: &mut Output) -> Result<()> {
    match what {
        Bench::EqualTime(args) => equal_time::run(args, out),
        Bench::Mis(args) => mis::run(args, out),
        Bench::Visibility(args) => crate::visibility::run(args, out),
    }
}

/// Measured unless a scene is named.
const SCENES: [&str; 8] = [
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "cornell-box-small",
    "cornell-box-large",
    "colonnade-small",
    "colonnade-large",
];

/// The scenes to measure.
fn scenes(args: &BenchArgs) -> Vec<&str> {
    match &args.scene {
        Some(name) => vec![name],
        None => SCENES.to_vec(),
    }
}
