//! Convergence studies for direct illumination: the library behind the `linelit` command.
//!
//! The crate measures how the error of an estimator falls with samples and with time: it runs
//! estimators over the pixels of scenes in independent trials, scores them against a reference
//! whose own error it states, fits orders of convergence and writes a report.
//!
//! ```no_run
//! use linelit_integrator::{Renderer, Settings, Workspace};
//!
//! let loaded = linelit_scenes::Library::default().load("cornell-box")?;
//! let renderer = Renderer::new(&loaded.scene);
//! let mut workspace = Workspace::new();
//! let radiance = renderer.pixel(&Settings::default(), [256, 400], &mut workspace);
//! println!("{radiance}");
//! # anyhow::Ok(())
//! ```

pub mod cli;
pub mod commands;
pub mod compare;
pub mod engine;
pub mod folder;
pub mod memory;
pub mod output;
pub mod plots;
pub mod report;
pub mod stats;
pub mod studies;
pub mod tables;

/// Version of linelit, for metadata.
#[must_use]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// A short name of a scene for tables: the stem of its file, or the name itself.
#[must_use]
pub fn short_name(name: &str) -> String {
    let stem = std::path::Path::new(name)
        .file_stem()
        .map_or(name.into(), |s| s.to_string_lossy());
    stem.into_owned()
}

/// The example of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
