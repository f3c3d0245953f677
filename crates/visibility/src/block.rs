//! The lines of one direction, side by side, eight to a block.
//!
//! In coordinates (u, v) with v along the lines, a line is a number u.

use crate::{dispatch::dispatch, frame::LightFrame, simd::Simd};
use linelit_geometry::{DVec3, Segment};

/// Images of lines on the light farther than this from parallel, in units of the light, make
/// groups of their own.
const PARALLEL: f64 = 1e-12;

/// Beyond every u.
const BEYOND: f64 = 1e300;

/// Eight lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct LineBlock {
    /// Where each line is; padding is beyond everything.
    pub(crate) u: [f64; 8],
    /// Lower and upper end of each line in v.
    pub(crate) from: [f64; 8],
    pub(crate) to: [f64; 8],
    /// What is known to be hidden around the latest triangle.
    pub(crate) run_lo: [f64; 8],
    pub(crate) run_hi: [f64; 8],
    /// Which line of the caller's it is.
    pub(crate) number: [u32; 8],
    /// A bit for each line that runs against v.
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

/// Where lines are on the light, in the caller's order.
#[derive(Debug, Default)]
pub(crate) struct Ends {
    /// Unit direction (along v) in the (p, q) plane; zero if no line has length.
    pub(crate) along: [f64; 2],
    /// Place across, and the two ends along the direction.
    pub(crate) u: Vec<f64>,
    pub(crate) a: Vec<f64>,
    pub(crate) b: Vec<f64>,
    /// How many lines; the vectors may be longer.
    pub(crate) count: usize,
    /// The lines in ascending order of u, if that is neither their order nor its reverse.
    order: Vec<u32>,
    kind: Order,
}

#[derive(Clone, Copy, Debug, Default)]
enum Order {
    #[default]
    Ascending,
    Descending,
    Other,
}

impl Ends {
    /// The direction of the first line that has length.
    fn set_direction(&mut self, frame: &LightFrame, point: DVec3, lines: &[Segment]) {
        self.along = [0.0; 2];
        for line in lines {
            let a = frame.project(line.p0 - point);
            let b = frame.project(line.p1 - point);
            let d = [b[0] - a[0], b[1] - a[1]];
            let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
            if length > 0.0 {
                self.along = [d[0] / length, d[1] / length];
            }
            if length != 0.0 {
                break;
            }
        }
    }

    /// Finds the order of the lines.
    fn sort(&mut self) {
        let u = &self.u[..self.count];
        self.kind = if u.is_sorted() {
            Order::Ascending
        } else if u.is_sorted_by(|a, b| a > b) {
            Order::Descending
        } else {
            self.order.clear();
            self.order.extend((0_u32..).take(u.len()));
            // Equal places in the caller's order.
            self.order
                .sort_by(|&a, &b| u[a as usize].total_cmp(&u[b as usize]));
            Order::Other
        };
    }

    /// The line that comes `k`-th in ascending order of u.
    #[inline(always)]
    pub(crate) fn nth(&self, k: usize) -> usize {
        match self.kind {
            Order::Ascending => k,
            Order::Descending => self.count - 1 - k,
            Order::Other => self.order[k] as usize,
        }
    }
}

/// Places the first lines that share a direction; without any, the first is not finite.
pub(crate) fn place(
    isa: crate::dispatch::Isa,
    frame: &LightFrame,
    point: DVec3,
    lines: &[Segment],
    ends: &mut Ends,
) {
    ends.set_direction(frame, point, lines);
    place_all(isa, frame, point, lines, ends);
    ends.sort();
}

#[inline(always)]
fn place_kernel<S: Simd>(
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
    let (dx, dy) = (s.dsplat(ends.along[0]), s.dsplat(ends.along[1]));
    let zero = s.dsplat(0.0);
    ends.count = 0;
    let (us, _) = ends.u.as_chunks_mut::<8>();
    let (starts, _) = ends.a.as_chunks_mut::<8>();
    let (stops, _) = ends.b.as_chunks_mut::<8>();
    for (k, few) in lines.chunks(8).enumerate() {
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
        let d = [s.dsub(b[0], a[0]), s.dsub(b[1], a[1])];
        let off = s.dsub(s.dmul(dx, d[1]), s.dmul(dy, d[0]));
        let off = s.dmax(off, s.dsub(zero, off));
        let parallel = s.bits(s.dle(off, s.dsplat(PARALLEL)));
        let across_a = s.dsub(s.dmul(dx, a[1]), s.dmul(dy, a[0]));
        let across_b = s.dsub(s.dmul(dx, b[1]), s.dmul(dy, b[0]));
        s.dstore(
            s.dmul(s.dsplat(0.5), s.dadd(across_a, across_b)),
            &mut us[k],
        );
        let forward = s.dadd(s.dmul(dx, a[0]), s.dmul(dy, a[1]));
        s.dstore(forward, &mut starts[k]);
        let forward = s.dadd(s.dmul(dx, b[0]), s.dmul(dy, b[1]));
        s.dstore(forward, &mut stops[k]);
        let good = few.len().min(parallel.trailing_ones() as usize);
        ends.count += good;
        if good < few.len() {
            break;
        }
    }
}

/// [`LightFrame::project`] for eight points.
#[inline(always)]
fn project<S: Simd>(
    s: S,
    frame: &LightFrame,
    point: DVec3,
    x: &[f64; 8],
    y: &[f64; 8],
    z: &[f64; 8],
) -> [S::D; 2] {
    let x = s.dsub(s.dload(x), s.dsplat(point.x));
    let y = s.dsub(s.dload(y), s.dsplat(point.y));
    let z = s.dsub(s.dload(z), s.dsplat(point.z));
    let p = ddot(s, frame.p, x, y, z);
    let q = ddot(s, frame.q, x, y, z);
    let w = ddot(s, frame.w, x, y, z);
    let off = s.dsub(w, s.dsplat(1.0));
    let off = s.dmax(off, s.dsub(s.dsplat(0.0), off));
    let there = s.dle(off, s.dsplat(1e-12));
    [
        s.select(there, s.ddiv(p, w), p),
        s.select(there, s.ddiv(q, w), q),
    ]
}

/// `n·(x, y, z)`, in the order of `DVec3::dot`.
#[inline(always)]
pub(crate) fn ddot<S: Simd>(s: S, n: DVec3, x: S::D, y: S::D, z: S::D) -> S::D {
    s.dadd(
        s.dadd(s.dmul(s.dsplat(n.x), x), s.dmul(s.dsplat(n.y), y)),
        s.dmul(s.dsplat(n.z), z),
    )
}

dispatch! {
    /// Places the first lines that share the direction of `ends`, on an instruction set.
    place_all = place_kernel(frame: &LightFrame, point: DVec3, lines: &[Segment], ends: &mut Ends)
}

/// Lines in ascending order of u, in blocks of eight.
#[derive(Debug, Default)]
pub(crate) struct Lines {
    /// Unit direction (along v) in the (p, q) plane.
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

    /// Takes all lines of `ends`; the caller knows the first of them as `first`.
    pub(crate) fn fill(&mut self, ends: &Ends, first: usize) {
        self.clear(ends.along);
        for k in 0..ends.count {
            let i = ends.nth(k);
            self.push(ends.u[i], (ends.a[i], ends.b[i]), number(first, i));
        }
    }

    /// Adds a line at `u` whose ends are at `a` and `b`.
    #[inline(always)]
    pub(crate) fn push(&mut self, u: f64, (a, b): (f64, f64), number: u32) {
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

/// A line's number in the caller's list.
#[inline(always)]
pub(crate) fn number(first: usize, i: usize) -> u32 {
    u32::try_from(first + i).unwrap_or(u32::MAX)
}
