//! Building the hierarchy: a binary tree, split from its root and improved, is collapsed into nodes
//! of eight.
//!
//! Time is n log n for any input: rows, copies, nests.

mod binary;
mod collapse;
mod order;
mod refit;
mod reinsert;
mod split;
#[cfg(test)]
mod tests;

use crate::{
    closed_mesh::{ClosedMesh, ClosedMeshes},
    node::{Child, Leaf, Node},
    pool,
    surfaces::Surfaces,
};
use binary::Bounds;
pub(crate) use binary::{least, most};
use linelit_simd::Simd;
pub(crate) use refit::refit;
use split::Reference;

/// Cost of testing a leaf, in tests of a node; `docs/decisions/003-growing-the-hierarchy.md`.
const LEAF_COST: f64 = 1.2;

/// The same in scenes of fewer than [`SMALL`] triangles. There it makes no difference to speed;
/// fuller leaves keep such scenes below a hundred bytes a triangle.
const LEAF_COST_SMALL: f64 = 0.6;
const SMALL: usize = 10_000;

/// With fewer leaves (3 MB) the caches hold everything.
const WORTH_PREFETCHING: usize = 10_000;

/// Most triangles in a leaf.
const LEAF_SIZE: u32 = 8;

impl Hierarchy {
    /// Bytes that it takes.
    pub(crate) fn memory(&self) -> usize {
        let Self {
            nodes,
            leaves,
            meshes,
            mesh_of,
            surfaces,
        } = self;
        size_of_val(&nodes[..])
            + size_of_val(&leaves[..])
            + size_of_val(&meshes[..])
            + size_of_val(&mesh_of[..])
            + surfaces.memory()
    }

    /// Closed meshes and the leaves' triangles in them.
    pub(crate) fn meshes(&self) -> (&[ClosedMesh], &[[u16; 8]]) {
        (&self.meshes, &self.mesh_of)
    }

    /// Asks for the memory of a node's children ahead of time.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, s: S, node: &Node, found: u8) {
        if self.leaves.len() < WORTH_PREFETCHING {
            return;
        }
        let mut found = found;
        while found != 0 {
            let child = Child(node.child[found.trailing_zeros() as usize]);
            found &= found - 1;
            if child.is_leaf() {
                s.prefetch(&self.leaves[child.index()]);
            } else {
                s.prefetch(&self.nodes[child.index()]);
            }
        }
    }
}

/// The collapsed hierarchy.
#[derive(Debug, Default)]
pub(crate) struct Hierarchy {
    /// The root first; those of a tree that was built, each before the nodes in it.
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// Closed meshes, and which of them the triangles of each leaf belong to (one more than the
    /// index, or zero); empty if there are none.
    pub(crate) meshes: Vec<ClosedMesh>,
    pub(crate) mesh_of: Vec<[u16; 8]>,
    /// How the fine ones among them lie in the tree.
    pub(crate) surfaces: Surfaces,
}

/// Triangles that may occlude, in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// What coordinates are relative to; an exact difference for every vertex.
    pub(crate) origin: [f32; 3],
    /// Largest absolute coordinate of what may occlude.
    pub(crate) extent: f32,
}

impl Geometry<'_> {
    /// The vertices of a triangle whose corners are in range.
    #[inline]
    pub(crate) fn vertices(&self, id: u32) -> [[f32; 3]; 3] {
        let [a, b, c] = self.triangles[id as usize];
        [self.vertex(a), self.vertex(b), self.vertex(c)]
    }

    #[inline]
    fn vertex(&self, corner: u32) -> [f32; 3] {
        let ([x, y, z], [u, v, w]) = (self.positions[corner as usize], self.origin);
        [x - u, y - v, z - w]
    }

    /// Triangles side by side.
    fn leaf(&self, id: [u32; 8]) -> Leaf {
        let mut leaf = Leaf { id, ..Leaf::EMPTY };
        for (lane, &id) in id.iter().enumerate() {
            for (slots, v) in leaf.vertices.chunks_exact_mut(3).zip(self.vertices(id)) {
                for (slot, x) in slots.iter_mut().zip(v) {
                    slot[lane] = x;
                }
            }
        }
        leaf
    }

    #[inline]
    fn bounds(&self, id: u32) -> Bounds {
        let [a, b, c] = self.vertices(id);
        Bounds {
            lo: std::array::from_fn(|k| least(a[k], least(b[k], c[k]))),
            hi: std::array::from_fn(|k| most(a[k], most(b[k], c[k]))),
        }
    }

    #[inline]
    fn reference(&self, id: u32) -> Reference {
        Reference::new(&self.bounds(id), id)
    }
}

/// Items that are worth a thread.
const AT_ONCE: usize = 1 << 11;

/// The boxes of the triangles that `kept` has.
fn references(geometry: &Geometry<'_>, kept: &[bool]) -> Vec<Reference> {
    let mut references = pool::collect(kept.len(), AT_ONCE, &|k| match kept[k] {
        true => geometry.reference(index(k)),
        false => Reference::new(&Bounds::EMPTY, 0),
    });
    let mut kept = kept.iter();
    references.retain(|_| kept.next() == Some(&true));
    references
}

/// Builds the hierarchy over the triangles that `kept` has.
pub(crate) fn build(geometry: &Geometry<'_>, kept: &[bool]) -> Hierarchy {
    let mut references = references(geometry, kept);
    if references.is_empty() {
        return Hierarchy::default();
    }
    let small = references.len() < SMALL;
    let tree = split::grow(&mut references, geometry.extent);
    drop(references);
    let leaf_cost = if small { LEAF_COST_SMALL } else { LEAF_COST };
    // Both together take little more memory than the tree took with the boxes.
    let ((mut nodes, ids), mut closed) = pool::join(
        || collapse::collapse(tree, leaf_cost),
        || ClosedMeshes::find(geometry, kept),
    );
    let leaves = pool::collect(ids.len(), AT_ONCE, &|k| geometry.leaf(ids[k]));
    drop(ids);
    order::by_crossings(&mut nodes, &leaves);
    let fine = std::mem::take(&mut closed.fine);
    let (meshes, mesh_of) = by_leaves(closed, &leaves);
    let surfaces = Surfaces::new(geometry, fine, &mut nodes, &leaves);
    Hierarchy {
        nodes,
        leaves,
        meshes,
        mesh_of,
        surfaces,
    }
}

/// Closed meshes, and which of them the triangles of each leaf belong to: [`Hierarchy::mesh_of`].
fn by_leaves(
    ClosedMeshes { meshes, of, .. }: ClosedMeshes,
    leaves: &[Leaf],
) -> (Vec<ClosedMesh>, Vec<[u16; 8]>) {
    let in_lanes = |leaf: &Leaf| leaf.id.map(|id| of[id as usize]);
    let mesh_of = match &meshes[..] {
        [] => Vec::new(),
        _ => leaves.iter().map(in_lanes).collect(),
    };
    (meshes, mesh_of)
}

/// Numbers of nodes and of what is in them are below 2³²: a leaf holds a triangle at least, and
/// [`Child::leaf`] refuses more than 2²⁸.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
