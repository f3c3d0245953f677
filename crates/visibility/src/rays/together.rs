//! Rays from one point that share a walk: all rays of a fan, or eight neighbours.
//!
//! A fan opens a node if any direction of the box of its directions can enter it. Where its rays go
//! apart, and it has looked at more than a few nodes and leaves, those that are still open start
//! anew by eights. Of eight neighbours, each box carries those that enter it: a node is opened once
//! for all of its rays, with the box of the directions of all eight; what that finds is tested
//! against each ray, eight in lanes, so that a ray visits what it would visit alone.
//!
//! Closest hits are found by the operations of
//! [`WatertightRay`](crate::rays::watertight::WatertightRay) to the bit: for rays whose directions
//! have the same longest component, of one sign, its axes are the same.

use crate::{
    bvh::{Bvh, largest_inverse_at},
    counters::Counters,
    lanes::{Lanes, dabs},
    node::{Child, Leaf, Node},
    rays::{
        fan::{Beam, Directions, FAN, Fan, LARGEST, Rays, Tests, one_by_one},
        ray::{Hit, ROOM, RayScratch, wait_for_root},
    },
    walk::{NearestFirst, Waiting, in_any_order, nearest_first},
};
use linelit_geometry::DVec3;
use linelit_simd::{Simd, dispatch};
use std::ops::{ControlFlow, Range};

/// More than a number that was rounded to `f32`, if that is not negative.
const UP: f32 = 1.0 + 2.0 * f32::EPSILON;

/// No triangle: more than all numbers of triangles.
const NONE: f64 = (1_u64 << 32) as f64;

/// Nodes and leaves that so many rays visit together before those that are open go on in
/// groups.
const fn budget(count: usize) -> usize {
    3 + count / 16
}

/// Buffers for rays that are traced together.
#[derive(Debug, Default)]
pub(crate) struct FanScratch {
    directions: Box<Directions>,
    /// Eight of them.
    group: Box<Directions>,
    /// Nodes and leaves that wait, with a bit for each of eight rays that visits them.
    waiting: Waiting<u8>,
}

/// Eight rays, ready for boxes: as [`Beam`], but that which side is entered is found for each ray.
#[derive(Default)]
pub(crate) struct Slabs {
    inverse: [[f32; 8]; 3],
    offset: [[f32; 8]; 3],
    room: [[f32; 8]; 3],
}

impl Slabs {
    #[inline(always)]
    pub(crate) fn new<S: Simd>(s: S, rays: &Rays, tests: &Tests) -> Self {
        let (origin, size) = (tests.origin, tests.size);
        let largest = largest_inverse_at(size);
        let mut out = Self::default();
        for k in 0..3 {
            let inverse = s.dsplat(1.0) / s.dload(&rays[k]);
            let inverse = s.dmin(s.dmax(inverse, s.dsplat(-largest)), s.dsplat(largest));
            let inverse = s.narrow(inverse);
            let wide = s.widen(inverse);
            s.store(inverse, &mut out.inverse[k]);
            s.store(s.narrow(wide * -origin[k]), &mut out.offset[k]);
            s.store(s.narrow(dabs(s, wide) * (ROOM * size)), &mut out.room[k]);
        }
        out
    }

    /// The rays that may enter a box of a node before each comes to `far`.
    #[inline(always)]
    pub(crate) fn enter<S: Simd>(&self, s: S, node: &Node, lane: usize, mut far: S::F) -> u8 {
        let mut near = s.splat(0.0);
        for k in 0..3 {
            let inverse = s.load(&self.inverse[k]);
            let offset = s.load(&self.offset[k]);
            let room = s.load(&self.room[k]);
            let a = s.fma(s.splat(node.bounds[k][lane]), inverse, offset);
            let b = s.fma(s.splat(node.bounds[k + 3][lane]), inverse, offset);
            near = s.max(s.min(a, b) - room, near);
            far = s.min(s.max(a, b) + room, far);
        }
        s.le(near, far)
    }
}

/// Eight rays on their walk: which boxes each of them enters.
struct Eight {
    beam: Beam,
    slabs: Slabs,
    /// The rays that the node which is open was opened for.
    mine: u8,
}

impl Eight {
    /// Eight rays with directions within `bounds`, before their walk.
    #[inline(always)]
    fn new<S: Simd>(s: S, rays: &Rays, tests: &Tests, bounds: [[f64; 3]; 2]) -> Self {
        Self {
            beam: tests.beam(bounds),
            slabs: Slabs::new(s, rays, tests),
            mine: 0,
        }
    }

    /// Those of the rays that may enter a box of the open node before each comes to `far`.
    #[inline(always)]
    fn enter<S: Simd>(&self, s: S, node: &Node, lane: usize, far: S::F) -> Option<u8> {
        let entering = self.mine & self.slabs.enter(s, node, lane, far);
        (entering != 0).then_some(entering)
    }
}

/// Whether rays of a fan are such as the tests of this module are for, and the largest coordinate
/// of the origin and all vertices.
#[inline(always)]
fn sane(bvh: &Bvh, fan: &Fan<'_>) -> (bool, f64) {
    let origin = fan.origin - bvh.origin;
    let size = bvh.extent.max(origin.abs().max_element());
    let times = fan.t_min >= 0.0 && fan.t_max >= fan.t_min;
    let is_sane = origin.is_finite() && size <= LARGEST && times && !bvh.hierarchy.nodes.is_empty();
    (is_sane, size)
}

#[inline(always)]
fn any_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    fan: &Fan<'_>,
    exclude: &Range<u32>,
    scratch: &mut RayScratch,
    together: &mut FanScratch,
    counters: &mut Counters,
) -> u64 {
    let (is_sane, size) = sane(bvh, fan);
    let bounds = together.directions.set(s, fan);
    let Some(bounds) = bounds.filter(|_| is_sane && fan.t_max <= LARGEST) else {
        return one_by_one(bvh, fan, fan.all(), exclude, scratch, counters);
    };
    let origin = (fan.origin - bvh.origin).to_array();
    let tests = Tests::new(fan, exclude, origin, size, bounds);
    let beam = tests.beam(bounds);
    let hierarchy = &*bvh.hierarchy;
    let (directions, mut open) = (&together.directions, fan.all());
    let RayScratch { stack, last, .. } = scratch;
    // As for single rays.
    if let Some((origin, child)) = *last
        && origin == fan.origin
        && let Some(leaf) = hierarchy.leaves.get(child.leaf_index())
    {
        counters.triangle_tests += u64::from(child.count());
        open &= !tests.meets(s, &beam, leaf, child, &directions.0, open);
    }
    bvh.make_room(stack);
    let (mut visited, budget) = (0, budget(fan.directions.len()));
    let ended = in_any_order(
        s,
        hierarchy,
        stack,
        #[inline(always)]
        |node| {
            if open == 0 || visited >= budget {
                return ControlFlow::Break(());
            }
            counters.node_tests += u64::from(node.valid.count_ones());
            let (found, _) = beam.boxes(s, node);
            let mut leaves = found & node.leaf;
            visited += 1 + leaves.count_ones() as usize;
            while leaves != 0 && open != 0 {
                let child = Child(node.child[leaves.trailing_zeros() as usize]);
                leaves &= leaves - 1;
                let leaf = &hierarchy.leaves[child.leaf_index()];
                counters.triangle_tests += u64::from(child.count());
                let hidden = tests.meets(s, &beam, leaf, child, &directions.0, open);
                if hidden != 0 {
                    *last = Some((fan.origin, child));
                    open &= !hidden;
                }
            }
            ControlFlow::Continue(found & !node.leaf)
        },
    );
    if ended && open != 0 {
        open = apart(s, bvh, &tests, fan, open, bounds, together, counters);
    }
    fan.all() & !open
}

/// Finds which of the `open` rays of a fan, whose directions are within `bounds`, are still open
/// after a walk for each eight neighbours.
#[allow(clippy::too_many_arguments, reason = "a step of one kernel")]
#[inline(always)]
fn apart<S: Simd>(
    s: S,
    bvh: &Bvh,
    tests: &Tests,
    fan: &Fan<'_>,
    mut open: u64,
    bounds: [[f64; 3]; 2],
    scratch: &mut FanScratch,
    counters: &mut Counters,
) -> u64 {
    let FanScratch {
        directions,
        group: few,
        waiting,
    } = scratch;
    let (order, count) = along_curve(directions, open, bounds);
    for group in order[..count].chunks(8) {
        let eight: [DVec3; 8] = std::array::from_fn(|lane| {
            fan.directions[usize::from(group[lane.min(group.len() - 1)])]
        });
        let directions = &eight[..];
        // The bounds of all hold for some, too.
        let bounds = few.set(s, &Fan { directions, ..*fan }).unwrap_or(bounds);
        let rays = &few.0[..1];
        let all = 0xff_u8 >> (8 - group.len());
        let mut visitor = AnyOfEight {
            eight: Eight::new(s, &rays[0], tests, bounds),
            tests,
            rays,
            open: all,
            alone: [None; 8],
        };
        wait_for_root(waiting, all);
        nearest_first(s, &bvh.hierarchy, waiting, counters, &mut visitor);
        for (lane, i) in group.iter().enumerate() {
            open &= !(u64::from(!visitor.open >> lane & 1) << i);
        }
    }
    open
}

/// Looks for triangles that hide eight rays.
struct AnyOfEight<'a> {
    eight: Eight,
    tests: &'a Tests,
    rays: &'a [Rays],
    /// The rays that are not known to be hidden.
    open: u8,
    /// The direction of a ray that is left alone, in place of the box of all.
    alone: [Option<Beam>; 8],
}

impl AnyOfEight<'_> {
    /// The box of the directions of some rays.
    #[inline(always)]
    fn beam(&self, rays: u8) -> &Beam {
        let alone = &self.alone[rays.trailing_zeros() as usize];
        match alone {
            Some(beam) if rays.is_power_of_two() => beam,
            _ => &self.eight.beam,
        }
    }
}

impl<S: Simd> NearestFirst<S> for AnyOfEight<'_> {
    type Entry = u8;

    #[inline(always)]
    fn wants(&self, _: S, _: f32, rays: u8) -> bool {
        rays & self.open != 0
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, rays: u8) -> (u8, S::F) {
        let mine = rays & self.open;
        let i = mine.trailing_zeros() as usize;
        if mine.is_power_of_two() && self.alone[i].is_none() {
            let direction = [0, 1, 2].map(|k| self.rays[0][k][i]);
            self.alone[i] = Some(self.tests.beam([direction; 2]));
        }
        self.eight.mine = mine;
        self.beam(mine).boxes(s, node)
    }

    #[inline(always)]
    fn entry(&self, s: S, node: &Node, lane: usize) -> Option<u8> {
        let mine = self.eight.mine;
        match mine.is_power_of_two() {
            true => Some(mine),
            false => self
                .eight
                .enter(s, node, lane, s.splat(self.eight.beam.t_max)),
        }
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, rays: u8) -> ControlFlow<()> {
        let mine = rays & self.open;
        let beam = self.beam(mine);
        let hidden = self
            .tests
            .meets(s, beam, leaf, child, self.rays, mine.into());
        self.open &= !hidden.to_le_bytes()[0];
        match self.open {
            0 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    }
}

/// The numbers of the open rays along a Z curve across the two widest sides of their box, and how
/// many they are.
#[allow(clippy::cast_possible_truncation, reason = "all are below 64")]
fn along_curve(
    Directions(rays): &Directions,
    mut open: u64,
    [low, high]: [[f64; 3]; 2],
) -> ([u8; FAN], usize) {
    let extent: [f64; 3] = std::array::from_fn(|k| high[k] - low[k]);
    let thin = (0..3)
        .min_by(|&i, &j| extent[i].total_cmp(&extent[j]))
        .unwrap_or(0);
    let axes = [(thin + 1) % 3, (thin + 2) % 3];
    let scale = axes.map(|k| 8.0 / extent[k].max(1e-30));
    let mut cells = [0_u8; FAN];
    let mut counts = [0_u8; 65];
    let all = open;
    while open != 0 {
        let i = open.trailing_zeros() as usize;
        open &= open - 1;
        let mut cell = 0;
        for (j, k) in axes.into_iter().enumerate() {
            let x = ((rays[i / 8][k][i % 8] - low[k]) * scale[j]).min(7.0) as u32;
            cell |= ((x & 1) | (x & 2) << 1 | (x & 4) << 2) << j;
        }
        cells[i] = cell as u8;
        counts[cell as usize + 1] += 1;
    }
    for i in 0..64 {
        counts[i + 1] += counts[i];
    }
    let mut order = [0; FAN];
    open = all;
    while open != 0 {
        let i = open.trailing_zeros() as usize;
        open &= open - 1;
        let at = &mut counts[cells[i] as usize];
        order[*at as usize] = i as u8;
        *at += 1;
    }
    (order, all.count_ones() as usize)
}

/// The triangles that eight rays have met so far.
struct Met<S: Simd> {
    /// The distance at which they begin.
    t_min: S::D,
    /// The distance at which they end: that of what they have met.
    t: S::D,
    /// The triangle's number, or [`NONE`].
    id: S::D,
    /// Edge functions of the second and third corner, and the sum of all.
    v: S::D,
    w: S::D,
    det: S::D,
}

impl<S: Simd> Met<S> {
    /// The hits.
    #[inline(always)]
    fn hand_out(&self, s: S, hits: &mut [Option<Hit>; 8]) {
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

/// Looks for the triangles that eight rays meet first.
struct ClosestOfEight<S: Simd> {
    eight: Eight,
    sheared: Sheared<S>,
    met: Met<S>,
    /// The end of each ray: the distance of what it has met, rounded up.
    reach: S::F,
}

impl<S: Simd> NearestFirst<S> for ClosestOfEight<S> {
    type Entry = u8;

    #[inline(always)]
    fn wants(&self, s: S, depth: f32, rays: u8) -> bool {
        rays & s.le(s.splat(depth), self.reach) != 0
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, rays: u8) -> (u8, S::F) {
        self.eight.mine = rays;
        self.eight.beam.boxes(s, node)
    }

    #[inline(always)]
    fn entry(&self, s: S, node: &Node, lane: usize) -> Option<u8> {
        self.eight.enter(s, node, lane, self.reach)
    }

    #[inline(always)]
    fn leaf(&mut self, s: S, child: Child, leaf: &Leaf, _: u8) -> ControlFlow<()> {
        let mut any = false;
        for lane in 0..child.count() as usize {
            any |= self.sheared.meet(s, leaf, lane, &mut self.met);
        }
        if any {
            self.reach = s.narrow(self.met.t) * UP;
        }
        ControlFlow::Continue(())
    }
}

/// Finds what up to eight rays meet first; false if they are not for these tests.
#[inline(always)]
fn closest_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    fan: &Fan<'_>,
    hits: &mut [Option<Hit>; 8],
    scratch: &mut FanScratch,
    counters: &mut Counters,
) -> bool {
    let (is_sane, size) = sane(bvh, fan);
    let Some(bounds) = scratch.directions.set(s, fan).filter(|_| is_sane) else {
        return false;
    };
    let origin = (fan.origin - bvh.origin).to_array();
    let rays = &scratch.directions.0[0];
    let Some(sheared) = Sheared::new(s, rays, origin, bounds) else {
        return false;
    };
    let tests = Tests::new(fan, &(0..0), origin, size, bounds);
    let eight = Eight::new(s, rays, &tests, bounds);
    let (zero, one) = (s.dsplat(0.0), s.dsplat(1.0));
    let mut visitor = ClosestOfEight {
        reach: s.splat(eight.beam.t_max),
        eight,
        sheared,
        met: Met {
            t_min: s.dsplat(fan.t_min),
            t: s.dsplat(fan.t_max),
            id: s.dsplat(NONE),
            v: zero,
            w: zero,
            det: one,
        },
    };
    wait_for_root(&mut scratch.waiting, 0xff);
    nearest_first(
        s,
        &bvh.hierarchy,
        &mut scratch.waiting,
        counters,
        &mut visitor,
    );
    visitor.met.hand_out(s, hits);
    true
}

dispatch! {
    /// Finds which rays of a fan are hidden, on an instruction set.
    pub(crate) fn any = any_kernel(bvh: &Bvh, fan: &Fan<'_>, exclude: &Range<u32>, scratch: &mut RayScratch, together: &mut FanScratch, counters: &mut Counters) -> u64
}
dispatch! {
    /// Finds what up to eight rays meet first, on an instruction set.
    pub(crate) fn closest = closest_kernel(bvh: &Bvh, fan: &Fan<'_>, hits: &mut [Option<Hit>; 8], scratch: &mut FanScratch, counters: &mut Counters) -> bool
}
