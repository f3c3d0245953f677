//! Rays: what they meet first, and whether they meet anything.

use crate::{
    Occluders, Scratch,
    node::{Child, Leaf, Node},
    sweep::Lanes,
    watertight::WatertightRay,
};
use linelit_geometry::{DVec3, Vector3};
use linelit_simd::{Simd, dispatch};
use std::ops::Range;

/// A ray, or a piece of one: `origin + t·direction` for `t_min ≤ t ≤ t_max`. The direction need
/// not have unit length; `t` is in units of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where t = 0.
    pub origin: DVec3,
    /// What one unit of t moves by.
    pub direction: DVec3,
    /// Least t.
    pub t_min: f64,
    /// Largest t, possibly infinite.
    pub t_max: f64,
}

impl Ray {
    /// The whole ray: 0 ≤ t, without end.
    #[must_use]
    pub fn new(origin: impl Vector3, direction: impl Vector3) -> Self {
        Self {
            origin: origin.dvec3(),
            direction: direction.dvec3(),
            t_min: 0.0,
            t_max: f64::INFINITY,
        }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle's number in the list the occluders were built from.
    pub triangle: u32,
    /// Distance in units of the ray's direction.
    pub t: f64,
    /// Barycentric coordinates of the triangle's second and third corner.
    pub barycentric: [f64; 2],
}

impl Occluders {
    /// The nearest triangle that the ray meets; among equally near ones, that with the smallest
    /// number, and solid ones before those with holes.
    ///
    /// Watertight: a ray towards a shared edge or corner meets one of the triangles there. Of those
    /// with holes, it is the nearest that hides what is behind it.
    pub fn closest_hit(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        scratch.counters.rays += 1;
        let hit = closest(self.isa, self, ray, scratch);
        match &self.holes {
            None => hit,
            Some(holes) => holes.closest(ray, hit, scratch),
        }
    }

    /// Whether the ray meets any triangle but the solid ones numbered in `exclude`.
    ///
    /// The same triangles count as for [`Occluders::closest_hit`].
    pub fn any_hit(&self, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool {
        scratch.counters.rays += 1;
        any(self.isa, self, ray, exclude, scratch) || self.any_with_holes(ray, scratch)
    }

    /// Whether a triangle with holes hides something from the ray.
    #[inline]
    pub(crate) fn any_with_holes(&self, ray: &Ray, scratch: &mut Scratch) -> bool {
        match &self.holes {
            None => false,
            Some(holes) => holes.any(ray, scratch),
        }
    }
}

/// A ray in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayQuery {
    exact: WatertightRay,
    t_min: f64,
    t_max: f64,
    /// Excluded triangles: first and number.
    exclude: (u32, u32),
    /// Which row of a node's bounds the ray enters and leaves through, per axis.
    enter: [usize; 3],
    leave: [usize; 3],
    inverse: [f32; 3],
    /// The origin, rounded, and the rest of it in `t = (bound − near) · inverse + offset`, with
    /// room for rounding.
    near: [f32; 3],
    offset_enter: [f32; 3],
    offset_leave: [f32; 3],
    t_min32: f32,
    pub(crate) t_max32: f32,
}

/// 2⁻²⁰, sixteen roundings of `f32`: room for the few operations of a box or triangle test
/// relative to the largest coordinate involved.
pub(crate) const ROOM: f64 = 8.0 * f32::EPSILON as f64;

/// Room for what `f32` cannot hold: its least normal number.
const LEAST: f64 = f32::MIN_POSITIVE as f64;

/// 2⁻⁴⁷, relative to the largest coordinate involved: room for the roundings of `f64` that the test
/// of a triangle moves its corners by, and for that of the second half of an origin.
pub(crate) const SPLIT_ROOM: f64 = 32.0 * f64::EPSILON;

/// 1 − 2⁻²¹: room for four roundings of `f32`, relative to a distance.
pub(crate) const CLOSER: f32 = 1.0 - 4.768_371_6e-7;

/// The largest coordinates that are split in two.
const SPLIT: f64 = 1e30;

/// A coordinate of the origin of rays in two halves, so that how far a box is from there is known
/// relative to that distance: `t = (bound − near) · inverse + offset`, where near is the coordinate
/// rounded to `f32` and the offset makes up for that. `size` is the largest coordinate in the
/// scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    pub(crate) near: f32,
    rest: f64,
    /// Room for rounding, and for directions along which a ray hardly moves.
    room: f64,
    room_along: f64,
    /// The [largest inverse](largest_inverse_at), which stands for such directions.
    largest: f32,
}

impl Split {
    #[allow(clippy::cast_possible_truncation, reason = "the rest is kept")]
    #[inline(always)]
    pub(crate) fn new(origin: f64, size: f64, largest: f64) -> Self {
        let room_along = ROOM * size;
        let (near, room) = if size > SPLIT {
            (0.0, room_along)
        } else {
            (origin as f32, SPLIT_ROOM * size + LEAST)
        };
        Self {
            near,
            rest: origin - f64::from(near),
            room,
            room_along,
            largest: largest as f32,
        }
    }

    /// The offset for an inverse, with room for rounding: less, or more where `sign` is positive.
    #[allow(clippy::cast_possible_truncation, reason = "the room allows for it")]
    #[inline(always)]
    pub(crate) fn offset(&self, inverse: f32, sign: f64) -> f32 {
        let wide = f64::from(inverse);
        let room = if inverse.abs() < self.largest {
            self.room
        } else {
            self.room_along
        };
        (sign * (room * wide.abs()) - self.rest * wide) as f32
    }
}

/// The largest reciprocal of a direction's component that boxes are tested with in a scene of this
/// size: smaller components move the ray by less than the room over any distance in `f32`.
pub(crate) fn largest_inverse_at(size: f64) -> f64 {
    (1e36 / size).min(1e37)
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl RayQuery {
    /// `None` for a ray that cannot meet anything: not finite, without direction, or empty.
    ///
    /// Inlined into the kernels, so that it is never copied.
    #[inline(always)]
    pub(crate) fn new(occluders: &Occluders, ray: &Ray, exclude: &Range<u32>) -> Option<Self> {
        let d = ray.direction;
        let o = ray.origin - occluders.origin;
        let nodes = &occluders.hierarchy.nodes;
        let finite = d * 0.0 + o * 0.0 == DVec3::ZERO;
        if !finite || d == DVec3::ZERO || !(ray.t_min <= ray.t_max) || nodes.is_empty() {
            return None;
        }
        let exact = WatertightRay::new(o, d);
        let (mut size, mut largest_inverse) = (occluders.extent, occluders.largest_inverse);
        let from = o.abs().max_element();
        if from > size {
            (size, largest_inverse) = (from, largest_inverse_at(from));
        }
        let mut q = Self {
            exact,
            t_min: ray.t_min,
            t_max: ray.t_max,
            exclude: (exclude.start, exclude.end.saturating_sub(exclude.start)),
            enter: [0; 3],
            leave: [0; 3],
            inverse: [0.0; 3],
            near: [0.0; 3],
            offset_enter: [0.0; 3],
            offset_leave: [0.0; 3],
            t_min32: ((ray.t_min - ray.t_min.abs() * ROOM - LEAST) as f32).max(-1e30),
            t_max32: ((ray.t_max + ray.t_max.abs() * ROOM + LEAST) as f32).min(1e30),
        };
        for axis in 0..3 {
            let inverse = (1.0 / d[axis]).clamp(-largest_inverse, largest_inverse) as f32;
            let split = Split::new(o[axis], size, largest_inverse);
            q.inverse[axis] = inverse;
            q.near[axis] = split.near;
            q.offset_enter[axis] = split.offset(inverse, -1.0);
            q.offset_leave[axis] = split.offset(inverse, 1.0);
            let negative = usize::from(inverse < 0.0);
            q.enter[axis] = axis + 3 * negative;
            q.leave[axis] = axis + 3 * (1 - negative);
        }
        Some(q)
    }

    /// Where the ray enters and leaves the slabs of a node's boxes between two planes.
    #[inline(always)]
    fn along<S: Simd>(&self, s: S, node: &Node, axis: usize) -> (S::F, S::F) {
        let (inverse, near) = (s.splat(self.inverse[axis]), s.splat(self.near[axis]));
        let enter = s.load(&node.bounds[self.enter[axis]]) - near;
        let leave = s.load(&node.bounds[self.leave[axis]]) - near;
        (
            s.fma(enter, inverse, s.splat(self.offset_enter[axis])),
            s.fma(leave, inverse, s.splat(self.offset_leave[axis])),
        )
    }

    /// The boxes of a node that the ray may enter before `t_max`, and where.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node, t_max: f32) -> (u8, S::F) {
        let ((x0, x1), (y0, y1), (z0, z1)) = (
            self.along(s, node, 0),
            self.along(s, node, 1),
            self.along(s, node, 2),
        );
        let near = s.max(s.max(x0, y0), s.max(z0, s.splat(self.t_min32))) * CLOSER;
        let far = s.min(s.min(x1, y1), s.min(z1, s.splat(t_max)));
        (s.le(near, far) & node.valid, near)
    }

    /// The triangles of a leaf that the ray meets between `t_min` and `t_max`, and where:
    /// [`WatertightRay::intersect`] for eight, to the bit.
    ///
    /// Nothing is left to a test in single precision first: half of the leaves hold a triangle
    /// that it could not exclude, such as the one that a shadow ray begins on.
    #[inline(always)]
    pub(crate) fn meets<S: Simd>(&self, s: S, leaf: &Leaf) -> (u8, S::D) {
        let [ax, ay, az] = self.sheared(s, &leaf.vertices, 0);
        let [bx, by, bz] = self.sheared(s, &leaf.vertices, 3);
        let [cx, cy, cz] = self.sheared(s, &leaf.vertices, 6);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let zero = s.dsplat(0.0);
        let negative = s.dlt(u, zero) | s.dlt(v, zero) | s.dlt(w, zero);
        let positive = s.dlt(zero, u) | s.dlt(zero, v) | s.dlt(zero, w);
        let outside = negative & positive;
        if s.bits(outside) == 0xff {
            return (0, zero);
        }
        let det = u + v + w;
        let t = (u * az + v * bz + w * cz) * self.exact.shear[2] / det;
        let some = s.dlt(det, zero) | s.dlt(zero, det);
        let within = s.dle(s.dsplat(self.t_min), t) & s.dle(t, s.dsplat(self.t_max));
        (s.bits(some & within & !outside), t)
    }

    /// A vertex of each triangle in the ray's coordinates: as [`WatertightRay`] has them.
    #[inline(always)]
    fn sheared<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], first: usize) -> [S::D; 3] {
        let [kx, ky, kz] = self.exact.axes;
        let o = &self.exact.origin;
        let x = s.widen(s.load(&vertices[first + kx])) - o[kx];
        let y = s.widen(s.load(&vertices[first + ky])) - o[ky];
        let z = s.widen(s.load(&vertices[first + kz])) - o[kz];
        [x - z * self.exact.shear[0], y - z * self.exact.shear[1], z]
    }

    /// Which of the triangles `among` those of a leaf the ray meets first, and before what it met
    /// at `t_max`, if any: then the ray ends there.
    #[inline(always)]
    fn nearer<S: Simd>(
        &mut self,
        s: S,
        leaf: &Leaf,
        among: u8,
        best: Option<(&Leaf, usize)>,
    ) -> Option<usize> {
        let (met, t) = self.meets(s, leaf);
        let mut met = met & among;
        if met == 0 {
            return None;
        }
        let mut at = Lanes([0.0; 8]);
        s.dstore(t, &mut at);
        let mut least = best.map(|(leaf, lane)| leaf.id[lane]);
        let mut found = None;
        while met != 0 {
            let lane = met.trailing_zeros() as usize;
            met &= met - 1;
            #[allow(clippy::float_cmp, reason = "the tie rule is about equal bits")]
            let tie = at[lane] == self.t_max && least.is_none_or(|id| leaf.id[lane] < id);
            if at[lane] < self.t_max || tie {
                self.t_max = at[lane];
                least = Some(leaf.id[lane]);
                found = Some(lane);
            }
        }
        self.end_at(self.t_max);
        found
    }

    /// Ends the ray at what it has met.
    #[inline(always)]
    pub(crate) fn end_at(&mut self, t: f64) {
        self.t_max = t;
        self.t_max32 = (t as f32).next_up().min(self.t_max32);
    }

    /// [`WatertightRay::intersect`] for a triangle of a leaf.
    #[inline(always)]
    pub(crate) fn intersect(&self, leaf: &Leaf, lane: usize) -> Option<(f64, [f64; 2])> {
        self.exact.intersect(&leaf.triangle(lane))
    }

    /// Visits leaves that the ray enters, nearer ones mostly first, with a bit for each triangle in
    /// use; until `visit`, which may shorten the ray, says so.
    #[inline(always)]
    pub(crate) fn nearest_first<'a, S: Simd>(
        &mut self,
        s: S,
        occluders: &'a Occluders,
        scratch: &mut Scratch,
        mut visit: impl FnMut(&mut Self, &'a Leaf, u8) -> bool,
    ) {
        let hierarchy = &*occluders.hierarchy;
        let counters = &mut scratch.counters;
        let stack = &mut scratch.near_stack;
        stack.clear();
        stack.push((Child::node(0), f32::NEG_INFINITY));
        while let Some((child, near)) = stack.pop() {
            if near > self.t_max32 {
                continue;
            }
            if child.is_leaf() {
                counters.triangle_tests += u64::from(child.count());
                if visit(self, &hierarchy.leaves[child.index()], child.mask()) {
                    return;
                }
                continue;
            }
            let node = &hierarchy.nodes[child.index()];
            counters.node_tests += u64::from(node.valid.count_ones());
            let (mut found, near) = self.boxes(s, node, self.t_max32);
            hierarchy.prefetch(s, node, found);
            let mut entry = Lanes([0.0; 8]);
            s.store(near, &mut entry);
            let base = stack.len();
            while found != 0 {
                let lane = found.trailing_zeros() as usize;
                found &= found - 1;
                // Insertion keeps the farthest lowest on the stack.
                stack.push((Child(node.child[lane]), entry[lane]));
                let mut k = stack.len() - 1;
                while k > base && stack[k - 1].1 < entry[lane] {
                    stack.swap(k - 1, k);
                    k -= 1;
                }
            }
        }
    }

    /// Whether the ray meets any of the triangles `among` those of a leaf that are not excluded.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, s: S, leaf: &Leaf, among: u8) -> bool {
        let met = self.meets(s, leaf).0 & among;
        met != 0 && met & !s.in_range(&leaf.id, self.exclude.0, self.exclude.1) != 0
    }
}

#[inline(always)]
fn any_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    ray: &Ray,
    exclude: &Range<u32>,
    scratch: &mut Scratch,
) -> bool {
    let Some(q) = RayQuery::new(occluders, ray, exclude) else {
        return false;
    };
    let hierarchy = &*occluders.hierarchy;
    let Scratch {
        counters,
        stack,
        last,
        ..
    } = scratch;
    // What met the latest ray from here often meets the next. Only from here, so that what is
    // tested does not depend on which points a thread was given.
    if let Some((origin, child)) = *last
        && origin == ray.origin
        && let Some(leaf) = hierarchy.leaves.get(child.leaf_index())
    {
        counters.triangle_tests += u64::from(child.count());
        if q.any(s, leaf, child.mask()) {
            return true;
        }
    }
    if stack.len() < occluders.stack_size {
        stack.resize(occluders.stack_size, 0);
    }
    let mut top = 0;
    let mut at = 0;
    loop {
        let node = &hierarchy.nodes[at as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (found, _) = q.boxes(s, node, q.t_max32);
        let mut leaves = found & node.leaf;
        while leaves != 0 {
            let lane = highest(leaves);
            leaves &= !(1 << lane);
            let child = Child(node.child[lane]);
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.leaf_index()];
            if q.any(s, leaf, child.mask()) {
                *last = Some((ray.origin, child));
                return true;
            }
        }
        let inner = found & !node.leaf;
        if inner != 0 {
            // The next one does not wait for the stack.
            let lane = highest(inner);
            at = node.child[lane];
            let others = inner & !(1 << lane);
            s.pack(others, &node.child, stack, top);
            top += others.count_ones() as usize;
        } else if top > 0 {
            top -= 1;
            at = stack[top];
        } else {
            return false;
        }
    }
}

/// The highest bit of a number that is not zero.
#[inline(always)]
fn highest(bits: u8) -> usize {
    (7 - bits.leading_zeros()) as usize
}

#[inline(always)]
fn closest_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    ray: &Ray,
    scratch: &mut Scratch,
) -> Option<Hit> {
    let mut q = RayQuery::new(occluders, ray, &(0..0))?;
    // Met at `q.t_max`.
    let mut best: Option<(&Leaf, usize)> = None;
    q.nearest_first(s, occluders, scratch, |q, leaf, among| {
        if let Some(lane) = q.nearer(s, leaf, among, best) {
            best = Some((leaf, lane));
        }
        false
    });
    let (leaf, lane) = best?;
    let (t, barycentric) = q.intersect(leaf, lane)?;
    Some(Hit {
        triangle: leaf.id[lane],
        t,
        barycentric,
    })
}

dispatch! {
    /// [`Occluders::any_hit`] on an instruction set.
    pub(crate) fn any = any_kernel(occluders: &Occluders, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool
}
dispatch! {
    /// [`Occluders::closest_hit`] on an instruction set.
    pub(crate) fn closest = closest_kernel(occluders: &Occluders, ray: &Ray, scratch: &mut Scratch) -> Option<Hit>
}
