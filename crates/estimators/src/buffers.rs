//! The memory of one thread.

use crate::combination::{CombinationBuffers, NoLines};
use crate::line_sum::Draws;
use crate::point_block::PointBlock;
use crate::round::RoundSource;
use crate::techniques::points::round::RoundPoints;
use crate::techniques::{lines::LineFamily, points::PointSource};
use crate::transformed::Fit;
use crate::{PlanCounters, SegmentCounters};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::{CylinderLines, RegionSampler};
use linelit_penumbra::{PartOnDisk, Penumbra};
use linelit_visibility::{Scratch, VisibleLines};

/// Memory that estimates use again, and counters; one for each thread. No estimate depends on
/// those before it.
#[derive(Debug, Default)]
pub struct Buffers {
    /// What rays and shafts keep, with their counters.
    pub scratch: Scratch,
    /// What is left to use while a shaft holds the scratch.
    pub samples: SampleBuffers,
}

/// Memory for samples, and what is counted of them.
#[derive(Debug, Default)]
pub struct SampleBuffers {
    /// What was skipped and what was done.
    pub plan: PlanCounters,
    /// Lines and their visible pieces.
    pub segments: SegmentCounters,
    pub(crate) visible: VisibleLines,
    pub(crate) draws: Draws,
    pub(crate) points: PointBlock,
    /// Points of a combination that wait for their visibility.
    pub(crate) targets: Vec<DVec3>,
    /// What pairs of points on linear lights send to the viewer, and their densities.
    pub(crate) pairs: Vec<(DVec3, [f64; 2])>,
    pub(crate) combination: CombinationBuffers<PointSource<'static>, LineFamily<'static>>,
    pub(crate) round: CombinationBuffers<RoundSource, NoLines>,
    pub(crate) cylinder: CombinationBuffers<RoundPoints, CylinderLines>,
    /// Lines as they are seen on an outline.
    pub(crate) outlined: Vec<Segment>,
    pub(crate) penumbra: Penumbra,
    pub(crate) on_disk: PartOnDisk,
    pub(crate) fit: Fit,
    /// What is visible of a light.
    pub(crate) region: RegionSampler,
}

impl SampleBuffers {
    /// Counts the lines that were drawn, their visible pieces, and those that have none.
    pub(crate) fn count_lines(&mut self) {
        for i in 0..self.draws.lines.len() {
            let parts = self.visible.line(i);
            self.segments.lines += 1;
            self.segments.pieces += parts.len() as u64;
            self.plan.hidden_lines += u64::from(parts.is_empty());
        }
    }
}
