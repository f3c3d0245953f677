//! The visible parts of a line: two forms, one interface.
//!
//! A line starts fully visible, as the interval [0, 1]; every occluder clips a closed interval
//! off. [`IntervalSet`] keeps the rest in a flat sorted list, which wins for the handful of pieces
//! that occur in practice; [`IntervalTree`] in a balanced tree that clips in logarithmic time
//! (Billen & Dutré 2016, section 5.2), for thousands of pieces.
//!
//! The result does not depend on the order of clips, and both forms agree to the bit.

mod set;
mod tree;

pub use set::IntervalSet;
pub use tree::IntervalTree;

/// Visible pieces shorter than this fraction of the line are dropped: that is the rounding of the
/// parameters themselves.
pub const MIN_LENGTH: f64 = 4.0 * f64::EPSILON;

/// A closed interval of line parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
}

impl Interval {
    /// The whole line.
    pub const UNIT: Self = Self { lo: 0.0, hi: 1.0 };

    /// The interval between two parameters.
    #[inline]
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    /// `hi − lo`.
    #[inline]
    #[must_use]
    pub fn length(&self) -> f64 {
        self.hi - self.lo
    }

    fn is_worth_keeping(&self) -> bool {
        self.length() >= MIN_LENGTH
    }
}

/// The visible part of a line: a set of disjoint closed intervals in [0, 1].
pub trait VisibleSet {
    /// The whole line is visible.
    fn full() -> Self;

    /// Makes the whole line visible again, keeping the memory.
    fn reset(&mut self);

    /// Removes the open interval between `lo` and `hi`; pieces below [`MIN_LENGTH`] go with it.
    /// Nothing happens unless `lo < hi`.
    fn clip(&mut self, lo: f64, hi: f64);

    /// Whether nothing is visible.
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
