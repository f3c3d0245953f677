//! Bins along the lines of a walk through a dense shaft: a coarse record of what is surely hidden,
//! which lets the walk skip boxes.
//!
//! Each line has 64 bins, one bit each in a `u64`. A bin is closed once it is known to be hidden as
//! a whole. The *image* of a box or triangle is its projection from the shading point onto the
//! light's plane. A box or triangle matters to a line if its image extends to both sides of the
//! line and touches an open bin:
//!
//! ```text
//!     line    |####|####|    |  ##|####|      # hidden
//!     open      0    0    1    1    0         a bit per bin
//!     image          [------)                 touches an open bin: needed
//! ```

use crate::{
    lanes::Lanes,
    shaft::{
        block::Lines,
        cover::{self, ImageBounds},
        merge::Slots,
    },
};
use linelit_simd::Simd;

/// The largest number of lines that share a walk.
pub(crate) const GROUP: usize = 8;

/// The number of intervals that a line gains before its intervals are merged, so that bins record
/// what several intervals hide together; see `docs/decisions/010-dense-shafts.md`.
const CROWDED: usize = 9;

/// The number of blocks of eight lines in a walk.
pub(crate) const BLOCKS: usize = GROUP / 8;

/// The projection of a box or triangle onto the light, for the bins: its bounds across the lines,
/// and a bit for each bin that it touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Image {
    low: f32,
    high: f32,
    bins: u64,
}

/// The projections of eight boxes or triangles.
#[derive(Default)]
pub(crate) struct Images {
    low: Lanes<[f32; 8]>,
    high: Lanes<[f32; 8]>,
    bins: Lanes<[u64; 8]>,
}

impl cover::Image for Image {
    type Eight = Images;

    const ALL: Self = Self {
        low: f32::NEG_INFINITY,
        high: f32::INFINITY,
        bins: u64::MAX,
    };

    #[inline(always)]
    fn eight<S: Simd>(s: S, [low, high]: ImageBounds<S>) -> Images {
        // Adding 2²³ rounds to an integer. After half a bin is subtracted, the result is the floor,
        // or one less for a number that is an integer already: never too high.
        let (zero, end) = (s.splat(0.0), s.splat(63.0));
        let half = s.splat(-0.5);
        let base = s.splat(8_388_608.0);
        let first = s.fma(low[1], s.splat(64.0), half);
        let first = s.min(s.max(first, zero), end) + base;
        let last = s.fma(high[1], s.splat(64.0), half);
        let last = s.min(s.max(last, zero), end) + base;
        let mut images = Images::default();
        s.store(low[0], &mut images.low);
        s.store(high[0], &mut images.high);
        s.bin_masks(first, last, &mut images.bins);
        images
    }

    #[inline(always)]
    fn of(images: &Images, lane: usize) -> Self {
        Self {
            low: images.low[lane],
            high: images.high[lane],
            bins: images.bins[lane],
        }
    }
}

/// The bins of all lines of a walk.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(crate) struct Covered {
    /// For each line, a bit for each bin that is not known to be hidden.
    open: [[u64; 8]; BLOCKS],
    /// The coordinates of the lines across their direction, rounded down and up.
    low: [[f32; 8]; BLOCKS],
    high: [[f32; 8]; BLOCKS],
    /// For each line, how many of its stored intervals are recorded in the bins.
    recorded: [[u32; 8]; BLOCKS],
    /// For each block, the number of intervals of a line at which the intervals of the block are
    /// merged next.
    crowded: [usize; BLOCKS],
    /// The number of blocks in use.
    blocks: usize,
}

impl Covered {
    /// Starts a walk: only what lies beyond the lines' ends is hidden.
    #[allow(clippy::cast_possible_truncation, reason = "rounded outward")]
    #[inline(always)]
    pub(crate) fn start<S: Simd>(&mut self, s: S, lines: &Lines) {
        self.blocks = lines.blocks.len();
        self.open = [[0; 8]; BLOCKS];
        self.recorded = [[0; 8]; BLOCKS];
        self.crowded = [CROWDED; BLOCKS];
        self.low = [[f32::INFINITY; 8]; BLOCKS];
        self.high = [[f32::NEG_INFINITY; 8]; BLOCKS];
        for line in 0..lines.count.min(GROUP) {
            let (k, lane) = (line / 8, line % 8);
            let block = &lines.blocks[k];
            // The coordinate across is −p.
            let p = -block.u[lane];
            self.low[k][lane] = (p as f32).next_down();
            self.high[k][lane] = (p as f32).next_up();
            self.open[k][lane] = u64::MAX;
        }
        for (k, block) in lines.blocks.iter().enumerate().take(BLOCKS) {
            self.hide(s, k, [s.dsplat(-1.0), s.dload(&block.from)]);
            self.hide(s, k, [s.dload(&block.to), s.dsplat(2.0)]);
        }
    }

    /// Whether a box or triangle with this projection can hide anything that is not hidden yet.
    #[inline(always)]
    pub(crate) fn needs<S: Simd>(&self, s: S, image: &Image) -> bool {
        let mut needed = 0;
        for k in 0..self.blocks.min(BLOCKS) {
            needed |= s.le(s.splat(image.low), s.load(&self.high[k]))
                & s.le(s.load(&self.low[k]), s.splat(image.high))
                & s.intersects(&self.open[k], image.bins);
        }
        needed != 0
    }

    /// Computes [`Covered::needs`] for eight projections, and returns a bit for each.
    #[inline(always)]
    pub(crate) fn needs_any<S: Simd>(&self, s: S, images: &Images) -> u8 {
        let (low, high) = (s.load(&images.low), s.load(&images.high));
        let mut needed = 0;
        for k in 0..self.blocks.min(BLOCKS) {
            for line in 0..8 {
                needed |= s.le(low, s.splat(self.high[k][line]))
                    & s.le(s.splat(self.low[k][line]), high)
                    & s.intersects(&images.bins, self.open[k][line]);
            }
        }
        needed
    }

    /// Records in the bins the intervals of the lines that are not recorded yet; returns true if
    /// all lines are hidden as a whole.
    #[inline(always)]
    pub(crate) fn record<S: Simd>(&mut self, s: S, lines: &mut Lines, slots: &mut Slots) -> bool {
        let mut open = 0;
        for (k, block) in lines.blocks.iter_mut().enumerate().take(BLOCKS) {
            // Merge the intervals of crowded lines; all of them are recorded anew then.
            if slots.most(k) >= self.crowded[k] {
                slots.unite(s, k, block);
                self.recorded[k] = [0; 8];
                self.crowded[k] = slots.most(k) + CROWDED;
            }
            // Close bins in the latest run of intervals and in all new ones.
            self.hide(s, k, [s.dload(&block.run_lo), s.dload(&block.run_hi)]);
            let counts = slots.counts(k);
            let (mut first, mut end) = (u32::MAX, 0);
            for (recorded, count) in self.recorded[k].iter().zip(counts) {
                if recorded < count {
                    (first, end) = (first.min(*recorded), end.max(*count));
                }
            }
            for row in first..end {
                self.hide(s, k, slots.row(s, k, row));
            }
            self.recorded[k] = *counts;
            for bins in &self.open[k] {
                open |= bins;
            }
        }
        open == 0
    }

    /// For each line of a block, closes the bins that lie wholly inside its interval from `low` to
    /// `high`.
    #[inline(always)]
    fn hide<S: Simd>(&mut self, s: S, k: usize, [low, high]: [S::D; 2]) {
        // Adding 2⁵² rounds to an integer; after moving half a bin inward, bins are never closed
        // too early.
        let (zero, end) = (s.dsplat(0.0), s.dsplat(64.0));
        let (half, one) = (s.dsplat(0.5), s.dsplat(1.0));
        let base = s.dsplat(4_503_599_627_370_496.0);
        let first = low * end + half;
        let first = s.dmin(s.dmax(first, zero), end) + base;
        let last = high * end - half;
        let last = s.dmin(s.dmax(last, zero), end) + base;
        // From the first bin to the one before the last; an inverted range makes an empty mask.
        let some = s.dlt(first, last);
        let first = s.select(some, one, first - base);
        let last = s.select(some, zero, last - base - one);
        let base = s.dsplat(8_388_608.0);
        let mut bins = Lanes([0; 8]);
        let (first, last) = (first + base, last + base);
        s.bin_masks(s.narrow(first), s.narrow(last), &mut bins);
        for (open, bins) in self.open[k].iter_mut().zip(&bins.0) {
            *open &= !bins;
        }
    }
}
