//! Convergence studies for direct illumination: the library behind the `linelit` command.
//!
//! The crate measures how the error of an estimator falls with samples and with time: it runs
//! estimators over the pixels of scenes in independent trials, scores them against a reference
//! whose own error it states, fits orders of convergence and writes a report.
//!
//! ```no_run
//! use linelit_integrator::{Renderer, Settings, Workspace};
//!
//! let loaded = linelit_study::scenes::load("cornell-box", &Default::default())?;
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
pub mod procedural;
pub mod report;
pub mod scenes;
pub mod stats;
pub mod studies;
pub mod tables;

/// Version of linelit, for metadata.
#[must_use]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}

/// The example of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
