//! Parallel lines against the images of triangles: which interval of each line each one hides.
//!
//! In coordinates (u, v) with v along the lines, a line is a number u. A triangle's vertices are
//! sorted by u; between two of them its sides are linear in u. A line is taken to lie an
//! infinitesimal beyond its u, so it never passes through a vertex, every side it crosses belongs
//! to at most two triangles, and both evaluate that side by the same expression: closed surfaces
//! leave no gap, not even of a rounding error.

use crate::{
    lanes::Lanes,
    lines::VisibleLines,
    shaft::{
        block::{self, Ends, LineBlock, Lines},
        merge::{self, Pieces, Slots},
        project::{FlatBlock, FlatTriangles},
        seen::Seen,
    },
};
use linelit_geometry::Segment;
use linelit_simd::{Simd, dispatch};

/// Eight triangles ready for lines: u₀, u₁, u₂ in ascending order, v₀, v₁, and the slopes of the
/// sides 0–1, 0–2 and 1–2.
pub(crate) type ReadyBlock = Lanes<[[f64; 8]; 8]>;

/// Turns eight images to the lines' direction, sorts their vertices and finds the slopes.
#[inline(always)]
fn ready_eight<S: Simd>(s: S, flat: &FlatBlock<'_>, along: [f64; 2]) -> ReadyBlock {
    let (dx, dy) = (s.dsplat(along[0]), s.dsplat(along[1]));
    let mut u = [s.dsplat(0.0); 3];
    let mut v = [s.dsplat(0.0); 3];
    for k in 0..3 {
        let (p, q) = (s.dload(flat[2 * k]), s.dload(flat[2 * k + 1]));
        u[k] = dx * q - dy * p;
        v[k] = dx * p + dy * q;
    }
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        let swap = s.dlt(u[j], u[i]);
        let (ui, uj, vi, vj) = (u[i], u[j], v[i], v[j]);
        u[i] = s.select(swap, ui, uj);
        u[j] = s.select(swap, uj, ui);
        v[i] = s.select(swap, vi, vj);
        v[j] = s.select(swap, vj, vi);
    }
    let tiny = s.dsplat(1e-280);
    let mut out = Lanes([[0.0; 8]; 8]);
    for (row, value) in [(0, u[0]), (1, u[1]), (2, u[2]), (3, v[0]), (4, v[1])] {
        s.dstore(value, &mut out[row]);
    }
    for (row, i, j) in [(5, 0, 1), (6, 0, 2), (7, 1, 2)] {
        let width = s.dmax(u[j] - u[i], tiny);
        s.dstore((v[j] - v[i]) / width, &mut out[row]);
    }
    out
}

/// Buffers for lines.
#[derive(Debug, Default)]
pub(crate) struct LineScratch {
    /// The places of lines on the light, in the caller's order.
    pub(crate) ends: Ends,
    /// The lines of one direction.
    pub(crate) lines: Lines,
    /// Triangles, ready for these.
    pub(crate) ready: Vec<ReadyBlock>,
    /// The hidden intervals of each line.
    pub(crate) slots: Slots,
    /// Visible pieces of eight lines.
    pieces: Pieces,
}

impl LineScratch {
    /// Hides from every line what the triangles in `flat` hide.
    #[inline(always)]
    pub(crate) fn sweep<S: Simd>(&mut self, s: S, flat: &FlatTriangles) {
        self.ready.clear();
        for block in flat.blocks() {
            self.ready.push(ready_eight(s, &block, self.lines.along));
        }
        for (index, block) in self.lines.blocks.iter_mut().enumerate() {
            sweep_block(s, &self.ready, flat.count, index, block, &mut self.slots);
        }
    }

    /// Hands out the visible pieces of lines of which all that is hidden is known.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, s: S, out: &mut VisibleLines) {
        merge::finish(s, &self.lines, &mut self.slots, &mut self.pieces, out);
    }
}

/// Places the first lines that share a direction and tells how many they are; unless the shaft is
/// dense, answers them, too. The caller knows the first of them as `first`.
#[inline(always)]
fn sweep_kernel<S: Simd>(
    s: S,
    seen: &Seen,
    lines: &[Segment],
    first: usize,
    dense: bool,
    scratch: &mut LineScratch,
    out: &mut VisibleLines,
) -> usize {
    block::place_lines(s, &seen.frame, seen.point, lines, &mut scratch.ends);
    let count = scratch.ends.count;
    if count > 0 && !dense {
        scratch.lines.fill(s, &scratch.ends, first);
        scratch.slots.reset(count);
        scratch.sweep(s, &seen.flat);
        scratch.finish(s, out);
    }
    count
}

/// Hands out the visible pieces of lines of which all that is hidden is known.
#[inline(always)]
fn finish_kernel<S: Simd>(s: S, scratch: &mut LineScratch, out: &mut VisibleLines) {
    scratch.finish(s, out);
}

/// All triangles against the lines of a block: what is known of the lines stays in registers.
#[inline(always)]
fn sweep_block<S: Simd>(
    s: S,
    ready: &[ReadyBlock],
    count: usize,
    index: usize,
    block: &mut LineBlock,
    slots: &mut Slots,
) {
    let u = s.dload(&block.u);
    let (from, to) = (s.dload(&block.from), s.dload(&block.to));
    let mut run_lo = s.dload(&block.run_lo);
    let mut run_hi = s.dload(&block.run_hi);
    let (first, last) = (s.dsplat(block.u[0]), s.dsplat(block.u[7]));
    for (k, t) in ready.iter().enumerate() {
        let before = s.dle(s.dload(&t[0]), last);
        let beyond = s.dlt(first, s.dload(&t[2]));
        let mut near = s.bits(before & beyond) & (0xff_u8 >> (8 - (count - 8 * k).min(8)));
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let u0 = s.dsplat(t[0][lane]);
            let u1 = s.dsplat(t[1][lane]);
            let crossed = s.dle(u0, u) & s.dlt(u, s.dsplat(t[2][lane]));
            let from_first = u - u0;
            let v0 = s.dsplat(t[3][lane]);
            let long = v0 + from_first * t[6][lane];
            let rising = v0 + from_first * t[5][lane];
            let falling = (u - u1) * t[7][lane] + t[4][lane];
            let short = s.select(s.dlt(u, u1), falling, rising);
            let lo = s.dmin(long, short);
            let hi = s.dmax(long, short);
            // Only what is on the line itself.
            let on_line = s.dlt(lo, to) & s.dlt(from, hi);
            let hit = crossed & on_line;
            let touches = s.dle(lo, run_hi) & s.dle(run_lo, hi);
            let joins = hit & (touches | s.dlt(run_hi, run_lo));
            let disjoint = hit & (!joins);
            let (old_lo, old_hi) = (run_lo, run_hi);
            // Where it joins: the union; where it is disjoint: it replaces the run, kept.
            run_lo = s.select(joins, run_lo, s.dmin(lo, run_lo));
            run_hi = s.select(joins, run_hi, s.dmax(hi, run_hi));
            run_lo = s.select(disjoint, run_lo, lo);
            run_hi = s.select(disjoint, run_hi, hi);
            let disjoint = s.bits(disjoint);
            if disjoint != 0 {
                slots.push_lanes(s, index, disjoint, old_lo, old_hi);
            }
        }
    }
    s.dstore(run_lo, &mut block.run_lo);
    s.dstore(run_hi, &mut block.run_hi);
}

/// Whether a point of the (p, q) plane is inside one of the images; edges and corners are.
#[inline(always)]
fn point_kernel<S: Simd>(s: S, flat: &FlatTriangles, point: [f64; 2]) -> bool {
    let (x, y) = (s.dsplat(point[0]), s.dsplat(point[1]));
    let zero = s.dsplat(0.0);
    let mut left = flat.count;
    for block in flat.blocks() {
        let (ax, ay) = (s.dload(block[0]) - x, s.dload(block[1]) - y);
        let (bx, by) = (s.dload(block[2]) - x, s.dload(block[3]) - y);
        let (cx, cy) = (s.dload(block[4]) - x, s.dload(block[5]) - y);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let low = s.dmin(s.dmin(u, v), w);
        let high = s.dmax(s.dmax(u, v), w);
        // All on one side, and not all zero.
        let positive = s.dle(zero, low) & s.dlt(zero, high);
        let negative = s.dle(high, zero) & s.dlt(low, zero);
        let used = 0xff_u8 >> (8 - left.min(8));
        if s.bits(positive | negative) & used != 0 {
            return true;
        }
        left = left.saturating_sub(8);
    }
    false
}

dispatch! {
    /// Places and answers lines on an instruction set.
    pub(crate) fn sweep = sweep_kernel(seen: &Seen, lines: &[Segment], first: usize, dense: bool, scratch: &mut LineScratch, out: &mut VisibleLines) -> usize
}
dispatch! {
    /// Finds what is visible of lines of which all that is hidden is known, on an instruction set.
    pub(crate) fn finish = finish_kernel(scratch: &mut LineScratch, out: &mut VisibleLines) -> ()
}
dispatch! {
    /// Whether the projected triangles hide a point, on an instruction set.
    pub(crate) fn hidden_point = point_kernel(flat: &FlatTriangles, point: [f64; 2]) -> bool
}
