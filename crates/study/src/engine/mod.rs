//! Runs estimators over pixels and trials, and scores them.

mod clock;
pub mod image;
mod reference;
mod run;
mod score;
mod study;

pub use clock::CpuClock;
pub use reference::{Reference, reference};
pub use run::{Cell, CellRun, Targets, run_cell};
pub use score::{Score, score};
pub use study::{CellResult, SceneResult, run_scene};
