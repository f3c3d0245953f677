//! One sample per stratum: jittered, multi-jittered and uniformly jittered patterns, for any number
//! of samples.

use crate::cells::Cells;
use crate::hash::{GOLDEN, below_one, lane, unit_f64, word};
use crate::permute::Permutation;
use linelit_simd::{Isa, Simd, dispatch};

/// Lanes of a key for the jitter of the two axes, for rows, for columns, and for the order of
/// uniform jitter; lanes below 2³² belong to the key's permutation.
const JITTER: [u64; 2] = [1 << 32, (1 << 32) + 1];
const ROWS: u64 = (1 << 32) + 2;
const COLUMNS: u64 = (1 << 32) + 4;
const ORDER: u64 = (1 << 32) + 7;

/// One jittered sample in each of N strata (1-D) or N equal cells (2-D), in random order.
///
/// **Formula.** 1-D: (π(i) + ξᵢ)/N. 2-D: cell π(i) of [`Cells`] with an independent uniform point
/// inside. Cook 1986, *Stochastic sampling in computer graphics*.
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

impl Stratified {
    /// [`Stratified::get_2d`] of the samples from `first` on, all below the count.
    pub(crate) fn fill_2d(&self, first: u32, x: &mut [f64], y: &mut [f64]) {
        if self.cells.is_grid() {
            for (x, i) in x.iter_mut().zip(first..) {
                *x = f64::from(self.order.get(i));
            }
            into_grid(Isa::best(), self, first, x, y);
        } else {
            for (i, (x, y)) in (first..).zip(x.iter_mut().zip(y)) {
                [*x, *y] = self.get_2d(i);
            }
        }
    }
}

/// Points in the cells of a grid whose numbers `x` holds: [`in_cell`] to the bit, for the quotient
/// that is cut to the row is off by less than what it is away from the next integer, unless it is
/// one.
///
/// A plain loop: compilers make vectors of it.
#[inline(always)]
fn grid_kernel<S: Simd>(_: S, set: &Stratified, first: u32, x: &mut [f64], y: &mut [f64]) {
    let [columns, count] = [set.cells.columns(), set.cells.count()].map(f64::from);
    let (jitter, mut i) = (set.jitter, u64::from(first));
    for (x, y) in x.iter_mut().zip(y) {
        #[expect(clippy::cast_possible_truncation, reason = "that is the row")]
        #[expect(clippy::cast_sign_loss, reason = "cells are not negative")]
        let row = f64::from((*x / columns) as u32);
        let before = row * columns;
        let offset = [unit_f64(word(jitter[0], i)), unit_f64(word(jitter[1], i))];
        *x = below_one(((*x - before) + offset[0]) / columns);
        *y = below_one((before + columns * offset[1]) / count);
        i += 1;
    }
}
dispatch! {
    fn into_grid = grid_kernel(set: &Stratified, first: u32, x: &mut [f64], y: &mut [f64])
}

/// Multi-jittered samples: one per cell *and* one per stratum of each axis.
///
/// **Formula.** In row r with n_r cells, column c: x = (c + (s + ξ)/a)/n_r, y = (C_r + t + ζ)/N
/// with the sub-strata s = (σ(r) + ρ(c)) mod a and t = (τ(c) + κ(r)) mod n_r; σ, κ permute the
/// rows, ρ, τ the columns. Chiu, Shirley & Wang 1994, *Multi-jittered sampling*, with Latin squares
/// in place of independent permutations for each row and column.
///
/// Kensler 2013 (*Correlated Multi-Jittered Sampling*) shares the permutations, s = σ(r) and t =
/// τ(c). Then all cells of a row are shifted alike, and the variance for smooth integrands falls
/// only as N^−1.5 (measured: −1.58 for exp(xy)), less than plain jitter's N⁻². In a Latin square
/// each row and each column holds every shift equally often, which cancels the leading error
/// instead.
///
/// Where the cells do not form a grid (Kensler then leaves cells of a larger grid empty), all N
/// cells still hold one sample and y has one sample in each of N strata; x is stratified within
/// each row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MultiJitter {
    base: Stratified,
    /// σ and κ.
    rows: [Permutation; 2],
    /// ρ, and τ for rows of ⌊N/a⌋ and of ⌊N/a⌋ + 1 cells.
    columns: [Permutation; 3],
}

impl MultiJitter {
    #[inline]
    pub(crate) fn new(key: u64, count: u32) -> Self {
        let base = Stratified::new(key, count);
        let rows = base.cells.rows();
        let short = count / rows;
        let long = if base.cells.is_grid() {
            short
        } else {
            short + 1
        };
        let sizes = [long, short, long];
        Self {
            base,
            rows: [0, 1].map(|k| Permutation::new(rows, lane(key, ROWS + k))),
            columns: [0, 1, 2].map(|k| Permutation::new(sizes[k], lane(key, COLUMNS + k as u64))),
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
        let tall = usize::from(cell.columns == self.columns[2].len());
        let [sigma, kappa] = [0, 1].map(|k| self.rows[k].get(cell.row));
        let [rho, tau] = [0, 1 + tall].map(|k| self.columns[k].get(cell.column));
        let across = (sigma + rho) % cells.rows();
        let up = (tau + kappa) % cell.columns;
        let x = below_one((f64::from(across) + self.base.offset(0, i)) / f64::from(cells.rows()));
        [
            below_one((f64::from(cell.column) + x) / f64::from(cell.columns)),
            stratum(cell.first + up, self.base.offset(1, i), cells.count()),
        ]
    }
}

/// The same random offset in every stratum: a randomly shifted lattice.
///
/// **Formula.** 1-D: (ξ + π(k))/N with one ξ for all k; the set is that of Ramamoorthi et al. 2012,
/// *A theory of Monte Carlo visibility sampling*, recommended for linear lights by Peters 2021,
/// section 5.3; the order π is random so that several dimensions pair up independently. 2-D: ((ξ +
/// j)/N, fract(ζ + j/φ)) with j = π(k) and the golden ratio φ, which is evenly spread for any N.
/// (One offset for all cells of a grid, the obvious generalisation, has only the variance N⁻¹;
/// rank-1 lattices with a generator near N/φ are poor for some N, 1024 among them.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UniformJitter {
    order: Permutation,
    count: u32,
    offset: f64,
    /// ζ in units of 2⁻⁶⁴.
    second: u64,
}

impl UniformJitter {
    #[inline]
    pub(crate) fn new(key: u64, count: u32) -> Self {
        Self::with_offset(key, count, [unit_f64(word(key, 0)), unit_f64(word(key, 1))])
    }

    /// With a given offset in [0, 1)², for example from a blue-noise tile.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the offset is in [0, 1)")]
    pub(crate) fn with_offset(key: u64, count: u32, offset: [f64; 2]) -> Self {
        let second = ((offset[1] * (1_u64 << 53) as f64) as u64) << 11;
        Self {
            order: Permutation::new(count, lane(key, ORDER)),
            count,
            offset: offset[0],
            second,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        stratum(self.order.get(i), self.offset, self.count)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let j = self.order.get(i);
        [
            stratum(j, self.offset, self.count),
            unit_f64(self.second.wrapping_add(u64::from(j).wrapping_mul(GOLDEN))),
        ]
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
