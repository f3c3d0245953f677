//! The progress of a plan, which is found from the names and times of the files in its folder.
#![allow(
    clippy::disallowed_methods,
    reason = "files say when they were written"
)]

use crate::{Folder, PlanError};
use std::fs;
use std::time::{Duration, SystemTime};

/// The progress of a plan, according to the names in its folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// The number of all units.
    pub units: u32,
    /// The number of units that have a part; the parts are not read.
    pub done: u32,
    /// The estimated cost of all units, in seconds of one thread.
    pub cost: f64,
    /// The estimated cost of the units that are done.
    pub cost_done: f64,
    /// The remaining seconds if work continues as in the ten minutes before the last part was
    /// written; `None` if there are too few parts.
    pub seconds_left: Option<f64>,
}

/// The time over which the speed of work is measured.
const WINDOW: Duration = Duration::from_secs(600);

impl Folder {
    /// Returns the progress of the plan.
    ///
    /// # Errors
    /// If the folder or the times of its files cannot be read.
    pub fn status(&self) -> Result<Status, PlanError> {
        let mut status = Status {
            units: self.units(),
            cost: self.plan().units.iter().map(|unit| unit.cost).sum(),
            ..Status::default()
        };
        let mut written = Vec::new();
        for number in self.done()? {
            let cost = self.plan().units[number as usize].cost;
            status.done += 1;
            status.cost_done += cost;
            let path = self.part_path(number);
            let time = fs::metadata(&path).and_then(|found| found.modified());
            written.push((time.map_err(PlanError::io(&path, "look at"))?, cost));
        }
        let left = status.cost - status.cost_done;
        status.seconds_left = speed(written).map(|speed| left / speed);
        Ok(status)
    }
}

/// Returns the estimated cost that was done per second in the last [`WINDOW`], from the times at
/// which parts were written.
fn speed(mut written: Vec<(SystemTime, f64)>) -> Option<f64> {
    written.sort_by_key(|(time, _)| *time);
    let (last, _) = *written.last()?;
    let since = |then: SystemTime| last.duration_since(then).unwrap_or_default();
    let from = written.partition_point(|(time, _)| since(*time) > WINDOW);
    // The first part was begun before the measured time, so that its cost does not count.
    let (first, rest) = written[from..].split_first()?;
    let cost: f64 = rest.iter().map(|(_, cost)| cost).sum();
    let seconds = since(first.0).as_secs_f64();
    (seconds > 0.0 && cost > 0.0).then(|| cost / seconds)
}
