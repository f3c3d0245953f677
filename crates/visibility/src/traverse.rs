//! Walking the hierarchy with a shaft: which triangles may lie between a point and a light.

use crate::{
    Occluders, Scratch,
    dispatch::dispatch,
    frame::LightFrame,
    node::{Child, Node},
    ray::ROOM,
    simd::Simd,
};
use linelit_geometry::{DVec3, glam::Vec3};

/// Half-spaces and a box around everything between a point and a light, in `f32`, with room for
/// the rounding of the tests: what is rejected lies outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftBounds {
    /// Inward normals; a corner is inside where `normal·corner ≥ least`.
    planes: [Plane; 6],
    /// Box around the shaft: lower corner, upper corner.
    lo: [f32; 3],
    hi: [f32; 3],
    /// The triangle test's homogeneous coordinates P, Q, W of a vertex relative to `point`.
    pub(crate) point: [f32; 3],
    pub(crate) rows: [[f32; 3]; 3],
    /// P, Q, W of the hierarchy's origin, negated.
    pub(crate) offset: [f32; 3],
    /// Rounding errors of P, Q and W.
    pub(crate) room: [f32; 3],
    /// The upper bound on p is `k W − P − j Q ≥ 0`.
    upper: [f32; 2],
    /// Excluded triangles: first and number.
    exclude: (u32, u32),
}

#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    normal: [f32; 3],
    least: f32,
    /// The row of a node's bounds that reaches farthest inward, per axis.
    farthest: [usize; 3],
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl ShaftBounds {
    /// The shaft from `point` (in the hierarchy's coordinates) to the light with corners
    /// `light`, relative to the point.
    pub(crate) fn new(
        occluders: &Occluders,
        point: DVec3,
        light: &[DVec3],
        frame: &LightFrame,
        exclude: (u32, u32),
    ) -> Self {
        let mut lo = DVec3::ZERO;
        let mut hi = DVec3::ZERO;
        for v in light {
            lo = lo.min(*v);
            hi = hi.max(*v);
        }
        let size = occluders
            .extent
            .max(point.abs().max_element())
            .max((lo + point).abs().max_element())
            .max((hi + point).abs().max_element());
        let room = ROOM * size;
        let mut bounds = Self {
            planes: [Plane::default(); 6],
            lo: ((lo + point) - DVec3::splat(room)).as_vec3().to_array(),
            hi: ((hi + point) + DVec3::splat(room)).as_vec3().to_array(),
            point: point.as_vec3().to_array(),
            rows: [frame.p, frame.q, frame.w].map(|g| g.as_vec3().to_array()),
            offset: [frame.p, frame.q, frame.w].map(|g| g.dot(point) as f32),
            room: [frame.p, frame.q, frame.w].map(|g| (g.abs().element_sum() * room) as f32),
            upper: [frame.shape.upper().0 as f32, frame.shape.upper().1 as f32],
            exclude,
        };
        let (k, j) = frame.shape.upper();
        let inward = [
            (frame.p, 0.0),
            (frame.w * k - frame.p - frame.q * j, 0.0),
            (frame.q, 0.0),
            (frame.w - frame.q, 0.0),
            (frame.w, 0.0),
            (-frame.w, -1.0),
        ];
        for (plane, (normal, least)) in bounds.planes.iter_mut().zip(inward) {
            let n32: Vec3 = normal.as_vec3();
            plane.normal = n32.to_array();
            plane.least = (normal.dot(point) + least - room * normal.abs().element_sum()) as f32;
            plane.farthest = std::array::from_fn(|i| if n32[i] < 0.0 { i } else { i + 3 });
        }
        bounds
    }

    /// The boxes of a node that the shaft may meet.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node) -> u8 {
        let mut found = node.valid;
        for axis in 0..3 {
            found &= s.le(s.load(&node.bounds[axis]), s.splat(self.hi[axis]));
            found &= s.le(s.splat(self.lo[axis]), s.load(&node.bounds[axis + 3]));
        }
        for plane in &self.planes {
            let x = s.load(&node.bounds[plane.farthest[0]]);
            let y = s.load(&node.bounds[plane.farthest[1]]);
            let z = s.load(&node.bounds[plane.farthest[2]]);
            let [nx, ny, nz] = plane.normal;
            let reach = s.fma(s.splat(nx), x, s.fma(s.splat(ny), y, s.mul(s.splat(nz), z)));
            found &= s.le(s.splat(plane.least), reach);
        }
        found
    }

    /// The triangles of a leaf that may be inside the shaft in part.
    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], ids: &[u32; 8]) -> u8 {
        let a = self.vertex(s, vertices, 0);
        let b = self.vertex(s, vertices, 3);
        let c = self.vertex(s, vertices, 6);
        let (rp, rq, rw) = (
            s.splat(self.room[0]),
            s.splat(self.room[1]),
            s.splat(self.room[2]),
        );
        let zero = s.splat(0.0);
        let mut found = !s.in_range(ids, self.exclude.0, self.exclude.1);
        // Some vertex inside each side: room + value ≥ 0.
        found &= s.le(zero, s.add(rp, max3(s, a.0, b.0, c.0)));
        found &= s.le(zero, s.add(rq, max3(s, a.1, b.1, c.1)));
        let beyond = max3(s, s.sub(a.2, a.1), s.sub(b.2, b.1), s.sub(c.2, c.1));
        found &= s.le(zero, s.add(s.add(rw, rq), beyond));
        let beyond = max3(s, self.upper(s, a), self.upper(s, b), self.upper(s, c));
        found &= s.le(zero, s.add(s.add(s.add(rw, rp), rq), beyond));
        // Some vertex before the shading point, and some before the light.
        found &= s.le(zero, s.add(rw, max3(s, a.2, b.2, c.2)));
        let nearest = s.min(s.min(a.2, b.2), c.2);
        found &= s.le(nearest, s.add(s.splat(1.0), rw));
        if found == 0 {
            return 0;
        }
        found & !self.beside(s, a, b, c)
    }

    /// Bounds of the triangles' images in (p, q), for those that are well before the shading
    /// point: a bit each.
    #[inline(always)]
    pub(crate) fn triangle_images<S: Simd>(
        &self,
        s: S,
        vertices: &[[f32; 8]; 9],
        low: &mut [[f32; 8]; 2],
        high: &mut [[f32; 8]; 2],
    ) -> u8 {
        let infinite = s.splat(f32::INFINITY);
        let minus_infinite = s.splat(f32::NEG_INFINITY);
        let mut least = [infinite; 2];
        let mut most = [minus_infinite; 2];
        let mut depth = infinite;
        for first in [0, 3, 6] {
            let v = self.vertex(s, vertices, first);
            depth = s.min(depth, v.2);
            let inverse = s.div(s.splat(1.0), v.2);
            for (k, value) in [v.0, v.1].into_iter().enumerate() {
                let at = s.mul(value, inverse);
                // (P ± a) / (W ± b) is off by (a + |p| b) / W, and a little for b² and rounding.
                let size = s.abs(at);
                let off = s.fma(size, s.splat(self.room[2]), s.splat(self.room[k]));
                let off = s.mul(off, s.mul(inverse, s.splat(1.25)));
                let off = s.fma(size, s.splat(1e-6), off);
                least[k] = s.min(least[k], s.sub(at, off));
                most[k] = s.max(most[k], s.add(at, off));
            }
        }
        for k in 0..2 {
            s.store(least[k], &mut low[k]);
            s.store(most[k], &mut high[k]);
        }
        s.le(s.splat((16.0 * self.room[2]).max(1e-6)), depth)
    }

    /// Triangles with a side whose plane through the shading point has the light on the other
    /// side from the triangle: long slivers that pass by.
    #[inline(always)]
    fn beside<S: Simd>(
        &self,
        s: S,
        a: (S::F, S::F, S::F),
        b: (S::F, S::F, S::F),
        c: (S::F, S::F, S::F),
    ) -> u8 {
        let zero = s.splat(0.0);
        let reach = max3(s, largest(s, a), largest(s, b), largest(s, c));
        // A plane's coordinates are off by two coordinates times two rooms, its value at a corner
        // of the unit square by three of them, the determinant by that times three coordinates.
        let rooms = self.room[0] + self.room[1] + self.room[2];
        let room = s.mul(reach, s.splat(5.0 * rooms));
        let (ab, bc, ca) = (plane(s, a, b), plane(s, b, c), plane(s, c, a));
        let det = s.fma(ab.0, c.0, s.fma(ab.1, c.1, s.mul(ab.2, c.2)));
        let det_room = s.mul(room, s.mul(reach, s.splat(3.0)));
        let left = s.lt(det_room, det);
        let right = s.lt(det, s.sub(zero, det_room));
        let minus_room = s.sub(zero, room);
        let mut beside = 0;
        for n in [ab, bc, ca] {
            let (mut most, mut least) = (n.2, n.2);
            // A linear light has p = 0.
            if self.upper[0] != 0.0 {
                most = s.add(most, s.max(n.0, zero));
                least = s.add(least, s.min(n.0, zero));
            }
            most = s.add(most, s.max(n.1, zero));
            least = s.add(least, s.min(n.1, zero));
            beside |= left & s.lt(most, minus_room);
            beside |= right & s.lt(room, least);
        }
        beside
    }

    /// P, Q, W of the leaf's vertices in rows `first` to `first + 2`.
    #[inline(always)]
    fn vertex<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], first: usize) -> (S::F, S::F, S::F) {
        let x = s.sub(s.load(&vertices[first]), s.splat(self.point[0]));
        let y = s.sub(s.load(&vertices[first + 1]), s.splat(self.point[1]));
        let z = s.sub(s.load(&vertices[first + 2]), s.splat(self.point[2]));
        (
            dot(s, &self.rows[0], x, y, z),
            dot(s, &self.rows[1], x, y, z),
            dot(s, &self.rows[2], x, y, z),
        )
    }

    /// How far inside the upper bound on p.
    #[inline(always)]
    fn upper<S: Simd>(&self, s: S, v: (S::F, S::F, S::F)) -> S::F {
        let (k, j) = (s.splat(self.upper[0]), s.splat(self.upper[1]));
        s.sub(s.mul(k, v.2), s.fma(j, v.1, v.0))
    }
}

/// The plane through the shading point and two vertices: their cross product.
#[inline(always)]
fn plane<S: Simd>(s: S, a: (S::F, S::F, S::F), b: (S::F, S::F, S::F)) -> (S::F, S::F, S::F) {
    (
        s.sub(s.mul(a.1, b.2), s.mul(a.2, b.1)),
        s.sub(s.mul(a.2, b.0), s.mul(a.0, b.2)),
        s.sub(s.mul(a.0, b.1), s.mul(a.1, b.0)),
    )
}

/// The largest absolute coordinate.
#[inline(always)]
fn largest<S: Simd>(s: S, v: (S::F, S::F, S::F)) -> S::F {
    max3(s, s.abs(v.0), s.abs(v.1), s.abs(v.2))
}

#[inline(always)]
fn max3<S: Simd>(s: S, a: S::F, b: S::F, c: S::F) -> S::F {
    s.max(s.max(a, b), c)
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(s: S, n: &[f32; 3], x: S::F, y: S::F, z: S::F) -> S::F {
    s.fma(
        s.splat(n[0]),
        x,
        s.fma(s.splat(n[1]), y, s.mul(s.splat(n[2]), z)),
    )
}

/// Appends the triangles in the shaft to `scratch.slots`, up to `limit`; false if there are more.
#[inline(always)]
fn collect_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    bounds: &ShaftBounds,
    limit: usize,
    scratch: &mut Scratch,
) -> bool {
    let hierarchy = &occluders.hierarchy;
    let counters = &mut scratch.counters;
    scratch.slots.clear();
    if hierarchy.nodes.is_empty() {
        return true;
    }
    if scratch.stack.len() < occluders.stack_size {
        scratch.stack.resize(occluders.stack_size, Child::default());
    }
    let stack = &mut scratch.stack[..];
    stack[0] = Child::node(0);
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let node = &hierarchy.nodes[stack[top].index()];
        counters.node_tests += u64::from(node.valid.count_ones());
        let mut found = bounds.boxes(s, node);
        hierarchy.prefetch(s, node, found);
        while found != 0 {
            let child = node.child[found.trailing_zeros() as usize];
            found &= found - 1;
            if !child.is_leaf() {
                stack[top] = child;
                top += 1;
                continue;
            }
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            let mut maybe = bounds.triangles(s, &leaf.vertices, &leaf.id) & child.mask();
            while maybe != 0 {
                #[allow(clippy::cast_possible_truncation, reason = "fewer than 2^28 leaves")]
                scratch
                    .slots
                    .push((child.index() * 8) as u32 + maybe.trailing_zeros());
                maybe &= maybe - 1;
            }
        }
        if scratch.slots.len() > limit {
            return false;
        }
    }
    true
}

dispatch! {
    /// Collects the triangles in a shaft on an instruction set.
    collect = collect_kernel(occluders: &Occluders, bounds: &ShaftBounds, limit: usize, scratch: &mut Scratch) -> bool
}
