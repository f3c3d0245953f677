//! This module holds blocks of a pattern: the parts that several users take of one larger set of
//! samples.

use crate::cells::Cells;
use crate::hash::{lane, word};
use crate::sobol::sobol_02;
use crate::stratified::{in_cell, in_grid};

/// One of several blocks of samples, of equal size, that together are one pattern. An example is
/// the light samples of each camera sample of a pixel.
///
/// [`Sampler::block`](crate::Sampler::block) returns the samples of a block. Each block is a
/// pattern by itself, as good as a pattern of its size. So are all blocks together, and any run of
/// blocks with consecutive numbers.
///
/// If a block makes one choice for all of its samples, by a random number of its own
/// ([`Block::spread`]), the choices divide the blocks into groups. [`Block::among`] returns a
/// block's index within its group.
///
/// ```
/// use linelit_samplers::{Block, Sampler, SamplerKind};
/// let sampler = Sampler::new(SamplerKind::Stratified, 1);
/// let mut all: Vec<f64> = Vec::new();
/// for index in 0..8 {
///     let block = sampler.block([0, 0], 0, 4, Block::new(index, 8));
///     all.extend(block.iter_1d());
/// }
/// all.sort_by(f64::total_cmp);
/// assert!(all.iter().zip(0..).all(|(x, k)| (32.0 * x).floor() as i32 == k));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    index: u32,
    of: u32,
}

/// The golden ratio minus one. Any run of consecutive multiples of this number, modulo one, is
/// spread over [0, 1) as uniformly as possible.
const GOLDEN_TURN: f64 = 0.618_033_988_749_894_9;

/// The lanes of a key for the parts of strata and for blocks; lanes below 2³³ belong to patterns.
const PARTS: u64 = 1 << 33;
const BLOCKS: u64 = 1 << 34;

impl Block {
    /// The only block of a pattern.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// Makes block `index` of `of` blocks. `of` = 0 counts as 1, and the index is taken modulo
    /// `of`.
    #[must_use]
    pub const fn new(index: u32, of: u32) -> Self {
        let of = if of == 0 { 1 } else { of };
        let index = if index < of { index } else { index % of };
        Self { index, of }
    }

    /// Returns the index of this block, below [`of`](Self::of).
    #[must_use]
    pub const fn index(&self) -> u32 {
        self.index
    }

    /// Returns the number of blocks.
    #[must_use]
    pub const fn of(&self) -> u32 {
        self.of
    }

    /// Returns u + index/of, modulo one: a number by which this block can make a choice for all of
    /// its samples. Over all blocks these numbers are equally spaced; `u` in [0, 1) is the same for
    /// all of them.
    ///
    /// ```
    /// use linelit_samplers::Block;
    /// assert_eq!(Block::new(3, 4).spread(0.5), 0.25);
    /// ```
    #[must_use]
    pub fn spread(&self, u: f64) -> f64 {
        (u + f64::from(self.index) / f64::from(self.of)).fract()
    }

    /// Returns this block's index in its group. The block has the [number](Block::spread) `v`, and
    /// two marks in [0, 1] divide the blocks into the group whose numbers lie between the marks and
    /// the group of the others.
    ///
    /// ```
    /// use linelit_samplers::Block;
    /// // The numbers are .05, .15 and so on; those from .3 to .7 belong to blocks 3 to 6.
    /// let among = |i| Block::new(i, 10).among((f64::from(i) + 0.5) / 10.0, [0.7, 0.3]);
    /// assert_eq!(among(4), Block::new(1, 4));
    /// assert_eq!([among(9), among(0)], [Block::new(2, 6), Block::new(3, 6)]);
    /// ```
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole numbers from 0 to the number of blocks"
    )]
    pub fn among(&self, v: f64, marks: [f64; 2]) -> Self {
        if self.is_whole() {
            return *self;
        }
        let of = f64::from(self.of);
        // The numbers are whole ones plus one common fraction, over `of`: order the blocks by them.
        let own = (v * of).floor();
        let first_from = |mark: f64| (mark * of - (v * of - own)).ceil().clamp(0.0, of);
        let [low, high] = [marks[0].min(marks[1]), marks[0].max(marks[1])].map(first_from);
        let (first, len) = if (low..high).contains(&own) {
            (low, high - low)
        } else {
            (high, of - (high - low))
        };
        let place = if own < first { own + of } else { own } - first;
        Self::new(place as u32, len as u32)
    }

    /// Returns the block with its index in another order, in which any run of indices is spread
    /// evenly over all blocks. Choices by it are not correlated with choices by the plain order.
    #[must_use]
    pub fn interleaved(&self) -> Self {
        Self {
            index: times(self.index, step(self.of), self.of),
            ..*self
        }
    }

    /// Whether this is the only block.
    #[inline]
    pub(crate) const fn is_whole(&self) -> bool {
        self.of == 1
    }

    /// Returns the keys of a pattern and of this block of it, from the key of a stream. Blocks of
    /// another `size` or number belong to another pattern.
    #[inline]
    pub(crate) const fn keys(&self, key: u64, size: u32) -> [u64; 2] {
        if self.is_whole() {
            return [key; 2];
        }
        let key = lane(key, (self.of as u64) << 32 | size as u64);
        [key, lane(key, BLOCKS + self.index as u64)]
    }
}

/// The part that a block takes of each stratum or cell of its pattern. A stratum or cell has as
/// many equal parts as there are blocks.
///
/// Blocks take parts in an order in which any run is spread evenly over a stratum or a cell: the
/// order of a (0,2)-sequence if the number of blocks is a power of two, and the order of
/// [`Block::interleaved`] otherwise. Each stratum adds a random shift, so that the part of a block
/// in one stratum is independent of its part in another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Parts {
    /// The division of a cell into parts.
    cells: Cells,
    key: u64,
    /// The part of a stratum, and of a cell, before the random shift.
    places: [u32; 2],
}

impl Parts {
    /// Makes the parts from the key of the pattern.
    #[inline]
    pub(crate) fn new(key: u64, block: Block) -> Self {
        if block.is_whole() {
            return Self {
                cells: Cells::ONE,
                key: 0,
                places: [0; 2],
            };
        }
        let cells = Cells::new(block.of);
        let places = if block.of.is_power_of_two() {
            let digits = |fraction: u32, parts: u32| scaled(fraction, parts, 1 << 32);
            let [x, y] = sobol_02(block.index);
            let [column, row] = [digits(x, cells.columns), digits(y, cells.rows)];
            [digits(x, block.of), row * cells.columns + column]
        } else {
            [block.interleaved().index; 2]
        };
        Self {
            cells,
            key: lane(key, PARTS),
            places,
        }
    }

    /// Whether there is only one part.
    #[inline]
    pub(crate) const fn is_whole(&self) -> bool {
        self.of() == 1
    }

    /// Returns the number of parts.
    #[inline]
    pub(crate) const fn of(&self) -> u32 {
        self.cells.count
    }

    /// Returns the division of a cell into parts.
    #[inline]
    pub(crate) const fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Returns the `k`-th random number of the pattern, below the number of parts.
    #[inline(always)]
    pub(crate) const fn random(&self, k: u64) -> u32 {
        scaled((word(self.key, k) >> 32) as u32, self.of(), 1 << 32)
    }

    /// Returns the part of stratum `k` or, with `axes` = 2, of cell `k`.
    #[inline(always)]
    pub(crate) const fn part(&self, axes: usize, k: u64) -> u32 {
        let (place, random) = (self.places[axes - 1], self.random(k));
        if self.of().is_power_of_two() {
            place ^ random
        } else {
            plus(place, random, self.of())
        }
    }

    /// Returns the block's position in stratum `k`, relative to its length, from the position in
    /// its part.
    #[inline]
    pub(crate) fn along(&self, k: u32, offset: f64) -> f64 {
        if self.is_whole() {
            return offset;
        }
        (f64::from(self.part(1, u64::from(k))) + offset) / f64::from(self.of())
    }

    /// Returns the block's position in cell `k`, relative to its size, from the position in its
    /// part.
    ///
    /// Cells are at least as high as wide, and so are the parts into which the unit square would be
    /// divided. Therefore a cell is divided along the other axis.
    #[inline]
    pub(crate) fn within(&self, k: u32, [x, y]: [f64; 2]) -> [f64; 2] {
        if self.is_whole() {
            return [x, y];
        }
        if self.cells.is_grid() {
            return self.within_grid(k, [x, y]);
        }
        let [y, x] = in_cell(&self.cells, self.part(2, u64::from(k)), [y, x]);
        [x, y]
    }

    /// Returns the position within a cell whose parts form a grid.
    #[inline(always)]
    pub(crate) fn within_grid(&self, k: u32, [x, y]: [f64; 2]) -> [f64; 2] {
        let part = self.part(2, u64::from(k));
        let [y, x] = in_grid(&self.cells, f64::from(part), [y, x]);
        [x, y]
    }

    /// Returns a random bit for stratum `k`.
    #[inline]
    pub(crate) const fn is_either(&self, k: u64) -> bool {
        word(self.key, 1 << 33 | k) >> 63 == 1
    }
}

/// Returns ⌊ab/n⌋ for a below n.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "below b")]
pub(crate) const fn scaled(a: u32, b: u32, n: u64) -> u32 {
    (a as u64 * b as u64 / n) as u32
}

/// Returns the product of two numbers modulo n.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "less than n")]
pub(crate) const fn times(a: u32, b: u32, n: u32) -> u32 {
    (a as u64 * b as u64 % n as u64) as u32
}

/// Returns the sum of two numbers below n, modulo n.
#[inline(always)]
pub(crate) const fn plus(a: u32, b: u32, n: u32) -> u32 {
    let room = n - b;
    if a < room { a + b } else { a - room }
}

/// Returns the largest number, up to n over the golden ratio (rounded), that has no common divisor
/// with n, so that its multiples modulo n are all numbers below n.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a part of n"
)]
pub(crate) fn step(n: u32) -> u32 {
    let mut step = ((f64::from(n) * GOLDEN_TURN).round() as u32).max(1);
    while gcd(step, n) > 1 {
        step -= 1;
    }
    step
}

/// Returns the greatest common divisor (Euclid).
pub(crate) const fn gcd(mut a: u32, mut b: u32) -> u32 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_have_no_divisor_in_common() {
        for n in (1..2000).chain([1 << 16, 30_030, u32::MAX]) {
            assert!(step(n) <= n && gcd(step(n), n) == 1, "{n}: {}", step(n));
        }
        assert_eq!([1, 5, 64, 60].map(step), [1, 3, 39, 37]);
    }
}
