//! Collapsing of the binary tree to the hierarchy: which nodes of the binary tree become wide nodes
//! and which subtrees become leaves, at the least expected cost.
//!
//! **Source**: the dynamic programme of Ylitie, Karras & Laine 2017, section 3.1, with leaves of up
//! to eight triangles at a fixed cost. From the leaves up, the programme computes for each subtree
//! its least cost if it is represented by up to 1, 2, … 8 children of a wide node, and stores the
//! choices that attain it; from the root down, the choices are carried out.

use super::{LEAF_SIZE, binary::Binary, index};
use crate::{
    node::{Child, Node},
    pool,
};
use std::{
    collections::VecDeque,
    sync::atomic::{AtomicU32, Ordering},
};

/// The indices of a leaf's triangles; lanes that are not in use repeat the first.
pub(super) type Triangles = [u32; LEAF_SIZE as usize];

/// The number of levels of the binary tree, from the root, within which the two children of a node
/// are handled by two threads.
const SHARED_LEVELS: u32 = 12;

/// The number of subtrees below which wide nodes are made in parallel, one task for each subtree.
const PARTS: usize = 1 << 8;

/// Collapses a binary tree: returns the wide nodes of the best hierarchy, and the triangles of its
/// leaves. `leaf_cost` is the cost of testing a leaf, relative to testing a node.
///
/// If the whole scene fits into one node, all boxes of that node are used: the expected cost would
/// put the walls of a room into one leaf, since a line through the room hits some of them; but a
/// shadow ray within the room enters the boxes of none.
pub(super) fn collapse(nodes: Vec<Binary>, leaf_cost: f64) -> (Vec<Node>, Vec<Triangles>) {
    let most = (index(nodes.len() / 2 + 1) / 8).clamp(2, LEAF_SIZE);
    let choices = (0..nodes.len() / 2).map(|_| AtomicU32::new(0)).collect();
    let tree = Tree {
        nodes,
        choices,
        leaf_cost,
        most,
    };
    tree.decide(0, SHARED_LEVELS);
    tree.widen()
}

/// The bit of a node's choice that says that the subtree becomes a leaf, if one child of a wide
/// node represents it.
const ONE_PIECE: u32 = 1 << 31;

/// The number of bits in a node's choice for each number of children j = 2 to 8 that may represent
/// the node: they hold how many of the children represent its left subtree, or 0 if a single child
/// represents the node.
const BITS: u32 = LEAF_SIZE.ilog2();

/// The least cost of a subtree if it is represented by up to 1, 2, … 8 children of a wide node, and
/// the number of its triangles. A *piece* of a subtree is one such child.
#[derive(Clone, Copy)]
struct Cost {
    pieces: [f64; 8],
    triangles: u32,
}

/// A binary tree, and the choices made for its nodes.
struct Tree {
    nodes: Vec<Binary>,
    /// For each pair of sibling nodes, the choice made for their parent.
    choices: Vec<AtomicU32>,
    leaf_cost: f64,
    /// The largest number of triangles in a leaf.
    most: u32,
}

/// A part of the hierarchy: wide nodes, the first of which is the root of the part, and leaves,
/// both with indices that begin at zero.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    leaves: Vec<Triangles>,
}

impl Tree {
    /// Makes the choices for all nodes of the subtree below node `at`, and returns its cost. Within
    /// the first `levels` levels, children are handled in parallel.
    fn decide(&self, at: u32, levels: u32) -> Cost {
        let node = &self.nodes[at as usize];
        let area = node.bounds.half_area();
        if node.is_leaf() {
            return Cost {
                pieces: [area * self.leaf_cost; 8],
                triangles: 1,
            };
        }
        let child = |at| self.decide(at, levels.saturating_sub(1));
        let (left, right) = if levels > 0 {
            pool::join(|| child(node.first), || child(node.first + 1))
        } else {
            (child(node.first), child(node.first + 1))
        };
        let (cost, choice) = self.decide_one(area, &left, &right);
        self.choices[node.first as usize / 2].store(choice, Ordering::Relaxed);
        cost
    }

    /// Computes the cost of a node with two children, and the choices that attain that cost.
    fn decide_one(&self, area: f64, left: &Cost, right: &Cost) -> (Cost, u32) {
        let mut cost = Cost {
            pieces: [0.0; 8],
            triangles: left.triangles.saturating_add(right.triangles),
        };
        let mut split = [0_u32; 8];
        // For each number of pieces, try all ways to divide them between the children; there are no
        // more pieces than triangles.
        let most = cost.triangles.min(LEAF_SIZE) as usize;
        for pieces in 2..=most {
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
        for pieces in most..8 {
            (cost.pieces[pieces], split[pieces]) = (cost.pieces[most - 1], split[most - 1]);
        }
        // As one piece, the node is either a leaf or opened into eight pieces.
        let opened = area + cost.pieces[7];
        let closed = if cost.triangles <= self.most {
            area * self.leaf_cost
        } else {
            f64::INFINITY
        };
        cost.pieces[0] = closed.min(opened);
        let mut choice = if closed <= opened { ONE_PIECE } else { 0 };
        for k in 1..8 {
            if cost.pieces[k - 1] <= cost.pieces[k] {
                // With one piece fewer the cost is no higher.
                cost.pieces[k] = cost.pieces[k - 1];
                split[k] = split[k - 1];
            }
            choice |= split[k] << (BITS * (index(k) - 1));
        }
        (cost, choice)
    }

    fn choice(&self, inner: &Binary) -> u32 {
        self.choices[inner.first as usize / 2].load(Ordering::Relaxed)
    }

    /// Whether a subtree becomes a leaf.
    fn is_leaf(&self, node: &Binary) -> bool {
        node.is_leaf() || self.choice(node) & ONE_PIECE != 0
    }

    /// Collects in `out` the up to eight children of the wide node that opens `root`.
    fn members(&self, root: u32, out: &mut Vec<u32>) {
        out.clear();
        let node = &self.nodes[root as usize];
        if self.is_leaf(node) {
            out.push(root);
            return;
        }
        let left = left_pieces(self.choice(node), 8).clamp(1, 7);
        self.spread(node.first, left, out);
        self.spread(node.first + 1, 8 - left, out);
    }

    /// Collects in `out` the nodes that represent the subtree below `at` in up to `pieces` pieces.
    fn spread(&self, at: u32, pieces: usize, out: &mut Vec<u32>) {
        let node = &self.nodes[at as usize];
        let left = if pieces < 2 || node.is_leaf() {
            0
        } else {
            left_pieces(self.choice(node), pieces)
        };
        if left == 0 {
            out.push(at);
        } else {
            self.spread(node.first, left, out);
            self.spread(node.first + 1, pieces - left, out);
        }
    }

    /// Returns the triangles of a subtree that becomes a leaf, and how many there are.
    fn triangles(&self, root: u32) -> (Triangles, usize) {
        let mut found = [0; LEAF_SIZE as usize];
        let mut count = 0;
        let mut todo = [root; LEAF_SIZE as usize + 1];
        let mut left = 1;
        while left > 0 {
            left -= 1;
            let node = &self.nodes[todo[left] as usize];
            if node.is_leaf() {
                found[count] = node.first;
                count += 1;
            } else {
                todo[left] = node.first + 1;
                todo[left + 1] = node.first;
                left += 2;
            }
        }
        for k in count..found.len() {
            found[k] = found[0];
        }
        (found, count)
    }

    /// Carries out the choices: makes the top of the hierarchy first, then the parts below it in
    /// parallel, and joins them.
    fn widen(self) -> (Vec<Node>, Vec<Triangles>) {
        // Open nodes breadth first until there are enough parts.
        let mut top = Part::default();
        let mut todo = VecDeque::from([(0, 0)]);
        top.nodes.push(Node::default());
        while todo.len() < PARTS
            && let Some((node, root)) = todo.pop_front()
        {
            self.open(node, root, &mut top, |node, root| {
                todo.push_back((node, root));
            });
        }
        // Make the parts.
        let parts = pool::collect(todo.len(), 1, &|k| {
            let mut part = Part::default();
            part.nodes.push(Node::default());
            let mut todo = vec![(0, todo[k].1)];
            while let Some((node, root)) = todo.pop() {
                self.open(node, root, &mut part, |node, root| todo.push((node, root)));
            }
            part
        });
        // Append them to the top, with their indices shifted.
        drop(self);
        let Part {
            mut nodes,
            mut leaves,
        } = top;
        let sum = |count: fn(&Part) -> usize| parts.iter().map(count).sum();
        nodes.reserve_exact(sum(|part| part.nodes.len() - 1));
        leaves.reserve_exact(sum(|part| part.leaves.len()));
        for (part, (at, _)) in parts.into_iter().zip(todo) {
            let (inner, outer) = (nodes.len() - 1, leaves.len());
            let own = part.nodes.into_iter();
            let mut own = own.map(|node| node.renumbered(inner, outer));
            nodes[at] = own.next().unwrap_or_default();
            nodes.extend(own);
            leaves.extend(part.leaves);
        }
        (nodes, leaves)
    }

    /// Makes the wide node that opens `root`, with index `node` in its part; calls `todo` for each
    /// wide node below it.
    fn open(&self, node: usize, root: u32, part: &mut Part, mut todo: impl FnMut(usize, u32)) {
        let mut members = Vec::with_capacity(8);
        self.members(root, &mut members);
        let mut packed = Node::default();
        for (lane, &member) in members.iter().enumerate() {
            let binary = &self.nodes[member as usize];
            packed.set_bounds(lane, &binary.bounds);
            let is_leaf = self.is_leaf(binary);
            packed.valid |= 1 << lane;
            packed.leaf |= u8::from(is_leaf) << lane;
            let child = if is_leaf {
                let (triangles, count) = self.triangles(member);
                part.leaves.push(triangles);
                Child::leaf(part.leaves.len() - 1, count)
            } else {
                part.nodes.push(Node::default());
                todo(part.nodes.len() - 1, member);
                Child::node(part.nodes.len() - 1)
            };
            packed.child[lane] = child.0;
        }
        part.nodes[node] = packed;
    }
}

fn left_pieces(choice: u32, pieces: usize) -> usize {
    (choice >> (BITS * index(pieces - 2)) & 7) as usize
}
