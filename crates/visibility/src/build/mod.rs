//! Building of the hierarchy: a binary tree over the triangles is grown from its root by the
//! surface area heuristic ([`split`]), improved by moving subtrees ([`reinsert`]), and collapsed
//! into nodes of eight boxes ([`collapse`]), whose boxes are then sorted ([`order`]).
//!
//! The time is n log n for any input: also for rows of triangles, for copies, and for triangles
//! nested in each other.

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

/// The cost of testing a leaf, relative to testing a node; see
/// `docs/decisions/003-growing-the-hierarchy.md`.
const LEAF_COST: f64 = 1.2;

/// The cost of testing a leaf, relative to testing a node, in scenes of fewer than [`SMALL`]
/// triangles. It makes no difference to the speed there, and fuller leaves reduce the memory of
/// such scenes below a hundred bytes per triangle.
const LEAF_COST_SMALL: f64 = LEAF_COST / 2.0;

/// The number of triangles below which a scene is small, so that [`LEAF_COST_SMALL`] applies; and
/// the number of leaves below which nothing is prefetched, since the caches hold all of them (3
/// MB).
const SMALL: usize = 10_000;

/// The largest number of triangles in a leaf.
const LEAF_SIZE: u32 = 8;

impl Hierarchy {
    /// The bytes of memory that the hierarchy takes.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.leaves[..])
            + size_of_val(&self.meshes[..])
            + size_of_val(&self.mesh_of[..])
            + self.surfaces.memory()
    }

    /// The closed meshes, and for each leaf the codes of the meshes that its triangles belong to.
    pub(crate) fn meshes(&self) -> (&[ClosedMesh], &[[u16; 8]]) {
        (&self.meshes, &self.mesh_of)
    }

    /// Prefetches the children of a node that are in the mask `found`.
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

/// The hierarchy that queries walk: nodes of eight boxes over leaves of up to eight triangles, with
/// what is known about meshes.
#[derive(Debug, Default)]
pub(crate) struct Hierarchy {
    /// The nodes, the root first, each before the nodes below it.
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// The closed meshes; and for each leaf, the codes of the meshes that its triangles belong to
    /// (the index plus one, or zero). Empty if there are none.
    pub(crate) meshes: Vec<ClosedMesh>,
    pub(crate) mesh_of: Vec<[u16; 8]>,
    /// The fine surfaces.
    pub(crate) surfaces: Surfaces,
}

/// The triangles of a scene, with conversion to the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// The origin of the hierarchy's coordinates; the difference to every vertex is exact.
    pub(crate) origin: [f32; 3],
    /// The largest absolute coordinate of the triangles that can hide something, relative to the
    /// origin.
    pub(crate) extent: f32,
}

impl Geometry<'_> {
    /// Returns the vertices of a triangle whose corner indices are in range, relative to the
    /// origin.
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

    /// Returns the leaf that holds the eight triangles with these indices.
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

/// The number of items that one parallel task handles.
const AT_ONCE: usize = 1 << 11;

/// Returns the bounding boxes of the triangles for which `kept` is true, with their indices.
fn references(geometry: &Geometry<'_>, kept: &[bool]) -> Vec<Reference> {
    let mut references = pool::collect(kept.len(), AT_ONCE, &|k| match kept[k] {
        true => geometry.reference(index(k)),
        false => Reference::new(&Bounds::EMPTY, 0),
    });
    let mut kept = kept.iter();
    references.retain(|_| kept.next() == Some(&true));
    references
}

/// The builder of the binary tree from which a hierarchy is made. Rays and lines get the same
/// answers with any builder; [`Occluders::refit`](crate::Occluders::refit) says which answers may
/// depend on the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Builder {
    /// The builder of this crate: splits triangles from the root down, in all threads.
    #[default]
    Own,
    /// The builder of the crate obvhs: joins triangles by locally ordered clustering, in one
    /// thread. Where it would make a tree that is deeper than four times the logarithm of the
    /// number of triangles, the own builder is used instead. This happens for triangles that are
    /// nested in each other, of which obvhs makes a list, in quadratic time.
    #[cfg(feature = "obvhs")]
    Obvhs,
}

/// Options for building a hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildOptions {
    /// Whether the hierarchy is for rays alone, without the data about meshes, as
    /// [`Occluders::build_for_rays`](crate::Occluders::build_for_rays) makes it.
    pub for_rays: bool,
    /// The builder of the tree.
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

/// Builds the hierarchy over the triangles for which `kept` is true. Unless the hierarchy is for
/// rays alone, it includes the data about meshes that shafts use.
///
/// The first shaft does not compute these data, because that needs the caller's triangles, marks
/// nodes, and uses all threads, which a caller that waits within a pool may not have.
pub(crate) fn build(geometry: &Geometry<'_>, kept: &[bool], options: BuildOptions) -> Hierarchy {
    // Grow the binary tree.
    let mut references = references(geometry, kept);
    if references.is_empty() {
        return Hierarchy::default();
    }
    let small = references.len() < SMALL;
    let tree = options.builder.grow(&mut references, geometry.extent);
    drop(references);
    let leaf_cost = if small { LEAF_COST_SMALL } else { LEAF_COST };
    // Collapse the tree, and find the meshes at the same time. Both together take little more
    // memory than the tree took together with the boxes.
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
    /// Adds the closed meshes and fine surfaces to a finished hierarchy.
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

/// Converts an index of a node, or of anything stored per node, to 32 bits. Indices are below 2³²:
/// each leaf has at least one triangle, and [`Child::leaf`] refuses more than 2²⁸ leaves.
pub(crate) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
