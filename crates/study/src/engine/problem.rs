//! What a study measures, told by whoever brings it: integrals, and ways to estimate them.

#[cfg(doc)]
use super::Design;
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Integrals that estimators are compared on: the pixels of a scene for a renderer, or any others.
///
/// The engine asks for estimates by seed and number of samples; metrics, fits, plots and the report
/// follow from those. See the example on the page of this crate.
pub trait Problem: Sync {
    /// The choice of an estimator and its parameters, but for samples and seed.
    type Settings: Clone + Sync;
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
