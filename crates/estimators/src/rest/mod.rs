//! Samples of the part of the light that is not known.

pub(crate) mod alone;
mod optimal;
mod prepared;
pub(crate) mod segment;
mod smooth;
pub(crate) mod visible;
pub(crate) mod weighted;

use crate::draw::block::PointBlock;
use linelit_lights::RegionSampler;

/// The memory of samples.
#[derive(Debug, Default)]
pub(crate) struct RestMemory {
    pub points: PointBlock,
    pub region: RegionSampler,
    pub segment: segment::SegmentMemory,
    pub weighted: weighted::WeightedMemory,
}
