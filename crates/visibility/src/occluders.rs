//! The occluders of a scene: triangles under a hierarchy of boxes.

use crate::{
    build::{self, Geometry, Hierarchy},
    closed_mesh::ClosedMeshes,
    node::Child,
};
use linelit_geometry::DVec3;
use linelit_simd::{InstructionSet, Isa};

/// The triangles of a scene, ready for ray and line queries.
///
/// Vertices are `f32` and exactly those given: no query moves or rounds them. Triangles that can
/// hide nothing (a vertex that is not finite, an index out of range, two vertices in one place)
/// are left out and counted. Three distinct vertices on a line stay: they hide next to nothing,
/// but keep the seam between their neighbours closed.
#[derive(Debug)]
pub struct Occluders {
    pub(crate) hierarchy: Hierarchy,
    /// What the hierarchy's coordinates are relative to; an exact difference for every vertex.
    pub(crate) origin: DVec3,
    /// Largest absolute coordinate relative to the origin.
    pub(crate) extent: f64,
    /// Room that a depth-first walk needs on its stack.
    pub(crate) stack_size: usize,
    pub(crate) isa: Isa,
    triangle_count: usize,
    left_out: usize,
}

impl Occluders {
    /// Builds the hierarchy over triangles given by their corners' positions.
    ///
    /// Called in a thread of a rayon pool, it uses that pool's threads; the result is the same to
    /// the bit. Time is n log n for any input, and memory at the peak 96 bytes a triangle beside
    /// what is passed. Building works for all finite corners; answers are right for coordinates up
    /// to 2⁶⁰, which are all that scene files may have, and those of rays up to 1e30 along them.
    ///
    /// # Panics
    /// If there are more than 2²⁸ leaves, which takes as many triangles at least.
    #[must_use]
    pub fn build(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Self {
        let kept: Vec<bool> = triangles.iter().map(|t| occludes(positions, t)).collect();
        let triangle_count = kept.iter().filter(|kept| **kept).count();
        let vertices = || {
            let corners = triangles.iter().zip(&kept).filter(|(_, kept)| **kept);
            corners.flat_map(|(t, _)| t.map(|corner| positions[corner as usize]))
        };
        let geometry = Geometry {
            positions,
            triangles,
            origin: exact_origin(vertices()),
        };
        let origin = geometry.origin;
        let mut extent = 0.0_f32;
        for v in vertices() {
            for axis in 0..3 {
                extent = extent.max((v[axis] - origin[axis]).abs());
            }
        }
        let meshes = ClosedMeshes::find(&geometry, &kept);
        let hierarchy = build::build(&geometry, &kept, meshes);
        // Eight more places, as packed stores write eight at a time.
        let stack_size = 16 * depth(&hierarchy) + 32;
        Self {
            hierarchy,
            origin: DVec3::new(origin[0].into(), origin[1].into(), origin[2].into()),
            extent: extent.into(),
            stack_size,
            isa: Isa::best(),
            triangle_count,
            left_out: triangles.len() - triangle_count,
        }
    }

    /// The number of triangles that can hide something.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The number of triangles that were left out because they can hide nothing.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Bytes that the hierarchy and its copy of the triangles take.
    #[must_use]
    pub fn memory(&self) -> usize {
        let Hierarchy {
            nodes,
            leaves,
            meshes,
            mesh_of,
        } = &self.hierarchy;
        size_of_val(&nodes[..])
            + size_of_val(&leaves[..])
            + size_of_val(&meshes[..])
            + size_of_val(&mesh_of[..])
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
        self
    }
}

/// Whether a triangle can hide something.
fn occludes(positions: &[[f32; 3]], corners: &[u32; 3]) -> bool {
    let mut t = [[0.0; 3]; 3];
    for (v, &c) in t.iter_mut().zip(corners) {
        match positions.get(c as usize) {
            Some(position) => *v = *position,
            None => return false,
        }
    }
    let finite = t.as_flattened().iter().all(|x| x.is_finite());
    #[allow(clippy::float_cmp, reason = "vertices in the very same place")]
    let distinct = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    finite && distinct
}

/// A point near the middle of the scene from which every coordinate has an `f32` difference
/// without rounding: on an axis where all coordinates are within a factor of two of each other
/// (Sterbenz), their middle; else zero. Keeps boxes tight far from the world's origin.
fn exact_origin(vertices: impl Iterator<Item = [f32; 3]>) -> [f32; 3] {
    let mut lo = [f32::INFINITY; 3];
    let mut hi = [f32::NEG_INFINITY; 3];
    for v in vertices {
        for axis in 0..3 {
            lo[axis] = lo[axis].min(v[axis]);
            hi[axis] = hi[axis].max(v[axis]);
        }
    }
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
