//! Walking the hierarchy with a shaft: which triangles may lie between a point and a light.

use crate::{
    Occluders, Scratch,
    dispatch::dispatch,
    frame::LightFrame,
    node::{Child, Leaf, Node},
    project,
    ray::ROOM,
    simd::Simd,
};
use linelit_geometry::{DVec3, glam::Vec3};

/// P, Q and W of eight places, or the coefficients of eight linear forms in them.
pub(crate) type Vertex<S> = (<S as Simd>::F, <S as Simd>::F, <S as Simd>::F);

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
/// A plane's value at a corner takes up to six roundings of numbers up to three times its normal's
/// sum of components times the scene's size, of which three are of products that sum up to one
/// such, and one of each of its four coefficients: within 14/16 of the room.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftBounds {
    /// The sides, facing inward.
    planes: [Plane; 4],
    /// The light's own plane, unless the box says as much.
    far: Option<Plane>,
    /// Box around the shaft: lower corner, upper corner.
    lo: [f32; 3],
    hi: [f32; 3],
    /// The homogeneous coordinates P, Q, W of a place.
    rows: [[f32; 3]; 3],
    /// P, Q, W of the hierarchy's origin.
    offset: [f32; 3],
    /// Rounding errors of P, Q and W.
    room: [f32; 3],
    /// The upper bound on p is `k W − P − j Q ≥ 0`.
    upper: [f32; 2],
    /// Excluded triangles: first and number.
    exclude: (u32, u32),
}

/// `normal·corner + offset ≥ 0` inside.
#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    /// The normal's negative components, which a box's lower corner reaches farthest along.
    negative: [f32; 3],
    /// And the positive ones.
    positive: [f32; 3],
    offset: f32,
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
            Plane {
                negative: n32.min(Vec3::ZERO).to_array(),
                positive: n32.max(Vec3::ZERO).to_array(),
                offset: offset as f32,
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
            rows: [frame.p, frame.q, frame.w].map(|g| g.as_vec3().to_array()),
            offset: [frame.p, frame.q, frame.w].map(|g| -g.dot(point) as f32),
            room: [frame.p, frame.q, frame.w].map(|g| (g.abs().element_sum() * room) as f32),
            upper: [k as f32, j as f32],
            exclude,
        }
    }

    /// The boxes of a node that the shaft may meet.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node) -> u8 {
        let mut rows = [s.splat(0.0); 6];
        for (row, bounds) in rows.iter_mut().zip(&node.bounds) {
            *row = s.load(bounds);
        }
        let mut inside = s.splat(f32::INFINITY);
        for axis in 0..3 {
            let low = s.sub(s.splat(self.hi[axis]), rows[axis]);
            let high = s.sub(rows[axis + 3], s.splat(self.lo[axis]));
            inside = s.min(inside, s.min(low, high));
        }
        for plane in &self.planes {
            inside = s.min(inside, plane.reach(s, &rows));
        }
        if let Some(plane) = &self.far {
            inside = s.min(inside, plane.reach(s, &rows));
        }
        s.le(s.splat(0.0), inside) & node.valid
    }

    /// Bounds of P, Q and W over the boxes of a node.
    #[inline(always)]
    pub(crate) fn extents<S: Simd>(&self, s: S, node: &Node) -> ([S::F; 3], [S::F; 3]) {
        let mut least = [s.splat(0.0); 3];
        let mut most = least;
        for k in 0..3 {
            let mut near = s.splat(self.offset[k] - self.room[k]);
            let mut far = s.splat(self.offset[k] + self.room[k]);
            for axis in 0..3 {
                let n = self.rows[k][axis];
                let up = axis + 3 * usize::from(n >= 0.0);
                let down = axis + 3 * usize::from(n < 0.0);
                near = s.fma(s.splat(n), s.load(&node.bounds[down]), near);
                far = s.fma(s.splat(n), s.load(&node.bounds[up]), far);
            }
            least[k] = near;
            most[k] = far;
        }
        (least, most)
    }

    /// The triangles of a leaf that may be inside the shaft in part, and those among them that may
    /// hide the light as a whole; what lies in lanes that are not in use says nothing.
    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(&self, s: S, leaf: &Leaf) -> (u8, u8) {
        let [a, b, c] = self.vertices(s, leaf);
        self.inside(s, leaf, a, b, c)
    }

    /// The corners of a leaf's triangles in (P, Q, W).
    #[inline(always)]
    pub(crate) fn vertices<S: Simd>(&self, s: S, leaf: &Leaf) -> [Vertex<S>; 3] {
        [
            self.vertex(s, &leaf.vertices, 0),
            self.vertex(s, &leaf.vertices, 3),
            self.vertex(s, &leaf.vertices, 6),
        ]
    }

    /// As [`ShaftBounds::triangles`], for known corners.
    #[inline(always)]
    pub(crate) fn inside<S: Simd>(
        &self,
        s: S,
        leaf: &Leaf,
        a: Vertex<S>,
        b: Vertex<S>,
        c: Vertex<S>,
    ) -> (u8, u8) {
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
        let (beside, around) = self.beside(s, a, b, c);
        (found & !beside, found & !beside & around)
    }

    /// Bounds of the triangles' images in (p, q), for those that are well before the shading
    /// point: a bit each.
    #[inline(always)]
    pub(crate) fn triangle_images<S: Simd>(
        &self,
        s: S,
        vertices: &[Vertex<S>; 3],
    ) -> (u8, [S::F; 2], [S::F; 2]) {
        let infinite = s.splat(f32::INFINITY);
        let minus_infinite = s.splat(f32::NEG_INFINITY);
        let mut least = [infinite; 2];
        let mut most = [minus_infinite; 2];
        let mut depth = infinite;
        for v in vertices {
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
        let before = s.le(s.splat((16.0 * self.room[2]).max(1e-6)), depth);
        (before, least, most)
    }

    /// Triangles with a side whose plane through the shading point has the light on the other
    /// side from the triangle: long slivers that pass by. And those that may hide the light, for
    /// `f64` to decide: all three planes have it on one side.
    #[inline(always)]
    fn beside<S: Simd>(&self, s: S, a: Vertex<S>, b: Vertex<S>, c: Vertex<S>) -> (u8, u8) {
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
        let (x, y, z) = (
            self.over_light(s, ab),
            self.over_light(s, bc),
            self.over_light(s, ca),
        );
        // The least of the three largest values, the largest of the three least, and so on.
        let minus_room = s.sub(zero, room);
        let beside = left & s.lt(min3(s, x.1, y.1, z.1), minus_room)
            | right & s.lt(room, max3(s, x.0, y.0, z.0));
        let around = s.lt(zero, min3(s, x.0, y.0, z.0)) | s.lt(max3(s, x.1, y.1, z.1), zero);
        (beside, around)
    }

    /// The least and the largest value of a linear form over the unit square of the light.
    #[inline(always)]
    fn over_light<S: Simd>(&self, s: S, n: Vertex<S>) -> (S::F, S::F) {
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
    fn vertex<S: Simd>(&self, s: S, vertices: &[[f32; 8]; 9], first: usize) -> Vertex<S> {
        let x = s.load(&vertices[first]);
        let y = s.load(&vertices[first + 1]);
        let z = s.load(&vertices[first + 2]);
        (
            self.form(s, 0, x, y, z),
            self.form(s, 1, x, y, z),
            self.form(s, 2, x, y, z),
        )
    }

    /// P, Q or W. As with the planes, its roundings are well within the room.
    #[inline(always)]
    fn form<S: Simd>(&self, s: S, k: usize, x: S::F, y: S::F, z: S::F) -> S::F {
        let [nx, ny, nz] = self.rows[k];
        let sum = s.fma(s.splat(nz), z, s.splat(self.offset[k]));
        s.fma(s.splat(nx), x, s.fma(s.splat(ny), y, sum))
    }

    /// How far inside the upper bound on p.
    #[inline(always)]
    fn upper<S: Simd>(&self, s: S, v: Vertex<S>) -> S::F {
        let (k, j) = (s.splat(self.upper[0]), s.splat(self.upper[1]));
        s.sub(s.mul(k, v.2), s.fma(j, v.1, v.0))
    }
}

impl Plane {
    /// How far the boxes of a node reach inside.
    #[inline(always)]
    fn reach<S: Simd>(&self, s: S, rows: &[S::F; 6]) -> S::F {
        let mut sum = s.splat(self.offset);
        for axis in 0..3 {
            sum = s.fma(s.splat(self.negative[axis]), rows[axis], sum);
            sum = s.fma(s.splat(self.positive[axis]), rows[axis + 3], sum);
        }
        sum
    }
}

/// The plane through the shading point and two vertices: their cross product.
#[inline(always)]
fn plane<S: Simd>(s: S, a: Vertex<S>, b: Vertex<S>) -> Vertex<S> {
    (
        s.sub(s.mul(a.1, b.2), s.mul(a.2, b.1)),
        s.sub(s.mul(a.2, b.0), s.mul(a.0, b.2)),
        s.sub(s.mul(a.0, b.1), s.mul(a.1, b.0)),
    )
}

/// The largest absolute coordinate.
#[inline(always)]
fn largest<S: Simd>(s: S, v: Vertex<S>) -> S::F {
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

/// Leaves that are looked into in one go.
const BATCH: usize = 12;

/// Puts the triangles in the shaft from `point` into `scratch.corners`, unless they are more than
/// `limit` or one hides the light.
#[inline(always)]
fn collect_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    bounds: &ShaftBounds,
    (point, limit): (DVec3, usize),
    scratch: &mut Scratch,
) -> Found {
    let hierarchy = &occluders.hierarchy;
    let Scratch {
        frame,
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
        stack.resize(occluders.stack_size, 0);
    }
    let stack = &mut stack[..];
    stack[0] = 0;
    let mut top = 1;
    // Leaves to look into: many at a time, so that nothing hangs on what kind a child is.
    let mut leaves = [0_u32; BATCH + 16];
    let mut waiting = 0;
    while top > 0 {
        top -= 1;
        let node = &hierarchy.nodes[stack[top] as usize];
        counters.node_tests += u64::from(node.valid.count_ones());
        let found = bounds.boxes(s, node);
        hierarchy.prefetch(s, node, found);
        let inner = found & !node.leaf;
        s.pack(inner, &node.child, stack, top);
        top += inner.count_ones() as usize;
        let ready = found & node.leaf;
        s.pack(ready, &node.child, &mut leaves, waiting);
        waiting += ready.count_ones() as usize;
        if waiting < BATCH && top > 0 {
            continue;
        }
        for &child in &leaves[..waiting] {
            let child = Child(child);
            counters.triangle_tests += u64::from(child.count());
            let leaf = &hierarchy.leaves[child.index()];
            let (maybe, around) = bounds.triangles(s, leaf);
            let maybe = maybe & child.mask();
            if maybe & around != 0 && maybe & around & project::hiding(s, leaf, point, frame) != 0 {
                return Found::All;
            }
            if maybe != 0 {
                corners.add(s, leaf, child.index(), maybe);
                if corners.count > limit {
                    return Found::Many;
                }
            }
        }
        waiting = 0;
    }
    Found::Few
}

dispatch! {
    /// Collects the triangles in a shaft on an instruction set.
    collect = collect_kernel(occluders: &Occluders, bounds: &ShaftBounds, at: (DVec3, usize), scratch: &mut Scratch) -> Found
}
