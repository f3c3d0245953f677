//! [`IntervalSet`]: the visible pieces of a line in a sorted list.

use super::{Interval, VisibleSet};
use smallvec::SmallVec;
use std::cmp::Ordering;

/// The visible pieces of a line in a sorted list, up to eight of them without allocation.
///
/// A clip finds its position by bisection and moves the pieces after it: O(log n + n) with a very
/// small constant.
#[derive(Clone, Debug, PartialEq)]
pub struct IntervalSet {
    pieces: SmallVec<[Interval; 8]>,
}

impl IntervalSet {
    /// The visible pieces in ascending order.
    #[inline]
    #[must_use]
    pub fn as_slice(&self) -> &[Interval] {
        &self.pieces
    }
}

impl Default for IntervalSet {
    fn default() -> Self {
        Self::full()
    }
}

impl VisibleSet for IntervalSet {
    fn full() -> Self {
        Self {
            pieces: SmallVec::from_slice(&[Interval::UNIT]),
        }
    }

    fn reset(&mut self) {
        self.pieces.clear();
        self.pieces.push(Interval::UNIT);
    }

    fn clip(&mut self, lo: f64, hi: f64) {
        if lo.partial_cmp(&hi) != Some(Ordering::Less) {
            return;
        }
        // Find the pieces [first, last) that overlap the clipped interval.
        let first = self.pieces.partition_point(|p| p.hi <= lo);
        let last = first + self.pieces[first..].partition_point(|p| p.lo < hi);
        if first == last {
            return;
        }
        // Replace them by the parts that are left of the first and of the last of them.
        let left = Interval::new(self.pieces[first].lo, lo);
        let right = Interval::new(hi, self.pieces[last - 1].hi);
        let keep: SmallVec<[Interval; 2]> = [left, right]
            .into_iter()
            .filter(Interval::is_worth_keeping)
            .collect();
        if keep.len() <= last - first {
            let end = first + keep.len();
            self.pieces[first..end].copy_from_slice(&keep);
            self.pieces.drain(end..last);
        } else {
            self.pieces[first] = left;
            self.pieces.insert(first + 1, right);
        }
    }

    fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    fn count(&self) -> usize {
        self.pieces.len()
    }

    fn for_each(&self, f: impl FnMut(Interval)) {
        self.pieces.iter().copied().for_each(f);
    }
}
