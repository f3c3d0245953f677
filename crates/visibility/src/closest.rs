//! What neighbouring rays from one point meet first: eight at a time.
//!
//! Nodes are opened once for all rays that enter them, with the box of their directions, as in
//! [`crate::apart`]; a triangle is tested against eight rays in lanes, by the operations of
//! [`WatertightRay`](crate::watertight::WatertightRay) to the bit: for rays whose directions have
//! the same longest component, of one sign, its axes are the same.

use crate::{
    Hit, Occluders, Scratch,
    apart::Slabs,
    fan::{FEW, Fan, LARGEST, Rays, Tests},
    node::{Child, Leaf},
    ray,
    sweep::Lanes,
};
use linelit_simd::{Simd, dispatch};

/// More than a number that was rounded to `f32`, if that is not negative.
const UP: f32 = 1.0 + 2.0 * f32::EPSILON;

/// No triangle: more than all numbers of triangles.
const NONE: f64 = (1_u64 << 32) as f64;

impl Occluders {
    /// What each ray of a fan meets first, in place of what `out` held: as
    /// [`Occluders::closest_hit`] for one after the other, the quicker where neighbours in the fan
    /// go almost the same way, as through the pixels of a row.
    ///
    /// The hits are the same to the bit, but for rays in the plane of a triangle to rounding: where
    /// such a triangle is met is anyone's guess, and so is whether it is looked at. There may be
    /// any number of rays. In the [`Counters`](crate::Counters), what is tested for several rays at
    /// once is one test.
    pub fn closest_hits(&self, fan: &Fan<'_>, out: &mut Vec<Option<Hit>>, scratch: &mut Scratch) {
        out.clear();
        scratch.counters.rays += fan.directions.len() as u64;
        for directions in fan.directions.chunks(8) {
            let few = Fan { directions, ..*fan };
            let mut hits = [None; 8];
            let count = directions.len();
            if count >= FEW && closest_of(self.isa, self, &few, &mut hits, scratch) {
                out.extend_from_slice(&hits[..count]);
            } else {
                out.extend((0..count).map(|i| ray::closest(self.isa, self, &few.ray(i), scratch)));
            }
        }
        if let Some(holes) = &self.holes {
            for (i, hit) in out.iter_mut().enumerate() {
                *hit = holes.closest(&fan.ray(i), *hit, scratch);
            }
        }
    }
}

/// What eight rays have met so far.
struct Met<S: Simd> {
    /// Where they begin.
    t_min: S::D,
    /// How far they go: to what they have met.
    t: S::D,
    /// The triangle's number, or [`NONE`].
    id: S::D,
    /// Edge functions of the second and third corner, and the sum of all.
    v: S::D,
    w: S::D,
    det: S::D,
}

/// Eight rays in coordinates in which they go along the last axis.
struct Sheared<S: Simd> {
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [S::D; 3],
}

impl<S: Simd> Sheared<S> {
    /// `None` if rays within `bounds` differ in which axis they go along.
    #[inline(always)]
    fn new(s: S, rays: &Rays, origin: [f64; 3], [low, high]: [[f64; 3]; 2]) -> Option<Self> {
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

    /// A vertex in each ray's coordinates.
    #[inline(always)]
    fn vertex(&self, s: S, v: &[f32; 3]) -> (S::D, S::D, f64) {
        let [x, y, z] = self.axes.map(|k| f64::from(v[k]) - self.origin[k]);
        (
            s.dsplat(x) - self.shear[0] * z,
            s.dsplat(y) - self.shear[1] * z,
            z,
        )
    }

    /// Notes where a triangle is what some rays meet first; false if it is for none of them.
    #[inline(always)]
    fn meet(&self, s: S, leaf: &Leaf, lane: usize, met: &mut Met<S>) -> bool {
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
        let det = u + v + w;
        let t = (u * az + v * bz + w * cz) * self.shear[2] / det;
        let id = s.dsplat(f64::from(leaf.id[lane]));
        let some = s.dlt(det, zero) | s.dlt(zero, det);
        let within = s.dle(met.t_min, t) & s.dle(t, met.t);
        // Of equally near ones, that with the smallest number.
        let first = s.dlt(t, met.t) | s.dlt(id, met.id);
        let take = some & within & first & !outside;
        if s.bits(take) == 0 {
            return false;
        }
        met.t = s.select(take, met.t, t);
        met.id = s.select(take, met.id, id);
        met.v = s.select(take, met.v, v);
        met.w = s.select(take, met.w, w);
        met.det = s.select(take, met.det, det);
        true
    }
}

/// What up to eight rays meet first; false if they are not for these tests.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
fn closest_of_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    fan: &Fan<'_>,
    hits: &mut [Option<Hit>; 8],
    scratch: &mut Scratch,
) -> bool {
    let hierarchy = &*occluders.hierarchy;
    let origin = fan.origin - occluders.origin;
    let size = occluders.extent.max(origin.abs().max_element());
    let sane = origin.is_finite() && size <= LARGEST && fan.t_min >= 0.0 && fan.t_max >= fan.t_min;
    if !sane || hierarchy.nodes.is_empty() {
        return false;
    }
    let Some(bounds) = scratch.fan.set(s, fan) else {
        return false;
    };
    let origin = origin.to_array();
    let rays = scratch.fan.0[0];
    let Some(sheared) = Sheared::new(s, &rays, origin, bounds) else {
        return false;
    };
    let tests = Tests::new(fan, &(0..0), origin, size, bounds);
    let beam = tests.beam(bounds);
    let slabs = Slabs::new(s, &rays, &tests);
    let (zero, one) = (s.dsplat(0.0), s.dsplat(1.0));
    let mut met = Met {
        t_min: s.dsplat(fan.t_min),
        t: s.dsplat(fan.t_max),
        id: s.dsplat(NONE),
        v: zero,
        w: zero,
        det: one,
    };
    let mut reach = s.splat(beam.t_max);
    let (counters, stack) = (&mut scratch.counters, &mut scratch.group_stack);
    stack.clear();
    stack.push((Child::node(0), 0.0, 0xff));
    while let Some((child, near, rays)) = stack.pop() {
        let mine = rays & s.le(s.splat(near), reach);
        if mine == 0 {
            continue;
        }
        if child.is_leaf() {
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            let mut any = false;
            for lane in 0..child.count() as usize {
                any |= sheared.meet(s, leaf, lane, &mut met);
            }
            if any {
                reach = s.narrow(met.t) * UP;
            }
            continue;
        }
        let node = &hierarchy.nodes[child.index()];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (mut found, near) = beam.boxes(s, node);
        hierarchy.prefetch(s, node, found);
        let mut entry = Lanes([0.0; 8]);
        s.store(near, &mut entry);
        let base = stack.len();
        while found != 0 {
            let lane = found.trailing_zeros() as usize;
            found &= found - 1;
            let entering = mine & slabs.enter(s, node, lane, reach);
            if entering == 0 {
                continue;
            }
            // Insertion keeps the farthest lowest on the stack.
            stack.push((Child(node.child[lane]), entry[lane], entering));
            let mut k = stack.len() - 1;
            while k > base && stack[k - 1].1 < entry[lane] {
                stack.swap(k - 1, k);
                k -= 1;
            }
        }
    }
    let mut rows = Lanes([[0.0; 8]; 4]);
    let columns = [met.t, met.id, met.v / met.det, met.w / met.det];
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
    true
}
dispatch! {
    /// Eight of [`Occluders::closest_hits`] on an instruction set.
    fn closest_of = closest_of_kernel(occluders: &Occluders, fan: &Fan<'_>, hits: &mut [Option<Hit>; 8], scratch: &mut Scratch) -> bool
}
