//! A binary tree of bounding boxes over any items with boxes; parts and patches are searched by it.

use linelit_geometry::{DVec3, stop};
use std::ops::Range;

/// The bounding box of some items, and the items.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub low: DVec3,
    pub high: DVec3,
    /// The range of the node's items in [`Tree::order`].
    pub items: Range<usize>,
    /// The indices of the two halves; `None` if the node holds one item.
    pub children: Option<[usize; 2]>,
}

/// A binary tree of boxes with one item in each leaf; nodes are halved across their longest side.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    /// The nodes; the first is the root.
    pub nodes: Vec<Node>,
    /// The items, sorted such that the items of each node are consecutive.
    pub order: Vec<usize>,
}

impl Tree {
    /// Builds the tree of some items, given their boxes.
    pub(crate) fn build(items: Vec<usize>, bounds: impl Fn(usize) -> [DVec3; 2]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: items,
        };
        if !tree.order.is_empty() {
            tree.add(0..tree.order.len(), &bounds);
        }
        tree
    }

    /// Adds the node of some items and all nodes below it, and returns its index. The depth is the
    /// logarithm of the number of items.
    fn add(&mut self, items: Range<usize>, bounds: &impl Fn(usize) -> [DVec3; 2]) -> usize {
        stop::check();
        // Find the box around the items.
        let all = self.order[items.clone()].iter().map(|&i| bounds(i));
        let whole = all.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)]);
        let [low, high] = whole.unwrap_or_default();
        let number = self.nodes.len();
        self.nodes.push(Node {
            low,
            high,
            items: items.clone(),
            children: None,
        });
        if items.len() > 1 {
            // Halve the items at the median of their middles along the longest side.
            let sides = (high - low).to_array();
            let axis = (0..3).fold(0, |a, b| if sides[b] > sides[a] { b } else { a });
            let place = |&i: &usize| bounds(i).map(|x| x[axis]).iter().sum::<f64>();
            let by_place = |a: &usize, b: &usize| place(a).total_cmp(&place(b)).then(a.cmp(b));
            let half = items.len() / 2;
            self.order[items.clone()].select_nth_unstable_by(half, by_place);
            let middle = items.start + half;
            let left = self.add(items.start..middle, bounds);
            let right = self.add(middle..items.end, bounds);
            self.nodes[number].children = Some([left, right]);
        }
        number
    }

    /// Calls `each` for all items in leaves for whose boxes `holds` returns true, as it has to for
    /// all boxes above them.
    pub(crate) fn find(&self, holds: impl Fn(DVec3, DVec3) -> bool, mut each: impl FnMut(usize)) {
        let mut waiting = vec![0];
        while let Some(node) = waiting.pop().and_then(|k: usize| self.nodes.get(k)) {
            if holds(node.low, node.high) {
                match node.children {
                    Some(children) => waiting.extend(children),
                    None => self.order[node.items.clone()].iter().for_each(|&i| each(i)),
                }
            }
        }
    }
}
