//! Single rays through the hierarchy: the box test in `f32` with error bounds, the triangle test in
//! `f64`, and the walks for any hit and for the closest hit.

use crate::{
    bvh::{Bvh, largest_inverse_at},
    counters::Counters,
    lanes::Lanes,
    node::{Child, Leaf, Node},
    rays::watertight::WatertightRay,
    walk::{NearestFirst, Waiting, highest, in_any_order, nearest_first},
};
use linelit_geometry::{DVec3, Margins, Vector3};
use linelit_simd::{Simd, dispatch};
use std::ops::{ControlFlow, Range};

/// A ray or a segment of one: `origin + t·direction` for `t_min ≤ t ≤ t_max`. The direction need
/// not have unit length; `t` is in units of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point where t = 0.
    pub origin: DVec3,
    /// The vector by which the ray advances per unit of t.
    pub direction: DVec3,
    /// The least t, which must not be negative.
    pub t_min: f64,
    /// The largest t, possibly infinite.
    pub t_max: f64,
}

impl Ray {
    /// Creates a ray without end: all t ≥ 0.
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

/// Where a ray hits a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The triangle's index in the list that the occluders were built from.
    pub triangle: u32,
    /// The distance along the ray, in units of the length of its direction.
    pub t: f64,
    /// The barycentric coordinates of the triangle's second and third corner at the hit.
    pub barycentric: [f64; 2],
}

/// A ray in the hierarchy's coordinates, prepared for tests of boxes and triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayQuery {
    exact: WatertightRay,
    t_min: f64,
    t_max: f64,
    /// The excluded triangles: the index of the first, and how many.
    exclude: (u32, u32),
    /// For each axis, the rows of a node's bounds through which the ray enters and leaves.
    enter: [usize; 3],
    leave: [usize; 3],
    inverse: [f32; 3],
    /// The origin rounded to `f32`; the inverses and offsets of the planes at which the ray enters
    /// and leaves boxes are such that `t = (bound − near) · inverse + offset`, with a margin for
    /// rounding ([`Split`]).
    near: [f32; 3],
    offset_enter: [f32; 3],
    offset_leave: [f32; 3],
    t_min32: f32,
    pub(crate) t_max32: f32,
}

/// 2⁻²⁰, sixteen roundings of `f32`: the margin for the few operations of a box or triangle test,
/// relative to the largest coordinate involved. What is outside by less than the margin counts as
/// inside.
pub(crate) const ROOM: f64 = 8.0 * f32::EPSILON as f64;

/// The margin for values below the least normal `f32`, whose relative rounding error is unbounded.
const LEAST: f64 = f32::MIN_POSITIVE as f64;

/// 2⁻⁴⁷, relative to the largest coordinate involved: the margin for the roundings in `f64` by
/// which the triangle test moves corners, and for the rounding of the remainder of an origin.
pub(crate) const SPLIT_ROOM: f64 = 32.0 * f64::EPSILON;

/// 1 − 2⁻²¹: the factor that makes a distance smaller by four roundings of `f32`.
pub(crate) const CLOSER: f32 = 1.0 - 4.768_371_6e-7;

/// The largest absolute coordinate of a scene up to which ray origins are split ([`Split`]). With
/// larger coordinates, the origin is not split and the margin [`ROOM`] is used.
const SPLIT: f64 = 1e30;

/// One coordinate of a ray's origin as the sum of an `f32` and a remainder, so that the error of
/// the distance to a box is relative to that distance and not to the scene: `t = (bound − near) ·
/// inverse + offset`, where `near` is the coordinate rounded to `f32`, and the offset makes up for
/// its rounding. The scene's `size` is its largest absolute coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    pub(crate) near: f32,
    rest: f64,
    /// The margins for rounding, in units of length: for most directions, and for directions in
    /// which the ray hardly moves along this axis.
    room: f64,
    room_along: f64,
    /// The [largest inverse](crate::bvh::largest_inverse_at), which directions of the second kind
    /// have.
    largest: f32,
}

impl Split {
    /// Splits one coordinate of an origin. `size` is the largest absolute coordinate of the scene
    /// or the origin, and `largest` the largest inverse for that size.
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

    /// Returns the offset that belongs to the reciprocal `inverse` of a direction's component, with
    /// the margin subtracted if `sign` is −1, or added if it is 1.
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

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl RayQuery {
    /// Prepares a ray; `None` if it cannot hit anything: a coordinate is not finite, the direction
    /// is zero, `t_min` exceeds `t_max`, or the hierarchy is empty.
    ///
    /// The function is inlined into the kernels, so that the result is never copied.
    #[inline(always)]
    pub(crate) fn new(bvh: &Bvh, ray: &Ray, exclude: &Range<u32>) -> Option<Self> {
        let d = ray.direction;
        let o = ray.origin - bvh.origin;
        let nodes = &bvh.hierarchy.nodes;
        let finite = d * 0.0 + o * 0.0 == DVec3::ZERO;
        if !finite || d == DVec3::ZERO || !(ray.t_min <= ray.t_max) || nodes.is_empty() {
            return None;
        }
        let exact = WatertightRay::new(o, d);
        // The tests' margins are relative to the largest coordinate, of the scene or of the origin.
        let (mut size, mut largest_inverse) = (bvh.extent, bvh.largest_inverse);
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
        // Prepare the slab test of each axis.
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

    /// Returns the distances at which the ray enters and leaves the slabs of a node's boxes along
    /// an axis, rounded outward.
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

    /// Returns a bit for each box of a node that the ray may enter before `t_max`, and lower bounds
    /// of the distances at which it enters the boxes.
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

    /// Returns a bit for each triangle of a leaf that the ray hits between `t_min` and `t_max`, and
    /// the distances of the hits. The results are bit-identical to [`WatertightRay::intersect`] for
    /// each of the eight triangles.
    ///
    /// There is no test in single precision first: half of the leaves hold a triangle that such a
    /// test could not exclude, such as the one on which a shadow ray begins.
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

    /// Returns one vertex of each triangle in the ray's coordinates, as in [`WatertightRay`];
    /// `first` is the index of the vertex's first row.
    #[inline(always)]
    fn sheared<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], first: usize) -> [S::D; 3] {
        let [kx, ky, kz] = self.exact.axes;
        let o = &self.exact.origin;
        let x = s.widen(s.load(&vertices[first + kx])) - o[kx];
        let y = s.widen(s.load(&vertices[first + ky])) - o[ky];
        let z = s.widen(s.load(&vertices[first + kz])) - o[kz];
        [x - z * self.exact.shear[0], y - z * self.exact.shear[1], z]
    }

    /// Finds which of a leaf's triangles in the mask `among` the ray hits first, and shortens the
    /// ray to end there. A hit at exactly `t_max` counts only if the triangle's index is smaller
    /// than `best`, the index of the triangle that the ray has hit at `t_max`, if any.
    #[inline(always)]
    fn nearer<S: Simd>(
        &mut self,
        s: S,
        leaf: &Leaf,
        among: u8,
        best: Option<u32>,
    ) -> Option<usize> {
        let (met, t) = self.meets(s, leaf);
        let mut met = met & among;
        if met == 0 {
            return None;
        }
        let mut at = Lanes([0.0; 8]);
        s.dstore(t, &mut at);
        // Of equally near triangles, the one with the smallest number.
        let mut least = best;
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

    /// Shortens the ray to end at `t`.
    #[inline(always)]
    pub(crate) fn end_at(&mut self, t: f64) {
        self.t_max = t;
        self.t_max32 = (t as f32).next_up().min(self.t_max32);
    }

    /// Computes [`WatertightRay::intersect`] for one triangle of a leaf.
    #[inline(always)]
    pub(crate) fn intersect(&self, leaf: &Leaf, lane: usize) -> Option<(f64, [f64; 2])> {
        self.exact.intersect(&leaf.triangle(lane))
    }

    /// Whether the ray hits a triangle of a leaf in the mask `among` that is not excluded.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, s: S, leaf: &Leaf, among: u8) -> bool {
        let met = self.meets(s, leaf).0 & among;
        met != 0 && met & !s.in_range(&leaf.id, self.exclude.0, self.exclude.1) != 0
    }
}

/// Buffers for single rays.
#[derive(Debug, Default)]
pub(crate) struct RayScratch {
    pub(crate) stack: Vec<u32>,
    pub(crate) waiting: Waiting<()>,
    /// The origin of the latest ray that hit anything, and the leaf of the triangle that it hit.
    pub(crate) last: Option<(DVec3, Child)>,
}

/// Whether a ray hits any triangle.
#[inline(always)]
fn any_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    ray: &Ray,
    exclude: &Range<u32>,
    scratch: &mut RayScratch,
    counters: &mut Counters,
) -> bool {
    let Some(query) = RayQuery::new(bvh, ray, exclude) else {
        return false;
    };
    let hierarchy = &*bvh.hierarchy;
    // Try the leaf that was hit by the latest ray first: a triangle in it often hides the next ray,
    // too. This is done only for rays from the same origin, so that the tests do not depend on
    // which points a thread was given.
    if let Some((origin, child)) = scratch.last
        && origin == ray.origin
        && let Some(leaf) = hierarchy.leaves.get(child.leaf_index())
    {
        counters.triangle_tests += u64::from(child.count());
        if query.any(s, leaf, child.mask()) {
            return true;
        }
    }
    // Walk in any order, since any hit will do.
    let RayScratch { stack, last, .. } = scratch;
    bvh.make_room(stack);
    in_any_order(
        s,
        hierarchy,
        stack,
        #[inline(always)]
        |node| {
            counters.node_tests += u64::from(node.valid.count_ones());
            let (found, _) = query.boxes(s, node, query.t_max32);
            let mut leaves = found & node.leaf;
            while leaves != 0 {
                let lane = highest(leaves);
                leaves &= !(1 << lane);
                let child = Child(node.child[lane]);
                counters.triangle_tests += u64::from(child.count());
                let leaf = &hierarchy.leaves[child.leaf_index()];
                if query.any(s, leaf, child.mask()) {
                    *last = Some((ray.origin, child));
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(found & !node.leaf)
        },
    )
}

/// A walk that calls `visit` for the leaves that a ray enters.
struct AlongRay<'a, F> {
    query: &'a mut RayQuery,
    visit: F,
}

impl<S: Simd, F> NearestFirst<S> for AlongRay<'_, F>
where
    F: FnMut(&mut RayQuery, Child, &Leaf) -> ControlFlow<()>,
{
    type Entry = ();

    #[inline(always)]
    fn wants(&self, _: S, depth: f32, (): ()) -> bool {
        depth <= self.query.t_max32
    }

    #[inline(always)]
    fn open(&mut self, s: S, node: &Node, (): ()) -> (u8, S::F) {
        self.query.boxes(s, node, self.query.t_max32)
    }

    #[inline(always)]
    fn entry(&self, _: S, _: &Node, _: usize) -> Option<()> {
        Some(())
    }

    #[inline(always)]
    fn leaf(&mut self, _: S, child: Child, leaf: &Leaf, (): ()) -> ControlFlow<()> {
        (self.visit)(self.query, child, leaf)
    }
}

impl RayQuery {
    /// Visits leaves that the ray enters, mostly near ones first, until `visit` breaks. `visit` may
    /// shorten the ray.
    #[inline(always)]
    pub(crate) fn nearest_first<S: Simd>(
        &mut self,
        s: S,
        bvh: &Bvh,
        waiting: &mut Waiting<()>,
        counters: &mut Counters,
        visit: impl FnMut(&mut Self, Child, &Leaf) -> ControlFlow<()>,
    ) {
        wait_for_root(waiting, ());
        let mut visitor = AlongRay { query: self, visit };
        nearest_first(s, &bvh.hierarchy, waiting, counters, &mut visitor);
    }
}

/// Starts a walk: the root waits to be visited.
#[inline(always)]
pub(crate) fn wait_for_root<E>(waiting: &mut Waiting<E>, entry: E) {
    waiting.clear();
    waiting.push((Child::node(0), f32::NEG_INFINITY, entry));
}

/// Finds the closest triangle that a ray hits.
#[inline(always)]
fn closest_kernel<S: Simd>(
    s: S,
    bvh: &Bvh,
    ray: &Ray,
    scratch: &mut RayScratch,
    counters: &mut Counters,
) -> Option<Hit> {
    let mut query = RayQuery::new(bvh, ray, &(0..0))?;
    // The closest triangle so far: its leaf, its lane there, and its number; hit at `query.t_max`.
    let mut best: Option<(Child, usize, u32)> = None;
    query.nearest_first(
        s,
        bvh,
        &mut scratch.waiting,
        counters,
        #[inline(always)]
        |q, child, leaf| {
            let number = best.map(|(.., id)| id);
            if let Some(lane) = q.nearer(s, leaf, child.mask(), number) {
                best = Some((child, lane, leaf.id[lane]));
            }
            ControlFlow::Continue(())
        },
    );
    // Compute the barycentric coordinates for the closest triangle only.
    let (child, lane, triangle) = best?;
    let leaf = &bvh.hierarchy.leaves[child.leaf_index()];
    let (t, barycentric) = query.intersect(leaf, lane)?;
    Some(Hit {
        triangle,
        t,
        barycentric,
    })
}

dispatch! {
    /// [`any_kernel`] on an instruction set.
    pub(crate) fn any = any_kernel(bvh: &Bvh, ray: &Ray, exclude: &Range<u32>, scratch: &mut RayScratch, counters: &mut Counters) -> bool
}
dispatch! {
    /// [`closest_kernel`] on an instruction set.
    pub(crate) fn closest = closest_kernel(bvh: &Bvh, ray: &Ray, scratch: &mut RayScratch, counters: &mut Counters) -> Option<Hit>
}

/// The shadow ray from a point to a target on a light, shortened by the margins; `None` if a
/// coordinate or the difference is not finite.
pub(crate) fn shadow_ray(bvh: &Bvh, point: DVec3, target: DVec3, margins: Margins) -> Option<Ray> {
    let direction = target - point;
    (point.is_finite() && direction.is_finite()).then(|| Ray {
        origin: point,
        direction,
        t_min: margins.near(bvh.reach(point), direction.length()),
        t_max: ray_end(margins),
    })
}

/// Returns where a ray towards a light ends, as a fraction of the way: before the light's margin,
/// and at least 2⁻⁴⁰ of the way before the light, since rounding moves the distance of triangles in
/// the light's own plane.
pub(crate) fn ray_end(margins: Margins) -> f64 {
    margins.end().min(1.0 - 9.094_947_017_729_282e-13)
}
