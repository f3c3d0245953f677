//! The visible parts of a line, in two representations with one interface, [`VisibleSet`].
//!
//! A line is fully visible at first, as the interval [0, 1]; every occluder clips off an interval.
//! [`IntervalSet`] stores the visible pieces in a sorted list, which is faster for the handful of
//! pieces that occur in practice; [`IntervalTree`] stores them in a balanced tree that clips in
//! logarithmic time (Billen & Dutré 2016, section 5.2), for thousands of pieces.
//!
//! The result does not depend on the order of clips, and both representations give bit-identical
//! results.

mod set;
mod tree;

pub use set::IntervalSet;
pub use tree::IntervalTree;

/// The length of a visible piece, as a fraction of the line, below which the piece is dropped,
/// since it is as short as the rounding errors of the parameters.
pub const MIN_LENGTH: f64 = 4.0 * f64::EPSILON;

/// A closed interval of line parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub lo: f64,
    /// The upper end.
    pub hi: f64,
}

impl Interval {
    /// The whole line.
    pub const UNIT: Self = Self { lo: 0.0, hi: 1.0 };

    /// Creates the interval between two parameters.
    #[inline]
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// The length `hi − lo`.
    #[inline]
    #[must_use]
    pub fn length(&self) -> f64 {
        self.hi - self.lo
    }

    fn is_worth_keeping(&self) -> bool {
        self.length() >= MIN_LENGTH
    }
}

/// The visible part of a line, as a set of disjoint closed intervals in [0, 1].
pub trait VisibleSet {
    /// Creates the set for a line that is wholly visible.
    fn full() -> Self;

    /// Makes the whole line visible again, and keeps the allocated memory.
    fn reset(&mut self);

    /// Removes the open interval between `lo` and `hi`, and pieces shorter than [`MIN_LENGTH`] that
    /// this leaves. The set does not change unless `lo < hi`.
    fn clip(&mut self, lo: f64, hi: f64);

    /// Whether no part of the line is visible.
    fn is_empty(&self) -> bool;

    /// The number of visible pieces.
    fn count(&self) -> usize;

    /// Calls `f` with each visible piece, in ascending order.
    fn for_each(&self, f: impl FnMut(Interval));

    /// The total length of the visible pieces.
    fn measure(&self) -> f64 {
        let mut sum = 0.0;
        self.for_each(|i| sum += i.length());
        sum
    }
}
