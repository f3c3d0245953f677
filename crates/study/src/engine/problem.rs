//! What a study measures, supplied by the caller: integrals, and ways to estimate them.

use super::{CELL_SECONDS, Cell};
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::AddAssign;

/// Integrals that estimators are compared on: the pixels of a scene for a renderer, or any others.
///
/// The engine asks for estimates by seed and number of samples; metrics, fits, plots and the report
/// follow from those. See the example on the page of this crate.
pub trait Problem: Sync {
    /// The choice of an estimator and its parameters, but for samples and seed: `()`, or a type
    /// with `#[derive(Clone, Debug)]`.
    type Settings: Clone + Debug + Sync;
    /// Buffers and counters that a thread reuses from one estimate to the next, or `()`.
    type Workspace: Default;

    /// Number of integrals.
    fn integrals(&self) -> usize;

    /// Number of pixels, by which sums of squared errors are divided: more than
    /// [`Problem::integrals`] where some pixels have nothing to estimate and no error.
    fn pixels(&self) -> usize {
        self.integrals()
    }

    /// An estimate of one integral (three channels, all equal for a scalar): a pure function of its
    /// arguments but the workspace, independent for different seeds.
    fn estimate(
        &self,
        settings: &Self::Settings,
        samples: u32,
        seed: u64,
        integral: usize,
        workspace: &mut Self::Workspace,
    ) -> DVec3;

    /// The work counted since the last call; zero unless implemented.
    fn take_counts(&self, _: &mut Self::Workspace) -> Counts {
        Counts::default()
    }
}

/// Work that does not depend on the machine, for the columns of `results.csv`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Shadow rays.
    pub rays: u64,
    /// Line samples whose integral was evaluated (not in the tables).
    pub lines: u64,
    /// Lines whose visible intervals were asked for.
    pub line_queries: u64,
    /// Tests against boxes of the hierarchy.
    pub node_tests: u64,
    /// Tests against triangles.
    pub triangle_tests: u64,
    /// Visible intervals found.
    pub intervals: u64,
    /// Tests against triangles past which light was integrated in closed form (not in the tables).
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

/// A way to estimate, with the names that tables and plots give it.
#[derive(Clone, Debug)]
pub struct Method<S> {
    /// The estimator's name.
    pub estimator: String,
    /// The sampling pattern's name.
    pub sampler: String,
    /// Independent trials of each number of samples, at least two to know a spread.
    pub trials: u32,
    /// The argument of [`Problem::estimate`].
    pub settings: S,
}

impl<S: Clone> Method<S> {
    /// Returns the cell of all its trials with this many samples, from a seed on.
    pub(super) fn cell(&self, samples: u32, seed: u64) -> Cell<S> {
        Cell {
            settings: self.settings.clone(),
            samples,
            seed,
            trials: self.trials,
        }
    }
}

/// The values that errors are measured by.
#[derive(Clone, Debug)]
pub enum Truth<S> {
    /// The integrals, one by one.
    Known(Vec<DVec3>),
    /// The mean of many estimates by this method: rounds of `trials` estimates of each integral, so
    /// many that a pilot says the error of their mean is small enough, or
    /// [`Design::reference_rounds`].
    Computed(Method<S>),
}

/// The default number of rounds that the reference of a study may take.
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
    /// The most rounds of a computed reference, at least one.
    pub reference_rounds: u32,
    /// Processor seconds that each method is measured for at least, at each number of samples.
    pub cell_seconds: f64,
}

impl<S> Design<S> {
    /// Creates the design of all methods at these numbers of samples, with seed 1.
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

    /// Returns the cells to measure: all methods with the least samples first.
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
