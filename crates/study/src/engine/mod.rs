//! Runs estimators over integrals and trials, and scores them.

mod bytes;
mod clock;
mod equal_time;
mod problem;
mod reference;
mod run;
mod score;
mod study;
mod times;
mod units;
mod window;

pub use bytes::{Broken, from_bytes, to_bytes};
pub use clock::CpuClock;
pub use equal_time::{Contest, Curve, Point as ContestPoint, contest};
pub use problem::{Counts, Method, Problem, Truth};
pub use reference::{Reference, ReferencePart, Replicates, reference};
pub use run::{CELL_SECONDS, Cell, CellRun, run_cell};
pub use score::{Score, score};
pub use study::{CellResult, Design, REFERENCE_ROUNDS, Results, measure};
pub use times::Times;
pub use units::{BLOCK_ESTIMATES, CellPart, Gathering, Job, Part, Planned, Unit};
