//! Parallel lines against the images of triangles: which interval of each line each one hides.
//!
//! In coordinates (u, v) with v along the lines, a line is a number u. A triangle's vertices are
//! sorted by u; between two of them its sides are linear in u. A line is taken to lie an
//! infinitesimal beyond its u, so it never passes through a vertex, every side it crosses belongs
//! to at most two triangles, and both evaluate that side by the same expression: closed surfaces
//! leave no gap, not even of a rounding error.

use crate::{
    Scratch, VisibleLines,
    dispatch::dispatch,
    merge::{self, Slots},
    project::{FlatBlock, FlatTriangles},
    simd::Simd,
};

/// Eight numbers side by side, aligned for the widest load.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Lanes<T>(pub(crate) T);

impl<T> std::ops::Deref for Lanes<T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> std::ops::DerefMut for Lanes<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// Eight triangles ready for lines: u₀, u₁, u₂ in ascending order, v₀, v₁, and the slopes of the
/// sides 0–1, 0–2 and 1–2.
pub(crate) type ReadyBlock = Lanes<[[f64; 8]; 8]>;

/// Lines of one direction, in ascending order of u, padded to blocks of eight.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    /// Unit direction (along v) in the (p, q) plane.
    pub(crate) along: [f64; 2],
    /// Blocks of u; padding is beyond everything.
    pub(crate) u: Vec<Lanes<[f64; 8]>>,
    /// Lower and upper end of each line in v.
    pub(crate) from: Vec<Lanes<[f64; 8]>>,
    pub(crate) to: Vec<Lanes<[f64; 8]>>,
    /// What is known to be hidden around the latest triangle.
    pub(crate) run_lo: Vec<Lanes<[f64; 8]>>,
    pub(crate) run_hi: Vec<Lanes<[f64; 8]>>,
    /// Which line of the caller's it is.
    pub(crate) number: Vec<u32>,
    /// Whether it runs against `along`.
    pub(crate) reversed: Vec<bool>,
    /// First block that may hold a line at or after each of 64 steps of u.
    first: Vec<u32>,
    start: f64,
    step: f64,
}

/// Beyond every u.
const BEYOND: f64 = 1e300;

impl Lines {
    pub(crate) fn clear(&mut self, along: [f64; 2]) {
        self.along = along;
        for rows in [
            &mut self.u,
            &mut self.from,
            &mut self.to,
            &mut self.run_lo,
            &mut self.run_hi,
        ] {
            rows.clear();
        }
        self.number.clear();
        self.reversed.clear();
    }

    /// Adds a line at `u` whose ends are at `a` and `b`.
    pub(crate) fn push(&mut self, u: f64, (a, b): (f64, f64), number: u32) {
        let lane = self.number.len() % 8;
        if lane == 0 {
            self.u.push(Lanes([BEYOND; 8]));
            self.from.push(Lanes([0.0; 8]));
            self.to.push(Lanes([0.0; 8]));
            self.run_lo.push(Lanes([f64::INFINITY; 8]));
            self.run_hi.push(Lanes([f64::NEG_INFINITY; 8]));
        }
        let block = self.u.len() - 1;
        self.u[block][lane] = u;
        self.from[block][lane] = a.min(b);
        self.to[block][lane] = a.max(b);
        self.number.push(number);
        self.reversed.push(b < a);
    }

    /// Prepares the look-up of blocks; lines must be in order.
    pub(crate) fn index(&mut self) {
        if self.u.len() <= 2 {
            return;
        }
        let last = self.u[(self.number.len() - 1) / 8][(self.number.len() - 1) % 8];
        self.start = self.u[0][0];
        self.step = 64.0 / (last - self.start).max(1e-300);
        let mut block = 0;
        self.first.resize(65, 0);
        for (k, first) in (0_u32..).zip(&mut self.first) {
            let u = self.start + (f64::from(k) - 1e-6) / self.step;
            while block + 1 < self.u.len() && self.u[block][7] < u {
                block += 1;
            }
            #[allow(clippy::cast_possible_truncation, reason = "lines are numbered by u32")]
            {
                *first = block as u32;
            }
        }
    }

    /// The first block that may hold a line at or after `u`.
    #[inline(always)]
    fn first_block(&self, u: f64) -> usize {
        if self.u.len() <= 2 {
            return 0;
        }
        // A float is clamped by the conversion.
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped"
        )]
        let step = ((u - self.start) * self.step).clamp(0.0, 64.0) as usize;
        self.first[step] as usize
    }
}

/// Turns eight images to the lines' direction, sorts their vertices and finds the slopes.
#[inline(always)]
fn ready_eight<S: Simd>(s: S, flat: &FlatBlock, along: [f64; 2]) -> ReadyBlock {
    let (dx, dy) = (s.dsplat(along[0]), s.dsplat(along[1]));
    let mut u = [s.dsplat(0.0); 3];
    let mut v = [s.dsplat(0.0); 3];
    for k in 0..3 {
        let (p, q) = (s.dload(&flat[2 * k]), s.dload(&flat[2 * k + 1]));
        u[k] = s.dsub(s.dmul(dx, q), s.dmul(dy, p));
        v[k] = s.dadd(s.dmul(dx, p), s.dmul(dy, q));
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
        let width = s.dmax(s.dsub(u[j], u[i]), tiny);
        s.dstore(s.ddiv(s.dsub(v[j], v[i]), width), &mut out[row]);
    }
    out
}

/// Hides from every line what the triangles in `flat` hide.
#[inline(always)]
pub(crate) fn sweep_flat<S: Simd>(
    s: S,
    flat: &FlatTriangles,
    lines: &mut Lines,
    slots: &mut Slots,
) {
    let mut left = flat.count;
    for block in &flat.blocks {
        let ready = ready_eight(s, block, lines.along);
        for lane in 0..left.min(8) {
            sweep_one(s, &ready, lane, lines, slots);
        }
        left = left.saturating_sub(8);
    }
}

/// The visible pieces of `scratch.lines` past the triangles in `scratch.flat`.
#[inline(always)]
fn sweep_kernel<S: Simd>(s: S, scratch: &mut Scratch, out: &mut VisibleLines) {
    let Scratch {
        flat,
        lines,
        slots_per_line,
        pieces,
        ..
    } = scratch;
    slots_per_line.reset(lines.number.len());
    sweep_flat(s, flat, lines, slots_per_line);
    merge::finish(s, lines, slots_per_line, pieces, out);
}

/// One triangle against all lines.
#[inline(always)]
fn sweep_one<S: Simd>(s: S, ready: &ReadyBlock, lane: usize, lines: &mut Lines, slots: &mut Slots) {
    let (first_u, last_u) = (ready[0][lane], ready[2][lane]);
    let u0 = s.dsplat(first_u);
    let u2 = s.dsplat(last_u);
    let mut block = lines.first_block(first_u);
    while block < lines.u.len() && lines.u[block][0] < last_u {
        let u = s.dload(&lines.u[block]);
        let crossed = s.and(s.dle(u0, u), s.dlt(u, u2));
        if s.bits(crossed) == 0 {
            block += 1;
            continue;
        }
        let u1 = s.dsplat(ready[1][lane]);
        let from_first = s.dsub(u, u0);
        let v0 = s.dsplat(ready[3][lane]);
        let long = s.dadd(v0, s.dmul(s.dsplat(ready[6][lane]), from_first));
        let before = s.dadd(v0, s.dmul(s.dsplat(ready[5][lane]), from_first));
        let after = s.dadd(
            s.dsplat(ready[4][lane]),
            s.dmul(s.dsplat(ready[7][lane]), s.dsub(u, u1)),
        );
        let short = s.select(s.dlt(u, u1), after, before);
        let lo = s.dmin(long, short);
        let hi = s.dmax(long, short);
        // Only what is on the line itself.
        let on_line = s.and(
            s.dlt(lo, s.dload(&lines.to[block])),
            s.dlt(s.dload(&lines.from[block]), hi),
        );
        let hit = s.and(crossed, on_line);
        let run_lo = s.dload(&lines.run_lo[block]);
        let run_hi = s.dload(&lines.run_hi[block]);
        let touches = s.and(s.dle(lo, run_hi), s.dle(run_lo, hi));
        let joins = s.and(hit, s.or(touches, s.dlt(run_hi, run_lo)));
        let apart = s.and(hit, s.not(joins));
        // Where it joins: the union; where it lies apart: it replaces the run, which is kept.
        let lower = s.select(joins, run_lo, s.dmin(lo, run_lo));
        let upper = s.select(joins, run_hi, s.dmax(hi, run_hi));
        s.dstore(s.select(apart, lower, lo), &mut lines.run_lo[block]);
        s.dstore(s.select(apart, upper, hi), &mut lines.run_hi[block]);
        let mut apart = s.bits(apart);
        if apart != 0 {
            let (mut los, mut his) = (Lanes([0.0; 8]), Lanes([0.0; 8]));
            s.dstore(run_lo, &mut los);
            s.dstore(run_hi, &mut his);
            while apart != 0 {
                let i = apart.trailing_zeros() as usize;
                apart &= apart - 1;
                slots.push(block, i, los[i], his[i]);
            }
        }
        block += 1;
    }
}

/// Whether a point of the (p, q) plane is inside one of the images; edges and corners are.
#[inline(always)]
fn point_kernel<S: Simd>(s: S, blocks: &[FlatBlock], point: [f64; 2]) -> bool {
    let (x, y) = (s.dsplat(point[0]), s.dsplat(point[1]));
    let zero = s.dsplat(0.0);
    for block in blocks {
        let (ax, ay) = (s.dsub(s.dload(&block[0]), x), s.dsub(s.dload(&block[1]), y));
        let (bx, by) = (s.dsub(s.dload(&block[2]), x), s.dsub(s.dload(&block[3]), y));
        let (cx, cy) = (s.dsub(s.dload(&block[4]), x), s.dsub(s.dload(&block[5]), y));
        let u = s.dsub(s.dmul(cx, by), s.dmul(cy, bx));
        let v = s.dsub(s.dmul(ax, cy), s.dmul(ay, cx));
        let w = s.dsub(s.dmul(bx, ay), s.dmul(by, ax));
        let low = s.dmin(s.dmin(u, v), w);
        let high = s.dmax(s.dmax(u, v), w);
        // All on one side, and not all zero.
        let positive = s.and(s.dle(zero, low), s.dlt(zero, high));
        let negative = s.and(s.dle(high, zero), s.dlt(low, zero));
        if s.bits(s.or(positive, negative)) != 0 {
            return true;
        }
    }
    false
}

dispatch! {
    /// Hides from every line what the projected triangles hide, on an instruction set.
    sweep = sweep_kernel(scratch: &mut Scratch, out: &mut VisibleLines)
}
dispatch! {
    /// Whether the projected triangles hide a point, on an instruction set.
    hidden_point = point_kernel(blocks: &[FlatBlock], point: [f64; 2]) -> bool
}
