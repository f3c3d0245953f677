//! One sample per stratum: jittered, multi-jittered and uniformly jittered patterns, for any number of samples.

use crate::cells::Cells;
use crate::hash::{below_one, lane, unit_f64, word};
use crate::permute::Permutation;

/// Lanes of a key for the jitter of the two axes, for rows, for columns, and for the order of uniform jitter; lanes below
/// 2³² belong to the key's permutation.
const JITTER: [u64; 2] = [1 << 32, (1 << 32) + 1];
const ROWS: u64 = (1 << 32) + 2;
const COLUMNS: [u64; 2] = [(1 << 32) + 3, (1 << 32) + 4];
const ORDER: u64 = (1 << 32) + 5;

/// One jittered sample in each of N strata (1-D) or N equal cells (2-D), in random order.
///
/// **Formula.** 1-D: (π(i) + ξᵢ)/N. 2-D: cell π(i) of [`Cells`] with an independent uniform point inside.
/// Cook 1986, *Stochastic sampling in computer graphics*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stratified {
    order: Permutation,
    cells: Cells,
    jitter: [u64; 2],
}

impl Stratified {
    #[inline]
    pub(crate) fn new(key: u64, count: u32) -> Self {
        Self {
            order: Permutation::new(count, key),
            cells: Cells::new(count),
            jitter: JITTER.map(|axis| lane(key, axis)),
        }
    }

    #[inline]
    fn offset(&self, axis: usize, i: u32) -> f64 {
        unit_f64(word(self.jitter[axis], u64::from(i)))
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        stratum(self.order.get(i), self.offset(0, i), self.cells.count())
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        in_cell(
            &self.cells,
            self.order.get(i),
            [self.offset(0, i), self.offset(1, i)],
        )
    }
}

/// Correlated multi-jittered samples: one per cell *and* one per stratum of each axis.
///
/// **Formula.** In row r with n_r cells, column c: x = (c + (σ(r) + ξ)/a)/n_r, y = (C_r + τ(c) + ζ)/N, with one
/// permutation σ of the a rows for all columns and one τ of the columns for all rows of that size. Kensler 2013,
/// *Correlated Multi-Jittered Sampling*, section 3, to which it reduces when the cells form a grid. Where they do not
/// (Kensler then leaves cells of a larger grid empty), all N cells still hold one sample and y still has one sample
/// in each of N strata; x has a + 1 samples at most in a stratum of width a/N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MultiJitter {
    base: Stratified,
    rows: Permutation,
    /// For rows of ⌊N/a⌋ and of ⌊N/a⌋ + 1 cells.
    columns: [Permutation; 2],
}

impl MultiJitter {
    #[inline]
    pub(crate) fn new(key: u64, count: u32) -> Self {
        let base = Stratified::new(key, count);
        let rows = base.cells.rows();
        let short = count / rows;
        let first = Permutation::new(short, lane(key, COLUMNS[0]));
        let second = if count.is_multiple_of(rows) {
            first
        } else {
            Permutation::new(short + 1, lane(key, COLUMNS[1]))
        };
        Self {
            base,
            rows: Permutation::new(rows, lane(key, ROWS)),
            columns: [first, second],
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.base.get_1d(i)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let Stratified { order, cells, .. } = &self.base;
        let cell = cells.cell(order.get(i));
        let short = cells.count() / cells.rows();
        let column = self.columns[usize::from(cell.columns != short)].get(cell.column);
        let across =
            (f64::from(self.rows.get(cell.row)) + self.base.offset(0, i)) / f64::from(cells.rows());
        [
            below_one((f64::from(cell.column) + below_one(across)) / f64::from(cell.columns)),
            stratum(cell.first + column, self.base.offset(1, i), cells.count()),
        ]
    }
}

/// The same random offset in every stratum or cell.
///
/// **Formula.** 1-D: (ξ + π(k))/N with one ξ for all k; the set is that of Ramamoorthi et al. 2012, *A theory of
/// Monte Carlo visibility sampling*, recommended for linear lights by Peters 2021, section 5.3; the order π is random
/// so that several dimensions pair up independently. 2-D: one (ξ, ζ) in each of the N equal cells of [`Cells`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UniformJitter {
    order: Permutation,
    cells: Cells,
    offset: [f64; 2],
}

impl UniformJitter {
    #[inline]
    pub(crate) fn new(key: u64, count: u32) -> Self {
        Self::with_offset(key, count, [unit_f64(word(key, 0)), unit_f64(word(key, 1))])
    }

    /// With a given offset in [0, 1)², for example from a blue-noise tile.
    #[inline]
    pub(crate) fn with_offset(key: u64, count: u32, offset: [f64; 2]) -> Self {
        Self {
            order: Permutation::new(count, lane(key, ORDER)),
            cells: Cells::new(count),
            offset,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        stratum(self.order.get(i), self.offset[0], self.cells.count())
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        in_cell(&self.cells, self.order.get(i), self.offset)
    }
}

/// (k + offset)/count, below one.
#[inline]
fn stratum(k: u32, offset: f64, count: u32) -> f64 {
    below_one((f64::from(k) + offset) / f64::from(count))
}

/// The point of cell `k` at `offset` of the cell's width and height.
#[inline]
fn in_cell(cells: &Cells, k: u32, offset: [f64; 2]) -> [f64; 2] {
    let cell = cells.cell(k);
    let columns = f64::from(cell.columns);
    [
        below_one((f64::from(cell.column) + offset[0]) / columns),
        below_one((f64::from(cell.first) + columns * offset[1]) / f64::from(cells.count())),
    ]
}
