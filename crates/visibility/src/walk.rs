//! Walks through the hierarchy: for each kind of query, the order in which nodes are opened.
//!
//! A query decides which children of a node matter and what to do with leaves; the walk stores what
//! is still to be visited. Where the nearest child should come first, children wait with their
//! depths ([`nearest_first`]); otherwise they are packed on a stack by one instruction
//! ([`in_any_order`]). Two searches have loops of their own: the search for triangles in a shaft
//! (`shaft::find`) opens two nodes at a time, since it always visits everything that it
//! finds; the search for silhouettes goes breadth first, so that it knows all nodes ahead and can
//! prefetch them.

use crate::{
    build::Hierarchy,
    counters::Counters,
    lanes::Lanes,
    node::{Child, Leaf, Node},
};
use linelit_simd::Simd;
use std::ops::ControlFlow;

/// A query that visits near nodes and leaves before far ones.
pub(crate) trait NearestFirst<S: Simd> {
    /// What the query remembers about a node or leaf while that waits.
    type Entry: Copy;

    /// Whether a child that the query entered at `depth` still matters when it is about to be
    /// visited.
    fn wants(&self, s: S, depth: f32, entry: Self::Entry) -> bool;

    /// Opens a node: returns a bit for each child that may matter, and the depths at which the
    /// query enters the children.
    fn open(&mut self, s: S, node: &Node, entry: Self::Entry) -> (u8, S::F);

    /// Returns what to remember about a child of the node that was opened last; `None` if the child
    /// does not matter.
    fn entry(&self, s: S, node: &Node, lane: usize) -> Option<Self::Entry>;

    /// Tests the triangles of a leaf; [`ControlFlow::Break`] ends the walk.
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, entry: Self::Entry) -> ControlFlow<()>;
}

/// The nodes and leaves that wait to be visited, each with its depth and what the query remembers
/// about it; the last entry is visited next.
pub(crate) type Waiting<E> = Vec<(Child, f32, E)>;

/// Visits the entries of `waiting` and everything below them that matters, the nearest child of
/// each node first. Returns true if a leaf ended the walk.
#[inline(always)]
pub(crate) fn nearest_first<S: Simd, V: NearestFirst<S>>(
    s: S,
    hierarchy: &Hierarchy,
    waiting: &mut Waiting<V::Entry>,
    counters: &mut Counters,
    visitor: &mut V,
) -> bool {
    while let Some((child, depth, entry)) = waiting.pop() {
        if !visitor.wants(s, depth, entry) {
            continue;
        }
        // Test the triangles of a leaf.
        if child.is_leaf() {
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.leaf_index()];
            if visitor.leaf(s, child, leaf, entry).is_break() {
                return true;
            }
            continue;
        }
        // Open a node, and let its children wait, sorted by depth.
        let node = &hierarchy.nodes[child.index()];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (mut found, near) = visitor.open(s, node, entry);
        hierarchy.prefetch(s, node, found);
        let mut depths = Lanes([0.0; 8]);
        s.store(near, &mut depths);
        let base = waiting.len();
        while found != 0 {
            let lane = found.trailing_zeros() as usize;
            found &= found - 1;
            let Some(entry) = visitor.entry(s, node, lane) else {
                continue;
            };
            // Insertion sort: the farthest is lowest on the stack.
            waiting.push((Child(node.child[lane]), depths[lane], entry));
            let mut k = waiting.len() - 1;
            while k > base && waiting[k - 1].1 < depths[lane] {
                waiting.swap(k - 1, k);
                k -= 1;
            }
        }
    }
    false
}

/// Opens the nodes of a hierarchy that is not empty, in any order. `stack` must be large enough for
/// the whole walk ([`crate::bvh::Bvh::make_room`]). `open` handles the leaves of a node itself and
/// returns a bit for each child node to visit; if it returns [`ControlFlow::Break`], the walk ends
/// and returns true.
#[inline(always)]
pub(crate) fn in_any_order<S: Simd>(
    s: S,
    hierarchy: &Hierarchy,
    stack: &mut [u32],
    mut open: impl FnMut(&Node) -> ControlFlow<(), u8>,
) -> bool {
    let (mut top, mut at) = (0, 0);
    loop {
        let node = &hierarchy.nodes[at as usize];
        let ControlFlow::Continue(inner) = open(node) else {
            return true;
        };
        if inner != 0 {
            // One child, expected to meet the most, is opened next without a detour through the
            // stack.
            let lane = highest(inner);
            at = node.child[lane];
            let others = inner & !(1 << lane);
            s.pack(others, &node.child, stack, top);
            top += others.count_ones() as usize;
        } else if top > 0 {
            top -= 1;
            at = stack[top];
        } else {
            return false;
        }
    }
}

/// Returns the position of the highest bit that is set in a number that is not zero.
#[inline(always)]
pub(crate) fn highest(bits: u8) -> usize {
    (7 - bits.leading_zeros()) as usize
}
