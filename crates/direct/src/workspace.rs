//! A workspace has the memory and the counters of one thread.

use linelit_estimators::{Buffers, PlanCounters, SegmentCounters, VisibleDisk, VisibleRegion};
use linelit_samplers::Block;
use linelit_visibility::{Counters, VisibleLines};
use std::ops::AddAssign;

/// Memory that is reused from point to point, and counters. Each thread needs its own. No result
/// depends on the results before it.
#[derive(Debug, Default)]
pub struct Workspace {
    /// The memory of estimators and of visibility queries, with their counters.
    pub buffers: Buffers,
    /// The visible parts of lines that were queried last.
    pub lines: VisibleLines,
    pub(crate) region: VisibleRegion,
    pub(crate) disk: VisibleDisk,
    /// The lights that the samples of a shading point have chosen.
    pub(crate) drawn: Vec<Drawn>,
    /// The weights by which lights are chosen.
    pub(crate) weights: Vec<f64>,
}

/// A light that some of the samples have chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Its index among the lights that were chosen from.
    pub light: usize,
    /// The number of the shading point's samples that chose it.
    pub count: u32,
    /// The probability αᵢ with which a sample chooses it (Shirley & Wang 1991).
    pub probability: f64,
    /// The part of the light's pattern that belongs to these samples.
    pub block: Block,
}

/// All counters of one thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Pairs of a point and a light, by how they were treated and which work was skipped.
    pub plan: PlanCounters,
    /// The work of visibility queries.
    pub visibility: Counters,
    /// Lines and their visible pieces.
    pub segments: SegmentCounters,
}

impl Counts {
    /// The estimated number of triangle tests in shafts whose light was then integrated in closed
    /// form. This is the number of all tests, in proportion to the number of such shafts among
    /// those that are neither empty nor blocked. It serves to estimate what closed forms cost.
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
    /// A workspace with empty memory.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the counts so far, and resets them to zero.
    pub fn take_counts(&mut self) -> Counts {
        Counts {
            plan: std::mem::take(&mut self.buffers.counts.plan),
            visibility: std::mem::take(&mut self.buffers.scratch.counters),
            segments: std::mem::take(&mut self.buffers.counts.segments),
        }
    }
}
