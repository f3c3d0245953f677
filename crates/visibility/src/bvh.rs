//! What all queries need of a hierarchy: the tree itself, the origin of its coordinates, and bounds
//! that follow from its size.

use crate::build::Hierarchy;
use linelit_geometry::DVec3;
use linelit_simd::Isa;
use std::sync::Arc;

/// A hierarchy of boxes, which clones share, with the bounds and sizes that queries on it need.
#[derive(Clone, Debug)]
pub(crate) struct Bvh {
    pub(crate) hierarchy: Arc<Hierarchy>,
    /// The origin of the hierarchy's coordinates, relative to which vertices were rounded.
    pub(crate) origin: DVec3,
    /// The largest absolute coordinate of a vertex relative to the origin.
    pub(crate) extent: f64,
    /// The value of [`largest_inverse_at`] for `extent`.
    pub(crate) largest_inverse: f64,
    /// The number of entries that the stack of a depth-first walk may need.
    pub(crate) stack_size: usize,
    pub(crate) isa: Isa,
}

impl Default for Bvh {
    /// Returns a hierarchy without triangles.
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
    /// The distance from `point`, a point in world coordinates, beyond which a light counts as far
    /// away from all triangles; for [`Margins::near`](linelit_geometry::Margins::near).
    #[inline(always)]
    pub(crate) fn reach(&self, point: DVec3) -> f64 {
        FAR * (self.extent + (point - self.origin).abs().max_element())
    }

    /// Grows a stack to `stack_size` entries, which suffice for a walk in any order.
    #[inline(always)]
    pub(crate) fn make_room(&self, stack: &mut Vec<u32>) {
        if stack.len() < self.stack_size {
            stack.resize(self.stack_size, 0);
        }
    }
}

/// A light counts as far away when its distance is this multiple of the farthest triangle's
/// distance. For lights up to there, the margin near a shading point is the same fraction of the
/// way for rays, lines and polygons, though the lengths of their ways differ: what is on the point
/// hides the light for all of them, or for none.
pub(crate) const FAR: f64 = 1024.0;

/// Returns, for a scene whose largest absolute coordinate is `size`, the largest absolute
/// reciprocal of a direction's component that box tests use. A smaller component is treated as the
/// reciprocal of this limit: over any distance in `f32`, the difference moves the ray by less than
/// the margin of the tests.
pub(crate) fn largest_inverse_at(size: f64) -> f64 {
    (1e36 / size).min(1e37)
}
