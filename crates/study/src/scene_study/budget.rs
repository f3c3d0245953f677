//! The time budget of a study: before each unit it is decided whether the result that the unit
//! belongs to fits into the remaining time.

use super::{Piece, PlannedUnit, SceneUnit};
use crate::engine::Unit;
use std::mem::discriminant;

/// A budget of some seconds for the units of a study.
///
/// A unit is begun only if the whole result that it belongs to is expected to end in time,
/// according to the plan's estimates and the measured speed of the units before it. A result is a
/// measurement together with its reference, or a picture. Each view has an equal part of the time,
/// in addition to what the views before it did not use. If its pictures are expected to take at
/// most a quarter of its part, measurements leave time for them.
#[derive(Debug)]
pub struct TimeBudget {
    units: Vec<PlannedUnit>,
    seconds: f64,
    threads: f64,
    /// The time when the first unit was begun.
    begun: Option<f64>,
    /// The estimated seconds of the units that were begun.
    guessed: f64,
    left_out: Vec<bool>,
}

/// The reason why a unit is left out: its result needs more seconds than are left.
#[derive(Clone, Copy, Debug)]
pub struct Shortage {
    /// The expected seconds up to the end of the result that the unit belongs to.
    pub expected: f64,
    /// The seconds that are left.
    pub left: f64,
    /// Whether this is the first unit of its kind and view that does not fit, about which a message
    /// is printed.
    pub is_first: bool,
}

/// The largest fraction of a view's time that is set aside for its pictures. If they are expected
/// to take more, no time is set aside for them.
const PICTURES: f64 = 0.25;

/// The weight, in seconds of measured time, of the speed that the plan assumes, when it is averaged
/// with the measured speed.
const PRIOR_SECONDS: f64 = 1.0;

impl TimeBudget {
    /// Creates a budget of some seconds from now on, for units that are computed one at a time, in
    /// their order, on this many threads.
    #[must_use]
    pub fn new(units: Vec<PlannedUnit>, seconds: f64, threads: usize) -> Self {
        Self {
            left_out: vec![false; units.len()],
            units,
            seconds,
            threads: threads.max(1) as f64,
            begun: None,
            guessed: 0.0,
        }
    }

    /// Begins a unit, `now` seconds after the budget was made, or leaves it out. Call it for the
    /// units that have to be computed, in their order.
    ///
    /// # Errors
    /// [`Shortage`] if the unit is left out.
    pub fn begin(&mut self, number: usize, now: f64) -> Result<(), Shortage> {
        let Some(unit) = self.units.get(number) else {
            return Ok(());
        };
        // Estimate the time up to the end of the whole result.
        let end = (number..self.units.len()).find(|k| self.ends_result(*k));
        let result = number..=end.unwrap_or(number);
        let cost: f64 = self.units[result].iter().map(|u| u.seconds).sum();
        let speed = self.seconds_per_guess(now);
        // The view's part of the time.
        let [begin, end] = [0, 1].map(|k| self.share_until(unit.unit.view + k));
        let mut expected = speed * cost;
        // Set time aside for the pictures, which come last, if they do not need much of it.
        if matches!(unit.unit.piece, Piece::Errors(_)) {
            let own = self.units.iter().filter(|u| u.unit.view == unit.unit.view);
            let pictures = own.filter(|u| !matches!(u.unit.piece, Piece::Errors(_)));
            let pictures = speed * pictures.map(|u| u.seconds).sum::<f64>();
            if pictures <= PICTURES * (end - begin) {
                expected += pictures;
            }
        }
        // Begin the unit if it fits and all that it needs was computed.
        let left = (end - now).max(0.0);
        if expected <= left && !self.lacks(number) {
            self.begun.get_or_insert(now);
            self.guessed += unit.seconds;
            return Ok(());
        }
        // Leave it out otherwise.
        let kind = |k: usize| {
            let SceneUnit { view, piece } = &self.units[k].unit;
            (*view, discriminant(piece))
        };
        let is_first = !(0..number).any(|k| self.left_out[k] && kind(k) == kind(number));
        self.left_out[number] = true;
        Err(Shortage {
            expected,
            left,
            is_first,
        })
    }

    /// Returns the expected seconds on the wall for an estimated second of one thread.
    fn seconds_per_guess(&self, now: f64) -> f64 {
        let passed = self.begun.map_or(0.0, |begun| now - begun);
        (passed + PRIOR_SECONDS) / (self.guessed + PRIOR_SECONDS * self.threads)
    }

    /// Returns the time, in seconds since the budget was made, at which the views before this one
    /// should be finished.
    fn share_until(&self, view: usize) -> f64 {
        let views = self.units.last().map_or(1, |last| last.unit.view + 1);
        self.seconds * view as f64 / views as f64
    }

    /// Returns whether this unit completes a result. A measurement comes after its reference, and
    /// the blocks of a measurement that is cut follow one another.
    fn ends_result(&self, number: usize) -> bool {
        match &self.units[number].unit.piece {
            Piece::Errors(Unit::Reference { .. }) | Piece::GalleryReference(_) => false,
            Piece::Errors(Unit::Cells { cells, .. }) => {
                let next = self.units.get(number + 1).map(|unit| &unit.unit.piece);
                !matches!(next, Some(Piece::Errors(Unit::Cells { cells: c, .. })) if c == cells)
            }
            Piece::GalleryPicture(_) | Piece::Exhibit => true,
        }
    }

    /// Returns whether another part of the same result, or of its reference, was left out.
    fn lacks(&self, number: usize) -> bool {
        let before = number.checked_sub(1);
        let broken = before.is_some_and(|k| self.left_out[k] && !self.ends_result(k));
        let unit = &self.units[number];
        // The picture of a scene is made from the measurements that there are.
        let needs_all = unit.unit.piece != Piece::Exhibit;
        broken || needs_all && unit.needs.clone().any(|k| self.left_out[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ops::Range;

    /// Returns the units of a view: a reference of two units of 2 s; measurements of 1 s, of three
    /// units of 2 s, and of 1 s; and a picture of 1 s.
    fn view(view: usize, first: usize) -> Vec<PlannedUnit> {
        let reference = |round| {
            Piece::Errors(Unit::Reference {
                round,
                integrals: 0..9,
            })
        };
        let cells = |cells, integrals| Piece::Errors(Unit::Cells { cells, integrals });
        let none = first..first;
        let held = first..first + 2;
        let pieces = [
            (reference(0), 2.0, &none),
            (reference(1), 2.0, &none),
            (cells(0..2, 0..9), 1.0, &held),
            (cells(2..3, 0..3), 2.0, &held),
            (cells(2..3, 3..6), 2.0, &held),
            (cells(2..3, 6..9), 2.0, &held),
            (cells(3..4, 0..9), 1.0, &held),
            (Piece::Exhibit, 1.0, &held),
        ];
        let unit = |(piece, seconds, needs): (Piece, f64, &Range<usize>)| PlannedUnit {
            unit: SceneUnit { view, piece },
            name: String::new(),
            seconds,
            needs: needs.clone(),
        };
        pieces.map(unit).into()
    }

    /// Returns the units that are begun on two threads if each takes `slow` times its estimate, and
    /// the time when the last one ends.
    fn run(units: &[PlannedUnit], seconds: f64, slow: f64) -> (Vec<usize>, f64) {
        let mut budget = TimeBudget::new(units.to_vec(), seconds, 2);
        let (mut begun, mut now) = (Vec::new(), 0.0);
        for (k, unit) in units.iter().enumerate() {
            if budget.begin(k, now).is_ok() {
                begun.push(k);
                now += slow * unit.seconds / 2.0;
            }
        }
        (begun, now)
    }

    #[test]
    fn results_are_begun_only_if_all_of_them_fits() {
        let units = view(0, 0);
        let all: Vec<usize> = (0..8).collect();
        // 13 s of one thread are 6.5 s of two.
        assert_eq!(run(&units, 6.5, 1.0), (all, 6.5));
        // The measurement of three blocks is left out, shorter ones are not.
        assert_eq!(run(&units, 5.9, 1.0), (vec![0, 1, 2, 6, 7], 3.5));
        // The reference, the shortest measurement and the picture take 3 s; in less time, no unit
        // of the first two is begun.
        assert_eq!(run(&units, 3.0, 1.0), (vec![0, 1, 2, 7], 3.0));
        assert_eq!(run(&units, 2.9, 1.0), (vec![7], 0.5));
        assert_eq!(run(&units, 0.0, 1.0), (vec![], 0.0));
        // Units are three times as slow as estimated, which is known after the first one.
        assert_eq!(run(&units, 3.9, 3.0), (vec![0], 3.0));
    }

    #[test]
    fn every_view_has_its_share_and_the_budget_is_kept() {
        let units = [view(0, 0), view(1, 8)].concat();
        let (begun, end) = run(&units, 7.0, 1.0);
        assert_eq!(begun, [0, 1, 2, 6, 7, 8, 9, 10, 14, 15]);
        assert!(end <= 7.0);
        // However wrong the estimates are, the time is exceeded by at most the current unit, whose
        // 2 s are on two threads.
        for tenths in 0..200 {
            for slow in [0.2, 1.0, 1.5, 3.0, 10.0] {
                let seconds = 0.1 * f64::from(tenths);
                let end = run(&units, seconds, slow).1;
                let longest = if slow > 1.0 { slow } else { 0.0 };
                assert!(end <= seconds + longest, "{end} {seconds} {slow}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_said_once_for_each_kind() {
        let units = view(0, 0);
        let mut budget = TimeBudget::new(units, 1e-9, 2);
        let said: Vec<usize> = (0..8)
            .filter(|k| {
                budget
                    .begin(*k, 0.0)
                    .is_err_and(|shortage| shortage.is_first)
            })
            .collect();
        assert_eq!(said, [0, 7]);
    }
}
