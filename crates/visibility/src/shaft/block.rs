//! The coordinates (u, v) of lines on the light, and blocks of eight lines. v runs along the lines'
//! common direction, so that a line is a number u and an interval of v.

use crate::{
    lanes::{Lanes, ddot},
    shaft::frame::LightFrame,
};
use linelit_geometry::{DVec3, Segment};
use linelit_simd::Simd;

/// The largest deviation from parallel, in units of the light, of lines that are handled as one
/// group. Lines that deviate more begin a new group.
const PARALLEL: f64 = 1e-12;

/// The coordinate u of padding, greater than any coordinate of a line.
const BEYOND: f64 = 1e300;

/// Eight lines of one direction, as a structure of arrays.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct LineBlock {
    /// The coordinate of each line across the direction; for lanes that are not in use it is
    /// greater than any other.
    pub(crate) u: [f64; 8],
    /// The lower and the upper end of each line in v.
    pub(crate) from: [f64; 8],
    pub(crate) to: [f64; 8],
    /// For each line, the hidden interval around the latest triangle, which grows as triangles
    /// overlap it.
    pub(crate) run_lo: [f64; 8],
    pub(crate) run_hi: [f64; 8],
    /// For each lane, the index of its line in the caller's list.
    pub(crate) number: [u32; 8],
    /// A bit for each line whose first end has the greater v.
    pub(crate) reversed: u8,
}

const EMPTY: LineBlock = LineBlock {
    u: [BEYOND; 8],
    from: [0.0; 8],
    to: [0.0; 8],
    run_lo: [f64::INFINITY; 8],
    run_hi: [f64::NEG_INFINITY; 8],
    number: [0; 8],
    reversed: 0,
};

/// The coordinates of lines on the light, in the caller's order.
#[derive(Debug, Default)]
pub(crate) struct Ends {
    /// The unit direction (along v) in the (p, q) plane; zero if no line has length.
    pub(crate) along: [f64; 2],
    /// For each line, its coordinate across, and its two ends along the direction.
    pub(crate) u: Vec<f64>,
    pub(crate) a: Vec<f64>,
    pub(crate) b: Vec<f64>,
    /// The number of lines; the vectors may be longer.
    pub(crate) count: usize,
    /// The indices of the lines in ascending order of u; not used if they are `ascending` already.
    order: Vec<u32>,
    ascending: bool,
}

impl Ends {
    /// Sets the direction to that of the first line that has length. `d` is the vector from the
    /// first end to the second of the first line in (p, q).
    #[inline(always)]
    fn set_direction(&mut self, frame: &LightFrame, point: DVec3, lines: &[Segment], d: [f64; 2]) {
        let direction = |line: &Segment| {
            let [a, b] = [line.p0, line.p1].map(|end| frame.project(end - point));
            [b[0] - a[0], b[1] - a[1]]
        };
        self.along = [0.0; 2];
        for d in std::iter::once(d).chain(lines[1..].iter().map(direction)) {
            let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
            if length > 0.0 {
                self.along = [d[0] / length, d[1] / length];
            }
            if length != 0.0 {
                break;
            }
        }
    }

    /// Determines the ascending order of the lines.
    fn sort(&mut self) {
        let u = &self.u[..self.count];
        self.ascending = u.is_sorted();
        if !self.ascending {
            self.order.clear();
            self.order.extend((0_u32..).take(u.len()));
            // A stable sort: equal coordinates stay in the caller's order.
            self.order
                .sort_by(|&a, &b| u[a as usize].total_cmp(&u[b as usize]));
        }
    }

    /// Reverses the direction, which changes the sign of all coordinates.
    #[inline(always)]
    fn turn<S: Simd>(&mut self, s: S) {
        self.along = [-self.along[0], -self.along[1]];
        let chunks = self.count.div_ceil(8);
        for row in [&mut self.u, &mut self.a, &mut self.b] {
            for eight in &mut row.as_chunks_mut::<8>().0[..chunks] {
                s.dstore(s.dsplat(-0.0) - s.dload(eight), eight);
            }
        }
    }

    /// The index of the line that is `k`-th in ascending order of u.
    #[inline(always)]
    pub(crate) fn nth(&self, k: usize) -> usize {
        if self.ascending {
            k
        } else {
            self.order[k] as usize
        }
    }
}

/// Computes the coordinates of the first lines that share a direction, up to the first line that
/// has another. If no line has length, the first coordinate is not finite.
///
/// The direction's sign is such that the last of these lines does not have a lower u than the
/// first.
#[inline(always)]
pub(crate) fn place_lines<S: Simd>(
    s: S,
    frame: &LightFrame,
    point: DVec3,
    lines: &[Segment],
    ends: &mut Ends,
) {
    let room = lines.len().next_multiple_of(8);
    if ends.u.len() < room {
        for row in [&mut ends.u, &mut ends.a, &mut ends.b] {
            row.resize(room, 0.0);
        }
    }
    let zero = s.dsplat(0.0);
    ends.count = 0;
    for (k, few) in lines.chunks(8).enumerate() {
        // Project the ends of eight lines; the first line is repeated as padding.
        let mut rows = [[0.0; 8]; 6];
        for lane in 0..8 {
            let line = &few[if lane < few.len() { lane } else { 0 }];
            rows[0][lane] = line.p0.x;
            rows[1][lane] = line.p0.y;
            rows[2][lane] = line.p0.z;
            rows[3][lane] = line.p1.x;
            rows[4][lane] = line.p1.y;
            rows[5][lane] = line.p1.z;
        }
        let a = project(s, frame, point, &rows[0], &rows[1], &rows[2]);
        let b = project(s, frame, point, &rows[3], &rows[4], &rows[5]);
        let d = [b[0] - a[0], b[1] - a[1]];
        // Determine the direction from the first line with length.
        if k == 0 {
            let mut first = [[0.0; 8]; 2];
            s.dstore(d[0], &mut first[0]);
            s.dstore(d[1], &mut first[1]);
            ends.set_direction(frame, point, lines, [first[0][0], first[1][0]]);
        }
        // Compute the coordinates, and how far each line is from parallel.
        let (dx, dy) = (s.dsplat(ends.along[0]), s.dsplat(ends.along[1]));
        let off = dx * d[1] - dy * d[0];
        let off = s.dmax(off, zero - off);
        let parallel = s.bits(s.dle(off, s.dsplat(PARALLEL)));
        let across_a = dx * a[1] - dy * a[0];
        let across_b = dx * b[1] - dy * b[0];
        s.dstore(
            (across_a + across_b) * 0.5,
            &mut ends.u.as_chunks_mut::<8>().0[k],
        );
        let forward = dx * a[0] + dy * a[1];
        s.dstore(forward, &mut ends.a.as_chunks_mut::<8>().0[k]);
        let forward = dx * b[0] + dy * b[1];
        s.dstore(forward, &mut ends.b.as_chunks_mut::<8>().0[k]);
        // Stop before the first line with another direction.
        let good = few.len().min(parallel.trailing_ones() as usize);
        ends.count += good;
        if good < few.len() {
            break;
        }
    }
    if ends.count > 0 && ends.u[ends.count - 1] < ends.u[0] {
        ends.turn(s);
    }
    ends.sort();
}

/// Computes [`LightFrame::project`] for eight points.
#[inline(always)]
fn project<S: Simd>(
    s: S,
    frame: &LightFrame,
    point: DVec3,
    x: &[f64; 8],
    y: &[f64; 8],
    z: &[f64; 8],
) -> [S::D; 2] {
    // Project point by point if the light's frame has `Sides`, which are exact.
    if let Some(sides) = &frame.sides {
        let mut rows = Lanes([[0.0; 8]; 2]);
        for lane in 0..8 {
            let [p, q] = sides.project(DVec3::new(x[lane], y[lane], z[lane]) - point);
            (rows[0][lane], rows[1][lane]) = (p, q);
        }
        return [s.dload(&rows[0]), s.dload(&rows[1])];
    }
    // Divide by W only where a point is off the light's plane.
    let x = s.dload(x) - point.x;
    let y = s.dload(y) - point.y;
    let z = s.dload(z) - point.z;
    let p = ddot::<S>(frame.p, x, y, z);
    let q = ddot::<S>(frame.q, x, y, z);
    let w = ddot::<S>(frame.w, x, y, z);
    let off = w - 1.0;
    let off = s.dmax(off, s.dsplat(0.0) - off);
    let there = s.dle(off, s.dsplat(1e-12));
    if s.bits(there) == 0xff {
        return [p, q];
    }
    [s.select(there, p / w, p), s.select(there, q / w, q)]
}

/// Lines in ascending order of u, in blocks of eight.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    /// The unit direction (along v) in the (p, q) plane.
    pub(crate) along: [f64; 2],
    pub(crate) blocks: Vec<LineBlock>,
    pub(crate) count: usize,
}

impl Lines {
    pub(crate) fn clear(&mut self, along: [f64; 2]) {
        self.along = along;
        self.blocks.clear();
        self.count = 0;
    }

    /// Replaces the contents by all lines of `ends`; `first` is the index in the caller's list of
    /// the first of these lines.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(&mut self, s: S, ends: &Ends, first: usize) {
        self.clear(ends.along);
        // Lines that are not in order go in one by one.
        if !ends.ascending {
            for k in 0..ends.count {
                let i = ends.nth(k);
                self.push(ends.u[i], ends.a[i], ends.b[i], number(first, i));
            }
            return;
        }
        // Lines in order are copied block by block.
        self.count = ends.count;
        let [u, a, b] = [&ends.u, &ends.a, &ends.b].map(|row| row.as_chunks::<8>().0);
        for k in 0..ends.count.div_ceil(8) {
            let mut block = EMPTY;
            let (a, b) = (s.dload(&a[k]), s.dload(&b[k]));
            s.dstore(s.dload(&u[k]), &mut block.u);
            s.dstore(s.dmin(a, b), &mut block.from);
            s.dstore(s.dmax(a, b), &mut block.to);
            block.reversed = s.bits(s.dlt(b, a));
            let base = number(first, 8 * k);
            for (lane, number) in (0..).zip(&mut block.number) {
                *number = base.wrapping_add(lane);
            }
            // Pad the last block.
            for lane in (ends.count - 8 * k).min(8)..8 {
                block.u[lane] = BEYOND;
                (block.from[lane], block.to[lane]) = (0.0, 0.0);
            }
            self.blocks.push(block);
        }
    }

    /// Adds a line at `u` whose ends have the coordinates `a` and `b` along the direction; `number`
    /// is its index in the caller's list.
    #[inline(always)]
    pub(crate) fn push(&mut self, u: f64, a: f64, b: f64, number: u32) {
        let lane = self.count % 8;
        if lane == 0 {
            self.blocks.push(EMPTY);
        }
        self.count += 1;
        if let Some(block) = self.blocks.last_mut() {
            block.u[lane] = u;
            block.from[lane] = a.min(b);
            block.to[lane] = a.max(b);
            block.number[lane] = number;
            block.reversed |= u8::from(b < a) << lane;
        }
    }
}

/// Returns the index in the caller's list of line `i` of a group that begins at index `first`.
#[inline(always)]
pub(crate) fn number(first: usize, i: usize) -> u32 {
    u32::try_from(first + i).unwrap_or(u32::MAX)
}

/// Whether a line is finite and has length, so that some of it can be visible.
#[inline]
pub(crate) fn has_length(line: &Segment) -> bool {
    // Zero times what is not finite is not a number.
    let nothing = line.p0 * 0.0 + line.p1 * 0.0;
    (nothing == DVec3::ZERO) & (line.p0 != line.p1)
}
