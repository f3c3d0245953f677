//! A hierarchy and where it stands in the world: what every query walks.

use crate::build::Hierarchy;
use linelit_geometry::DVec3;
use linelit_simd::Isa;
use std::sync::Arc;

/// A hierarchy of boxes, shared by clones, with what queries on it need to know.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    pub(crate) hierarchy: Arc<Hierarchy>,
    /// The origin of the hierarchy's coordinates, relative to which vertices were rounded.
    pub(crate) origin: DVec3,
    /// Largest absolute coordinate relative to the origin.
    pub(crate) extent: f64,
    /// [`largest_inverse_at`] that.
    pub(crate) largest_inverse: f64,
    /// Room that a depth-first walk needs on its stack.
    pub(crate) stack_size: usize,
    pub(crate) isa: Isa,
}

impl Default for Bvh {
    /// Empty.
    fn default() -> Self {
        Self {
            hierarchy: Arc::default(),
            origin: DVec3::ZERO,
            extent: 0.0,
            largest_inverse: largest_inverse_at(0.0),
            stack_size: 32,
            isa: Isa::best(),
        }
    }
}

impl Bvh {
    /// The distance from a point of the world beyond which lights are far from all triangles, for
    /// [`Margins::near`](linelit_geometry::Margins::near).
    #[inline(always)]
    pub(crate) fn reach(&self, point: DVec3) -> f64 {
        FAR * (self.extent + (point - self.origin).abs().max_element())
    }

    /// Makes room on a stack for a walk in any order.
    #[inline(always)]
    pub(crate) fn make_room(&self, stack: &mut Vec<u32>) {
        if stack.len() < self.stack_size {
            stack.resize(self.stack_size, 0);
        }
    }
}

/// Lights are far where they are so many times as far away as the farthest triangle. Up to there
/// the margin near a point is one fraction of the way for rays, lines and polygons, though the ways
/// to them differ: what stands on the point hides the light for all of them, or for none.
pub(crate) const FAR: f64 = 1024.0;

/// The largest reciprocal of a direction's component that boxes are tested with in a scene of this
/// size: smaller components move the ray by less than the room over any distance in `f32`.
pub(crate) fn largest_inverse_at(size: f64) -> f64 {
    (1e36 / size).min(1e37)
}
