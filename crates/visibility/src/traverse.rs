//! Walking the hierarchy with a shaft: which triangles may lie between a point and a light.

use crate::{
    Occluders, Scratch,
    dispatch::dispatch,
    frame::LightFrame,
    node::{Child, Leaf, Node},
    ray::ROOM,
    simd::Simd,
};
use linelit_geometry::{DVec3, LIGHT_MARGIN, POINT_MARGIN, glam::Vec3};

/// What is in a shaft.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// As many triangles as are kept, or fewer, or none.
    Few,
    /// More than that.
    Many,
    /// A triangle that hides the light as a whole.
    All,
}

/// Half-spaces and a box around everything between a point and a light, in `f32`, with room for
/// the rounding of the tests: what is rejected lies outside.
///
/// A plane's value at a corner takes six roundings of numbers up to three times normal (sum of
/// components) × size, and one each of its four coefficients: within 14/16 of the room.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftBounds {
    /// The sides, facing inward.
    planes: [Plane; 4],
    /// The light's own plane, unless the box says as much.
    far: Option<Plane>,
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

/// `normal·corner + offset ≥ 0` inside.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    normal: [f32; 3],
    offset: f32,
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
    #[inline(always)]
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
        let (k, j) = frame.shape.upper();
        let plane = |normal: DVec3, least: f64| {
            let n32: Vec3 = normal.as_vec3();
            let offset = room * normal.abs().element_sum() - least - normal.dot(point);
            let row = |i: usize| if n32[i] < 0.0 { i } else { i + 3 };
            Plane {
                normal: n32.to_array(),
                offset: offset as f32,
                farthest: [row(0), row(1), row(2)],
            }
        };
        let steepness = frame.w.abs();
        let tilted = steepness.element_sum() > 1.01 * steepness.max_element();
        Self {
            planes: [
                plane(frame.p, 0.0),
                plane(frame.w * k - frame.p - frame.q * j, 0.0),
                plane(frame.q, 0.0),
                plane(frame.w - frame.q, 0.0),
            ],
            far: tilted.then(|| plane(-frame.w, -1.0)),
            lo: ((lo + point) - DVec3::splat(room)).as_vec3().to_array(),
            hi: ((hi + point) + DVec3::splat(room)).as_vec3().to_array(),
            point: point.as_vec3().to_array(),
            rows: [frame.p, frame.q, frame.w].map(|g| g.as_vec3().to_array()),
            offset: [frame.p, frame.q, frame.w].map(|g| g.dot(point) as f32),
            room: [frame.p, frame.q, frame.w].map(|g| (g.abs().element_sum() * room) as f32),
            upper: [k as f32, j as f32],
            exclude,
        }
    }

    /// The boxes of a node that the shaft may meet.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node) -> u8 {
        let mut inside = s.splat(f32::INFINITY);
        for axis in 0..3 {
            let low = s.sub(s.splat(self.hi[axis]), s.load(&node.bounds[axis]));
            let high = s.sub(s.load(&node.bounds[axis + 3]), s.splat(self.lo[axis]));
            inside = s.min(inside, s.min(low, high));
        }
        for plane in &self.planes {
            inside = s.min(inside, plane.reach(s, node));
        }
        if let Some(plane) = &self.far {
            inside = s.min(inside, plane.reach(s, node));
        }
        s.le(s.splat(0.0), inside) & node.valid
    }

    /// The triangles of a leaf that may be inside the shaft in part, and those among them that
    /// hide the light as a whole without doubt; what lies in lanes that are not in use says
    /// nothing.
    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(&self, s: S, leaf: &Leaf) -> (u8, u8) {
        let a = self.vertex(s, &leaf.vertices, 0);
        let b = self.vertex(s, &leaf.vertices, 3);
        let c = self.vertex(s, &leaf.vertices, 6);
        let (rp, rq, rw) = (
            s.splat(self.room[0]),
            s.splat(self.room[1]),
            s.splat(self.room[2]),
        );
        // Some vertex inside each side, some before the shading point, some before the light:
        // room + value ≥ 0.
        let mut inside = s.min(
            s.add(rp, max3(s, a.0, b.0, c.0)),
            s.add(rq, max3(s, a.1, b.1, c.1)),
        );
        let beyond = max3(s, s.sub(a.2, a.1), s.sub(b.2, b.1), s.sub(c.2, c.1));
        inside = s.min(inside, s.add(s.add(rw, rq), beyond));
        let beyond = max3(s, self.upper(s, a), self.upper(s, b), self.upper(s, c));
        inside = s.min(inside, s.add(s.add(s.add(rw, rp), rq), beyond));
        inside = s.min(inside, s.add(rw, max3(s, a.2, b.2, c.2)));
        let nearest = s.min(s.min(a.2, b.2), c.2);
        inside = s.min(inside, s.sub(s.add(s.splat(1.0), rw), nearest));
        let mut found = s.le(s.splat(0.0), inside);
        if self.exclude.1 > 0 {
            found &= !s.in_range(&leaf.id, self.exclude.0, self.exclude.1);
        }
        if found == 0 {
            return (0, 0);
        }
        let (beside, before) = self.beside(s, a, b, c);
        (found & !beside, found & before)
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
    /// side from the triangle: long slivers that pass by. And those that hide the light: all
    /// three planes have it on the triangle's side.
    ///
    /// What is told to hide the light here does so in `f64` as well (see `project`): with
    /// coordinates up to 32 and W of .01 at least, images are within the guard and the margin
    /// there, 1e-13 (image size + 2)² W², is below a fifth of the room here.
    #[inline(always)]
    fn beside<S: Simd>(
        &self,
        s: S,
        a: (S::F, S::F, S::F),
        b: (S::F, S::F, S::F),
        c: (S::F, S::F, S::F),
    ) -> (u8, u8) {
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
        let (ab, bc, ca) = (
            self.over_light(s, ab),
            self.over_light(s, bc),
            self.over_light(s, ca),
        );
        // The least of the three largest values, the largest of the three least, and so on.
        let minus_room = s.sub(zero, room);
        let beside = left & s.lt(min3(s, ab.1, bc.1, ca.1), minus_room)
            | right & s.lt(room, max3(s, ab.0, bc.0, ca.0));
        let around = left & s.lt(room, min3(s, ab.0, bc.0, ca.0))
            | right & s.lt(max3(s, ab.1, bc.1, ca.1), minus_room);
        if around == 0 {
            return (beside, 0);
        }
        let rw = self.room[2];
        let nearest = s.splat((POINT_MARGIN as f32 + rw).max(0.01));
        let farthest = s.splat(1.0 - LIGHT_MARGIN as f32 - rw - 1e-7);
        let before = around
            & s.le(nearest, min3(s, a.2, b.2, c.2))
            & s.le(max3(s, a.2, b.2, c.2), farthest)
            & s.le(reach, s.splat(32.0));
        (beside, before)
    }

    /// The least and the largest value of a linear form over the unit square of the light.
    #[inline(always)]
    fn over_light<S: Simd>(&self, s: S, n: (S::F, S::F, S::F)) -> (S::F, S::F) {
        let zero = s.splat(0.0);
        let mut least = s.add(n.2, s.min(n.1, zero));
        let mut most = s.add(n.2, s.max(n.1, zero));
        // A linear light has p = 0.
        if self.upper[0] != 0.0 {
            least = s.add(least, s.min(n.0, zero));
            most = s.add(most, s.max(n.0, zero));
        }
        (least, most)
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

impl Plane {
    /// How far the boxes of a node reach inside.
    #[inline(always)]
    fn reach<S: Simd>(&self, s: S, node: &Node) -> S::F {
        let [nx, ny, nz] = self.normal;
        let x = s.load(&node.bounds[self.farthest[0]]);
        let y = s.load(&node.bounds[self.farthest[1]]);
        let z = s.load(&node.bounds[self.farthest[2]]);
        let sum = s.fma(s.splat(nz), z, s.splat(self.offset));
        s.fma(s.splat(nx), x, s.fma(s.splat(ny), y, sum))
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
fn min3<S: Simd>(s: S, a: S::F, b: S::F, c: S::F) -> S::F {
    s.min(s.min(a, b), c)
}

#[inline(always)]
fn dot<S: Simd>(s: S, n: &[f32; 3], x: S::F, y: S::F, z: S::F) -> S::F {
    s.fma(
        s.splat(n[0]),
        x,
        s.fma(s.splat(n[1]), y, s.mul(s.splat(n[2]), z)),
    )
}

/// Puts the triangles in the shaft into `scratch.corners`, unless they are more than `limit`.
#[inline(always)]
fn collect_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    bounds: &ShaftBounds,
    limit: usize,
    scratch: &mut Scratch,
) -> Found {
    let hierarchy = &occluders.hierarchy;
    let Scratch {
        counters,
        corners,
        stack,
        ..
    } = scratch;
    corners.clear();
    if hierarchy.nodes.is_empty() {
        return Found::Few;
    }
    if stack.len() < occluders.stack_size {
        stack.resize(occluders.stack_size, Child::default());
    }
    let stack = &mut stack[..];
    stack[0] = Child::node(0);
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let node = &hierarchy.nodes[stack[top].index()];
        counters.node_tests += u64::from(node.valid.count_ones());
        let found = bounds.boxes(s, node);
        hierarchy.prefetch(s, node, found);
        let mut inner = found & !node.leaf;
        while inner != 0 {
            stack[top] = node.child[inner.trailing_zeros() as usize];
            top += 1;
            inner &= inner - 1;
        }
        let mut leaves = found & node.leaf;
        while leaves != 0 {
            let child = node.child[leaves.trailing_zeros() as usize];
            leaves &= leaves - 1;
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            let (maybe, before) = bounds.triangles(s, leaf);
            if before & child.mask() != 0 {
                return Found::All;
            }
            if maybe & child.mask() != 0 {
                corners.add(s, leaf, child.index(), maybe & child.mask());
            }
        }
        if corners.count > limit {
            return Found::Many;
        }
    }
    Found::Few
}

dispatch! {
    /// Collects the triangles in a shaft on an instruction set.
    collect = collect_kernel(occluders: &Occluders, bounds: &ShaftBounds, limit: usize, scratch: &mut Scratch) -> Found
}
