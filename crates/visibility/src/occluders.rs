//! The occluders of a scene: triangles under a hierarchy of boxes.

use crate::{
    Instance,
    build::{self, Geometry, Hierarchy, least, most},
    instances::Instances,
    node::Child,
    pool, ray,
};
use linelit_geometry::DVec3;
use linelit_simd::{InstructionSet, Isa};
use std::sync::Arc;

/// The triangles of a scene, ready for ray and line queries.
///
/// Vertices are `f32` and exactly those given: no query moves or rounds them. Triangles that can
/// hide nothing (a vertex that is not finite, an index out of range, two vertices in one place)
/// are left out and counted. Three distinct vertices on a line stay: they hide next to nothing,
/// but keep the seam between their neighbours closed.
///
/// Beside triangles of their own they may have [`Instance`]s of other occluders: moved, with a
/// filter that cuts holes into triangles, or with a ray mask ([`Occluders::with_instances`]). Where
/// there are none, no query costs more than a branch. A clone shares the hierarchies.
#[derive(Clone, Debug)]
pub struct Occluders {
    pub(crate) hierarchy: Arc<Hierarchy>,
    /// What the hierarchy's coordinates are relative to; an exact difference for every vertex.
    pub(crate) origin: DVec3,
    /// Largest absolute coordinate relative to the origin.
    pub(crate) extent: f64,
    /// [`ray::largest_inverse_at`] that.
    pub(crate) largest_inverse: f64,
    /// Room that a depth-first walk needs on its stack.
    pub(crate) stack_size: usize,
    pub(crate) isa: Isa,
    triangle_count: usize,
    left_out: usize,
    out_of_range: usize,
    /// Which triangles were kept: the memory of [`Occluders::become_flat`].
    kept: Vec<bool>,
    pub(crate) instances: Option<Arc<Instances>>,
    /// Of rays and lines.
    pub(crate) mask: u32,
}

impl Default for Occluders {
    /// None.
    fn default() -> Self {
        Self {
            hierarchy: Arc::default(),
            origin: DVec3::ZERO,
            extent: 0.0,
            largest_inverse: ray::largest_inverse_at(0.0),
            stack_size: 32,
            isa: Isa::best(),
            triangle_count: 0,
            left_out: 0,
            out_of_range: 0,
            kept: Vec::new(),
            instances: None,
            mask: u32::MAX,
        }
    }
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
    /// the bit. Time is n log n for any input, and memory at the peak 97 bytes a triangle beside
    /// what is passed, about 125 on several threads, and some 40 more where closed meshes are fine
    /// enough to be seen by their silhouettes. Building works for all finite corners; answers are
    /// right for coordinates up to 2⁶⁰, which are all that scene files may have, and those of rays
    /// up to 1e30 along them.
    ///
    /// # Panics
    /// If there are more than 2²⁸ leaves, which takes as many triangles at least.
    #[must_use]
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let (kept, found) = Kept::find_all(positions, triangles);
        let mut occluders = Self::default();
        occluders.become_built(positions, triangles, &found, |geometry, hierarchy| {
            *hierarchy = build::build(geometry, &kept);
        });
        occluders
    }

    /// Moves the triangles to new positions of their corners: what was given when they were built,
    /// in the same order. What is left out is as in [`Occluders::build`].
    ///
    /// Answers are those of a fresh [`Occluders::build`], to the bit, but that of a shaft with
    /// nothing hidden it may depend on the tree whether it is known to be empty; where more than
    /// 224 triangles are between a point and a light, to the rounding of interval ends, for what is
    /// looked at one by one there depends on the tree. Boxes are made anew under the tree that
    /// stands. This takes less than half of the time of building, most of it to find closed meshes
    /// again; the farther triangles go from their neighbours, the more boxes overlap, and the
    /// longer queries take. Where other triangles than before can hide something (a vertex has
    /// become finite, or two have met), or a clone shares the hierarchy, it is built anew.
    /// Instances stay as they are.
    pub fn refit(&mut self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
        let (kept, found) = Kept::find_all(positions, triangles);
        let leaves = &self.hierarchy.leaves;
        let mut used = leaves.iter().flat_map(|leaf| leaf.id);
        let same = Arc::strong_count(&self.hierarchy) == 1
            && found.count == self.triangle_count
            && used.all(|id| kept.get(id as usize) == Some(&true));
        self.become_built(positions, triangles, &found, |geometry, hierarchy| {
            if same {
                build::refit(geometry, &kept, hierarchy);
            } else {
                *hierarchy = build::build(geometry, &kept);
            }
        });
    }

    /// Becomes those of other triangles, without a hierarchy that would take long to build.
    pub(crate) fn become_flat(&mut self, positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        kept.resize(triangles.len(), false);
        let found = Kept::find(positions, triangles, &mut kept);
        self.become_built(positions, triangles, &found, |geometry, hierarchy| {
            build::flat(geometry, &kept, hierarchy);
        });
        self.kept = kept;
    }

    fn become_built(
        &mut self,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        found: &Kept,
        build: impl FnOnce(&Geometry<'_>, &mut Hierarchy),
    ) {
        let Kept { count, lo, hi, .. } = *found;
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
        if Arc::get_mut(&mut self.hierarchy).is_none() {
            self.hierarchy = Arc::default();
        }
        if let Some(hierarchy) = Arc::get_mut(&mut self.hierarchy) {
            build(&geometry, hierarchy);
        }
        self.origin = DVec3::new(origin[0].into(), origin[1].into(), origin[2].into());
        self.extent = extent.into();
        self.largest_inverse = ray::largest_inverse_at(extent.into());
        // Eight more places, as packed stores write eight at a time.
        self.stack_size = 16 * depth(&self.hierarchy) + 32;
        self.triangle_count = count;
        self.left_out = triangles.len() - count;
        self.out_of_range = found.out_of_range;
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

    /// Bytes that the hierarchy and its copy of the triangles take, those of instances, each
    /// hierarchy counted once, and what each instance takes; filters have their own.
    #[must_use]
    pub fn memory(&self) -> usize {
        let own = self.hierarchy.memory();
        own + self.instances.as_ref().map_or(0, |all| all.memory())
    }

    /// The instruction set in use.
    #[must_use]
    pub fn instruction_set(&self) -> InstructionSet {
        self.isa.name()
    }

    /// Uses no instruction set beyond `limit`, which is for tests and measurements: results do
    /// not depend on it.
    #[must_use]
    pub fn limited_to(mut self, limit: InstructionSet) -> Self {
        self.isa = Isa::detect(limit);
        if let Some(instances) = &self.instances {
            self.instances = Some(Arc::new(instances.limited_to(limit)));
        }
        self
    }

    /// The same with these instances in place of those that they had.
    #[must_use]
    pub fn with_instances(mut self, instances: Vec<Instance>) -> Self {
        self.set_instances(instances);
        self
    }

    /// Takes instances in place of those that they had: also of what has moved. A small hierarchy
    /// over their boxes is built, which takes about a microsecond for each.
    pub fn set_instances(&mut self, instances: Vec<Instance>) {
        self.instances = Instances::new(instances).map(Arc::new);
    }

    /// The instances, which [`Hit::instance`](crate::Hit::instance) numbers.
    #[must_use]
    pub fn instances(&self) -> &[Instance] {
        self.instances.as_ref().map_or(&[], |all| &all.list)
    }

    /// The occluders that rays and lines of this mask meet: instances of whose
    /// [mask](Instance::with_mask) it has a bit, and all triangles of their own, whose mask has all
    /// (so that the mask 0 meets nothing). Shadow linking: a light's lines are asked of the
    /// occluders with its mask.
    ///
    /// Shares the hierarchies: it takes no time, and a few hundred bytes.
    #[must_use]
    pub fn with_mask(&self, mask: u32) -> Self {
        let mask = self.mask & mask;
        match mask {
            0 => Self {
                isa: self.isa,
                mask,
                ..Self::default()
            },
            _ => Self {
                mask,
                ..self.clone()
            },
        }
    }

    /// The box of their own triangles; `None` without any.
    pub(crate) fn bounds(&self) -> Option<[DVec3; 2]> {
        let [lo, hi] = self
            .hierarchy
            .bounds()?
            .map(|v| DVec3::from(v.map(f64::from)));
        Some([self.origin + lo, self.origin + hi])
    }
}

/// Triangles that are looked at in one go.
const AT_ONCE: usize = 1 << 14;

/// How many triangles can hide something, and the box of them; of how many a corner has no
/// position.
struct Kept {
    count: usize,
    out_of_range: usize,
    lo: [f32; 3],
    hi: [f32; 3],
}

impl Kept {
    /// Of all triangles, and which.
    fn find_all(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> (Vec<bool>, Self) {
        let mut kept = vec![false; triangles.len()];
        let found = pool::fold_stretches(
            &mut kept,
            AT_ONCE,
            &|first, kept| Self::find(positions, &triangles[first..], kept),
            &Self::and,
        );
        (kept, found)
    }

    /// Of the first triangles, as many as `kept` has room for.
    fn find(positions: &[[f32; 3]], triangles: &[[u32; 3]], kept: &mut [bool]) -> Self {
        let mut found = Self {
            count: 0,
            out_of_range: 0,
            lo: [f32::INFINITY; 3],
            hi: [f32::NEG_INFINITY; 3],
        };
        for (corners, kept) in triangles.iter().zip(kept) {
            let Some(t) = occludes(positions, corners) else {
                let is_known = |corner: &u32| (*corner as usize) < positions.len();
                found.out_of_range += usize::from(!corners.iter().all(is_known));
                continue;
            };
            *kept = true;
            found.count += 1;
            for v in t {
                found.lo = std::array::from_fn(|axis| least(found.lo[axis], v[axis]));
                found.hi = std::array::from_fn(|axis| most(found.hi[axis], v[axis]));
            }
        }
        found
    }

    fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            out_of_range: self.out_of_range + other.out_of_range,
            lo: std::array::from_fn(|axis| least(self.lo[axis], other.lo[axis])),
            hi: std::array::from_fn(|axis| most(self.hi[axis], other.hi[axis])),
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
fn depth(hierarchy: &Hierarchy) -> usize {
    if hierarchy.nodes.is_empty() {
        return 0;
    }
    let mut deepest = 0;
    let mut todo = vec![(0, 1)];
    while let Some((index, depth)) = todo.pop() {
        deepest = deepest.max(depth);
        let node = &hierarchy.nodes[index];
        for lane in 0..8 {
            if (node.valid & !node.leaf) >> lane & 1 != 0 {
                todo.push((Child(node.child[lane]).index(), depth + 1));
            }
        }
    }
    deepest
}
