//! [`VisibleLines`], the result of visibility queries with lines: the visible intervals of each
//! line sample of a shading point.

use linelit_geometry::intervals::{Interval, VisibleSet};

/// The visible intervals of several lines, in one reusable buffer.
///
/// Interval ends are parameters of the line, 0 at its first end and 1 at its second; a line's
/// intervals are disjoint and ascend.
#[derive(Clone, Debug, Default)]
pub struct VisibleLines {
    /// The visible intervals of all lines; the first `filled` entries are in use.
    intervals: Vec<Interval>,
    filled: usize,
    /// For each line, the range of its intervals in `intervals`.
    spans: Vec<(usize, usize)>,
}

impl VisibleLines {
    /// Creates a set without lines.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of lines.
    #[must_use]
    pub fn len(&self) -> usize {
        self.spans.len()
    }

    /// Whether there are no lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// Returns the visible intervals of line `i`: an empty slice if the line is hidden or does not
    /// exist.
    #[inline]
    #[must_use]
    pub fn line(&self, i: usize) -> &[Interval] {
        self.spans
            .get(i)
            .map_or(&[], |&(start, end)| &self.intervals[start..end])
    }

    /// Returns the visible fraction of line `i`, between 0 and 1.
    #[inline]
    #[must_use]
    pub fn fraction(&self, i: usize) -> f64 {
        self.line(i).iter().map(Interval::length).sum()
    }

    /// The total number of intervals over all lines.
    #[must_use]
    pub fn interval_count(&self) -> usize {
        self.filled
    }

    /// Removes all lines.
    pub fn clear(&mut self) {
        self.reset(0);
    }

    /// Appends the lines of another set, with their intervals.
    pub fn append(&mut self, other: &Self) {
        for line in 0..other.len() {
            self.spans.push((self.filled, self.filled));
            let parts = other.line(line).iter().map(|p| (p.lo, p.hi, true));
            self.put(self.spans.len() - 1, parts);
        }
    }

    /// Starts over with `count` lines, all of them hidden.
    pub(crate) fn reset(&mut self, count: usize) {
        self.filled = 0;
        self.spans.clear();
        self.spans.resize(count, (0, 0));
    }

    /// Sets the visible intervals of a line. The iterator yields, for each candidate interval, its
    /// lower end, its upper end, and whether it is to be stored.
    #[inline(always)]
    pub(crate) fn put(
        &mut self,
        line: usize,
        intervals: impl ExactSizeIterator<Item = (f64, f64, bool)>,
    ) {
        let start = self.filled;
        if self.intervals.len() < start + intervals.len() {
            self.grow(start + intervals.len());
        }
        let mut end = start;
        // Without a branch: an interval that is not to be stored is overwritten by the next.
        for (lo, hi, counts) in intervals {
            self.intervals[end] = Interval { lo, hi };
            end += usize::from(counts);
        }
        self.filled = end;
        self.spans[line] = (start, end);
    }

    #[cold]
    fn grow(&mut self, least: usize) {
        self.intervals.resize(2 * least + 16, Interval::UNIT);
    }

    /// Makes those lines wholly visible for which `counts` is true; all lines must be hidden
    /// before, as [`VisibleLines::reset`] leaves them.
    #[inline]
    pub(crate) fn put_all_whole(&mut self, counts: impl Iterator<Item = bool>) {
        let most = self.spans.len();
        if self.intervals.len() < most {
            self.grow(most);
        }
        self.intervals[..most].fill(Interval::UNIT);
        let mut end = 0;
        for (span, counts) in self.spans.iter_mut().zip(counts) {
            let start = end;
            end += usize::from(counts);
            *span = (start, end);
        }
        self.filled = end;
    }

    /// Sets the visible intervals of a line.
    pub(crate) fn put_set(&mut self, line: usize, set: &impl VisibleSet) {
        let start = self.filled;
        if self.intervals.len() < start + set.count() {
            self.grow(start + set.count());
        }
        set.for_each(|part| {
            self.intervals[self.filled] = part;
            self.filled += 1;
        });
        self.spans[line] = (start, self.filled);
    }

    /// Makes a line visible as a whole.
    pub(crate) fn put_whole(&mut self, line: usize) {
        self.put(line, std::iter::once((0.0, 1.0, true)));
    }
}
