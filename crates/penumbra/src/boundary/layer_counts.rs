//! Numbers of layers of which only the differences are known: a system of equations such as x + 2 =
//! y − 1, solved by a union–find structure with weights.
//!
//! A silhouette says by how much the number of layers changes across it, not what the number is. So
//! a count is an unknown integer x plus a known one, and two counts over the same point make an
//! equation. Unknowns that are connected by equations form a tree, in which each stores its
//! difference from its parent:
//!
//! ```text
//!                x₀                x₁ = x₀ + 2
//!           + 2 ╱  ╲ − 1           x₂ = x₀ − 1
//!             x₁    x₂             x₃ = x₂ + 3 = x₀ + 2
//!                    ╲ + 3
//!                     x₃
//! ```
//!
//! The root represents all of them: adding the differences on the way up expresses each count by
//! the root, so that counts of one tree can be compared. An equation between two trees makes one
//! root a child of the other; an equation within a tree is true or contradicts the others. Searches
//! shorten the paths for later searches, by path splitting (Tarjan and van Leeuwen, *Worst-case
//! analysis of set union algorithms*, 1984).

use super::index::Index;

/// A number of layers: an unknown integer, about which [`LayerEquations`] has equations, plus a
/// known one.
#[derive(Clone, Copy, Debug)]
pub(super) struct LayerCount {
    pub(super) unknown: Index,
    pub(super) plus: i32,
}

impl LayerCount {
    /// Returns the count at a point that `more` layers hide than the point of this count.
    pub(super) fn plus(self, more: i32) -> Self {
        Self {
            plus: self.plus + more,
            ..self
        }
    }
}

/// The equations between counts that have been found so far.
#[derive(Debug, Default)]
pub(super) struct LayerEquations {
    /// For each unknown, its parent in the tree plus its difference from the parent; a root is its
    /// own parent.
    parents: Vec<LayerCount>,
}

impl LayerEquations {
    pub(super) fn clear(&mut self) {
        self.parents.clear();
    }

    /// The number of unknowns, which are numbered from 0.
    pub(super) fn len(&self) -> usize {
        self.parents.len()
    }

    /// Returns a new count about which there are no equations.
    pub(super) fn new_unknown(&mut self) -> LayerCount {
        let unknown = Index::new(self.parents.len());
        let count = LayerCount { unknown, plus: 0 };
        self.parents.push(count);
        count
    }

    /// Expresses a count by the root of its tree.
    pub(super) fn by_root(&mut self, count: LayerCount) -> LayerCount {
        let LayerCount {
            unknown: mut at,
            mut plus,
        } = count;
        loop {
            let parent = self.parents[at.get()];
            if parent.unknown == at {
                return LayerCount { unknown: at, plus };
            }
            // Split the path for later searches: each unknown on it becomes a child of its
            // grandparent.
            let grandparent = self.parents[parent.unknown.get()];
            if grandparent.unknown != parent.unknown {
                self.parents[at.get()] = LayerCount {
                    unknown: grandparent.unknown,
                    plus: parent.plus + grandparent.plus,
                };
            }
            plus += parent.plus;
            at = parent.unknown;
        }
    }

    /// Adds the equation that two counts are equal; returns false if it contradicts the equations
    /// before.
    pub(super) fn equate(&mut self, a: LayerCount, b: LayerCount) -> bool {
        let [a, b] = [a, b].map(|count| self.by_root(count));
        // From a.unknown + a.plus = b.unknown + b.plus.
        let difference = b.plus - a.plus;
        if a.unknown == b.unknown {
            return difference == 0;
        }
        self.parents[a.unknown.get()] = LayerCount {
            unknown: b.unknown,
            plus: difference,
        };
        true
    }
}
