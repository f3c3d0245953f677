//! This module holds patterns with one sample per stratum: jittered, multi-jittered and uniformly
//! jittered patterns, for any number of samples.

use crate::block::{Block, Parts, gcd, plus, scaled, step, times};
use crate::cells::Cells;
use crate::hash::{GOLDEN, below_one, lane, unit_f64, word};
use crate::permute::{Permutation, permuted};
use linelit_simd::{Isa, Simd, dispatch};

/// The lanes of a key for the jitter of the two axes, for rows, for columns, and for the order of
/// uniform jitter; lanes below 2³² belong to the key's permutation.
const JITTER: [u64; 2] = [1 << 32, (1 << 32) + 1];
const ROWS: u64 = (1 << 32) + 2;
const COLUMNS: u64 = (1 << 32) + 4;
const ORDER: u64 = (1 << 32) + 7;
const PLACES: u64 = (1 << 32) + 8;

/// One jittered sample in each of N strata (1-D) or N equal cells (2-D), in random order.
///
/// **Formula.** 1-D: (π(i) + ξᵢ)/N. 2-D: cell π(i) of [`Cells`] with an independent uniform point
/// inside. Cook 1986, *Stochastic sampling in computer graphics*. A block takes a [part](Parts) of
/// each stratum or cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stratified {
    order: Permutation,
    cells: Cells,
    jitter: [u64; 2],
    parts: Parts,
}

impl Stratified {
    /// Makes the pattern from the keys of the pattern and of the block.
    #[inline]
    pub(crate) fn new([all, own]: [u64; 2], count: u32, block: Block) -> Self {
        Self {
            order: Permutation::new(count, own),
            cells: Cells::new(count),
            jitter: JITTER.map(|axis| lane(own, axis)),
            parts: Parts::new(all, block),
        }
    }

    /// Returns the jitter of sample `i` along an axis, in [0, 1).
    #[inline]
    fn offset(&self, axis: usize, i: u32) -> f64 {
        unit_f64(word(self.jitter[axis], u64::from(i)))
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        let k = self.order.get(i);
        let along = self.parts.along(k, self.offset(0, i));
        stratum(k, along, self.cells.count)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let k = self.order.get(i);
        let offset = [self.offset(0, i), self.offset(1, i)];
        in_cell(&self.cells, k, self.parts.within(k, offset))
    }
}

impl Stratified {
    /// Computes [`Stratified::get_2d`] of the samples from `first` on, all below the count.
    pub(crate) fn fill_2d(&self, first: u32, x: &mut [f64], y: &mut [f64]) {
        if self.cells.is_grid() && self.parts.cells().is_grid() {
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

/// Computes points in the cells of a grid whose indices `x` holds: [`Stratified::get_2d`] to the
/// bit.
///
/// It is a plain loop that compilers vectorize.
#[inline(always)]
fn grid_kernel<S: Simd>(_: S, set: &Stratified, first: u32, x: &mut [f64], y: &mut [f64]) {
    let (jitter, mut i) = (set.jitter, u64::from(first));
    for (x, y) in x.iter_mut().zip(y) {
        let mut offset = [unit_f64(word(jitter[0], i)), unit_f64(word(jitter[1], i))];
        if !set.parts.is_whole() {
            #[expect(clippy::cast_possible_truncation, reason = "a number of a cell")]
            #[expect(clippy::cast_sign_loss, reason = "cells are not negative")]
            let cell = *x as u32;
            offset = set.parts.within_grid(cell, offset);
        }
        [*x, *y] = in_grid(&set.cells, *x, offset);
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
/// τ(c). Then all cells of a row have the same shift, and the variance for smooth integrands falls
/// only as N^−1.5 (measured: −1.58 for exp(xy)), slower than plain jitter's N⁻². In a Latin square
/// each row and each column has every shift equally often, which cancels the leading error.
///
/// If the cells do not form a grid (Kensler then leaves cells of a larger grid empty), all N cells
/// still have one sample, and y has one sample in each of N strata; x is stratified within each
/// row.
///
/// A block takes one of S parts of each stratum. Let (X, Y)/S be a point of a multi-jittered
/// pattern of S points. The block adds X/S of a cell's width and Y/S of its height to the position
/// of each sample, modulo these. All blocks together then have S samples in each cell and one in
/// each of NS strata of each axis, and if N is one, they are multi-jittered. In random strata,
/// parts are counted from the other end, so that the position of a block in one stratum does not
/// determine its position in another. If S does not form a grid, the points are a lattice; if N
/// does not, x is stratified within each row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MultiJitter {
    base: Stratified,
    /// The permutations σ and κ.
    rows: [Permutation; 2],
    /// The permutations ρ, and τ for rows of ⌊N/a⌋ and of ⌊N/a⌋ + 1 cells.
    columns: [Permutation; 3],
    /// The block's offsets: along x, and along y in short and in long rows.
    places: [BlockOffset; 3],
}

impl MultiJitter {
    /// Makes the pattern from the keys of the pattern and of the block.
    #[inline]
    pub(crate) fn new(keys: [u64; 2], count: u32, block: Block) -> Self {
        let (base, key) = (Stratified::new(keys, count, block), keys[0]);
        let (cells, parts) = (&base.cells, &base.parts);
        let rows = cells.rows;
        let short = count / rows;
        let long = if cells.is_grid() { short } else { short + 1 };
        let sizes = [long, short, long];
        // Find the block's offset.
        let mut places = [BlockOffset::default(); 3];
        if !parts.is_whole() {
            let [x, y] = multi_jittered(parts, lane(key, PLACES));
            places = [
                BlockOffset::new(x, rows, parts.of()),
                BlockOffset::new(y, short, parts.of()),
                BlockOffset::new(y, long, parts.of()),
            ];
        }
        // A single sample needs no permutations.
        if count == 1 {
            return Self {
                base,
                rows: [Permutation::ONE; 2],
                columns: [Permutation::ONE; 3],
                places,
            };
        }
        Self {
            base,
            rows: [0, 1].map(|k| Permutation::new(rows, lane(key, ROWS + k))),
            columns: [0, 1, 2].map(|k| Permutation::new(sizes[k], lane(key, COLUMNS + k as u64))),
            places,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.base.get_1d(i)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let Stratified { order, cells, .. } = &self.base;
        // Find the cell of the sample, and permute its row and column.
        let cell = cells.cell(order.get(i));
        let tall = usize::from(cell.columns == self.columns[2].len());
        let [sigma, kappa] = [0, 1].map(|k| self.rows[k].get(cell.row));
        let [rho, tau] = [0, 1 + tall].map(|k| self.columns[k].get(cell.column));
        // Place the sample in its stratum of each axis.
        let x = self.across((sigma + rho) % cells.rows, cell.column, i);
        let place = &self.places[1 + tall];
        let up = cell.first + (tau + kappa + place.stratum) % cell.columns;
        [
            below_one((f64::from(cell.column) + x) / f64::from(cell.columns)),
            stratum(up, self.offset(1, i, place.part, up), cells.count),
        ]
    }

    /// Returns the position of sample `i` along x in a cell of a column: in sub-stratum `s`, before
    /// the block's offset.
    #[inline]
    fn across(&self, s: u32, column: u32, i: u32) -> f64 {
        let (cells, parts, place) = (&self.base.cells, &self.base.parts, &self.places[0]);
        let rows = cells.rows;
        if !cells.is_grid() && rows <= parts.of() && !parts.is_whole() {
            // Treat the row by itself, with the parts of the whole cell.
            let part = plus(
                place.of_cell,
                scaled(s, parts.of(), u64::from(rows)),
                parts.of(),
            );
            return self.offset(0, i, part, column);
        }
        let across = (s + place.stratum) % rows;
        let offset = self.offset(0, i, place.part, column * rows + across);
        below_one((f64::from(across) + offset) / f64::from(rows))
    }

    /// Returns the position of sample `i` in stratum `k` of an axis, of which the block takes a
    /// part.
    #[inline]
    fn offset(&self, axis: usize, i: u32, part: u32, k: u32) -> f64 {
        let (parts, jitter) = (&self.base.parts, self.base.offset(axis, i));
        if parts.is_whole() {
            return jitter;
        }
        let from_other_end = parts.is_either((axis as u64) << 32 | u64::from(k));
        let part = if from_other_end {
            parts.of() - 1 - part
        } else {
            part
        };
        (f64::from(part) + jitter) / f64::from(parts.of())
    }
}

/// The block's offset along an axis of each cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct BlockOffset {
    /// The index of the part of the cell.
    of_cell: u32,
    /// The index of the stratum with this part, and the part of the stratum.
    stratum: u32,
    part: u32,
}

impl BlockOffset {
    /// Splits part `of_cell` of a cell with `len` strata, which is at len · of_cell/of strata from
    /// its beginning, into a whole number of strata and a fraction. The fraction is rounded such
    /// that each part of a stratum belongs to one part of the cell.
    fn new(of_cell: u32, len: u32, of: u32) -> Self {
        if len == 1 {
            return Self {
                of_cell,
                stratum: 0,
                part: of_cell,
            };
        }
        let turns = scaled(of_cell, gcd(len, of), u64::from(of));
        Self {
            of_cell,
            stratum: scaled(of_cell, len, u64::from(of)),
            part: plus(times(of_cell, len, of), turns, of),
        }
    }
}

/// Returns the strata X and Y of a block's point in a multi-jittered pattern of as many points as
/// there are blocks, or in a lattice if that number does not form a grid.
fn multi_jittered(parts: &Parts, key: u64) -> [u32; 2] {
    let (cells, of) = (parts.cells(), parts.of());
    let number = parts.part(2, 1 << 32);
    if !cells.is_grid() {
        let y = times(number, step(of), of);
        return [number, plus(y, parts.random(1 << 32 | 1), of)];
    }
    let cell = cells.cell(number);
    let shift = |axis: u64, len: u32| {
        let key = lane(key, axis);
        let by_row = permuted(cell.row, cells.rows, key);
        let by_column = permuted(cell.column, cell.columns, key.rotate_left(32));
        (by_row + by_column + scaled((key >> 32) as u32, len, 1 << 32)) % len
    };
    let x = cell.column * cells.rows + shift(0, cells.rows);
    let y = cell.first + shift(1, cell.columns);
    // Cells are at least as high as wide, and parts are at most as high as wide.
    [y, x]
}

/// A pattern with the same random offset in every stratum: a randomly shifted lattice.
///
/// **Formula.** 1-D: (ξ + π(k))/N with one ξ for all k. The set is that of Ramamoorthi et al. 2012,
/// *A theory of Monte Carlo visibility sampling*, which Peters 2021, section 5.3, recommends for
/// linear lights; the order π is random, so that several dimensions are paired independently. 2-D:
/// ((ξ + j)/N, fract(ζ + j/φ)) with j = π(k) and the golden ratio φ, which is evenly spread for any
/// N. (One offset for all cells of a grid, the obvious generalisation, has only the variance N⁻¹;
/// rank-1 lattices with a generator near N/φ are poor for some N, among them 1024.)
///
/// A block takes the same part p of all strata: ξ is replaced by (ξ + p)/S. In 2-D it is the
/// lattice ((ξ + j)/N, fract(ζ + p/φ + j√3)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UniformJitter {
    order: Permutation,
    count: u32,
    offset: f64,
    /// ζ in units of 2⁻⁶⁴.
    second: u64,
    /// The step from each point to the next along the second axis, in the same units.
    turn: u64,
}

/// The fraction of √3 in units of 2⁻⁶⁴.
const ROOT_OF_THREE: u64 = 0xBB67_AE85_84CA_A73B;

impl UniformJitter {
    /// Makes the pattern from the keys of the pattern and of the block.
    #[inline]
    pub(crate) fn new(keys: [u64; 2], count: u32, block: Block) -> Self {
        let offset = [0, 1].map(|k| unit_f64(word(keys[0], k)));
        Self::with_offset(keys, count, block, offset)
    }

    /// Makes the pattern with a given offset in [0, 1)², for example from a blue-noise tile.
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the offset is in [0, 1), and half of a word is wanted"
    )]
    pub(crate) fn with_offset(
        [all, own]: [u64; 2],
        count: u32,
        block: Block,
        offset: [f64; 2],
    ) -> Self {
        let second = ((offset[1] * (1_u64 << 53) as f64) as u64) << 11;
        let order = Permutation::new(count, lane(own, ORDER));
        if block.of() == 1 {
            return Self {
                order,
                count,
                offset: offset[0],
                second,
                turn: GOLDEN,
            };
        }
        // Several blocks take different parts of the strata, in an order of which any run is even.
        let random = scaled((word(all, 2) >> 32) as u32, block.of(), 1 << 32);
        let part = plus(block.interleaved().index(), random, block.of());
        Self {
            order,
            count,
            offset: (f64::from(part) + offset[0]) / f64::from(block.of()),
            second: second.wrapping_add(u64::from(part).wrapping_mul(GOLDEN)),
            turn: ROOT_OF_THREE,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        stratum(self.order.get(i), self.offset, self.count)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let j = self.order.get(i);
        let turns = u64::from(j).wrapping_mul(self.turn);
        [
            stratum(j, self.offset, self.count),
            unit_f64(self.second.wrapping_add(turns)),
        ]
    }
}

/// Returns (k + offset)/count, below one.
#[inline]
fn stratum(k: u32, offset: f64, count: u32) -> f64 {
    below_one((f64::from(k) + offset) / f64::from(count))
}

/// Returns the point of cell `k` of a grid at `offset` of the cell's width and height. It is
/// [`in_cell`] to the bit: the rounding of the quotient from which the row is cut is smaller than
/// its distance from the next integer, unless it is an integer.
#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the row of a cell"
)]
pub(crate) fn in_grid(cells: &Cells, k: f64, offset: [f64; 2]) -> [f64; 2] {
    let [columns, count] = [cells.columns, cells.count].map(f64::from);
    let before = f64::from((k / columns) as u32) * columns;
    [
        below_one(((k - before) + offset[0]) / columns),
        below_one((before + columns * offset[1]) / count),
    ]
}

/// Returns the point of cell `k` at `offset` of the cell's width and height.
#[inline]
pub(crate) fn in_cell(cells: &Cells, k: u32, offset: [f64; 2]) -> [f64; 2] {
    let cell = cells.cell(k);
    let columns = f64::from(cell.columns);
    [
        below_one((f64::from(cell.column) + offset[0]) / columns),
        below_one((f64::from(cell.first) + columns * offset[1]) / f64::from(cells.count)),
    ]
}
