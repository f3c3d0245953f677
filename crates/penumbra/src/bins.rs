//! A search structure for boxes: which of many boxes may overlap a given box. Sets of boxes are
//! stored as bit sets, one bit for each box.

use super::orient::Point;

/// The number of bins along each axis if there are at most [`MANY`] boxes.
const BINS: usize = 16;

/// The number of boxes from which on there are four times as many bins.
const MANY: usize = 256;

/// The number of boxes up to which a query returns all of them and no bins are filled, since
/// filling bins takes longer than it saves.
const FEW: usize = 20;

/// A rectangle parallel to the axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: Point,
    pub high: Point,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::NONE
    }
}

impl Bounds {
    /// The empty rectangle.
    pub(super) const NONE: Self = Self {
        low: [f64::INFINITY; 2],
        high: [f64::NEG_INFINITY; 2],
    };

    #[inline]
    pub(super) fn is_within(&self, other: &Self) -> bool {
        (other.low[0] <= self.low[0])
            & (other.low[1] <= self.low[1])
            & (self.high[0] <= other.high[0])
            & (self.high[1] <= other.high[1])
    }

    #[inline]
    pub(super) fn of<const N: usize>(points: [Point; N]) -> Self {
        Self::of_all(&points)
    }

    /// The bounding box of some points.
    #[inline]
    pub(super) fn of_all(points: &[Point]) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for p in points {
            for k in 0..2 {
                // One instruction each, unlike `min` and `max`; NaN is ignored, as by these.
                low[k] = if p[k] < low[k] { p[k] } else { low[k] };
                high[k] = if p[k] > high[k] { p[k] } else { high[k] };
            }
        }
        Self { low, high }
    }

    /// Returns the rectangle enlarged by `room` on each side.
    #[inline]
    pub(super) fn wider(&self, room: f64) -> Self {
        let Self { low, high } = self;
        Self {
            low: [low[0] - room, low[1] - room],
            high: [high[0] + room, high[1] + room],
        }
    }

    #[inline]
    pub(super) fn meets(&self, other: &Self) -> bool {
        // Without branches, since which of the four fails is hard to predict.
        (self.low[0] <= other.high[0])
            & (other.low[0] <= self.high[0])
            & (self.low[1] <= other.high[1])
            & (other.low[1] <= self.high[1])
    }
}

/// Boxes sorted into bins by their ends: for each axis and bin, the set of the boxes that start in
/// that bin or before, and the set of those that end in it or after. The boxes that overlap another
/// are in all four of the sets at that box's ends.
///
/// The bin is a monotone function of the coordinate, so that no overlapping box is missed.
#[derive(Debug, Default)]
pub(super) struct Bins {
    words: usize,
    /// The number of boxes; if there are few, there are no sets.
    few: usize,
    /// The number of bins along each axis, a power of two.
    bins: usize,
    low: Point,
    scale: Point,
    /// The bit sets, each of `words` words, one for each bin: first of starts along x, then of ends
    /// along x, of starts along y, and of ends along y.
    sets: Vec<u64>,
}

/// The four bit sets whose intersection has the boxes that may overlap one box; or, if there are
/// few boxes, the set of all.
#[derive(Clone, Copy, Debug)]
struct Query<'a> {
    sets: [&'a [u64]; 4],
    few: u64,
}

impl Bins {
    /// Sorts boxes into bins over `area`; boxes with ends outside of the area go to the outermost
    /// bins.
    pub(super) fn fill(&mut self, area: &Bounds, boxes: impl ExactSizeIterator<Item = Bounds>) {
        self.few = boxes.len();
        self.words = 0;
        if self.few <= FEW {
            return;
        }
        // Choose the number of bins, and the scale from coordinates to bins.
        self.words = self.few.div_ceil(64);
        self.low = area.low;
        self.bins = if self.few < MANY { BINS } else { 4 * BINS };
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let scale =
            |k: usize| (self.bins - 1) as f64 / (area.high[k] - area.low[k]).max(f64::MIN_POSITIVE);
        self.scale = [scale(0), scale(1)];
        self.sets.clear();
        self.sets.resize(4 * self.bins * self.words, 0);
        // Enter each box at its start and at its end on each axis.
        for (i, b) in boxes.enumerate() {
            let (word, bit) = (i / 64, 1 << (i % 64));
            for row in self.rows(&b.low, &b.high) {
                self.sets[row * self.words + word] |= bit;
            }
        }
        // Accumulate the sets: starts upwards, ends downwards.
        let size = self.bins * self.words;
        for axis in self.sets.chunks_exact_mut(2 * size) {
            let (starts, ends) = axis.split_at_mut(size);
            for i in self.words..size {
                starts[i] |= starts[i - self.words];
            }
            for i in (0..size - self.words).rev() {
                ends[i] |= ends[i + self.words];
            }
        }
    }

    /// Returns the indices, from `first` on, of the boxes that may overlap the box `b`, in
    /// ascending order.
    #[inline]
    pub(super) fn near(&self, b: &Bounds, first: usize) -> impl Iterator<Item = usize> {
        let query = if self.words == 0 {
            let sets = [&[][..]; 4];
            let few = (1 << self.few) - 1;
            Query { sets, few }
        } else {
            self.query(b)
        };
        query.from(first)
    }

    #[inline(never)]
    fn query(&self, b: &Bounds) -> Query<'_> {
        // Select boxes that start before the end of `b`, and end after its start.
        let rows = self.rows(&b.high, &b.low);
        let sets = rows.map(|row| &self.sets[row * self.words..(row + 1) * self.words]);
        Query { sets, few: 0 }
    }

    /// Returns the indices of four bit sets: for starts along x, ends along x, starts along y, ends
    /// along y.
    #[inline]
    fn rows(&self, start: &Point, end: &Point) -> [usize; 4] {
        // Adding 2⁵² rounds to an integer: monotone, and NaN goes to the last bin.
        let bins = self.bins;
        #[allow(clippy::cast_precision_loss, reason = "a small number")]
        let most = (bins - 1) as f64;
        let bin = |p: &Point, k: usize| {
            let place = ((p[k] - self.low[k]) * self.scale[k]).min(most).max(0.0);
            #[allow(clippy::cast_possible_truncation, reason = "less than that many")]
            let bin = ((place + 4_503_599_627_370_496.0).to_bits() & (bins as u64 - 1)) as usize;
            bin
        };
        [
            bin(start, 0),
            bins + bin(end, 0),
            2 * bins + bin(start, 1),
            3 * bins + bin(end, 1),
        ]
    }
}

impl Query<'_> {
    /// Returns the indices that are in all four sets, from `first` on.
    #[inline]
    fn from(self, first: usize) -> impl Iterator<Item = usize> {
        let [a, b, c, d] = self.sets;
        let words = a.len();
        let word = move |w: usize| a[w] & b[w] & c[w] & d[w];
        let mut w = first / 64;
        let mut bits = u64::MAX << (first % 64);
        bits &= match w {
            _ if w < words => word(w),
            0 => self.few,
            _ => 0,
        };
        std::iter::from_fn(move || {
            while bits == 0 {
                w += 1;
                if w >= words {
                    return None;
                }
                bits = word(w);
            }
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            Some(64 * w + bit)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_box_that_meets_is_missed() {
        let mut rng = linelit_testkit::cases::rng(7);
        let area = Bounds {
            low: [0.0, 0.0],
            high: [1.0, 2.0],
        };
        let mut bins = Bins::default();
        for count in [0usize, 1, FEW, FEW + 1, 63, 64, 65, 200, MANY, 700] {
            let mut any = || {
                let (x, y) = (rng.in_range(-1.0, 2.0), rng.in_range(-1.0, 3.0));
                let (w, h) = (rng.in_range(0.0, 0.5), rng.in_range(0.0, 0.5));
                Bounds::of([[x, y], [x + w, y + h]])
            };
            let boxes: Vec<Bounds> = (0..count).map(|_| any()).collect();
            bins.fill(&area, boxes.iter().copied());
            for _ in 0..200 {
                let query = any();
                let found: Vec<usize> = bins.near(&query, 0).collect();
                assert!(found.is_sorted() && found.iter().all(|i| *i < count));
                for (i, b) in boxes.iter().enumerate() {
                    assert!(!b.meets(&query) || found.contains(&i), "{b:?} {query:?}");
                }
                let first = if count > 64 { 70 } else { count / 2 };
                let later: Vec<usize> = bins.near(&query, first).collect();
                assert!(later.iter().eq(found.iter().filter(|i| **i >= first)));
            }
        }
    }
}
