//! The memory and the counters of one thread.

use linelit_estimators::{Buffers, PlanCounters, SegmentCounters, VisibleDisk, VisibleRegion};
use linelit_samplers::Block;
use linelit_visibility::{Counters, VisibleLines};
use std::ops::AddAssign;

/// Memory that is used again from point to point, and counters; one for each thread. No answer
/// depends on those before it.
#[derive(Debug, Default)]
pub struct Workspace {
    /// The memory of estimators and of visibility queries, with their counters.
    pub buffers: Buffers,
    /// The visible parts of lines.
    pub lines: VisibleLines,
    pub(crate) region: VisibleRegion,
    pub(crate) disk: VisibleDisk,
    /// The lights that the samples of a shading point have picked.
    pub(crate) drawn: Vec<Drawn>,
    /// The weights by which they are picked.
    pub(crate) weights: Vec<f64>,
}

/// A light that some of the samples have picked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Index into the lights that one is picked from.
    pub light: usize,
    /// The number of the shading point's samples that picked this light.
    pub count: u32,
    /// The probability αᵢ with which a sample picks this light (Shirley & Wang 1991).
    pub probability: f64,
    /// The part of the light's pattern that these samples take.
    pub block: Block,
}

/// All counters of a thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Pairs of points and lights, by the work that was skipped.
    pub plan: PlanCounters,
    /// Work of visibility queries.
    pub visibility: Counters,
    /// Visible pieces of lines.
    pub segments: SegmentCounters,
}

impl Counts {
    /// The part of the tests of triangles that shafts took whose light was then integrated in
    /// closed form: an estimate, in proportion to the number of such shafts among those with a
    /// penumbra. It is for guesses of what closed forms cost.
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
    /// Empty memory.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The counts so far; counting starts again from zero.
    pub fn take_counts(&mut self) -> Counts {
        Counts {
            plan: std::mem::take(&mut self.buffers.counts.plan),
            visibility: std::mem::take(&mut self.buffers.scratch.counters),
            segments: std::mem::take(&mut self.buffers.counts.segments),
        }
    }
}
