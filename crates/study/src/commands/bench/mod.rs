//! `bench`: what takes how long.

mod equal_time;
mod mis;

use crate::cli::{Bench, BenchArgs};
use anyhow::Result;

/// Runs a benchmark.
///
/// # Errors
/// If a scene cannot be read.
pub fn run(args: &BenchArgs) -> Result<()> {
    match args.what {
        Bench::EqualTime => equal_time::run(args),
        Bench::Mis => mis::run(args),
    }
}

/// The scenes to measure.
fn scenes<'a>(args: &'a BenchArgs, built_in: &[&'a str]) -> Vec<&'a str> {
    match &args.scene {
        Some(name) => vec![name],
        None => built_in.to_vec(),
    }
}

/// All pixels of an image, row by row.
fn pixels([width, height]: [u32; 2]) -> Vec<[u32; 2]> {
    let row = |y| (0..width).map(move |x| [x, y]);
    (0..height).flat_map(row).collect()
}
