//! Sums whose bits do not depend on who added what.

/// Combines items pairwise in a tree whose shape depends on nothing but their number.
///
/// Items come in their order, one after the other; of n of them at most log₂ n + 1 are kept.
/// Neighbours are combined first: of five items ((0 1)(2 3)) 4.
///
/// ```
/// let mut tree = linelit_plan::Tree::new(|a: String, b: String| format!("({a}{b})"));
/// for k in 0..5 {
///     tree.push(k.to_string());
/// }
/// assert_eq!(tree.finish().as_deref(), Some("(((01)(23))4)"));
/// ```
#[derive(Debug)]
pub struct Tree<T, F> {
    combine: F,
    /// Whole subtrees from left to right, and the number of items of each, a power of two.
    subtrees: Vec<(T, u64)>,
}

impl<T, F: FnMut(T, T) -> T> Tree<T, F> {
    /// An empty tree; `combine` takes the left and the right side.
    pub const fn new(combine: F) -> Self {
        Self {
            combine,
            subtrees: Vec::new(),
        }
    }

    /// Adds an item to the right.
    pub fn push(&mut self, item: T) {
        let (mut right, mut count) = (item, 1);
        while let Some((left, _)) = self.subtrees.pop_if(|(_, n)| *n == count) {
            right = (self.combine)(left, right);
            count *= 2;
        }
        self.subtrees.push((right, count));
    }

    /// All items combined; `None` of none.
    pub fn finish(mut self) -> Option<T> {
        let (mut right, _) = self.subtrees.pop()?;
        while let Some((left, _)) = self.subtrees.pop() {
            right = (self.combine)(left, right);
        }
        Some(right)
    }
}
