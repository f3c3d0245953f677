//! The sweep of line samples over the projections of triangles: which interval of each line each
//! triangle hides. The *image* of a triangle is its projection from the shading point onto the
//! light's plane.
//!
//! In coordinates (u, v) with v along the lines, a line is a number u. A triangle's vertices are
//! sorted by u; between two of them, its sides are linear in u:
//!
//! ```text
//!     v      1
//!           ╱╲           a line u between u₀ and u₁ is hidden from the side 0–2 to the side 0–1,
//!         ╱    ╲         one between u₁ and u₂ from 0–2 to 1–2
//!       0────────2  u
//! ```
//!
//! A line is taken to be an infinitesimal beyond its u, so it never passes through a vertex, and
//! every side that it crosses belongs to at most two triangles, which evaluate the side by the same
//! expression. So closed surfaces leave no gap, not even one of a rounding error.

use crate::{
    lanes::Lanes,
    lines::VisibleLines,
    shaft::{
        block::{self, Ends, LineBlock, Lines},
        merge::{self, Pieces, Slots},
        project::{FlatBlock, FlatTriangles},
        seen::ShaftState,
    },
};
use linelit_geometry::Segment;
use linelit_simd::{Simd, dispatch};

/// Eight triangles, prepared for lines: the rows u₀, u₁, u₂ in ascending order, v₀, v₁, and the
/// slopes of the sides 0–1, 0–2 and 1–2.
pub(crate) type ReadyBlock = Lanes<[[f64; 8]; 8]>;

/// Prepares eight projected triangles: rotates them to the lines' direction, sorts their vertices
/// by u, and computes the slopes of their sides.
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
    // Sort the vertices by u, with a network of three comparisons.
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        let swap = s.dlt(u[j], u[i]);
        let (ui, uj, vi, vj) = (u[i], u[j], v[i], v[j]);
        u[i] = s.select(swap, ui, uj);
        u[j] = s.select(swap, uj, ui);
        v[i] = s.select(swap, vi, vj);
        v[j] = s.select(swap, vj, vi);
    }
    // Store the vertices and the slopes; sides across the lines have no slope, but are never
    // evaluated.
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

/// Buffers for visibility along lines.
#[derive(Debug, Default)]
pub(crate) struct LineScratch {
    /// The coordinates of lines on the light, in the caller's order.
    pub(crate) ends: Ends,
    /// The lines of one direction.
    pub(crate) lines: Lines,
    /// Triangles, prepared for the direction of the lines.
    pub(crate) ready: Vec<ReadyBlock>,
    /// The hidden intervals of each line.
    pub(crate) slots: Slots,
    /// The visible pieces of eight lines.
    pieces: Pieces,
}

impl LineScratch {
    /// Adds what the triangles in `flat` hide to the hidden intervals of all lines.
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

    /// Stores the visible pieces of all lines in `out`, after all triangles that hide them were
    /// swept.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, s: S, out: &mut VisibleLines) {
        merge::finish(s, &self.lines, &mut self.slots, &mut self.pieces, out);
    }
}

/// Computes the coordinates of the first lines that share a direction, and returns how many lines
/// these are. Unless the shaft is dense, the function also finds their visible pieces. `first` is
/// the index of the first of them in the caller's list.
#[inline(always)]
fn sweep_kernel<S: Simd>(
    s: S,
    seen: &ShaftState,
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

/// [`LineScratch::finish`] as a kernel.
#[inline(always)]
fn finish_kernel<S: Simd>(s: S, scratch: &mut LineScratch, out: &mut VisibleLines) {
    scratch.finish(s, out);
}

/// Sweeps all triangles over the lines of one block, whose latest hidden intervals stay in
/// registers.
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
    // Find which of eight triangles are over any line of the block.
    for (k, t) in ready.iter().enumerate() {
        let before = s.dle(s.dload(&t[0]), last);
        let beyond = s.dlt(first, s.dload(&t[2]));
        let mut near = s.bits(before & beyond) & (0xff_u8 >> (8 - (count - 8 * k).min(8)));
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            // Evaluate both sides of the triangle at each line.
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
            // Keep only what overlaps the line itself.
            let on_line = s.dlt(lo, to) & s.dlt(from, hi);
            let hit = crossed & on_line;
            let touches = s.dle(lo, run_hi) & s.dle(run_lo, hi);
            let joins = hit & (touches | s.dlt(run_hi, run_lo));
            let disjoint = hit & (!joins);
            let (old_lo, old_hi) = (run_lo, run_hi);
            // Extend the running interval where the new one touches it; elsewhere replace it, and
            // move the old one to the line's slots.
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

/// Whether a point of the (p, q) plane is inside one of the projected triangles; edges and corners
/// count as inside.
#[inline(always)]
fn point_kernel<S: Simd>(s: S, flat: &FlatTriangles, point: [f64; 2]) -> bool {
    let (x, y) = (s.dsplat(point[0]), s.dsplat(point[1]));
    let zero = s.dsplat(0.0);
    let mut left = flat.count;
    for block in flat.blocks() {
        // Compute the edge functions of eight images.
        let (ax, ay) = (s.dload(block[0]) - x, s.dload(block[1]) - y);
        let (bx, by) = (s.dload(block[2]) - x, s.dload(block[3]) - y);
        let (cx, cy) = (s.dload(block[4]) - x, s.dload(block[5]) - y);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let low = s.dmin(s.dmin(u, v), w);
        let high = s.dmax(s.dmax(u, v), w);
        // Inside, all have one sign or are zero, but not all of them are zero.
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
    /// [`sweep_kernel`] on an instruction set.
    pub(crate) fn sweep = sweep_kernel(seen: &ShaftState, lines: &[Segment], first: usize, dense: bool, scratch: &mut LineScratch, out: &mut VisibleLines) -> usize
}
dispatch! {
    /// [`finish_kernel`] on an instruction set.
    pub(crate) fn finish = finish_kernel(scratch: &mut LineScratch, out: &mut VisibleLines) -> ()
}
dispatch! {
    /// [`point_kernel`] on an instruction set.
    pub(crate) fn hidden_point = point_kernel(flat: &FlatTriangles, point: [f64; 2]) -> bool
}
