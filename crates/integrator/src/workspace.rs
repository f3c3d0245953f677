//! The buffers of one thread.

use crate::PlanCounters;
use crate::lines::Draws;
use crate::mix::MixBuffers;
use crate::selection::Drawn;
use linelit_penumbra::Penumbra;
use linelit_visibility::{Counters, Scratch, VisibleLines};
use std::ops::AddAssign;

/// Reusable buffers and counters; one for each thread. Nothing in it outlives a shading point but
/// memory and counts.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(crate) scratch: Scratch,
    pub(crate) visible: VisibleLines,
    pub(crate) draws: Draws,
    pub(crate) mix: MixBuffers<'static>,
    pub(crate) penumbra: Penumbra,
    pub(crate) plan: PlanCounters,
    pub(crate) segments: SegmentCounters,
    /// Lights picked for a shading point, and the weights by which.
    pub(crate) drawn: Vec<Drawn>,
    pub(crate) weights: Vec<f64>,
}

/// How many pieces line samples were cut into (Billen & Dutré 2016, Fig. 5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SegmentCounters {
    /// Line samples asked.
    pub lines: u64,
    /// Visible pieces found.
    pub pieces: u64,
}

impl AddAssign for SegmentCounters {
    fn add_assign(&mut self, other: Self) {
        self.lines += other.lines;
        self.pieces += other.pieces;
    }
}

/// Everything that was counted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// What the plan skipped.
    pub plan: PlanCounters,
    /// What visibility did.
    pub visibility: Counters,
    /// Visible pieces of lines.
    pub segments: SegmentCounters,
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
            plan: std::mem::take(&mut self.plan),
            visibility: std::mem::take(&mut self.scratch.counters),
            segments: std::mem::take(&mut self.segments),
        }
    }
}
