//! How far a plan is.

use crate::folder::part_number;
use crate::lease::{Leases, Standing, stamp};
use crate::{Folder, PlanError, durable};
use std::time::{Duration, SystemTime};

/// What a plan still lacks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Missing {
    /// Units without a part.
    pub absent: Vec<u32>,
    /// Units whose part is broken, and what is wrong with it.
    pub broken: Vec<(u32, String)>,
}

impl Missing {
    /// Whether nothing is missing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.absent.is_empty() && self.broken.is_empty()
    }

    /// How many units are missing.
    #[must_use]
    pub fn len(&self) -> usize {
        self.absent.len() + self.broken.len()
    }
}

/// How far a plan is, by the names in its folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Units in all, and those with a part, which is not read.
    pub units: u32,
    /// Units that have a part.
    pub done: u32,
    /// Units in hand.
    pub running: u32,
    /// Units whose process is gone; others will take them.
    pub lost: u32,
    /// Guessed cost of all units, and of those that are done, in seconds of one thread.
    pub cost: f64,
    /// Guessed cost of those that are done.
    pub cost_done: f64,
    /// Seconds of waiting that are left, by what was done in the last ten minutes; `None` if
    /// nothing is under way or too little is known.
    pub seconds_left: Option<f64>,
}

/// How far back one looks to tell how fast work goes.
const WINDOW: Duration = Duration::from_secs(600);

impl Folder {
    /// How far the plan is. Leases that were not touched for `lease` count as lost.
    ///
    /// # Errors
    /// If the folder cannot be looked at.
    pub fn status(&self, lease: Duration) -> Result<Status, PlanError> {
        let mut is_done = vec![false; self.plan().units.len()];
        let names = durable::names(&self.parts())?;
        for number in names.iter().filter_map(|name| part_number(name)) {
            if let Some(done) = is_done.get_mut(number as usize) {
                *done = true;
            }
        }
        let mut status = Status {
            units: self.units(),
            ..Status::default()
        };
        for (unit, done) in self.plan().units.iter().zip(&is_done) {
            status.cost += unit.cost;
            if *done {
                status.done += 1;
                status.cost_done += unit.cost;
            }
        }
        let leases = Leases::new(self, lease);
        for number in leases.listed()? {
            if is_done.get(number as usize) != Some(&false) {
                continue;
            }
            match leases.standing(number)? {
                Standing::Fresh => status.running += 1,
                Standing::Lost => status.lost += 1,
                Standing::Absent => {}
            }
        }
        if status.running > 0 {
            let left = status.cost - status.cost_done;
            status.seconds_left = self.speed(&is_done)?.map(|speed| left / speed);
        }
        Ok(status)
    }

    /// Guessed cost that was done a second of late, by the stamps of parts.
    fn speed(&self, is_done: &[bool]) -> Result<Option<f64>, PlanError> {
        let mut stamps: Vec<(SystemTime, f64)> = Vec::new();
        for ((number, unit), done) in (0..).zip(&self.plan().units).zip(is_done) {
            if *done {
                let path = self.part_path(number);
                let written = stamp(&path).map_err(PlanError::io(&path, "look at"))?;
                stamps.push((written, unit.cost));
            }
        }
        stamps.sort_by_key(|(written, _)| *written);
        let Some((last, _)) = stamps.last().copied() else {
            return Ok(None);
        };
        let since = |then: SystemTime| last.duration_since(then).unwrap_or_default();
        let from = stamps.partition_point(|(written, _)| since(*written) > WINDOW);
        let recent = &stamps[from..];
        // What was written first was begun before the time that is measured.
        let (first, cost) = match recent {
            [(first, _), rest @ ..] => (*first, rest.iter().map(|(_, cost)| cost).sum::<f64>()),
            [] => return Ok(None),
        };
        let seconds = since(first).as_secs_f64();
        Ok((seconds > 0.0 && cost > 0.0).then(|| cost / seconds))
    }
}
