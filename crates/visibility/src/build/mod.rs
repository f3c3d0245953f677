//! Building the hierarchy: a binary tree, split from its root and improved, is collapsed into nodes
//! of eight.
//!
//! Time is n log n for any input: rows, copies, nests.

mod binary;
mod collapse;
mod reinsert;
mod split;
#[cfg(test)]
mod tests;

use crate::{
    closed_mesh::{ClosedMesh, ClosedMeshes},
    node::{Child, Leaf, Node},
    pool,
};
use binary::{Binary, Bounds};
use linelit_simd::Simd;
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
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<Leaf>,
    /// Closed meshes, and which of them the triangles of each leaf belong to (one more than the
    /// index, or zero); empty if there are none.
    pub(crate) meshes: Vec<ClosedMesh>,
    pub(crate) mesh_of: Vec<[u16; 8]>,
}

/// Triangles that may occlude, in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    pub(crate) triangles: &'a [[u32; 3]],
    /// What coordinates are relative to; an exact difference for every vertex.
    pub(crate) origin: [f32; 3],
}

impl Geometry<'_> {
    /// The vertices of a triangle whose corners are in range.
    #[inline]
    pub(crate) fn vertices(&self, id: u32) -> [[f32; 3]; 3] {
        self.triangles[id as usize].map(|corner| {
            let v = self.positions[corner as usize];
            std::array::from_fn(|axis| v[axis] - self.origin[axis])
        })
    }

    fn reference(&self, id: u32) -> Reference {
        let mut bounds = Bounds::EMPTY;
        for v in self.vertices(id) {
            bounds.extend(&Bounds { lo: v, hi: v });
        }
        Reference::new(&bounds, id)
    }
}

/// Leaves that are filled in one go.
const LEAVES_AT_ONCE: usize = 1 << 12;

/// Builds the hierarchy over the triangles that `kept` has.
pub(crate) fn build(geometry: &Geometry<'_>, kept: &[bool], meshes: ClosedMeshes) -> Hierarchy {
    let ids = || (0_u32..).zip(kept).filter(|(_, kept)| **kept);
    let mut references = Vec::with_capacity(ids().count());
    references.extend(ids().map(|(id, _)| geometry.reference(id)));
    if references.is_empty() {
        return Hierarchy::default();
    }
    let small = references.len() < SMALL;
    let mut tree = split::grow(&mut references);
    drop(references);
    collapse::decide(&mut tree, if small { LEAF_COST_SMALL } else { LEAF_COST });
    let (nodes, ids) = widen(&tree);
    drop(tree);
    let mut out = Hierarchy {
        nodes,
        leaves: vec![Leaf::EMPTY; ids.len()],
        ..Hierarchy::default()
    };
    pool::for_stretches(&mut out.leaves, LEAVES_AT_ONCE, &|first, leaves| {
        for (leaf, ids) in leaves.iter_mut().zip(&ids[first..]) {
            leaf.id = *ids;
            for (lane, &id) in ids.iter().enumerate() {
                let v = geometry.vertices(id);
                for (k, slot) in leaf.vertices.iter_mut().enumerate() {
                    slot[lane] = v[k / 3][k % 3];
                }
            }
        }
    });
    if !meshes.meshes.is_empty() {
        let of = |ids: &[u32; 8]| ids.map(|id| meshes.of[id as usize]);
        out.mesh_of = ids.iter().map(of).collect();
        out.meshes = meshes.meshes;
    }
    out
}

/// The wide nodes, and the triangles of the leaves.
fn widen(tree: &[Binary]) -> (Vec<Node>, Vec<[u32; 8]>) {
    let (node_count, leaf_count) = count(tree);
    let mut nodes = Vec::with_capacity(node_count);
    let mut leaves = Vec::with_capacity(leaf_count);
    nodes.push(Node::EMPTY);
    let mut todo = vec![(0_usize, 0_u32)];
    let mut members = Vec::new();
    while let Some((node, root)) = todo.pop() {
        members.clear();
        collapse::members(tree, root, &mut members);
        let mut packed = Node::EMPTY;
        for (lane, &member) in members.iter().enumerate() {
            let bounds = &tree[member as usize].bounds;
            for axis in 0..3 {
                packed.bounds[axis][lane] = bounds.lo[axis];
                packed.bounds[axis + 3][lane] = bounds.hi[axis];
            }
            let is_leaf = collapse::is_leaf(&tree[member as usize]);
            packed.valid |= 1 << lane;
            packed.leaf |= u8::from(is_leaf) << lane;
            let child = if is_leaf {
                let (found, count) = collapse::triangles(tree, member);
                // Lanes that are not in use repeat the first.
                leaves.push(std::array::from_fn(|k| {
                    found[if k < count { k } else { 0 }]
                }));
                Child::leaf(leaves.len() - 1, count)
            } else {
                nodes.push(Node::EMPTY);
                todo.push((nodes.len() - 1, member));
                Child::node(nodes.len() - 1)
            };
            packed.child[lane] = child.0;
        }
        nodes[node] = packed;
    }
    (nodes, leaves)
}

/// The numbers of wide nodes and of leaves.
fn count(tree: &[Binary]) -> (usize, usize) {
    let (mut nodes, mut leaves) = (0, 0);
    let mut todo = vec![0_u32];
    let mut members = Vec::new();
    while let Some(root) = todo.pop() {
        nodes += 1;
        members.clear();
        collapse::members(tree, root, &mut members);
        for &member in &members {
            if collapse::is_leaf(&tree[member as usize]) {
                leaves += 1;
            } else {
                todo.push(member);
            }
        }
    }
    (nodes, leaves)
}

/// Numbers of nodes and of what is in them are below 2³²: a leaf holds a triangle at least, and
/// [`Child::leaf`] refuses more than 2²⁸.
fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
