//! The occluders of a scene: triangles under a hierarchy of boxes.

use crate::{
    build::{self, Bounds, BuildOptions, Geometry},
    bvh::{Bvh, largest_inverse_at},
    holes::{Holes, filter::SharedFilter},
    node::{Child, Node},
    pool,
    rounded::Rounded,
};
use linelit_geometry::{DVec3, Rounding, Vector3};
use linelit_simd::{InstructionSet, Isa};
use std::sync::Arc;

/// The triangles of a scene, ready for ray and line queries.
///
/// Vertices are stored as `f32`. Those given as `f32` are stored exactly: no query moves or rounds
/// them. Those given as `f64` ([`Occluders::build_with`], [`Occluders::refit`]) are rounded once,
/// relative to an [origin](Occluders::origin) in their middle; points and lights stay `f64`, and
/// are in the coordinates that vertices were given in. Triangles that can hide nothing (a vertex
/// that is not finite, an index out of range, two vertices in one place) are left out and counted.
/// Three distinct vertices on a line stay: they hide next to nothing, but keep the seam between
/// their neighbours closed.
///
/// Beside solid triangles they may have others, into which a filter cuts holes
/// ([`Occluders::with_holes`]). Where there are none, no query costs more than a branch. A clone
/// shares the hierarchies.
#[derive(Clone, Debug, Default)]
pub struct Occluders {
    pub(crate) bvh: Bvh,
    triangle_count: usize,
    left_out: usize,
    out_of_range: usize,
    pub(crate) holes: Option<Arc<Holes>>,
    options: BuildOptions,
    rounding: Rounding,
}

impl Occluders {
    /// Builds the hierarchy over triangles given by their corners' positions.
    ///
    /// Triangles that can hide nothing are left out: those with two corners in one place, those
    /// with a coordinate that is not finite, and those with a corner of which there is no position.
    /// The last are a mistake, which no answer shows: [`Occluders::out_of_range`] counts them, and
    /// [`Occluders::left_out`] all.
    ///
    /// ```
    /// use linelit_visibility::Occluders;
    /// let positions = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    /// // The second triangle counts from one.
    /// let occluders = Occluders::build(&positions, &[[0, 1, 2], [1, 2, 3], [0, 0, 1]]);
    /// assert_eq!(occluders.triangle_count(), 1);
    /// assert_eq!((occluders.left_out(), occluders.out_of_range()), (2, 1));
    /// ```
    ///
    /// Called in a thread of a rayon pool, it uses that pool's threads; the result is the same to
    /// the bit. Time is expected to be n log n for any input, and memory at the peak 97 bytes a
    /// triangle beside what is passed, about 125 on several threads, and some 40 more where closed
    /// meshes are fine enough to be seen by their silhouettes. Building works for all finite
    /// corners; answers are right for coordinates up to 2⁶⁰, which are all that scene files may
    /// have, and those of rays up to 1e30 along them.
    ///
    /// # Panics
    /// If there are more than 2²⁸ leaves, which takes as many triangles at least.
    #[must_use]
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        Self::build_with(positions, triangles, BuildOptions::default())
    }

    /// Builds the hierarchy for rays alone, without what shafts know of closed and fine meshes: a
    /// third of the memory, and more of the time.
    ///
    /// Rays get the same answers, to the bit. Shafts are answered, too, but look at more triangles:
    /// those that hide nothing which others do not hide are not told apart, there are no
    /// silhouettes, and interval ends past more than 224 triangles agree up to rounding.
    #[must_use]
    pub fn build_for_rays(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let options = BuildOptions {
            for_rays: true,
            ..BuildOptions::default()
        };
        Self::build_with(positions, triangles, options)
    }

    /// Builds the hierarchy as `options` tell, over vertices of any type.
    ///
    /// ```
    /// use linelit_visibility::{BuildOptions, Occluders};
    /// // A triangle of ten centimetres, at five million metres.
    /// let positions = [[0.0, 5e6, 1.0], [0.1, 5e6, 1.0], [0.0, 5e6 + 0.1, 1.0]];
    /// let occluders = Occluders::build_with(&positions, &[[0, 1, 2]], BuildOptions::default());
    /// assert_eq!(occluders.triangle_count(), 1);
    /// assert!(occluders.rounding().displacement < 1e-8);
    /// ```
    #[must_use]
    pub fn build_with<V: Vector3 + Copy + Sync>(
        positions: &[V],
        triangles: &[[u32; 3]],
        options: BuildOptions,
    ) -> Self {
        let mut occluders = Self {
            options,
            ..Self::default()
        };
        occluders.refit(positions, triangles);
        occluders
    }

    /// Moves the triangles to new positions of their corners, with those in the same order as when
    /// they were built. Triangles are left out as in [`Occluders::build`].
    ///
    /// Answers are those of a fresh [`Occluders::build`], to the bit, but that of a shaft with
    /// nothing hidden it may depend on the tree whether it is known to be empty; where more than
    /// 224 triangles are between a point and a light, to the rounding of interval ends, for what is
    /// looked at one by one there depends on the tree. Boxes are made anew under the tree that
    /// stands. This takes less than half of the time of building, most of it to find closed meshes
    /// again; the farther triangles go from their neighbours, the more boxes overlap, and the
    /// longer queries take. Where other triangles than before can hide something (a vertex has
    /// become finite, or two have met), or a clone shares the hierarchy, it is built anew.
    /// Triangles with holes stay as they are.
    pub fn refit<V: Vector3 + Copy + Sync>(&mut self, positions: &[V], triangles: &[[u32; 3]]) {
        let Rounded {
            positions,
            origin,
            rounding,
        } = Rounded::new(positions, triangles);
        self.refit_singles(&positions, triangles);
        self.rounding = rounding;
        self.bvh.origin += origin;
    }

    fn refit_singles(&mut self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
        let (kept, found) = Kept::find_all(positions, triangles);
        let bvh = &mut self.bvh;
        let leaves = &bvh.hierarchy.leaves;
        let mut used = leaves.iter().flat_map(|leaf| leaf.id);
        let same = Arc::strong_count(&bvh.hierarchy) == 1
            && found.count == self.triangle_count
            && used.all(|id| kept.get(id as usize) == Some(&true));
        let (count, Bounds { lo, hi }) = (found.count, found.bounds);
        let origin = exact_origin(lo, hi);
        let mut extent = 0.0_f32;
        for (x, origin) in [lo, hi].into_iter().flat_map(|v| v.into_iter().zip(origin)) {
            if count > 0 {
                extent = extent.max((x - origin).abs());
            }
        }
        let geometry = Geometry {
            positions,
            triangles,
            origin,
            extent,
        };
        if Arc::get_mut(&mut bvh.hierarchy).is_none() {
            bvh.hierarchy = Arc::default();
        }
        if let Some(hierarchy) = Arc::get_mut(&mut bvh.hierarchy) {
            if same {
                build::refit(&geometry, &kept, !self.options.for_rays, hierarchy);
            } else {
                *hierarchy = build::build(&geometry, &kept, self.options);
            }
        }
        bvh.origin = DVec3::from(origin.map(f64::from));
        bvh.extent = extent.into();
        bvh.largest_inverse = largest_inverse_at(extent.into());
        // Eight more places, as packed stores write eight at a time.
        bvh.stack_size = 16 * depth(&bvh.hierarchy.nodes) + 32;
        self.triangle_count = count;
        self.left_out = triangles.len() - count;
        self.out_of_range = found.out_of_range;
    }

    /// Builds the hierarchy over triangles that another has found, such as those
    /// `Between` a point and a light, in the order in which they come.
    #[must_use]
    pub fn from_triangles(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Self {
        let positions: Vec<_> = triangles.into_iter().flatten().collect();
        let corners = (0_u32..).step_by(3).map(|k| [k, k + 1, k + 2]);
        let triangles: Vec<_> = corners.take(positions.len() / 3).collect();
        Self::build(&positions, &triangles)
    }

    /// Moves all triangles, without rounding what is stored: `by` is added to the
    /// [origin](Occluders::origin). For those with holes, before [`Occluders::with_holes`].
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Self {
        self.bvh.origin += by;
        self
    }

    /// The number of triangles of their own that can hide something.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The number of triangles that were left out because they can hide nothing.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// The number of triangles that were left out because there is no position of one of their
    /// corners: more than zero says that the indices belong to other positions.
    #[must_use]
    pub fn out_of_range(&self) -> usize {
        self.out_of_range
    }

    /// The point relative to which vertices are stored: on each axis zero, or a middle of the
    /// vertices that triangles use ([`origin_of_box`](linelit_geometry::origin_of_box), where they
    /// were not `f32`).
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.bvh.origin
    }

    /// What rounding did to the vertices that triangles use: nothing, if they were `f32`.
    #[must_use]
    pub const fn rounding(&self) -> Rounding {
        self.rounding
    }

    /// Bytes that the hierarchy and its copy of the triangles take, with those of triangles with
    /// holes; filters have their own.
    #[must_use]
    pub fn memory(&self) -> usize {
        let own = self.bvh.hierarchy.memory();
        own + self
            .holes
            .as_ref()
            .map_or(0, |all| all.bvh.hierarchy.memory())
    }

    /// The instruction set in use.
    #[must_use]
    pub fn instruction_set(&self) -> InstructionSet {
        self.bvh.isa.name()
    }

    /// Uses no instruction set beyond `limit`, which is for tests and measurements: results do
    /// not depend on it.
    #[must_use]
    pub fn limited_to(mut self, limit: InstructionSet) -> Self {
        self.bvh.isa = Isa::detect(limit);
        if let Some(holes) = &self.holes {
            let mut holes = Holes::clone(holes);
            holes.bvh.isa = self.bvh.isa;
            self.holes = Some(Arc::new(holes));
        }
        self
    }

    /// Replaces the triangles with holes by these, into which a filter cuts holes. Those of
    /// `triangles` that have holes themselves are left out. The numbers that
    /// [`Hit::triangle`](crate::Hit::triangle) and the filter get are those of the list that
    /// `triangles` were built from: to tell both kinds apart, build both from one list, with unused
    /// corner indices (without a position) in place of the triangles that are not meant.
    #[must_use]
    pub fn with_holes(mut self, triangles: Self, filter: SharedFilter) -> Self {
        let bvh = triangles.bvh;
        self.holes = Some(Arc::new(Holes { bvh, filter }));
        self
    }
}

/// Triangles that are looked at in one go.
const AT_ONCE: usize = 1 << 14;

/// The triangles that can hide something: their number and their box, and the number of those with
/// a corner that has no position.
struct Kept {
    count: usize,
    out_of_range: usize,
    bounds: Bounds,
}

impl Kept {
    const NONE: Self = Self {
        count: 0,
        out_of_range: 0,
        bounds: Bounds::EMPTY,
    };

    /// Finds which of all triangles can hide something, and their totals.
    fn find_all(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> (Vec<bool>, Self) {
        let mut kept = vec![false; triangles.len()];
        let parts = pool::stretches_of(&mut kept, AT_ONCE, &|first, kept| {
            Self::find(positions, &triangles[first..], kept)
        });
        (kept, parts.into_iter().fold(Self::NONE, Self::and))
    }

    /// Finds which of the first triangles can hide something, as many as `kept` has room for.
    fn find(positions: &[[f32; 3]], triangles: &[[u32; 3]], kept: &mut [bool]) -> Self {
        let mut found = Self::NONE;
        for (corners, kept) in triangles.iter().zip(kept) {
            let Some(t) = occludes(positions, corners) else {
                let is_known = |corner: &u32| (*corner as usize) < positions.len();
                found.out_of_range += usize::from(!corners.iter().all(is_known));
                continue;
            };
            *kept = true;
            found.count += 1;
            for v in t {
                found.bounds.extend(&Bounds { lo: v, hi: v });
            }
        }
        found
    }

    fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            out_of_range: self.out_of_range + other.out_of_range,
            bounds: self.bounds.union(&other.bounds),
        }
    }
}

/// The vertices of a triangle that can hide something.
#[inline(always)]
fn occludes(positions: &[[f32; 3]], &[a, b, c]: &[u32; 3]) -> Option<[[f32; 3]; 3]> {
    let vertex = |corner: u32| positions.get(corner as usize).copied();
    let t = [vertex(a)?, vertex(b)?, vertex(c)?];
    let finite = t.as_flattened().iter().all(|x| x.is_finite());
    #[allow(clippy::float_cmp, reason = "vertices in the very same place")]
    let distinct = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    (finite && distinct).then_some(t)
}

/// A point near the middle of the scene from which every coordinate has an `f32` difference
/// without rounding: on an axis where all coordinates are within a factor of two of each other
/// (Sterbenz), their middle; else zero. Keeps boxes tight far from the world's origin.
fn exact_origin(lo: [f32; 3], hi: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| {
        let (lo, hi) = (lo[axis], hi[axis]);
        let (small, large) = (lo.abs().min(hi.abs()), lo.abs().max(hi.abs()));
        if lo <= hi && lo.signum() * hi.signum() > 0.0 && large <= 2.0 * small {
            lo + (hi - lo) * 0.5
        } else {
            0.0
        }
    })
}

/// The number of nodes on the longest way down.
fn depth(nodes: &[Node]) -> usize {
    let mut below = vec![1; nodes.len()];
    // Children stand behind their parents.
    for (at, node) in nodes.iter().enumerate().rev() {
        for child in node.lanes().map(|lane| Child(node.child[lane])) {
            if !child.is_leaf() {
                below[at] = below[at].max(1 + below[child.index()]);
            }
        }
    }
    below.first().copied().unwrap_or(0)
}
