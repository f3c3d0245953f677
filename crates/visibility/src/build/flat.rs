//! Triangles under boxes in the order in which they come: for few that are asked about once.

use super::{Geometry, Hierarchy, LEAF_SIZE, binary::Bounds, index};
use crate::{
    node::{Child, Node},
    surfaces::Surfaces,
};

/// Fills `hierarchy` with the triangles that `kept` has, eight to a leaf and eight to a node.
pub(crate) fn flat(geometry: &Geometry<'_>, kept: &[bool], hierarchy: &mut Hierarchy) {
    let Hierarchy {
        nodes,
        leaves,
        meshes,
        mesh_of,
        surfaces,
    } = hierarchy;
    nodes.clear();
    leaves.clear();
    meshes.clear();
    mesh_of.clear();
    *surfaces = Surfaces::default();
    let mut row = Vec::with_capacity(kept.len().div_ceil(8));
    let mut ids = (0..kept.len()).filter(|k| kept[*k]).map(index);
    while let Some(first) = ids.next() {
        // Lanes that are not in use repeat the first.
        let mut id = [first; LEAF_SIZE as usize];
        let mut bounds = geometry.bounds(first);
        let mut count = 1;
        for (slot, next) in id[1..].iter_mut().zip(&mut ids) {
            *slot = next;
            bounds.extend(&geometry.bounds(next));
            count += 1;
        }
        row.push((Child::leaf(leaves.len(), count), bounds));
        leaves.push(geometry.leaf(id));
    }
    if row.is_empty() {
        return;
    }
    nodes.push(Node::EMPTY);
    while row.len() > 8 {
        let above = row.len().div_ceil(8);
        for k in 0..above {
            let (node, bounds) = pack(&row[8 * k..row.len().min(8 * k + 8)]);
            row[k] = (Child::node(nodes.len()), bounds);
            nodes.push(node);
        }
        row.truncate(above);
    }
    nodes[0] = pack(&row).0;
}

/// A node of up to eight children, and the box around it.
fn pack(children: &[(Child, Bounds)]) -> (Node, Bounds) {
    let (mut node, mut around) = (Node::EMPTY, Bounds::EMPTY);
    for (lane, (child, bounds)) in children.iter().enumerate() {
        for axis in 0..3 {
            node.bounds[axis][lane] = bounds.lo[axis];
            node.bounds[axis + 3][lane] = bounds.hi[axis];
        }
        node.child[lane] = child.0;
        node.valid |= 1 << lane;
        node.leaf |= u8::from(child.is_leaf()) << lane;
        around.extend(bounds);
    }
    (node, around)
}
