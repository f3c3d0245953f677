//! Refitting: new boxes for triangles that have moved, in a tree whose structure stays.

use super::{AT_ONCE, Geometry, Hierarchy, binary::Bounds, least, most};
use crate::{
    closed_mesh::ClosedMeshes,
    node::{Child, Leaf, Node},
    pool,
};

/// Gives `hierarchy`, which was built over the triangles for which `kept` is true, their new
/// corners. Leaves are copied anew, boxes are fitted from the last node to the root, and closed
/// meshes are found again.
pub(crate) fn refit(
    geometry: &Geometry<'_>,
    kept: &[bool],
    for_shafts: bool,
    hierarchy: &mut Hierarchy,
) {
    let Hierarchy { nodes, leaves, .. } = hierarchy;
    // Fit leaves and boxes, and find the closed meshes at the same time. Children come after their
    // parents.
    let closed = || for_shafts.then(|| ClosedMeshes::find(geometry, kept));
    let copy = |_, leaves: &mut [Leaf]| {
        for leaf in leaves {
            *leaf = geometry.leaf(leaf.id);
        }
    };
    let ((), closed) = pool::join(
        || {
            pool::stretches_of(leaves, AT_ONCE, &copy);
            for at in (0..nodes.len()).rev() {
                let (above, below) = nodes.split_at_mut(at + 1);
                for lane in above[at].lanes() {
                    let child = Child(above[at].child[lane]);
                    let bounds = match child.is_leaf() {
                        true => around_leaf(&leaves[child.index()]),
                        false => around(&below[child.index() - at - 1]),
                    };
                    above[at].set_bounds(lane, &bounds);
                }
            }
        },
        closed,
    );
    if let Some(closed) = closed {
        hierarchy.serve_shafts(geometry, closed);
    }
}

/// Returns the bounding box of all boxes of a node.
fn around(node: &Node) -> Bounds {
    let mut all = Bounds::EMPTY;
    for lane in node.lanes() {
        all.extend(&node.bounds_of(lane));
    }
    all
}

/// Returns the bounding box of a leaf's triangles; lanes that are not in use repeat the first
/// triangle.
fn around_leaf(leaf: &Leaf) -> Bounds {
    let mut all = Bounds::EMPTY;
    for (k, column) in leaf.vertices.iter().enumerate() {
        for x in column {
            all.lo[k % 3] = least(all.lo[k % 3], *x);
            all.hi[k % 3] = most(all.hi[k % 3], *x);
        }
    }
    all
}
