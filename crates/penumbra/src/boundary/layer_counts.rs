//! Numbers of layers of which only differences are known: a system of equations x + 2 = y − 1,
//! solved by a union–find with weights.
//!
//! A silhouette says by how much the number of layers changes across it, not what it is. So a count
//! is an unknown integer x plus a known one, and two counts over the same point give an equation.
//! Unknowns that equations connect form a tree, in which each has its difference from its parent:
//!
//! ```text
//!                x₀                x₁ = x₀ + 2
//!           + 2 ╱  ╲ − 1           x₂ = x₀ − 1
//!             x₁    x₂             x₃ = x₂ + 3 = x₀ + 2
//!                    ╲ + 3
//!                     x₃
//! ```
//!
//! The root represents all of them: sums on the way up express each count by the root, so that
//! counts of one tree can be compared. An equation between two trees hangs one root below the
//! other; one within a tree is right or wrong by what is known. Searches split their way for the
//! next (Tarjan and van Leeuwen, *Worst-case analysis of set union algorithms*, 1984).

use super::index::Index;

/// A number of layers: an unknown one, which only the [`LayerEquations`] know, plus a known one.
#[derive(Clone, Copy, Debug)]
pub(super) struct LayerCount {
    pub(super) unknown: Index,
    pub(super) plus: i32,
}

impl LayerCount {
    /// The number of layers where there are more by a known number.
    pub(super) fn plus(self, more: i32) -> Self {
        Self {
            plus: self.plus + more,
            ..self
        }
    }
}

/// The equations between counts that were found so far.
#[derive(Debug, Default)]
pub(super) struct LayerEquations {
    /// For each unknown its parent plus their difference; of a root, itself.
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

    /// A count of which nothing is known.
    pub(super) fn new_unknown(&mut self) -> LayerCount {
        let unknown = Index::new(self.parents.len());
        let count = LayerCount { unknown, plus: 0 };
        self.parents.push(count);
        count
    }

    /// A count expressed by the root of its tree.
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
            // Split the way for the next search: let each unknown on it hang below its grandparent.
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

    /// Takes in that two counts are equal; false if that contradicts what is known.
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
