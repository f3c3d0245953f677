//! Fans: rays from one point, and the tests that they share.
//! `Occluders::any_hits` and `Occluders::closest_hits` trace them.
//!
//! In a leaf, eight triangles are first tested against the box that holds the directions of all
//! rays. This shows for most triangles that they hide no ray, and for some that they hide all rays;
//! the remaining triangles are tested against eight rays at a time. Where the error bounds of these
//! tests leave a case open, the test for single rays decides, so that the answers are the same.

use crate::{
    bvh::{Bvh, largest_inverse_at},
    counters::Counters,
    lanes::{Lanes, dabs},
    node::{Child, Leaf, Node},
    rays::{
        ray::{self, CLOSER, ROOM, Ray, RayScratch, Split},
        watertight::WatertightRay,
    },
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;
use std::ops::Range;

/// The largest number of rays in a [`Fan`] for `Occluders::any_hits`,
/// whose answer has one bit per ray.
pub const FAN: usize = u64::BITS as usize;

/// The number of rays in a fan below which each ray is traced by itself.
pub(crate) const FEW: usize = 4;

/// Rays from one point, `origin + t·direction` for `t_min` ≤ t ≤ `t_max`, each with its own
/// direction.
#[derive(Clone, Copy, Debug)]
pub struct Fan<'a> {
    /// The origin of all rays, where t = 0.
    pub origin: DVec3,
    /// For each ray the vector by which it advances per unit of t. There may be at most [`FAN`]
    /// rays for `Occluders::any_hits`.
    pub directions: &'a [DVec3],
    /// The least t, which must not be negative.
    pub t_min: f64,
    /// The largest t.
    pub t_max: f64,
}

impl Fan<'_> {
    pub(crate) fn ray(&self, i: usize) -> Ray {
        Ray {
            origin: self.origin,
            direction: self.directions[i],
            t_min: self.t_min,
            t_max: self.t_max,
        }
    }

    /// Returns a mask with a bit for each ray of the fan; the lowest bit is the first ray's.
    #[must_use]
    pub fn all(&self) -> u64 {
        match self.directions.len() {
            0 => 0,
            count => u64::MAX >> FAN.saturating_sub(count),
        }
    }
}

/// Returns which of the `open` rays hit a triangle, by tracing each of them by itself.
pub(crate) fn one_by_one(
    bvh: &Bvh,
    fan: &Fan<'_>,
    mut open: u64,
    exclude: &Range<u32>,
    scratch: &mut RayScratch,
    counters: &mut Counters,
) -> u64 {
    let mut hidden = 0;
    while open != 0 {
        let i = open.trailing_zeros();
        open &= open - 1;
        let ray = fan.ray(i as usize);
        let meets = ray::any(bvh.isa, bvh, &ray, exclude, scratch, counters);
        hidden |= u64::from(meets) << i;
    }
    hidden
}

/// The directions of eight rays, as the rows x, y and z.
pub(crate) type Rays = Lanes<[[f64; 8]; 3]>;

/// The directions of a fan in groups of eight; the last direction is repeated to fill its group.
#[derive(Debug, Default)]
pub(crate) struct Directions(pub(crate) [Rays; FAN / 8]);

/// The limit for distances and direction components, and for the reciprocal of a direction's
/// largest component: within it, the products of five of them that the tests compute neither
/// overflow nor underflow.
pub(crate) const LARGEST: f64 = 1e30;

impl Directions {
    /// Stores the directions of a fan and returns the lowest and the highest corner of their
    /// bounding box; `None` if some direction exceeds the limits of the tests of this module.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, s: S, fan: &Fan<'_>) -> Option<[[f64; 3]; 2]> {
        let (mut low, mut high) = ([s.dsplat(f64::MAX); 3], [s.dsplat(-f64::MAX); 3]);
        let mut all = 0xff;
        for (eight, rays) in fan.directions.chunks(8).zip(&mut self.0) {
            // Transpose, and repeat the last direction.
            for (k, row) in rays.iter_mut().enumerate() {
                for (lane, out) in row.iter_mut().enumerate() {
                    *out = eight[lane.min(eight.len() - 1)][k];
                }
            }
            // Extend the box, and check the components' sizes.
            let mut most = s.dsplat(0.0);
            let mut valid = s.dlt(most, s.dsplat(1.0));
            for k in 0..3 {
                let x = s.dload(&rays[k]);
                low[k] = s.dmin(low[k], x);
                high[k] = s.dmax(high[k], x);
                let size = dabs(s, x);
                valid = valid & s.dle(size, s.dsplat(LARGEST));
                most = s.dmax(most, size);
            }
            all &= s.bits(valid & s.dlt(s.dsplat(1.0 / LARGEST), most));
        }
        // Reduce the bounds of eight lanes to one.
        let mut bounds = [[0.0; 3]; 2];
        for k in 0..3 {
            let mut lanes = Lanes([[0.0; 8]; 2]);
            s.dstore(low[k], &mut lanes[0]);
            s.dstore(s.dsplat(0.0) - high[k], &mut lanes[1]);
            for (sign, (lanes, bounds)) in [1.0, -1.0].iter().zip(lanes.iter_mut().zip(&mut bounds))
            {
                for width in [4, 2, 1] {
                    for i in 0..width {
                        let (a, b) = (lanes[i], lanes[i + width]);
                        lanes[i] = if a < b { a } else { b };
                    }
                }
                bounds[k] = sign * lanes[0];
            }
        }
        (all == 0xff).then_some(bounds)
    }
}

/// A *beam*: the bounding box of the directions of several rays from one origin, prepared for tests
/// that hold for all these rays at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// The centre of the box of directions, and half its size, rounded up.
    middle: [f64; 3],
    half: [f64; 3],
    /// The origin, rounded to `f32`; then pairs of an inverse and an offset, such that the plane of
    /// a box at `bound` is reached at `t = (bound − near) · inverse + offset` ([`Split`]). For each
    /// axis, `enter` has two pairs, for the lower and the upper bound of a box: the distances at
    /// which the first ray enters it. `leave` has one pair, and the row of a node's bounds through
    /// which the last ray leaves the box.
    near: [f32; 3],
    enter: [[[f32; 2]; 2]; 3],
    leave: [([f32; 2], usize); 3],
    pub(crate) t_max: f32,
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl Beam {
    /// Creates the beam of the box of directions from `low` to `high`. `size` is the largest
    /// absolute coordinate of `origin` and of all vertices, in the hierarchy's coordinates.
    #[inline(always)]
    fn new([low, high]: [[f64; 3]; 2], t_max: f64, origin: [f64; 3], size: f64) -> Self {
        let largest = largest_inverse_at(size);
        let mut beam = Self {
            middle: [0.0; 3],
            half: [0.0; 3],
            near: [0.0; 3],
            enter: [[[0.0; 2]; 2]; 3],
            leave: [([0.0, f32::INFINITY], 0); 3],
            t_max: (t_max + t_max * ROOM + f64::from(f32::MIN_POSITIVE)) as f32,
        };
        for k in 0..3 {
            // Compute the centre and half the size of the box, with a margin for rounding.
            let (lo, hi) = (low[k], high[k]);
            beam.middle[k] = 0.5 * (lo + hi);
            beam.half[k] = 0.5 * (hi - lo) + 2.0 * f64::EPSILON * lo.abs().max(hi.abs());
            let split = Split::new(origin[k], size, largest);
            beam.near[k] = split.near;
            let line = |inverse: f64, sign: f64| {
                let inverse = inverse as f32;
                [inverse, split.offset(inverse, sign)]
            };
            // If no direction ascends along this axis, a box above the origin is entered only at
            // the largest distance; likewise below.
            let up = if hi > 0.0 {
                (1.0 / hi).min(largest)
            } else {
                largest
            };
            let down = if lo < 0.0 {
                (1.0 / lo).max(-largest)
            } else {
                -largest
            };
            beam.enter[k] = [line(up, -1.0), line(down, -1.0)];
            // There is a last ray to leave only if all rays ascend, or all descend.
            if lo > 0.0 {
                beam.leave[k] = (line((1.0 / lo).min(largest), 1.0), k + 3);
            } else if hi < 0.0 {
                beam.leave[k] = (line((1.0 / hi).max(-largest), 1.0), k);
            }
        }
        beam
    }

    /// Returns a bit for each box of a node that some ray of the beam may enter before `t_max`, and
    /// lower bounds of the distances at which the boxes are entered.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node) -> (u8, S::F) {
        let mut near = s.splat(0.0);
        let mut far = s.splat(self.t_max);
        for k in 0..3 {
            let from = s.splat(self.near[k]);
            for (side, [inverse, offset]) in self.enter[k].iter().enumerate() {
                let bound = s.load(&node.bounds[k + 3 * side]) - from;
                near = s.max(s.fma(bound, s.splat(*inverse), s.splat(*offset)), near);
            }
            let ([inverse, offset], row) = self.leave[k];
            let bound = s.load(&node.bounds[row]) - from;
            far = s.min(s.fma(bound, s.splat(inverse), s.splat(offset)), far);
        }
        let near = near * CLOSER;
        (s.le(near, far) & node.valid, near)
    }
}

/// The parameters and error bounds that all tests of a fan share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tests {
    pub(crate) origin: [f64; 3],
    /// The largest absolute coordinate of the origin and of all vertices.
    pub(crate) size: f64,
    /// The excluded triangles: the index of the first, and how many.
    exclude: (u32, u32),
    t_min: f64,
    t_max: f64,
    /// The error bounds of edge functions and of distances, as multiples of the sum of the squares
    /// of a triangle's corners: see [`Tests::new`].
    edge_room: f64,
    distance_room: f64,
    near_room: f64,
}

/// Eight triangles prepared for the tests of rays, with corners a, b, c relative to the rays'
/// origin. Rows 0 to 8 are b × c, c × a and a × b, multiplied by the sign that makes T = a·(b × c)
/// positive. Row 9 is T, and row 10 the error bound of the edge functions. Row 11 is the error
/// bound of T where the sign of T is certain; elsewhere it is negative, minus the margin for hits
/// near the origin.
type Prepared = Lanes<[[f64; 8]; 12]>;

impl Tests {
    /// Tests of a fan, with the bounds of their rounding.
    ///
    /// In units of η = 2⁻⁵³, with R the largest coordinate of a, b, c, and D that of the
    /// directions, to first order: a corner relative to the origin is the same number here and in
    /// [`WatertightRay`]. There, with d scaled to have the largest component 1, sheared
    /// coordinates, at most 2R, are off by 4ηR (the quotient, the product and the difference), an
    /// edge function by 2·(2·2R·4ηR + 4ηR²) + 8ηR² = 48ηR², the sum of three by 184ηR², and T by
    /// 3·(48 + 8)ηR³ + 48ηR³ = 216ηR³; t's two more operations are 3η|T| ≤ 18ηR³. Here, a cross
    /// product is off by 4ηR² in each component, an edge function, d not scaled, by 30ηR²D, the
    /// sum of three by 120ηR²D, and T by 30ηR³. Where an edge function here is beyond 128ηR²D, that
    /// of a single ray has its sign; where T is beyond 512ηR²(R + D t_max), so has T; and where T
    /// and t_max times the sum of edge functions are that much apart, t is on the same side of
    /// t_max, and so of t_min ≤ t_max. Where the sign of T is not certain, t < t_min if |T| is
    /// below t_min times the size of that sum by 512ηR²(R + D t_min). R² is at most the sum of the
    /// squares of the corners; R at most twice `size`.
    #[inline(always)]
    pub(crate) fn new(
        fan: &Fan<'_>,
        exclude: &Range<u32>,
        origin: [f64; 3],
        size: f64,
        [low, high]: [[f64; 3]; 2],
    ) -> Self {
        let mut largest = 0.0_f64;
        for k in 0..3 {
            largest = largest.max(-low[k]).max(high[k]);
        }
        Self {
            origin,
            size,
            exclude: (exclude.start, exclude.end.saturating_sub(exclude.start)),
            t_min: fan.t_min,
            t_max: fan.t_max,
            edge_room: 64.0 * f64::EPSILON * largest,
            distance_room: 256.0 * f64::EPSILON * (2.0 * size + largest * fan.t_max),
            near_room: 256.0 * f64::EPSILON * (2.0 * size + largest * fan.t_min),
        }
    }

    /// Creates the beam of a box of directions, given by its lowest and highest corner.
    #[inline(always)]
    pub(crate) fn beam(&self, bounds: [[f64; 3]; 2]) -> Beam {
        Beam::new(bounds, self.t_max, self.origin, self.size)
    }

    /// Returns one vertex of each of the eight triangles of a leaf, relative to the rays' origin;
    /// `first` is the index of the vertex's first row.
    #[inline(always)]
    fn vertex<S: Simd>(&self, s: S, leaf: &Leaf, first: usize) -> [S::D; 3] {
        let v = &leaf.vertices;
        [
            s.widen(s.load(&v[first])) - self.origin[0],
            s.widen(s.load(&v[first + 1])) - self.origin[1],
            s.widen(s.load(&v[first + 2])) - self.origin[2],
        ]
    }

    /// Prepares the triangles of a leaf for tests with single rays, stores them in `out`, and tests
    /// them against the whole beam. Returns a bit for each triangle that may hide some ray, and a
    /// bit for each that hides all rays.
    #[inline(always)]
    fn prepare<S: Simd>(&self, s: S, beam: &Beam, leaf: &Leaf, out: &mut Prepared) -> (u8, u8) {
        let zero = s.dsplat(0.0);
        let [a, b, c] = [
            self.vertex(s, leaf, 0),
            self.vertex(s, leaf, 3),
            self.vertex(s, leaf, 6),
        ];
        // Compute T and the planes through the origin and each side, all with the sign of T.
        let normals = [cross::<S>(&b, &c), cross::<S>(&c, &a), cross::<S>(&a, &b)];
        let t = dot::<S>(&a, &normals[0]);
        let square = dot::<S>(&a, &a) + dot::<S>(&b, &b) + dot::<S>(&c, &c);
        let edge_room = square * self.edge_room;
        let distance_room = square * self.distance_room;
        let sign = s.select(s.dlt(t, zero), s.dsplat(1.0), s.dsplat(-1.0));
        let t = t * sign;
        let certain = s.dlt(distance_room, t);
        // Over the box of directions, compare the edge functions with zero, and the distance with
        // t_min and t_max.
        let (mut some, mut all) = (!s.dlt(t, t), certain);
        let mut sum = [zero; 3];
        for (k, normal) in normals.iter().enumerate() {
            let n = [normal[0] * sign, normal[1] * sign, normal[2] * sign];
            for j in 0..3 {
                sum[j] = sum[j] + n[j];
                s.dstore(n[j], &mut out[3 * k + j]);
            }
            let (least, most) = range(s, beam, &n);
            some = some & !s.dlt(most, zero - edge_room);
            all = all & s.dlt(edge_room, least);
        }
        let (least, most) = range(s, beam, &sum);
        let (below, above) = (t - distance_room, t + distance_room);
        some = some & !s.dlt(most * self.t_max, below) & !s.dlt(above, least * self.t_min);
        all = all & s.dlt(above, least * self.t_max) & s.dlt(most * self.t_min, below);
        s.dstore(t, &mut out[9]);
        s.dstore(edge_room, &mut out[10]);
        s.dstore(distance_room, &mut out[11]);
        if s.bits(certain) != 0xff {
            // Triangles whose plane goes through the origin, up to rounding: their hits are nearer
            // than t_min, except for rays in the plane.
            let near_room = square * self.near_room;
            s.dstore(
                s.select(certain, zero - near_room, distance_room),
                &mut out[11],
            );
            let apart = s.dmax(least, zero - most) * self.t_min;
            some = some & certain | !certain & !s.dlt(t + near_room, apart);
        }
        (s.bits(some), s.bits(all))
    }

    /// Returns a bit for each of eight rays, among those in the mask `open`, that a prepared
    /// triangle hides.
    #[inline(always)]
    fn hides<S: Simd>(
        &self,
        s: S,
        leaf: &Leaf,
        prepared: &Prepared,
        lane: usize,
        rays: &Rays,
        open: u8,
    ) -> u8 {
        // Compute the three edge functions of each ray.
        let (x, y, z) = (s.dload(&rays[0]), s.dload(&rays[1]), s.dload(&rays[2]));
        let mut edges = [x; 3];
        for (edge, n) in edges.iter_mut().zip(prepared.as_chunks::<3>().0) {
            *edge = x * n[0][lane] + y * n[1][lane] + z * n[2][lane];
        }
        let [u, v, w] = edges;
        let (t, edge_room, room) = (prepared[9][lane], prepared[10][lane], prepared[11][lane]);
        let least = s.dmin(s.dmin(u, v), w);
        let outside = s.dlt(least, s.dsplat(-edge_room));
        // Rays are missed or hit where the error bounds decide it. Without a certain sign of T,
        // only misses are decided.
        let sum = u + v + w;
        let (missed, mut hidden) = if room <= 0.0 {
            let most = s.dmax(s.dmax(u, v), w);
            let outside = outside & s.dlt(s.dsplat(edge_room), most);
            let near = s.dlt(s.dsplat(t - room), dabs(s, sum) * self.t_min);
            (s.bits(outside | near), 0)
        } else {
            let (below, above) = (s.dsplat(t - room), s.dsplat(t + room));
            let (begun, reached) = (sum * self.t_min, sum * self.t_max);
            let missed = outside | s.dlt(reached, below) | s.dlt(above, begun);
            let hit = s.dlt(s.dsplat(edge_room), least) & s.dlt(above, reached);
            (s.bits(missed), s.bits(hit & s.dlt(begun, below)))
        };
        // Decide the others as single rays.
        let mut undecided = open & !missed & !hidden;
        while undecided != 0 {
            let ray = undecided.trailing_zeros() as usize;
            undecided &= undecided - 1;
            let direction = DVec3::new(rays[0][ray], rays[1][ray], rays[2][ray]);
            let exact = WatertightRay::new(self.origin.into(), direction);
            if let Some((t, _)) = exact.intersect(&leaf.triangle(lane))
                && t >= self.t_min
                && t <= self.t_max
            {
                hidden |= 1 << ray;
            }
        }
        hidden & open
    }

    /// Returns a bit for each of the `open` rays that a triangle of the leaf hides.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(
        &self,
        s: S,
        beam: &Beam,
        leaf: &Leaf,
        child: Child,
        rays: &[Rays],
        open: u64,
    ) -> u64 {
        // Test the whole beam: if a triangle hides every ray, the leaf is done.
        let mut prepared = Lanes([[0.0; 8]; 12]);
        let (some, all) = self.prepare(s, beam, leaf, &mut prepared);
        let among = child.mask() & !s.in_range(&leaf.id, self.exclude.0, self.exclude.1);
        if all & among != 0 {
            return open;
        }
        // Test each remaining triangle against the rays that are still open, eight at a time.
        let mut some = some & among;
        let mut hidden = 0;
        while some != 0 {
            let lane = some.trailing_zeros() as usize;
            some &= some - 1;
            let left = (open & !hidden).to_le_bytes();
            for (i, (&left, rays)) in left.iter().zip(rays).enumerate() {
                if left != 0 {
                    let found = self.hides(s, leaf, &prepared, lane, rays, left);
                    hidden |= u64::from(found) << (8 * i);
                }
            }
        }
        hidden
    }
}

/// Returns the least and the largest value of n·d over all directions d of the beam, each with an
/// error below the error of n·d itself.
#[inline(always)]
fn range<S: Simd>(s: S, beam: &Beam, n: &[S::D; 3]) -> (S::D, S::D) {
    let Beam {
        middle: m, half: h, ..
    } = beam;
    let middle = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
    let half = dabs(s, n[0]) * h[0] + dabs(s, n[1]) * h[1] + dabs(s, n[2]) * h[2];
    (middle - half, middle + half)
}

#[inline(always)]
fn dot<S: Simd>(a: &[S::D; 3], b: &[S::D; 3]) -> S::D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<S: Simd>(a: &[S::D; 3], b: &[S::D; 3]) -> [S::D; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
