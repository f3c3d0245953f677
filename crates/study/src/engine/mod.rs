//! Runs estimators over pixels and trials, and scores them.

mod clock;
mod equal_time;
mod gallery;
pub mod image;
mod reference;
mod run;
mod score;
mod study;

pub use clock::CpuClock;
pub use equal_time::{Contest, Curve, Point as ContestPoint, Truth, contest};
pub use gallery::GalleryPicture;
pub use reference::{Reference, reference};
pub use run::{CELL_SECONDS, Cell, CellRun, Targets, Times, run_cell};
pub use score::{Score, score};
pub use study::{CellResult, LeftOut, Opened, SceneResult, open_all, run_scene};
