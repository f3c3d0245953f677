//! [`IntervalTree`]: the visible pieces of a line in a height-balanced search tree, which clips in
//! logarithmic time.
#![allow(clippy::disallowed_types, reason = "nodes are kept for the next query")]

use super::{Interval, VisibleSet};
use std::cmp::Ordering;

/// The index of a node; `NIL` is the empty tree.
type Link = u32;
const NIL: Link = u32::MAX;

/// A node of the tree: a visible piece, with the pieces before it in the left subtree and the
/// pieces after it in the right one.
#[derive(Clone, Copy, Debug)]
struct Node {
    piece: Interval,
    left: Link,
    right: Link,
    height: u8,
}

/// The visible pieces of a line in an AVL tree, ordered by position.
///
/// A clip splits the tree at both ends of the clipped interval, drops the middle, and joins the
/// rest: O(log n) for n pieces, amortised over the dropped nodes. Nodes are stored in one arena
/// that is reused.
///
/// **Source**: Billen & Dutré 2016, section 5.2 ("binary tree over the visible intervals");
/// join-based balancing after Blelloch, Ferizovic & Sun 2016.
#[derive(Clone, Debug)]
pub struct IntervalTree {
    nodes: Vec<Node>,
    free: Vec<Link>,
    root: Link,
    count: usize,
}

impl Default for IntervalTree {
    fn default() -> Self {
        Self::full()
    }
}

impl IntervalTree {
    fn node(&self, t: Link) -> &Node {
        &self.nodes[t as usize]
    }

    fn height(&self, t: Link) -> u8 {
        if t == NIL { 0 } else { self.node(t).height }
    }

    /// Makes a node without children, in an entry of the arena that is not in use if there is one.
    fn create(&mut self, piece: Interval) -> Link {
        self.count += 1;
        let node = Node {
            piece,
            left: NIL,
            right: NIL,
            height: 1,
        };
        if let Some(t) = self.free.pop() {
            self.nodes[t as usize] = node;
            return t;
        }
        self.nodes.push(node);
        Link::try_from(self.nodes.len() - 1).unwrap_or(NIL)
    }

    /// Makes `middle` the parent of two subtrees, and updates its height.
    fn link(&mut self, left: Link, middle: Link, right: Link) -> Link {
        let height = 1 + self.height(left).max(self.height(right));
        let node = &mut self.nodes[middle as usize];
        (node.left, node.right, node.height) = (left, right, height);
        middle
    }

    fn rotate_left(&mut self, t: Link) -> Link {
        let (l, r) = (self.node(t).left, self.node(t).right);
        let (rl, rr) = (self.node(r).left, self.node(r).right);
        let t = self.link(l, t, rl);
        self.link(t, r, rr)
    }

    fn rotate_right(&mut self, t: Link) -> Link {
        let (l, r) = (self.node(t).left, self.node(t).right);
        let (ll, lr) = (self.node(l).left, self.node(l).right);
        let t = self.link(lr, t, r);
        self.link(ll, l, t)
    }

    /// Joins `left`, `middle` and `right`, in this order, to one tree, in O(difference of heights).
    fn join(&mut self, left: Link, middle: Link, right: Link) -> Link {
        let (hl, hr) = (self.height(left), self.height(right));
        if hl > hr + 1 {
            let (ll, lr) = (self.node(left).left, self.node(left).right);
            let lower = self.join(lr, middle, right);
            let t = self.link(ll, left, lower);
            self.mend_right(t)
        } else if hr > hl + 1 {
            let (rl, rr) = (self.node(right).left, self.node(right).right);
            let lower = self.join(left, middle, rl);
            let t = self.link(lower, right, rr);
            self.mend_left(t)
        } else {
            self.link(left, middle, right)
        }
    }

    /// Restores the balance after the right subtree has grown by one level.
    fn mend_right(&mut self, t: Link) -> Link {
        let (l, r) = (self.node(t).left, self.node(t).right);
        if self.height(r) <= self.height(l) + 1 {
            return t;
        }
        if self.height(self.node(r).left) > self.height(self.node(r).right) {
            let r = self.rotate_right(r);
            self.link(l, t, r);
        }
        self.rotate_left(t)
    }

    /// Restores the balance after the left subtree has grown by one level.
    fn mend_left(&mut self, t: Link) -> Link {
        let (l, r) = (self.node(t).left, self.node(t).right);
        if self.height(l) <= self.height(r) + 1 {
            return t;
        }
        if self.height(self.node(l).right) > self.height(self.node(l).left) {
            let l = self.rotate_left(l);
            self.link(l, t, r);
        }
        self.rotate_right(t)
    }

    /// Splits a tree into the pieces for which `goes_left` is true, and those after them.
    fn split(&mut self, t: Link, goes_left: &impl Fn(&Interval) -> bool) -> (Link, Link) {
        if t == NIL {
            return (NIL, NIL);
        }
        let Node {
            piece, left, right, ..
        } = *self.node(t);
        if goes_left(&piece) {
            let (a, b) = self.split(right, goes_left);
            (self.join(left, t, a), b)
        } else {
            let (a, b) = self.split(left, goes_left);
            (a, self.join(b, t, right))
        }
    }

    /// Removes the last node; returns the rest, and the node.
    fn split_last(&mut self, t: Link) -> (Link, Link) {
        let Node { left, right, .. } = *self.node(t);
        if right == NIL {
            return (left, t);
        }
        let (rest, last) = self.split_last(right);
        (self.join(left, t, rest), last)
    }

    /// Joins two trees without a node between them.
    fn join2(&mut self, left: Link, right: Link) -> Link {
        if left == NIL {
            return right;
        }
        let (rest, last) = self.split_last(left);
        self.join(rest, last, right)
    }

    /// Returns the piece at one end of a tree: the last on the path along which `next` leads;
    /// `None` for an empty tree.
    fn edge(&self, mut t: Link, next: impl Fn(&Node) -> Link) -> Option<Interval> {
        let mut piece = None;
        while t != NIL {
            piece = Some(self.node(t).piece);
            t = next(self.node(t));
        }
        piece
    }

    /// Returns the nodes of a tree to the arena.
    fn drop_tree(&mut self, t: Link) {
        if t != NIL {
            let Node { left, right, .. } = *self.node(t);
            self.drop_tree(left);
            self.drop_tree(right);
            self.free.push(t);
            self.count -= 1;
        }
    }

    /// Calls `f` with the pieces of a subtree in ascending order.
    fn visit(&self, t: Link, f: &mut impl FnMut(Interval)) {
        if t != NIL {
            let Node {
                piece, left, right, ..
            } = *self.node(t);
            self.visit(left, f);
            f(piece);
            self.visit(right, f);
        }
    }

    /// The height of the tree: at most 1.45 log₂(n + 2).
    #[must_use]
    pub fn depth(&self) -> usize {
        usize::from(self.height(self.root))
    }
}

impl VisibleSet for IntervalTree {
    fn full() -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            free: Vec::new(),
            root: NIL,
            count: 0,
        };
        tree.root = tree.create(Interval::UNIT);
        tree
    }

    fn reset(&mut self) {
        self.nodes.clear();
        self.free.clear();
        self.count = 0;
        self.root = self.create(Interval::UNIT);
    }

    fn clip(&mut self, lo: f64, hi: f64) {
        if lo.partial_cmp(&hi) != Some(Ordering::Less) {
            return;
        }
        // Cut out the pieces that overlap the clipped interval.
        let (before, rest) = self.split(self.root, &|p| p.hi <= lo);
        let (middle, after) = self.split(rest, &|p| p.lo < hi);
        // Insert what is left of the first and of the last of them.
        let left = self
            .edge(middle, |n| n.left)
            .map(|p| Interval::new(p.lo, lo));
        let right = self
            .edge(middle, |n| n.right)
            .map(|p| Interval::new(hi, p.hi));
        self.drop_tree(middle);
        let mut root = before;
        for piece in [left, right]
            .into_iter()
            .flatten()
            .filter(Interval::is_worth_keeping)
        {
            let node = self.create(piece);
            root = self.join(root, node, NIL);
        }
        self.root = self.join2(root, after);
    }

    fn is_empty(&self) -> bool {
        self.root == NIL
    }

    fn count(&self) -> usize {
        self.count
    }

    fn for_each(&self, mut f: impl FnMut(Interval)) {
        self.visit(self.root, &mut f);
    }
}
