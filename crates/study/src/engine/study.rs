//! A whole convergence study of one problem: methods × numbers of samples.
#![allow(clippy::disallowed_methods, reason = "compares with the deadline")]

use super::bytes::Broken;
use super::units::{Gathering, Job, Unit};
use super::{CELL_SECONDS, Counts, Method, Problem, Reference, Score, Times, Truth};
use crate::tables::LeftOutRow;
use std::time::Instant;

/// Rounds that the reference of a study may take, unless told.
pub const REFERENCE_ROUNDS: u32 = 32;

/// Methods, numbers of samples and limits of a study.
#[derive(Clone, Debug)]
pub struct Design<S> {
    /// The methods to compare.
    pub methods: Vec<Method<S>>,
    /// Numbers of samples, ascending.
    pub samples: Vec<u32>,
    /// Seed of each method's first trial.
    pub seed: u64,
    /// When no more measurements are begun.
    pub deadline: Option<Instant>,
    /// The most rounds of a computed reference, at least one.
    pub reference_rounds: u32,
    /// Processor seconds that each method is measured for at least, at each number of samples.
    pub cell_seconds: f64,
}

impl<S> Design<S> {
    /// All methods at these numbers of samples, with seed 1 and no deadline.
    #[must_use]
    pub const fn new(methods: Vec<Method<S>>, samples: Vec<u32>) -> Self {
        Self {
            methods,
            samples,
            seed: 1,
            deadline: None,
            reference_rounds: REFERENCE_ROUNDS,
            cell_seconds: CELL_SECONDS,
        }
    }

    /// What is measured: all methods with the least samples first.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = (&Method<S>, u32)> {
        let count = self.methods.len();
        let cell = move |k| (&self.methods[k % count], self.samples[k / count]);
        (0..count * self.samples.len()).map(cell)
    }

    /// Samples of each replicate of the reference.
    #[must_use]
    pub(super) fn reference_samples(&self) -> u32 {
        let most = self.samples.last().copied().unwrap_or(1);
        most.saturating_mul(4).clamp(256, 4096)
    }
}

/// Errors and times of all methods on one problem.
#[derive(Clone, Debug)]
pub struct Results {
    /// Number of integrals.
    pub integrals: usize,
    /// Number of pixels, by which sums of errors are divided ([`Problem::pixels`]).
    pub pixels: usize,
    /// The reference.
    pub reference: Reference,
    /// Mean over pixels and channels of the reference's square: what squared errors are relative
    /// to.
    pub power: f64,
    /// All measurements, in the order of [`Design::cells`].
    pub cells: Vec<CellResult>,
    /// Measurements that the deadline left out; the scene's name is still empty.
    pub left_out: Vec<LeftOutRow>,
}

/// Error and time of one method at one number of samples.
#[derive(Clone, Debug)]
pub struct CellResult {
    /// The estimator's name.
    pub estimator: String,
    /// The pattern's name.
    pub sampler: String,
    /// Samples.
    pub samples: u32,
    /// Trials.
    pub trials: u32,
    /// Errors.
    pub score: Score,
    /// Seconds of one trial.
    pub times: Times,
    /// The processor that was timed; of what was measured on several, no time is known.
    pub processor: String,
    /// Counts of all trials.
    pub counts: Counts,
}

/// Measures all methods on a problem, on the threads of the rayon pool that it is called in: the
/// units of [`Job::units`], one after the other. The error of a computed reference is below a tenth
/// of the smallest variance found, as far as a pilot can tell and [`Design::reference_rounds`]
/// allow; what has none but rounding ([`Score::variance`]) does not count.
///
/// Only times depend on how many those are. `begun` is called once for each method and number of
/// samples, before they are measured or left out: for those who show progress.
///
/// # Panics
/// If known values are not one for each integral.
pub fn measure<P: Problem>(
    problem: &P,
    truth: &Truth<P::Settings>,
    design: &Design<P::Settings>,
    mut begun: impl FnMut(),
) -> Results {
    let job = Job {
        problem,
        truth,
        design,
    };
    let over = || design.deadline.is_some_and(|d| Instant::now() > d);
    let mut gathering = Gathering::new(job);
    let mut reference = None;
    for planned in job.units() {
        if let Unit::Cells { cells, integrals } = &planned.unit {
            if integrals.start == 0 {
                cells.clone().for_each(|_| begun());
            }
            reference.get_or_insert_with(|| gathering.reference());
            if over() {
                continue;
            }
        }
        let values = || reference.as_ref().ok_or(Broken("the reference"));
        if let Ok(part) = job.compute(&planned.unit, values) {
            gathering.add(&planned.unit, part);
        }
    }
    gathering.results()
}
