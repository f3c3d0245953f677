//! Improvement of a binary tree: subtrees are removed and inserted where they make boxes smaller.
//!
//! **Source**: Bittner, Hapala & Havran 2013, "Fast insertion-based optimization of bounding volume
//! hierarchies", for the choice of subtrees: the nodes with the largest boxes, one after the other.
//! The search for the new position is that of Meister & Bittner 2018, "Parallel reinsertion for
//! bounding volume hierarchy optimization": from the old position upwards. A search visits a
//! bounded number of nodes, so that the time is n log n even where boxes lie on top of each other.

use super::{binary::Binary, index};
use linelit_geometry::stop;
use std::{cmp::Reverse, collections::BinaryHeap};

/// The fraction of the nodes, those with the largest boxes, that each pass tries to move; and the
/// number of passes.
const SHARE: f64 = 0.03;
const PASSES: usize = 2;

/// The largest number of nodes that the search for one position visits.
const MOST_VISITS: u32 = 512;

/// The largest number of levels of a tree, as a multiple of the logarithm of its number of nodes.
/// Moves that would make the tree deeper are not made.
pub(super) const LEVELS: u32 = 4;

/// The number of pairs of nodes in the top of a large tree; the top is improved separately from the
/// subtrees below it.
const TOP: usize = 1 << 14;

/// Returns the other child of the same parent; nodes have the indices of [`Binary`].
#[inline(always)]
const fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

/// The tree with the data that moves need.
struct Tree<'a> {
    nodes: &'a mut [Binary],
    parents: Vec<u32>,
    /// For each node, the number of levels below it.
    heights: Vec<u16>,
    /// The largest number of levels that the tree may have, so that searching and moving take n log
    /// n.
    most_levels: u32,
    /// The stack of the search: nodes to visit, each with the gain at its parent.
    todo: Vec<(f64, u32)>,
}

/// Improves a tree with root 0 and fewer than 2³¹ nodes. Children have to come after their parents
/// in the list before the improvement, and may come before them afterwards.
pub(super) fn improve(nodes: &mut [Binary]) {
    if nodes.len() < 7 {
        return;
    }
    let mut parents = vec![0; nodes.len()];
    let mut heights = vec![0; nodes.len()];
    // Find parents and heights; children come after their parents.
    for (i, node) in nodes.iter().enumerate().rev() {
        if !node.is_leaf() {
            parents[node.first as usize] = index(i);
            parents[node.first as usize + 1] = index(i);
            heights[i] = above(&heights, node.first);
        }
    }
    let mut tree = Tree {
        heights,
        most_levels: LEVELS * (usize::BITS - nodes.len().leading_zeros()),
        nodes,
        parents,
        todo: Vec::new(),
    };
    // Choose the nodes with the largest boxes. All passes use the same nodes, although some boxes
    // change.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of the nodes"
    )]
    let count = (tree.nodes.len() as f64 * SHARE) as usize + 1;
    let with_area = |node: u32, tree: &Tree<'_>| (tree.area(node), node);
    let last = index(tree.nodes.len() - 1);
    let mut candidates: Vec<_> = (1..=last).map(|node| with_area(node, &tree)).collect();
    let largest_first = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if count < candidates.len() {
        candidates.select_nth_unstable_by(count, largest_first);
        candidates.truncate(count);
    }
    // Move each of them to the best position.
    for _ in 0..PASSES {
        for candidate in &mut candidates {
            *candidate = with_area(candidate.1, &tree);
        }
        candidates.sort_unstable_by(largest_first);
        for &(_, from) in &candidates {
            stop::check();
            if let Some(to) = tree.search(from) {
                tree.apply(from, to);
            }
        }
    }
}

/// Returns the number of levels below the parent of a pair of nodes.
fn above(heights: &[u16], pair: u32) -> u16 {
    let pair = pair as usize;
    heights[pair].max(heights[pair + 1]).saturating_add(1)
}

impl Tree<'_> {
    fn area(&self, node: u32) -> f64 {
        self.nodes[node as usize].bounds.half_area()
    }

    /// Finds the best position for a subtree: the node that should become its sibling. `None` if it
    /// should stay.
    ///
    /// The gain of a move is how much the sum of all boxes' areas shrinks. The search removes the
    /// subtree in thought, climbs from its old position to the root, and from each ancestor
    /// descends into the other child, as long as the gain before adding the subtree's own box can
    /// still exceed the best.
    fn search(&mut self, from: u32) -> Option<u32> {
        let bounds = self.nodes[from as usize].bounds;
        let area = bounds.half_area();
        let parent = self.parents[from as usize];
        let (mut best, mut place) = (0.0, 0);
        // Without the subtree its parent is removed, and the boxes above shrink to what is left.
        let mut gain = self.area(parent);
        let mut beside = sibling(from);
        let mut left = self.nodes[beside as usize].bounds;
        let mut pivot = parent;
        let mut visits = 0;
        self.todo.clear();
        // Descend into the subtree on the other side of the ancestor.
        loop {
            self.todo.push((gain, beside));
            while let Some((gain, to)) = self.todo.pop() {
                if gain - area <= best {
                    continue;
                }
                visits += 1;
                let node = &self.nodes[to as usize];
                let here = gain - node.bounds.union(&bounds).half_area();
                if here > best {
                    (best, place) = (here, to);
                }
                if !node.is_leaf() && visits < MOST_VISITS {
                    let below = here + node.bounds.half_area();
                    self.todo.push((below, node.first));
                    self.todo.push((below, node.first + 1));
                }
            }
            // Climb to the next ancestor, and shrink it.
            if pivot == 0 || visits >= MOST_VISITS {
                break;
            }
            if pivot != parent {
                left.extend(&self.nodes[beside as usize].bounds);
                gain += self.area(pivot) - left.half_area();
            }
            beside = sibling(pivot);
            pivot = self.parents[pivot as usize];
        }
        let stays = place == 0 || place == sibling(from) || place == parent;
        (!stays).then_some(place)
    }

    /// Moves the subtree `from` so that node `to` becomes its sibling, unless the tree would become
    /// too deep.
    fn apply(&mut self, from: u32, to: u32) {
        // Compute the depth that the subtree would reach.
        let parent = self.parents[from as usize];
        let mut levels = 1;
        let mut above = to;
        while above != 0 {
            levels += 1;
            above = self.parents[above as usize];
        }
        let below = self.heights[from as usize].max(self.heights[to as usize]);
        if levels + u32::from(below) > self.most_levels {
            return;
        }
        // Reuse the old parent's pair of nodes: it becomes the pair below the new position, with
        // the node that was there as the second child. The subtree's old sibling takes the parent's
        // place.
        let beside = sibling(from);
        let other = self.nodes[beside as usize];
        let there = self.nodes[to as usize];
        let heights = [beside, to].map(|n| self.heights[n as usize]);
        self.nodes[to as usize].first = from.min(beside);
        self.nodes[to as usize].tag &= !Binary::LEAF;
        self.put(beside, there, heights[1]);
        self.put(parent, other, heights[0]);
        self.parents[from as usize] = to;
        self.parents[beside as usize] = to;
        // Fit the boxes above both positions; the sibling that replaced the parent may be smaller.
        self.refit(to);
        if parent != 0 {
            self.refit(self.parents[parent as usize]);
        }
    }

    /// Moves a node to another index, and updates its children's parent.
    fn put(&mut self, at: u32, node: Binary, height: u16) {
        self.nodes[at as usize] = node;
        self.heights[at as usize] = height;
        if !node.is_leaf() {
            self.parents[node.first as usize] = at;
            self.parents[node.first as usize + 1] = at;
        }
    }

    /// Fits boxes and heights to those of the children, from an inner node upwards as far as they
    /// change.
    fn refit(&mut self, mut node: u32) {
        loop {
            let Binary { bounds, first, .. } = self.nodes[node as usize];
            let children = &self.nodes[first as usize..first as usize + 2];
            let fit = children[0].bounds.union(&children[1].bounds);
            let height = above(&self.heights, first);
            if fit == bounds && height == self.heights[node as usize] {
                return;
            }
            self.nodes[node as usize].bounds = fit;
            self.heights[node as usize] = height;
            if node == 0 {
                return;
            }
            node = self.parents[node as usize];
        }
    }
}

/// Improves the top of a large tree whose parts have been improved by themselves.
pub(super) fn improve_top(nodes: &mut [Binary]) {
    // Copy the top: open the nodes with the largest boxes first, and remember where their pairs
    // were.
    let mut top = vec![nodes[0]];
    let mut pairs = Vec::new();
    let area = |node: &Binary| node.bounds.half_area().to_bits();
    let mut open = BinaryHeap::from([(area(&nodes[0]), Reverse(0_usize))]);
    // Nodes at which the top ends become leaves; what they were is stored in this list meanwhile.
    let mut ends: Vec<(u32, u32)> = Vec::new();
    while let Some((_, Reverse(at))) = open.pop() {
        let node = top[at];
        if node.is_leaf() || pairs.len() >= TOP {
            top[at].first = index(ends.len());
            top[at].tag = Binary::LEAF;
            ends.push((node.first, node.tag));
            continue;
        }
        let pair = node.first as usize;
        top[at].first = index(2 * pairs.len() + 1);
        pairs.push(pair);
        for child in &nodes[pair..pair + 2] {
            open.push((area(child), Reverse(top.len())));
            top.push(*child);
        }
    }
    // Improve the copy, and copy it back to the same pairs.
    improve(&mut top);
    for node in &mut top {
        if node.is_leaf() {
            (node.first, node.tag) = ends[node.first as usize];
        } else {
            node.first = index(pairs[(node.first as usize - 1) / 2]);
        }
    }
    nodes[0] = top[0];
    for (k, pair) in pairs.into_iter().enumerate() {
        nodes[pair..pair + 2].copy_from_slice(&top[2 * k + 1..2 * k + 3]);
    }
}
