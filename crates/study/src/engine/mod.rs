//! Runs estimators over integrals and trials, and scores them.

mod clock;
mod equal_time;
pub mod image;
mod problem;
mod reference;
mod run;
mod score;
mod study;

pub use clock::CpuClock;
pub use equal_time::{Contest, Curve, Point as ContestPoint, contest};
pub use problem::{Counts, Method, Problem, Truth};
pub use reference::{Reference, reference};
pub use run::{CELL_SECONDS, Cell, CellRun, Times, run_cell};
pub use score::{Score, score};
pub use study::{CellResult, Design, REFERENCE_LIMIT, Results, measure};
