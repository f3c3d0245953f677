//! Building the hierarchy: a binary tree, split from its root and improved, is collapsed into nodes
//! of eight.
//!
//! Time is n log n for any input: rows, copies, nests.

mod binary;
mod collapse;
mod order;
#[cfg(feature = "obvhs")]
mod ploc;
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
use binary::Binary;
pub(crate) use binary::{Bounds, least, most};
use linelit_simd::Simd;
pub(crate) use refit::refit;
use split::Reference;

/// Cost of testing a leaf, in tests of a node; `docs/decisions/003-growing-the-hierarchy.md`.
const LEAF_COST: f64 = 1.2;

/// The leaf cost in scenes of fewer than [`SMALL`] triangles. There it makes no difference to
/// speed; fuller leaves keep such scenes below a hundred bytes a triangle.
const LEAF_COST_SMALL: f64 = LEAF_COST / 2.0;

/// Triangles of a small scene; of as many leaves (3 MB) the caches hold everything, so that asking
/// for them ahead of time is of no use.
const SMALL: usize = 10_000;

/// Most triangles in a leaf.
const LEAF_SIZE: u32 = 8;

impl Hierarchy {
    /// Bytes that it takes.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.leaves[..])
            + size_of_val(&self.meshes[..])
            + size_of_val(&self.mesh_of[..])
            + self.surfaces.memory()
    }

    /// Closed meshes and the leaves' triangles in them.
    pub(crate) fn meshes(&self) -> (&[ClosedMesh], &[[u16; 8]]) {
        (&self.meshes, &self.mesh_of)
    }

    /// Asks for the memory of a node's children ahead of time.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, s: S, node: &Node, found: u8) {
        if self.leaves.len() < SMALL {
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
    /// The fine meshes among them, by nodes and leaves.
    pub(crate) surfaces: Surfaces,
}

/// Triangles that may occlude, in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// The origin of coordinates; an exact difference for every vertex.
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
    pub(crate) fn bounds(&self, id: u32) -> Bounds {
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

/// The builder of the binary tree that a hierarchy is made of. Rays and lines get the same answers
/// from either; what may depend on the tree is said at
/// [`Occluders::refit`](crate::Occluders::refit).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Builder {
    /// Our own builder splits triangles from the root on, in all threads.
    #[default]
    Own,
    /// obvhs joins triangles by locally ordered clustering, in one thread. Our own takes its place
    /// where its tree is deeper than four times the logarithm of the number of triangles: where
    /// they are nested in each other, of which it makes a list, in quadratic time.
    #[cfg(feature = "obvhs")]
    Obvhs,
}

/// Tells how a hierarchy is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// Makes it for rays alone, as
    /// [`Occluders::build_for_rays`](crate::Occluders::build_for_rays) does.
    pub for_rays: bool,
    /// Names who grows the tree.
    pub builder: Builder,
}

impl Builder {
    fn grow(self, references: &mut [Reference], extent: f32) -> Vec<Binary> {
        let tree = match self {
            Self::Own => None,
            #[cfg(feature = "obvhs")]
            Self::Obvhs => ploc::grow(references, extent),
        };
        tree.unwrap_or_else(|| split::grow(references, extent))
    }
}

/// Builds the hierarchy over the triangles that `kept` has; unless it is for rays alone, with what
/// is of use to shafts.
///
/// That is made with the rest, not when a shaft first asks: it needs the caller's triangles, marks
/// nodes, and takes all threads, which a caller that waits for it within a pool may not have.
pub(crate) fn build(geometry: &Geometry<'_>, kept: &[bool], options: BuildOptions) -> Hierarchy {
    let mut references = references(geometry, kept);
    if references.is_empty() {
        return Hierarchy::default();
    }
    let small = references.len() < SMALL;
    let tree = options.builder.grow(&mut references, geometry.extent);
    drop(references);
    let leaf_cost = if small { LEAF_COST_SMALL } else { LEAF_COST };
    // Both together take little more memory than the tree took with the boxes.
    let (mut hierarchy, closed) = pool::join(
        || {
            let (mut nodes, ids) = collapse::collapse(tree, leaf_cost);
            let leaves = pool::collect(ids.len(), AT_ONCE, &|k| geometry.leaf(ids[k]));
            order::by_crossings(&mut nodes, &leaves);
            Hierarchy {
                nodes,
                leaves,
                ..Hierarchy::default()
            }
        },
        || (!options.for_rays).then(|| ClosedMeshes::find(geometry, kept)),
    );
    if let Some(closed) = closed {
        hierarchy.serve_shafts(geometry, closed);
    }
    hierarchy
}

impl Hierarchy {
    /// Takes over which triangles belong to closed meshes and surfaces.
    fn serve_shafts(&mut self, geometry: &Geometry<'_>, closed: ClosedMeshes) {
        let ClosedMeshes { meshes, of, fine } = closed;
        let leaves = &self.leaves;
        self.mesh_of = match &meshes[..] {
            [] => Vec::new(),
            _ => pool::collect(leaves.len(), AT_ONCE, &|at| {
                leaves[at].id.map(|id| of[id as usize])
            }),
        };
        self.meshes = meshes;
        drop(of);
        self.surfaces = Surfaces::new(geometry, fine, &mut self.nodes, leaves);
    }
}

/// Numbers of nodes and of what is in them are below 2³²: a leaf holds a triangle at least, and
/// [`Child::leaf`] refuses more than 2²⁸.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
