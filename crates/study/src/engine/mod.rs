//! The engine of studies: it cuts a study into units, runs estimators over integrals and trials,
//! and scores them against a reference.

mod clock;
mod equal_time;
mod problem;
mod reference;
mod results;
mod run;
mod score;
mod times;
mod units;

pub use clock::CpuClock;
pub use equal_time::{Contest, Curve, Point as ContestPoint, contest};
pub use problem::{Counts, Design, Method, Problem, REFERENCE_ROUNDS, Truth};
pub use reference::{Reference, ReferencePart};
pub use results::{CellResult, Gathering, Results, measure};
pub use run::{CELL_SECONDS, Cell, CellRun, run_cell};
pub use score::{Score, score};
pub use times::Times;
pub use units::{BLOCK_ESTIMATES, CellPart, Job, Part, Planned, Unit, from_bytes, to_bytes};
