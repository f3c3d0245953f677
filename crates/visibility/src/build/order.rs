//! The order of the boxes in each node: a ray that only needs any hit visits the last box that it
//! enters first.
//!
//! The boxes are sorted by the number of triangles that a ray through them is expected to hit. A
//! line through a convex body crosses surfaces of area A within it A / (half of the body's own
//! surface) times in the mean (Crofton), so the box with the most triangle area for its size comes
//! last. This order needs no distances and no sorting at run time, and opens fewer nodes than the
//! nearest box first: see `docs/decisions/003-growing-the-hierarchy.md`.

use super::{AT_ONCE, Child, Leaf, Node};
use crate::{node::DENSE, pool};
use linelit_geometry::DVec3;

/// Sorts the boxes of every node by the expected number of crossings, ascending, and marks the
/// boxes that hold many triangles.
pub(super) fn by_crossings(nodes: &mut [Node], leaves: &[Leaf]) {
    let of_leaves = pool::collect(leaves.len(), AT_ONCE, &|k| area(&leaves[k]));
    // Sum up the area and the number of the triangles below each node; children come after their
    // parents.
    let mut sums = vec![(0.0, 0); nodes.len()];
    let below = |sums: &[(f64, usize)], child: Child| match child.is_leaf() {
        true => (of_leaves[child.index()], child.count() as usize),
        false => sums[child.index()],
    };
    for (at, node) in nodes.iter().enumerate().rev() {
        let used = node.valid.count_ones() as usize;
        for child in &node.child[..used] {
            let (area, count) = below(&sums, Child(*child));
            sums[at] = (sums[at].0 + area, sums[at].1 + count);
        }
    }
    // Sort the boxes of each node.
    let arrange = |_, nodes: &mut [Node]| {
        for node in nodes {
            let used = node.valid.count_ones() as usize;
            let mut lanes = [(0.0, 0); 8];
            for (lane, (crossings, number)) in lanes.iter_mut().enumerate().take(used) {
                let (area, count) = below(&sums, Child(node.child[lane]));
                node.dense |= u8::from(count > DENSE) << lane;
                let half = node.bounds_of(lane).half_area();
                *crossings = if half > 0.0 { area / half } else { 0.0 };
                *number = lane;
            }
            lanes[..used].sort_by(|a, b| a.0.total_cmp(&b.0));
            *node = permuted(node, &lanes[..used]);
        }
    };
    pool::stretches_of(nodes, AT_ONCE, &arrange);
}

/// Returns the total area of a leaf's triangles. Lanes that are not in use repeat the first
/// triangle, and are not counted.
fn area(leaf: &Leaf) -> f64 {
    let mut area = 0.0;
    for lane in 0..8 {
        if lane == 0 || leaf.id[lane] != leaf.id[0] {
            let [a, b, c] = leaf.triangle(lane).map(|v| DVec3::from(v.map(f64::from)));
            area += 0.5 * (b - a).cross(c - a).length();
        }
    }
    area
}

/// Returns the node with its boxes in the order of `lanes`.
fn permuted(node: &Node, lanes: &[(f64, usize)]) -> Node {
    let mut out = Node::default();
    for (to, &(_, from)) in lanes.iter().enumerate() {
        out.set_bounds(to, &node.bounds_of(from));
        out.child[to] = node.child[from];
        out.valid |= 1 << to;
        out.leaf |= (node.leaf >> from & 1) << to;
        out.dense |= (node.dense >> from & 1) << to;
    }
    out
}
