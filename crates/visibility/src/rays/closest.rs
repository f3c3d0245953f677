//! Closest hits of up to eight neighbouring rays of a fan, such as the rays through the pixels of a
//! row.
//!
//! A [`Packet`] walks the nearest box first. In a leaf, one triangle after the other is tested
//! against all eight rays at once:
//!
//! ```text
//!     lane            0     1     2     3     4     5     6     7
//!     hit so far    t, id  t, id  …
//!     a triangle    t, id  t, id  …        replaces the hit in lanes where it is nearer
//!                                          (at equal t, where its id is smaller)
//! ```
//!
//! Each lane's ray ends at its hit so far, and boxes that begin beyond all ends are skipped.
//!
//! The hits are bit-identical to the hits of
//! [`WatertightRay`](crate::rays::watertight::WatertightRay), because the operations are the same:
//! that test permutes the axes by the longest component of the direction and its sign, so packets
//! are for rays that agree in both.

use crate::{
    bvh::Bvh,
    counters::Counters,
    lanes::Lanes,
    node::{Child, Leaf, Node},
    rays::{
        fan::{Fan, Rays, Tests},
        packet::{self, Packet},
        ray::{Hit, wait_for_root},
        together::FanScratch,
    },
    walk::{NearestFirst, nearest_first},
};
use linelit_simd::{Simd, dispatch};
use std::ops::ControlFlow;

/// A factor that makes a positive `f64` at least as large after rounding to `f32` as before.
const UP: f32 = 1.0 + 2.0 * f32::EPSILON;

/// The value of [`Nearest::id`] for a ray that has hit no triangle: greater than all indices of
/// triangles.
const NONE: f64 = (1_u64 << 32) as f64;

/// The closest hit so far of each of eight rays.
struct Nearest<S: Simd> {
    /// The distance at which the rays begin.
    t_min: S::D,
    /// For each ray, the distance at which it ends: where it hits the closest triangle so far, or
    /// `t_max` before any hit.
    t: S::D,
    /// For each ray, the index of the triangle that it hits, or [`NONE`].
    id: S::D,
    /// For each ray, the edge functions of the triangle's second and third corner, and the sum of
    /// all three edge functions; their quotients are the barycentric coordinates.
    v: S::D,
    w: S::D,
    det: S::D,
}

impl<S: Simd> Nearest<S> {
    /// Returns the state of rays that have hit no triangle.
    #[inline(always)]
    fn none(s: S, t_min: f64, t_max: f64) -> Self {
        Self {
            t_min: s.dsplat(t_min),
            t: s.dsplat(t_max),
            id: s.dsplat(NONE),
            v: s.dsplat(0.0),
            w: s.dsplat(0.0),
            det: s.dsplat(1.0),
        }
    }

    /// Writes the hit of each ray to `hits`, or `None` for a ray that hit no triangle.
    #[inline(always)]
    fn write(&self, s: S, hits: &mut [Option<Hit>; 8]) {
        let mut rows = Lanes([[0.0; 8]; 4]);
        let columns = [self.t, self.id, self.v / self.det, self.w / self.det];
        for (row, column) in rows.iter_mut().zip(columns) {
            s.dstore(column, row);
        }
        for (lane, hit) in hits.iter_mut().enumerate() {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a u32, as it was given"
            )]
            let triangle = rows[1][lane] as u32;
            *hit = (rows[1][lane] < NONE).then_some(Hit {
                triangle,
                t: rows[0][lane],
                barycentric: [rows[2][lane], rows[3][lane]],
            });
        }
    }
}

/// Eight rays in coordinates in which each goes along the last axis: the axes are permuted in the
/// same way for all rays, and sheared for each ray by itself.
struct ShearedRays<S: Simd> {
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [S::D; 3],
}

impl<S: Simd> ShearedRays<S> {
    /// Prepares rays whose directions are within the box from `low` to `high`; `None` if the
    /// directions may differ in the axis of their longest component or in that component's sign.
    #[inline(always)]
    fn new(s: S, rays: &Rays, origin: [f64; 3], [low, high]: [[f64; 3]; 2]) -> Option<Self> {
        // Find the axis along which the least absolute component of any direction is larger than
        // the largest along the other axes.
        let least = |k: usize| f64::max(low[k], -high[k]);
        let most = |k: usize| f64::max(high[k], -low[k]);
        let is_longest = |&k: &usize| {
            let others = most((k + 1) % 3).max(most((k + 2) % 3));
            least(k) > others
        };
        let longest = (0..3).find(is_longest)?;
        let (mut kx, mut ky) = ((longest + 1) % 3, (longest + 2) % 3);
        if low[longest] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let [x, y, z] = [kx, ky, longest].map(|k| s.dload(&rays[k]));
        Some(Self {
            origin,
            axes: [kx, ky, longest],
            shear: [x / z, y / z, s.dsplat(1.0) / z],
        })
    }

    /// Returns a vertex in the coordinates of each ray; the last coordinate is the same for all
    /// rays.
    #[inline(always)]
    fn vertex(&self, s: S, v: &[f32; 3]) -> (S::D, S::D, f64) {
        let [x, y, z] = self.axes.map(|k| f64::from(v[k]) - self.origin[k]);
        (
            s.dsplat(x) - self.shear[0] * z,
            s.dsplat(y) - self.shear[1] * z,
            z,
        )
    }

    /// Tests a triangle of a leaf against all rays, and stores it in `nearest` for each ray that
    /// hits it nearer than any triangle so far. Returns false if there is no such ray.
    #[inline(always)]
    fn meet(&self, s: S, leaf: &Leaf, lane: usize, nearest: &mut Nearest<S>) -> bool {
        // Compute the edge functions; done if for each ray some are positive and some negative.
        let triangle = leaf.triangle(lane);
        let (ax, ay, az) = self.vertex(s, &triangle[0]);
        let (bx, by, bz) = self.vertex(s, &triangle[1]);
        let (cx, cy, cz) = self.vertex(s, &triangle[2]);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let zero = s.dsplat(0.0);
        let negative = s.dlt(u, zero) | s.dlt(v, zero) | s.dlt(w, zero);
        let positive = s.dlt(zero, u) | s.dlt(zero, v) | s.dlt(zero, w);
        let outside = negative & positive;
        if s.bits(outside) == 0xff {
            return false;
        }
        // Compute the distance, and find where it is the least.
        let det = u + v + w;
        let t = (u * az + v * bz + w * cz) * self.shear[2] / det;
        let id = s.dsplat(f64::from(leaf.id[lane]));
        let is_crossed = s.dlt(det, zero) | s.dlt(zero, det);
        let is_within = s.dle(nearest.t_min, t) & s.dle(t, nearest.t);
        // Of equally near triangles, the one with the smallest number.
        let is_first = s.dlt(t, nearest.t) | s.dlt(id, nearest.id);
        let take = is_crossed & is_within & is_first & !outside;
        if s.bits(take) == 0 {
            return false;
        }
        // Store this triangle as the hit of the rays for which it is nearer.
        nearest.t = s.select(take, nearest.t, t);
        nearest.id = s.select(take, nearest.id, id);
        nearest.v = s.select(take, nearest.v, v);
        nearest.w = s.select(take, nearest.w, w);
        nearest.det = s.select(take, nearest.det, det);
        true
    }
}

/// A walk that looks for the triangles that the rays of a packet hit first. A node or leaf waits
/// with a bit for each ray that enters it.
struct ClosestOfPacket<S: Simd> {
    packet: Packet,
    rays: ShearedRays<S>,
    nearest: Nearest<S>,
    /// For each ray, the distance of its closest hit so far, at which the ray ends, rounded up.
    reach: S::F,
}

impl<S: Simd> NearestFirst<S> for ClosestOfPacket<S> {
    type Entry = u8;

    #[inline(always)]
    fn wants(&self, s: S, depth: f32, rays: u8) -> bool {
        rays & s.le(s.splat(depth), self.reach) != 0
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, rays: u8) -> (u8, S::F) {
        self.packet.active = rays;
        self.packet.beam.boxes(s, node)
    }

    #[inline(always)]
    fn entry(&self, s: S, node: &Node, lane: usize) -> Option<u8> {
        self.packet.enter(s, node, lane, self.reach)
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, _: u8) -> ControlFlow<()> {
        let mut any = false;
        for lane in 0..child.count() as usize {
            any |= self.rays.meet(s, leaf, lane, &mut self.nearest);
        }
        if any {
            self.reach = s.narrow(self.nearest.t) * UP;
        }
        ControlFlow::Continue(())
    }
}

/// Finds the closest hits of up to eight rays. Returns false, with no hits, if the tests of packets
/// are not valid for these rays: they may differ in their longest axis, or exceed the limits of the
/// error bounds.
#[inline(always)]
fn closest_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    fan: &Fan<'_>,
    hits: &mut [Option<Hit>; 8],
    scratch: &mut FanScratch,
    counters: &mut Counters,
) -> bool {
    // Prepare the packet, if the tests are for rays like these.
    let size = packet::size_of(bvh, fan);
    let bounds = scratch.directions.set(s, fan);
    let (Some(size), Some(bounds)) = (size, bounds) else {
        return false;
    };
    let origin = (fan.origin - bvh.origin).to_array();
    let directions = &scratch.directions.0[0];
    let Some(rays) = ShearedRays::new(s, directions, origin, bounds) else {
        return false;
    };
    let tests = Tests::new(fan, &(0..0), origin, size, bounds);
    let packet = Packet::new(s, directions, &tests, bounds);
    let mut visitor = ClosestOfPacket {
        reach: s.splat(packet.beam.t_max),
        packet,
        rays,
        nearest: Nearest::none(s, fan.t_min, fan.t_max),
    };
    // Walk the hierarchy, and write the hits.
    wait_for_root(&mut scratch.waiting, 0xff);
    nearest_first(
        s,
        &bvh.hierarchy,
        &mut scratch.waiting,
        counters,
        &mut visitor,
    );
    visitor.nearest.write(s, hits);
    true
}

dispatch! {
    /// [`closest_kernel`] on an instruction set.
    pub(crate) fn closest = closest_kernel(bvh: &Bvh, fan: &Fan<'_>, hits: &mut [Option<Hit>; 8], scratch: &mut FanScratch, counters: &mut Counters) -> bool
}
