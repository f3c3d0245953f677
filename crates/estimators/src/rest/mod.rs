//! The rest of the light, which is not integrated, is sampled here: by one technique alone
//! (`alone`), by several with weights (`weighted`), within the visible region (`visible`), or on
//! linear lights (`segment`).

pub(crate) mod alone;
mod optimal;
mod prepared;
pub(crate) mod segment;
mod smooth;
pub(crate) mod visible;
pub(crate) mod weighted;

use crate::draw::block::PointBlock;
use linelit_lights::RegionSampler;

/// The memory of samples, which is reused.
#[derive(Debug, Default)]
pub(crate) struct RestMemory {
    pub points: PointBlock,
    pub region: RegionSampler,
    pub segment: segment::SegmentMemory,
    pub weighted: weighted::WeightedMemory,
}
