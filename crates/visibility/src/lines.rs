//! The visible parts of a shading point's line samples.

use linelit_geometry::intervals::Interval;

/// The visible intervals of several lines, in one reusable buffer.
///
/// Interval ends are parameters of the line, 0 at its first end and 1 at its second; a line's
/// intervals are disjoint and ascend.
#[derive(Clone, Debug, Default)]
pub struct VisibleLines {
    intervals: Vec<Interval>,
    /// Where each line's intervals start and end.
    spans: Vec<(usize, usize)>,
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
        self.spans.len()
    }

    /// Whether there are no lines.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// The visible intervals of line `i`; none if it is hidden or there is no such line.
    #[must_use]
    pub fn line(&self, i: usize) -> &[Interval] {
        self.spans
            .get(i)
            .map_or(&[], |&(start, end)| &self.intervals[start..end])
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

    /// `count` lines, all hidden so far.
    pub(crate) fn reset(&mut self, count: usize) {
        self.intervals.clear();
        self.spans.clear();
        self.spans.resize(count, (0, 0));
    }

    /// Sets the visible intervals of a line.
    #[inline(always)]
    pub(crate) fn put<I: Iterator<Item = Interval>>(&mut self, line: usize, intervals: &mut I) {
        let start = self.intervals.len();
        for interval in intervals {
            self.intervals.push(interval);
        }
        self.spans[line] = (start, self.intervals.len());
    }

    /// Makes a line visible as a whole.
    pub(crate) fn put_whole(&mut self, line: usize) {
        self.put(line, &mut std::iter::once(Interval::UNIT));
    }
}
