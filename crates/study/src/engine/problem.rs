//! The description of a study by its caller: the integrals, the ways to estimate them, and how
//! often each is tried. Come here to study an estimator of your own.

use super::{CELL_SECONDS, Cell};
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::AddAssign;

/// The integrals that estimators are compared on: the pixels of a scene for a renderer, or any
/// others.
///
/// The engine calls for estimates by seed and number of samples; metrics, fits, plots and the
/// report follow from these. The page of this crate has an example.
pub trait Problem: Sync {
    /// The choice of an estimator and its parameters, without samples and seed: `()`, or a type
    /// with `#[derive(Clone, Debug)]`.
    type Settings: Clone + Debug + Sync;
    /// Buffers and counters that a thread reuses from one estimate to the next, or `()`.
    type Workspace: Default;

    /// Returns the number of integrals.
    fn integrals(&self) -> usize;

    /// Returns the number of pixels, which sums of squared errors are divided by. It is larger than
    /// [`Problem::integrals`] where some pixels have no integral, and therefore no error.
    fn pixels(&self) -> usize {
        self.integrals()
    }

    /// Returns an estimate of one integral (three channels, all equal for a scalar). It has to be a
    /// pure function of its arguments, the workspace aside, and independent for different seeds.
    fn estimate(
        &self,
        settings: &Self::Settings,
        samples: u32,
        seed: u64,
        integral: usize,
        workspace: &mut Self::Workspace,
    ) -> DVec3;

    /// Returns the work counted since the last call, and resets the counters. The default
    /// implementation counts no work.
    fn take_counts(&self, _: &mut Self::Workspace) -> Counts {
        Counts::default()
    }
}

/// Counts of work that do not depend on the machine, for the columns of `results.csv`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// The number of shadow rays.
    pub rays: u64,
    /// The number of line samples whose integral was evaluated (not in the tables).
    pub lines: u64,
    /// The number of lines whose visible intervals were computed.
    pub line_queries: u64,
    /// The number of tests against boxes of the hierarchy.
    pub node_tests: u64,
    /// The number of tests against triangles.
    pub triangle_tests: u64,
    /// The number of visible intervals found.
    pub intervals: u64,
    /// The number of tests against triangles made while light was integrated in closed form over
    /// the part of a light that these triangles do not hide (not in the tables).
    pub exact_tests: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.lines += other.lines;
        self.line_queries += other.line_queries;
        self.node_tests += other.node_tests;
        self.triangle_tests += other.triangle_tests;
        self.intervals += other.intervals;
        self.exact_tests += other.exact_tests;
    }
}

/// An estimator with its sampling pattern, the names by which tables and plots call them, and the
/// number of trials.
#[derive(Clone, Debug)]
pub struct Method<S> {
    /// The name of the estimator.
    pub estimator: String,
    /// The name of the sampling pattern.
    pub sampler: String,
    /// The number of independent trials at each number of samples; a spread needs at least two.
    pub trials: u32,
    /// The settings that [`Problem::estimate`] is called with.
    pub settings: S,
}

impl<S: Clone> Method<S> {
    /// Returns the cell of all trials of this method at one number of samples, whose first trial
    /// has this seed.
    pub(super) fn cell(&self, samples: u32, seed: u64) -> Cell<S> {
        Cell {
            settings: self.settings.clone(),
            samples,
            seed,
            trials: self.trials,
        }
    }
}

/// The true values that errors are measured by.
#[derive(Clone, Debug)]
pub enum Truth<S> {
    /// The known values, one for each integral.
    Known(Vec<DVec3>),
    /// The mean of many estimates by this method. It is computed in rounds of `trials` estimates of
    /// each integral, until the error of the mean should be small enough according to a pilot run,
    /// or [`Design::reference_rounds`] is reached.
    Computed(Method<S>),
}

/// The default limit on the rounds of a computed reference.
pub const REFERENCE_ROUNDS: u32 = 32;

/// The methods, numbers of samples and limits of a study.
#[derive(Clone, Debug)]
pub struct Design<S> {
    /// The methods to compare.
    pub methods: Vec<Method<S>>,
    /// The numbers of samples, ascending.
    pub samples: Vec<u32>,
    /// The seed of each method's first trial.
    pub seed: u64,
    /// The largest number of rounds of a computed reference, at least one.
    pub reference_rounds: u32,
    /// The least processor time, in seconds, for which each method is measured at each number of
    /// samples; shorter measurements are repeated until this time is reached.
    pub cell_seconds: f64,
}

impl<S> Design<S> {
    /// Creates the design of all methods at these numbers of samples, with seed 1 and default
    /// limits.
    #[must_use]
    pub const fn new(methods: Vec<Method<S>>, samples: Vec<u32>) -> Self {
        Self {
            methods,
            samples,
            seed: 1,
            reference_rounds: REFERENCE_ROUNDS,
            cell_seconds: CELL_SECONDS,
        }
    }

    /// Returns the cells to measure, a method and a number of samples each: first all methods with
    /// the least number of samples, then all with the next.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = (&Method<S>, u32)> {
        let count = self.methods.len();
        let cell = move |k| (&self.methods[k % count], self.samples[k / count]);
        (0..count * self.samples.len()).map(cell)
    }

    /// Returns the number of samples of each replicate of the reference: four times the largest of
    /// the study, but at least 256 and at most 4096.
    #[must_use]
    pub(super) fn reference_samples(&self) -> u32 {
        let most = self.samples.last().copied().unwrap_or(1);
        most.saturating_mul(4).clamp(256, 4096)
    }
}
