//! The memory of one thread.

use crate::WorkCounters;
use crate::draw::block::PointBlock;
use crate::known::KnownMemory;
use crate::rest::segment::SegmentMemory;
use crate::rest::weighted::WeightedMemory;
use linelit_lights::RegionSampler;
use linelit_visibility::Scratch;

/// Memory that estimates use again, and counters; one for each thread. No estimate depends on
/// those before it.
#[derive(Debug, Default)]
pub struct Buffers {
    /// The memory of rays and shafts, with their counters.
    pub scratch: Scratch,
    /// Skipped and finished work.
    pub counts: WorkCounters,
    pub(crate) known: KnownMemory,
    pub(crate) rest: RestMemory,
}

/// The memory of samples.
#[derive(Debug, Default)]
pub(crate) struct RestMemory {
    pub points: PointBlock,
    pub region: RegionSampler,
    pub segment: SegmentMemory,
    pub weighted: WeightedMemory,
}
