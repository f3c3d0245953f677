//! This crate runs convergence studies of any estimator: it measures errors and times, fits orders
//! of convergence, draws plots and writes reports.
//!
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

pub mod engine;
pub mod memory;
pub mod pixels;
pub mod plots;
pub mod record;
pub mod report;
pub mod scene_study;
pub mod stats;
pub mod tables;

// What public signatures name, so that one dependency is enough.
pub use {linelit_film as film, linelit_geometry as geometry};

/// Returns the version of linelit, which reports and tables state.
#[must_use]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// Returns a short name of a scene for tables: the stem of its file name, or the whole name if it
/// is not a path.
#[must_use]
pub fn short_name(name: &str) -> String {
    let stem = std::path::Path::new(name)
        .file_stem()
        .map_or(name.into(), |s| s.to_string_lossy());
    stem.into_owned()
}
