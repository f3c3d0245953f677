//! The buffers of one thread.

use crate::selection::Drawn;
use linelit_estimators::{Buffers, PlanCounters, SegmentCounters};
use linelit_visibility::{Counters, Hit};
use std::ops::AddAssign;

/// Reusable buffers and counters; one for each thread. Nothing in it outlives a shading point but
/// memory and counts.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(crate) buffers: Buffers,
    /// What the camera rays of a few pixels meet.
    pub(crate) hits: Vec<Option<Hit>>,
    /// Lights picked for a shading point, and the weights by which.
    pub(crate) drawn: Vec<Drawn>,
    pub(crate) weights: Vec<f64>,
}

/// Everything that was counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Work that the plan skipped.
    pub plan: PlanCounters,
    /// Work of visibility queries.
    pub visibility: Counters,
    /// Visible pieces of lines.
    pub segments: SegmentCounters,
}

impl Counts {
    /// Tests against triangles past which light was then integrated in closed form, for guesses of
    /// what that takes: the share of all tests that such shafts have among those with a penumbra.
    #[must_use]
    pub fn exact_tests(&self) -> u64 {
        let (exact, partial) = (self.plan.exact_penumbrae, self.visibility.partial_shafts);
        let tests = u128::from(self.visibility.triangle_tests) * u128::from(exact);
        let share = tests / u128::from(partial.max(exact).max(1));
        u64::try_from(share).unwrap_or(u64::MAX)
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.plan += other.plan;
        self.visibility += other.visibility;
        self.segments += other.segments;
    }
}

impl Workspace {
    /// Empty buffers.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The counts so far; starts again from zero.
    pub fn take_counts(&mut self) -> Counts {
        Counts {
            plan: std::mem::take(&mut self.buffers.samples.plan),
            visibility: std::mem::take(&mut self.buffers.scratch.counters),
            segments: std::mem::take(&mut self.buffers.samples.segments),
        }
    }
}
