//! Which nodes of the binary tree become leaves of the hierarchy and which its wide nodes, by the
//! least expected cost.
//!
//! **Source**: the dynamic programme of Ylitie, Karras & Laine 2017, section 3.1, with leaves of
//! eight at a fixed cost.

use super::binary::Binary;
use super::{LEAF_SIZE, index};

/// The tag's bit of a node that is best kept as a leaf in one piece.
const ONE_PIECE: u32 = 1 << 30;

/// Bits of the tag for the pieces of the left child when the node is spread over up to j pieces,
/// j = 2 to 8; 0: the node stays in one piece.
const BITS: u32 = 3;

fn left_pieces(node: &Binary, pieces: usize) -> usize {
    (node.tag >> (BITS * index(pieces - 2)) & 7) as usize
}

/// What a subtree costs in up to 1 to 8 pieces, and its triangles.
#[derive(Clone, Copy)]
struct Cost {
    pieces: [f64; 8],
    triangles: u32,
}

/// Decides for all nodes; `leaf_cost` is what testing a leaf costs, in tests of a node.
pub(super) fn decide(nodes: &mut [Binary], leaf_cost: f64) {
    // Children before their parents.
    let mut todo = vec![(0_u32, false)];
    let mut done: Vec<Cost> = Vec::new();
    while let Some((at, children_done)) = todo.pop() {
        let node = &mut nodes[at as usize];
        let area = node.bounds.half_area();
        if node.is_leaf() {
            node.tag |= ONE_PIECE;
            done.push(Cost {
                pieces: [area * leaf_cost; 8],
                triangles: 1,
            });
        } else if !children_done {
            todo.extend([(at, true), (node.first + 1, false), (node.first, false)]);
        } else if let (Some(right), Some(left)) = (done.pop(), done.pop()) {
            let cost;
            (cost, node.tag) = decide_one(area, &left, &right, leaf_cost);
            done.push(cost);
        }
    }
}

/// What a node with two children costs, and its tag.
fn decide_one(area: f64, left: &Cost, right: &Cost, leaf_cost: f64) -> (Cost, u32) {
    let mut cost = Cost {
        pieces: [0.0; 8],
        triangles: left.triangles.saturating_add(right.triangles),
    };
    let mut split = [0_u32; 8];
    for pieces in 2..=8_usize {
        let mut best = (f64::INFINITY, 0);
        for k in 1..pieces {
            let c = left.pieces[k - 1] + right.pieces[pieces - k - 1];
            if c < best.0 {
                best = (c, k);
            }
        }
        cost.pieces[pieces - 1] = best.0;
        split[pieces - 1] = index(best.1);
    }
    let opened = area + cost.pieces[7];
    let closed = if cost.triangles <= LEAF_SIZE {
        area * leaf_cost
    } else {
        f64::INFINITY
    };
    cost.pieces[0] = closed.min(opened);
    let mut tag = if closed <= opened { ONE_PIECE } else { 0 };
    for k in 1..8 {
        if cost.pieces[k - 1] <= cost.pieces[k] {
            // As for one piece fewer.
            cost.pieces[k] = cost.pieces[k - 1];
            split[k] = split[k - 1];
        }
        tag |= split[k] << (BITS * (index(k) - 1));
    }
    (cost, tag)
}

/// Whether a subtree becomes a leaf.
pub(super) fn is_leaf(node: &Binary) -> bool {
    node.tag & ONE_PIECE != 0
}

/// The up to eight members of the wide node that opens `root`.
pub(super) fn members(nodes: &[Binary], root: u32, out: &mut Vec<u32>) {
    let node = &nodes[root as usize];
    if is_leaf(node) {
        out.push(root);
        return;
    }
    let left = left_pieces(node, 8).clamp(1, 7);
    spread(nodes, node.first, left, out);
    spread(nodes, node.first + 1, 8 - left, out);
}

fn spread(nodes: &[Binary], at: u32, pieces: usize, out: &mut Vec<u32>) {
    let node = &nodes[at as usize];
    let left = if pieces < 2 || node.is_leaf() {
        0
    } else {
        left_pieces(node, pieces)
    };
    if left == 0 {
        out.push(at);
    } else {
        spread(nodes, node.first, left, out);
        spread(nodes, node.first + 1, pieces - left, out);
    }
}

/// The triangles below a node that becomes a leaf, and their number.
pub(super) fn triangles(nodes: &[Binary], root: u32) -> ([u32; LEAF_SIZE as usize], usize) {
    let mut found = [0; LEAF_SIZE as usize];
    let mut count = 0;
    let mut todo = [root; LEAF_SIZE as usize + 1];
    let mut left = 1;
    while left > 0 {
        left -= 1;
        let node = &nodes[todo[left] as usize];
        if node.is_leaf() {
            found[count] = node.first;
            count += 1;
        } else {
            todo[left] = node.first + 1;
            todo[left + 1] = node.first;
            left += 2;
        }
    }
    (found, count)
}
