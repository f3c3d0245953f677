//! [`Occluders`], the public entry to this crate: how the hierarchy over a scene's triangles is
//! built, refitted and configured. The queries are methods of it in the modules of rays, shafts and
//! holes.

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
/// Vertices are stored as `f32`. Vertices given as `f32` are stored exactly: no query moves or
/// rounds them. Vertices given as `f64` ([`Occluders::build_with`], [`Occluders::refit`]) are
/// rounded once, relative to an [origin](Occluders::origin) near the centre of their bounding box;
/// points and lights stay `f64`, and are in the coordinates in which the vertices were given.
/// Triangles that can hide nothing (a vertex that is not finite, an index out of range, two
/// vertices at the same position) are left out and counted. Triangles with three distinct vertices
/// on one line stay: they hide next to nothing, but keep the seam between their neighbours closed.
///
/// In addition to solid triangles, there may be triangles into which a filter cuts holes
/// ([`Occluders::with_holes`]). Without them, queries pay no more than a branch for the feature. A
/// clone shares the hierarchies.
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
    /// Triangles that can hide nothing are left out: those with two corners at the same position,
    /// with a coordinate that is not finite, or with a corner index that has no position. An index
    /// without a position is a mistake of the caller that no query reports:
    /// [`Occluders::out_of_range`] counts such triangles, and [`Occluders::left_out`] counts all
    /// that were left out.
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
    /// Called in a thread of a rayon pool, the function uses that pool's threads; the result is
    /// bit-identical for any number of threads. The expected time is n log n for any input. The
    /// peak memory is 97 bytes per triangle in addition to the arguments, about 125 on several
    /// threads, and some 40 more where closed meshes are fine enough that queries use their
    /// silhouettes. Building works for all finite corners; answers of queries are right for
    /// coordinates up to 2⁶⁰, which is the limit for scene files too, and answers of rays up to a
    /// distance of 1e30 along them.
    ///
    /// # Panics
    /// If there are more than 2²⁸ leaves, which takes at least as many triangles.
    #[must_use]
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        Self::build_with(positions, triangles, BuildOptions::default())
    }

    /// Builds a hierarchy for rays alone, without the data about closed and fine meshes that only
    /// shafts use: these are a third of the memory, and more than a third of the building time.
    ///
    /// Rays get bit-identical answers. Shafts can be queried too, but test more triangles: back
    /// faces of closed meshes are not left out, there are no silhouettes, and where more than 224
    /// triangles are between a point and a light, the ends of intervals agree up to rounding only.
    #[must_use]
    pub fn build_for_rays(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let options = BuildOptions {
            for_rays: true,
            ..BuildOptions::default()
        };
        Self::build_with(positions, triangles, options)
    }

    /// Builds the hierarchy with `options`, over vertices of any type that has three coordinates.
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

    /// Moves the triangles to new positions of their corners, and keeps the structure of the tree.
    ///
    /// `triangles` must be in the same order as when the hierarchy was built. Triangles are left
    /// out as in [`Occluders::build`]. If other triangles than before can hide something (a vertex
    /// has become finite, or two have met), or if a clone shares the hierarchy, it is built anew.
    /// Triangles with holes stay as they are.
    ///
    /// Answers are bit-identical to those of a fresh [`Occluders::build`], with two exceptions:
    /// whether a shaft in which nothing is hidden is classified as empty may depend on the tree;
    /// and where more than 224 triangles are between a point and a light, the ends of intervals
    /// agree up to rounding, since the tree determines which triangles are tested one by one there.
    ///
    /// Refitting takes less than half of the time of building, most of it to find closed meshes
    /// again. The farther triangles move from their neighbours, the more boxes overlap, and the
    /// longer queries take.
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

    /// Does the work of [`Self::refit`] for vertices that are `f32`, relative to the origin that
    /// [`Rounded`] has chosen.
    fn refit_singles(&mut self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
        // Find the triangles that can hide something; the tree can stay if they are the ones in its
        // leaves.
        let (kept, found) = Totals::find_all(positions, triangles);
        let bvh = &mut self.bvh;
        let leaves = &bvh.hierarchy.leaves;
        let mut used = leaves.iter().flat_map(|leaf| leaf.id);
        let same = Arc::strong_count(&bvh.hierarchy) == 1
            && found.count == self.triangle_count
            && used.all(|id| kept.get(id as usize) == Some(&true));
        let (count, Bounds { lo, hi }) = (found.count, found.bounds);
        // Choose the origin, and measure how far coordinates are from it.
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
        // Refit the tree, or build a new one; a hierarchy that clones share is not touched.
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
        // Eight more entries, as packed stores write eight at a time.
        bvh.stack_size = 16 * depth(&bvh.hierarchy.nodes) + 32;
        self.triangle_count = count;
        self.left_out = triangles.len() - count;
        self.out_of_range = found.out_of_range;
    }

    /// Builds the hierarchy over triangles that another hierarchy has found, such as the triangles
    /// in the `SpaceBetween` a point and a light. Their indices are their positions in the
    /// iterator.
    #[must_use]
    pub fn from_triangles(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Self {
        let positions: Vec<_> = triangles.into_iter().flatten().collect();
        let corners = (0_u32..).step_by(3).map(|k| [k, k + 1, k + 2]);
        let triangles: Vec<_> = corners.take(positions.len() / 3).collect();
        Self::build(&positions, &triangles)
    }

    /// Moves all triangles without rounding what is stored: `by` is added to the
    /// [origin](Occluders::origin). Triangles with holes do not move; move them by themselves
    /// before passing them to [`Occluders::with_holes`].
    #[must_use]
    pub fn moved(mut self, by: DVec3) -> Self {
        self.bvh.origin += by;
        self
    }

    /// The number of solid triangles that can hide something; triangles with holes are not counted.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The number of triangles that were left out because they can hide nothing.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// The number of triangles that were left out because one of their corner indices has no
    /// position. If it is not zero, the indices probably belong to other positions.
    #[must_use]
    pub fn out_of_range(&self) -> usize {
        self.out_of_range
    }

    /// The point relative to which vertices are stored. On each axis it is zero, or near the centre
    /// of the bounding box of the vertices that triangles use
    /// ([`origin_of_box`](linelit_geometry::origin_of_box), if the vertices were not `f32`).
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.bvh.origin
    }

    /// How far rounding to `f32` moved the vertices that triangles use; zero if they were given as
    /// `f32`.
    #[must_use]
    pub const fn rounding(&self) -> Rounding {
        self.rounding
    }

    /// The bytes of memory that the hierarchies take, copies of the triangles and triangles with
    /// holes included; the memory of filters is not counted.
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

    /// Restricts queries to instruction sets up to `limit`. This is for tests and measurements:
    /// results do not depend on the instruction set.
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

    /// Adds triangles into which `filter` cuts holes, in place of any that were added before. If
    /// `triangles` has triangles with holes itself, those are left out.
    ///
    /// [`Hit::triangle`](crate::Hit::triangle) and the filter receive indices into the list that
    /// `triangles` was built from. To be able to distinguish solid triangles from those with holes,
    /// build both hierarchies from one list, and replace in each the triangles of the other kind by
    /// ones with a corner index that has no position: these are left out, and indices stay.
    #[must_use]
    pub fn with_holes(mut self, triangles: Self, filter: SharedFilter) -> Self {
        let bvh = triangles.bvh;
        self.holes = Some(Arc::new(Holes { bvh, filter }));
        self
    }
}

/// The number of triangles that one parallel task handles, when triangles are checked before
/// building.
const AT_ONCE: usize = 1 << 14;

/// Totals over the triangles that can hide something: their number and their bounding box; and the
/// number of triangles with a corner index that has no position.
struct Totals {
    count: usize,
    out_of_range: usize,
    bounds: Bounds,
}

impl Totals {
    const NONE: Self = Self {
        count: 0,
        out_of_range: 0,
        bounds: Bounds::EMPTY,
    };

    /// Returns a list that says for each triangle whether it can hide something, and the totals.
    fn find_all(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> (Vec<bool>, Self) {
        let mut kept = vec![false; triangles.len()];
        let parts = pool::stretches_of(&mut kept, AT_ONCE, &|first, kept| {
            Self::find(positions, &triangles[first..], kept)
        });
        (kept, parts.into_iter().fold(Self::NONE, Self::and))
    }

    /// Finds for each of the first `kept.len()` triangles whether it can hide something, stores
    /// that in `kept`, and returns the totals over these triangles.
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

/// The vertices of a triangle, or `None` if it can hide nothing (see [`Occluders::build`]).
#[inline(always)]
fn occludes(positions: &[[f32; 3]], &[a, b, c]: &[u32; 3]) -> Option<[[f32; 3]; 3]> {
    let vertex = |corner: u32| positions.get(corner as usize).copied();
    let t = [vertex(a)?, vertex(b)?, vertex(c)?];
    let finite = t.as_flattened().iter().all(|x| x.is_finite());
    #[allow(clippy::float_cmp, reason = "vertices in the very same place")]
    let distinct = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    (finite && distinct).then_some(t)
}

/// Returns an origin from which every coordinate in the box from `lo` to `hi` differs by an `f32`
/// without rounding: on an axis where all coordinates are within a factor of two of each other, the
/// centre of the box (by Sterbenz' lemma the difference is exact); on other axes zero. This keeps
/// boxes tight far from the world's origin.
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

/// The number of nodes on the longest path from the root to a leaf.
fn depth(nodes: &[Node]) -> usize {
    let mut below = vec![1; nodes.len()];
    // Children come after their parents in the list.
    for (at, node) in nodes.iter().enumerate().rev() {
        for child in node.lanes().map(|lane| Child(node.child[lane])) {
            if !child.is_leaf() {
                below[at] = below[at].max(1 + below[child.index()]);
            }
        }
    }
    below.first().copied().unwrap_or(0)
}
