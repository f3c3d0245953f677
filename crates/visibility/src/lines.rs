//! The visible parts of a shading point's line samples.

use linelit_geometry::intervals::Interval;

/// The visible intervals of several lines, in one reusable buffer.
///
/// Interval ends are parameters of the line, 0 at its first end and 1 at its second; a line's
/// intervals are disjoint and ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VisibleLines {
    intervals: Vec<Interval>,
    /// Where each line's intervals end.
    ends: Vec<usize>,
}

impl VisibleLines {
    /// No lines.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of lines.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are no lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The visible intervals of line `i`; none if it is hidden or there is no such line.
    #[must_use]
    pub fn line(&self, i: usize) -> &[Interval] {
        let Some(&end) = self.ends.get(i) else {
            return &[];
        };
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.intervals[start..end]
    }

    /// The visible fraction of line `i`.
    #[must_use]
    pub fn fraction(&self, i: usize) -> f64 {
        self.line(i).iter().map(Interval::length).sum()
    }

    /// The number of intervals of all lines.
    #[must_use]
    pub fn interval_count(&self) -> usize {
        self.intervals.len()
    }

    pub(crate) fn clear(&mut self) {
        self.intervals.clear();
        self.ends.clear();
    }

    /// Adds an interval to the line that is being filled.
    #[inline]
    pub(crate) fn push(&mut self, interval: Interval) {
        self.intervals.push(interval);
    }

    /// Adds a line that is visible as a whole.
    #[inline]
    pub(crate) fn push_whole(&mut self) {
        self.intervals.push(Interval::UNIT);
        self.finish_line();
    }

    /// Ends the line that is being filled.
    #[inline]
    pub(crate) fn finish_line(&mut self) {
        self.ends.push(self.intervals.len());
    }
}
