//! Rays: what they meet first, and whether they meet anything.

use crate::{
    Occluders, Scratch,
    node::{Child, Leaf, Node},
    sweep::Lanes,
    watertight::WatertightRay,
};
use linelit_geometry::DVec3;
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
    /// number.
    ///
    /// Watertight: a ray towards a shared edge or corner meets one of the triangles there.
    pub fn closest_hit(&self, ray: &Ray, scratch: &mut Scratch) -> Option<Hit> {
        scratch.counters.rays += 1;
        closest(self.isa, self, ray, scratch)
    }

    /// Whether the ray meets any triangle but those numbered in `exclude`.
    ///
    /// The same triangles count as for [`Occluders::closest_hit`].
    pub fn any_hit(&self, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool {
        scratch.counters.rays += 1;
        any(self.isa, self, ray, exclude, scratch)
    }
}

/// A ray in the hierarchy's coordinates.
#[derive(Clone, Copy, Debug)]
struct RayQuery {
    exact: WatertightRay,
    t_min: f64,
    t_max: f64,
    /// Excluded triangles: first and number.
    exclude: (u32, u32),
    /// Which row of a node's bounds the ray enters and leaves through, per axis.
    enter: [usize; 3],
    leave: [usize; 3],
    inverse: [f32; 3],
    /// `t = bound · inverse + offset`, rounded towards more room.
    offset_enter: [f32; 3],
    offset_leave: [f32; 3],
    t_min32: f32,
    t_max32: f32,
    /// Origin and shear for the leaf test, and the rounding error of a sheared coordinate there.
    origin: [f32; 3],
    shear: [f32; 2],
    error: f32,
}

/// 2⁻²⁰, sixteen roundings of `f32`: room for the few operations of a box or triangle test
/// relative to the largest coordinate involved.
pub(crate) const ROOM: f64 = 9.536_743_164_062_5e-7;

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl RayQuery {
    /// `None` for a ray that cannot meet anything: not finite, without direction, or empty.
    ///
    /// Inlined into the kernels, so that it is never copied.
    #[inline(always)]
    fn new(occluders: &Occluders, ray: &Ray, exclude: &Range<u32>) -> Option<Self> {
        let d = ray.direction;
        let o = ray.origin - occluders.origin;
        let sane = d.is_finite() && o.is_finite() && d != DVec3::ZERO;
        if !sane || !(ray.t_min <= ray.t_max) || occluders.hierarchy.nodes.is_empty() {
            return None;
        }
        let exact = WatertightRay::new(o, d);
        let size = occluders.extent.max(o.abs().max_element());
        // A component this small moves the ray by less than the room over any distance in f32.
        let largest_inverse = (1e36 / size).min(1e37);
        let mut q = Self {
            exact,
            t_min: ray.t_min,
            t_max: ray.t_max,
            exclude: (exclude.start, exclude.end.saturating_sub(exclude.start)),
            enter: [0; 3],
            leave: [0; 3],
            inverse: [0.0; 3],
            offset_enter: [0.0; 3],
            offset_leave: [0.0; 3],
            t_min32: (ray.t_min as f32).next_down().max(-1e30),
            t_max32: (ray.t_max as f32).next_up().min(1e30),
            origin: o.as_vec3().to_array(),
            shear: [exact.shear[0] as f32, exact.shear[1] as f32],
            error: (ROOM * size) as f32,
        };
        for axis in 0..3 {
            let inverse = (1.0 / d[axis]).clamp(-largest_inverse, largest_inverse) as f32;
            let offset = -o[axis] * f64::from(inverse);
            let room = ROOM * size * f64::from(inverse).abs();
            q.inverse[axis] = inverse;
            q.offset_enter[axis] = (offset - room) as f32;
            q.offset_leave[axis] = (offset + room) as f32;
            let negative = usize::from(inverse < 0.0);
            q.enter[axis] = axis + 3 * negative;
            q.leave[axis] = axis + 3 * (1 - negative);
        }
        Some(q)
    }

    /// The boxes of a node that the ray may enter before `t_max`, and where.
    #[inline(always)]
    fn boxes<S: Simd>(&self, s: S, node: &Node, t_max: f32) -> (u8, S::F) {
        let mut near = s.splat(self.t_min32);
        let mut far = s.splat(t_max);
        for axis in 0..3 {
            let inverse = s.splat(self.inverse[axis]);
            let enter = s.load(&node.bounds[self.enter[axis]]);
            let leave = s.load(&node.bounds[self.leave[axis]]);
            near = s.max(
                s.fma(enter, inverse, s.splat(self.offset_enter[axis])),
                near,
            );
            far = s.min(s.fma(leave, inverse, s.splat(self.offset_leave[axis])), far);
        }
        (s.le(near, far) & node.valid, near)
    }

    /// The sheared x and y of the leaf's vertices in rows `first` to `first + 2`.
    #[inline(always)]
    fn shear<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], first: usize) -> (S::F, S::F) {
        let [kx, ky, kz] = self.exact.axes;
        let z = s.load(&vertices[first + kz]) - self.origin[kz];
        let x = s.load(&vertices[first + kx]) - self.origin[kx];
        let y = s.load(&vertices[first + ky]) - self.origin[ky];
        (
            s.fma(s.splat(-self.shear[0]), z, x),
            s.fma(s.splat(-self.shear[1]), z, y),
        )
    }

    /// The triangles of a leaf whose plane figure may contain the ray: all that do, and rarely
    /// one that does not.
    #[inline(always)]
    fn triangles<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9]) -> u8 {
        let (ax, ay) = self.shear(s, vertices, 0);
        let (bx, by) = self.shear(s, vertices, 3);
        let (cx, cy) = self.shear(s, vertices, 6);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        // Each coordinate is off by at most e = ROOM · size, a product of two by 2 e r + e² for
        // the largest coordinate r, a difference by twice that; rounding of the products, with
        // r below 4 sizes, is less than another e r.
        let r = s.max(
            s.max(s.max(s.abs(ax), s.abs(ay)), s.max(s.abs(bx), s.abs(by))),
            s.max(s.abs(cx), s.abs(cy)),
        );
        let e = s.splat(self.error);
        let room = e * s.fma(r, s.splat(6.0), e * 2.0);
        let low = s.min(s.min(u, v), w);
        let high = s.max(s.max(u, v), w);
        // low ≥ −room or high ≤ room, or NaN, where far vertices overflow.
        !(s.lt(low, s.splat(0.0) - room) & s.lt(room, high))
    }

    /// Whether the ray meets any of the triangles `among` those of a leaf that are not excluded.
    #[inline(always)]
    fn meets<S: Simd>(&self, s: S, leaf: &Leaf, among: u8) -> bool {
        let mut maybe = self.triangles(s, &leaf.vertices) & among;
        while maybe != 0 {
            let lane = maybe.trailing_zeros() as usize;
            maybe &= maybe - 1;
            if leaf.id[lane].wrapping_sub(self.exclude.0) < self.exclude.1 {
                continue;
            }
            if let Some((t, _)) = self.exact.intersect(&leaf.triangle(lane))
                && t >= self.t_min
                && t <= self.t_max
            {
                return true;
            }
        }
        false
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
    let hierarchy = &occluders.hierarchy;
    let counters = &mut scratch.counters;
    if scratch.stack.len() < occluders.stack_size {
        scratch.stack.resize(occluders.stack_size, 0);
    }
    // What met the latest ray from here often meets the next. Only from here, so that what is
    // tested does not depend on which points a thread was given.
    if let Some((origin, child)) = scratch.last
        && origin == ray.origin
        && let Some(leaf) = hierarchy.leaves.get(child.leaf_index())
    {
        counters.triangle_tests += u64::from(child.count());
        if q.meets(s, leaf, child.mask()) {
            return true;
        }
    }
    let stack = &mut scratch.stack[..];
    stack[0] = Child::node(0).0;
    let mut top = 1;
    let mut order = [0.0_f32; 8];
    while top > 0 {
        top -= 1;
        let node = &hierarchy.nodes[stack[top] as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (found, near) = q.boxes(s, node, q.t_max32);
        let mut leaves = found & node.leaf;
        while leaves != 0 {
            let child = Child(node.child[leaves.trailing_zeros() as usize]);
            leaves &= leaves - 1;
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            if q.meets(s, leaf, child.mask()) {
                scratch.last = Some((ray.origin, child));
                return true;
            }
        }
        let mut inner = found & !node.leaf;
        if inner == 0 {
            continue;
        }
        let mut entry = Lanes([0.0; 8]);
        s.store(near, &mut entry);
        let base = top;
        while inner != 0 {
            let lane = inner.trailing_zeros() as usize;
            inner &= inner - 1;
            // Insertion keeps the farthest lowest on the stack.
            let mut k = top;
            while k > base && order[k - base - 1] < entry[lane] {
                order[k - base] = order[k - base - 1];
                stack[k] = stack[k - 1];
                k -= 1;
            }
            order[k - base] = entry[lane];
            stack[k] = node.child[lane];
            top += 1;
        }
    }
    false
}

#[inline(always)]
fn closest_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    ray: &Ray,
    scratch: &mut Scratch,
) -> Option<Hit> {
    let hierarchy = &occluders.hierarchy;
    let mut q = RayQuery::new(occluders, ray, &(0..0))?;
    let counters = &mut scratch.counters;
    let stack = &mut scratch.near_stack;
    stack.clear();
    stack.push((Child::node(0), f32::NEG_INFINITY));
    let mut best: Option<Hit> = None;
    while let Some((child, near)) = stack.pop() {
        if near > q.t_max32 {
            continue;
        }
        if child.is_leaf() {
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            let mut maybe = q.triangles(s, &leaf.vertices) & child.mask();
            while maybe != 0 {
                let lane = maybe.trailing_zeros() as usize;
                maybe &= maybe - 1;
                let Some((t, barycentric)) = q.exact.intersect(&leaf.triangle(lane)) else {
                    continue;
                };
                #[allow(clippy::float_cmp, reason = "the tie rule is about equal bits")]
                let nearer =
                    best.is_none_or(|b| t < b.t || (t == b.t && leaf.id[lane] < b.triangle));
                if t >= q.t_min && t <= q.t_max && nearer {
                    best = Some(Hit {
                        triangle: leaf.id[lane],
                        t,
                        barycentric,
                    });
                    q.t_max = t;
                    #[allow(clippy::cast_possible_truncation, reason = "rounded up")]
                    {
                        q.t_max32 = (t as f32).next_up().min(q.t_max32);
                    }
                }
            }
            continue;
        }
        let node = &hierarchy.nodes[child.index()];
        counters.node_tests += u64::from(node.valid.count_ones());
        let (mut found, near) = q.boxes(s, node, q.t_max32);
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
    best
}

dispatch! {
    /// [`Occluders::any_hit`] on an instruction set.
    pub(crate) fn any = any_kernel(occluders: &Occluders, ray: &Ray, exclude: &Range<u32>, scratch: &mut Scratch) -> bool
}
dispatch! {
    /// [`Occluders::closest_hit`] on an instruction set.
    pub(crate) fn closest = closest_kernel(occluders: &Occluders, ray: &Ray, scratch: &mut Scratch) -> Option<Hit>
}
