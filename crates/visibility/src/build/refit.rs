//! New boxes for triangles that have moved, in the tree that stands.

use super::{AT_ONCE, Geometry, Hierarchy, binary::Bounds, by_leaves, least, most};
use crate::{
    closed_mesh::ClosedMeshes,
    node::{Child, Leaf, Node},
    pool,
    surfaces::Surfaces,
};

/// Gives `hierarchy`, which was built over the triangles that `kept` has, their new corners: leaves
/// are copied anew, boxes made from the last node to the root, closed meshes found again.
pub(crate) fn refit(geometry: &Geometry<'_>, kept: &[bool], hierarchy: &mut Hierarchy) {
    let Hierarchy {
        nodes,
        leaves,
        meshes,
        mesh_of,
        surfaces,
    } = hierarchy;
    let closed = || ClosedMeshes::find(geometry, kept);
    let copy = |_, leaves: &mut [Leaf]| {
        for leaf in leaves {
            *leaf = geometry.leaf(leaf.id);
        }
    };
    let ((), mut closed) = pool::join(
        || {
            pool::fold_stretches(leaves, AT_ONCE, &copy, &|(), ()| ());
            for at in (0..nodes.len()).rev() {
                let (above, below) = nodes.split_at_mut(at + 1);
                fit(&mut above[at], |child| match child.is_leaf() {
                    true => around_leaf(&leaves[child.index()]),
                    false => around(&below[child.index() - at - 1]),
                });
            }
        },
        closed,
    );
    *surfaces = Surfaces::new(geometry, std::mem::take(&mut closed.fine), nodes, leaves);
    (*meshes, *mesh_of) = by_leaves(closed, leaves);
}

/// Puts the boxes of a node around what is in them.
fn fit(node: &mut Node, around: impl Fn(Child) -> Bounds) {
    for lane in (0..8).filter(|lane| node.valid >> lane & 1 != 0) {
        let bounds = around(Child(node.child[lane]));
        for axis in 0..3 {
            node.bounds[axis][lane] = bounds.lo[axis];
            node.bounds[axis + 3][lane] = bounds.hi[axis];
        }
    }
}

/// The box around those of a node.
pub(super) fn around(node: &Node) -> Bounds {
    let b = &node.bounds;
    let mut all = Bounds::EMPTY;
    for lane in (0..8).filter(|lane| node.valid >> lane & 1 != 0) {
        all.extend(&Bounds {
            lo: [b[0][lane], b[1][lane], b[2][lane]],
            hi: [b[3][lane], b[4][lane], b[5][lane]],
        });
    }
    all
}

/// The box around a leaf's triangles; lanes that are not in use repeat the first.
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
