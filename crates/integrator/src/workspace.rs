//! The buffers of one thread.

use linelit_estimators::{Buffers, PlanCounters, SegmentCounters};
use linelit_samplers::Block;
use linelit_visibility::{Counters, Hit};
use std::ops::AddAssign;

/// Reusable buffers and counters; one for each thread. Nothing in it outlives a shading point but
/// memory and counts.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(crate) buffers: Buffers,
    /// The surfaces that a few camera rays meet.
    pub(crate) hits: Vec<Option<Hit>>,
    /// The lights picked for a shading point.
    pub(crate) drawn: Vec<Drawn>,
    /// Numbers in proportion to which they are picked.
    pub(crate) weights: Vec<f64>,
}

/// A light that some of the samples have picked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Index into the lights that there are to pick.
    pub light: usize,
    /// Number of samples that picked it.
    pub count: u32,
    /// αᵢ.
    pub probability: f64,
    /// The place of these samples among those of the camera samples that picked the light.
    pub block: Block,
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
            plan: std::mem::take(&mut self.buffers.counts.plan),
            visibility: std::mem::take(&mut self.buffers.scratch.counters),
            segments: std::mem::take(&mut self.buffers.counts.segments),
        }
    }
}
