//! Bounds of a shaft in `f32`: tests that find which boxes and triangles may be in the space
//! between a point and a light. Every test has a margin for its rounding, so that what is rejected
//! is outside.

use crate::{
    node::{Leaf, Node},
    rays::ray::{ROOM, SPLIT_ROOM},
    shaft::frame::LightFrame,
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// The coordinates P, Q and W of eight points, or the coefficients of eight linear functions of
/// these coordinates.
pub(crate) type Vertex<S> = (<S as Simd>::F, <S as Simd>::F, <S as Simd>::F);

/// Half-spaces and a box around everything between a point and a light, in `f32`, with margins for
/// the rounding of the tests: what is rejected lies outside.
///
/// A *form* is a linear function of a position. The value of a plane's form at a corner is computed
/// with up to six roundings of numbers up to three times the product of its normal's sum of
/// absolute components and the scene's size. Three of these roundings are of products that add up
/// to one such number, and each of the form's four coefficients is rounded once: together at most
/// 14/16 of the margin.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ShaftBounds {
    /// The coefficients of eight linear functions of a position, as `form[axis][index]`: how far
    /// the position is inside the four sides and the light's plane, then P, Q and W.
    form: [[f32; 8]; 3],
    /// For each form, its negative coefficients, for which a box's lower corner gives the largest
    /// value, and its positive coefficients.
    negative: [[f32; 8]; 3],
    positive: [[f32; 8]; 3],
    /// The values of the forms at the hierarchy's origin; the forms of planes have their error
    /// bounds added.
    offset: [f32; 8],
    /// The error bounds of the values of the forms.
    room: [f32; 8],
    /// The error bounds of W − Q and of the upper bound on p; and one plus the error bound of W.
    sums: [f32; 3],
    /// Five times the sum of the error bounds of P, Q and W; infinite where products of three
    /// coordinates may overflow.
    rooms: f32,
    /// Whether the light's plane is so far from parallel to the axes that it excludes more than the
    /// box around the shaft.
    tilted: bool,
    /// The lower corner of the bounding box of the shaft; `hi` is the upper corner.
    lo: [f32; 3],
    hi: [f32; 3],
    /// The coefficients (k, j) of the upper bound on p, which is `k W − P − j Q ≥ 0`.
    upper: [f32; 2],
    /// The excluded triangles: the index of the first, and how many.
    exclude: (u32, u32),
}

/// The indices of P, Q and W among the forms.
const PQW: [usize; 3] = [5, 6, 7];

/// A bit for each of the forms P, Q and W.
const PQW_BITS: u8 = 0b1110_0000;

/// The range of numbers that are normal in `f32` even after multiplication with the error bound
/// 2⁻²⁰, and finite even if a few of them are added.
const F32: [f64; 2] = [1e-30, 1e36];

/// The range of the scene's size, in units of the light, in which a shaft has bounds. At the upper
/// end, projections of triangles are off by half of the light.
const LIGHTS: [f64; 2] = [1e-30, 1e15];

/// The range of coordinates for which sums of six products of three coordinates are finite in
/// `f32`.
const CUBES: [f64; 2] = [0.0, 4e11];

#[allow(
    clippy::cast_possible_truncation,
    reason = "the bounds allow for the rounding"
)]
impl ShaftBounds {
    /// Creates the bounds of the shaft from `point` to a light in the box `around`. All coordinates
    /// are the hierarchy's; for its triangles they are at most `extent`.
    ///
    /// Returns `None` if P, Q and W would not be precise enough for anything in the scene: if their
    /// coefficients or error bounds are not finite and normal numbers in `f32`, or if in `f64` they
    /// are less precise than the light is large.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        s: S,
        extent: f64,
        point: DVec3,
        around: [DVec3; 2],
        frame: &LightFrame,
        exclude: (u32, u32),
    ) -> Option<Self> {
        // Compute the margins, and the plane of the upper bound on p.
        let [lo, hi] = [around[0].min(point), around[1].max(point)];
        let size = lo.abs().max(hi.abs()).max_element().max(extent);
        let room = ROOM * size;
        // Bounds of boxes are compared as they are: the box needs a margin for the rounding in
        // `f64` alone.
        let fine = SPLIT_ROOM * size;
        let (k, j) = frame.shape.upper();
        let (p, q, w) = (frame.p, frame.q, frame.w);
        let upper = w * k - p - q * j;
        let beyond = w - q;
        let zero = s.dsplat(0.0);
        // Set the coefficients of all eight forms, axis by axis.
        let mut at_point = zero;
        let mut sum = zero;
        let mut bounds = Self {
            rooms: f32::INFINITY,
            tilted: {
                let steepness = w.abs();
                steepness.element_sum() > 1.01 * steepness.max_element()
            },
            lo: (lo - DVec3::splat(fine)).to_array().map(least_above),
            hi: (hi + DVec3::splat(fine)).to_array().map(greatest_below),
            upper: [k as f32, j as f32],
            exclude,
            ..Self::default()
        };
        for axis in 0..3 {
            let n = s.dload(&[
                p[axis],
                upper[axis],
                q[axis],
                beyond[axis],
                -w[axis],
                p[axis],
                q[axis],
                w[axis],
            ]);
            at_point = at_point + n * point[axis];
            sum = sum + s.dmax(n, zero - n);
            let n = s.narrow(n);
            s.store(n, &mut bounds.form[axis]);
            s.store(s.min(n, s.splat(0.0)), &mut bounds.negative[axis]);
            s.store(s.max(n, s.splat(0.0)), &mut bounds.positive[axis]);
        }
        // Refuse where rounding would be larger than the light.
        let largest = sum * size;
        let fit = within(s, sum, F32) & within(s, largest, LIGHTS);
        if !fit & PQW_BITS != 0 {
            return None;
        }
        let sum = sum * room;
        s.store(s.narrow(sum), &mut bounds.room);
        bounds.sum_rooms(!within(s, largest, CUBES) & PQW_BITS == 0);
        // The light's plane is where W is one.
        let mut offset = s.dload(&[0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]) - at_point;
        let planes = s.dload(&[1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        offset = offset + sum * planes;
        s.store(s.narrow(offset), &mut bounds.offset);
        Some(bounds)
    }

    /// Sets `sums`; and if `cubes`, which says that products of three coordinates are finite, sets
    /// `rooms` to five times the sum of the error bounds of P, Q and W.
    #[inline(always)]
    fn sum_rooms(&mut self, cubes: bool) {
        let [rp, rq, rw] = [self.room[5], self.room[6], self.room[7]];
        self.sums = [rw + rq, rw + rp + rq, 1.0 + rw];
        if cubes {
            self.rooms = 5.0 * (rp + rq + rw);
        }
    }

    /// Returns a bit for each box of a node that may overlap the shaft.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, s: S, node: &Node) -> u8 {
        let mut rows = [s.splat(0.0); 6];
        for (row, bounds) in rows.iter_mut().zip(&node.bounds) {
            *row = s.load(bounds);
        }
        // Compare with the box around the shaft, then with its side planes, and with the light's
        // plane if that excludes anything more.
        let mut inside = s.splat(f32::INFINITY);
        for axis in 0..3 {
            let low = s.splat(self.hi[axis]) - rows[axis];
            let high = rows[axis + 3] - self.lo[axis];
            inside = s.min(inside, s.min(low, high));
        }
        for plane in 0..4 {
            inside = s.min(inside, self.reach(s, plane, &rows));
        }
        if self.tilted {
            inside = s.min(inside, self.reach(s, 4, &rows));
        }
        s.le(s.splat(0.0), inside) & node.valid
    }

    /// Returns a bit for each box of a node that lies wholly in the shaft, up to rounding.
    #[inline(always)]
    pub(crate) fn holds<S: Simd>(&self, s: S, node: &Node) -> u8 {
        let mut inside = s.splat(f32::INFINITY);
        // For each plane, compute the value at the corner that is the least far inside.
        for plane in [0, 1, 2, 3, 4, PQW[2]] {
            let mut near = s.splat(self.offset[plane]);
            for axis in 0..3 {
                let (low, high) = (s.load(&node.bounds[axis]), s.load(&node.bounds[axis + 3]));
                near = s.fma(s.splat(self.positive[axis][plane]), low, near);
                near = s.fma(s.splat(self.negative[axis][plane]), high, near);
            }
            inside = s.min(inside, near);
        }
        s.lt(s.splat(0.0), inside)
    }

    /// Returns the least and the greatest P, Q and W over each box of a node.
    #[inline(always)]
    pub(crate) fn extents<S: Simd>(&self, s: S, node: &Node) -> ([S::F; 3], [S::F; 3]) {
        let mut least = [s.splat(0.0); 3];
        let mut most = least;
        for (k, number) in PQW.into_iter().enumerate() {
            let mut near = s.splat(self.offset[number] - self.room[number]);
            let mut far = s.splat(self.offset[number] + self.room[number]);
            for axis in 0..3 {
                let n = self.form[axis][number];
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

    /// Returns bounds of the projections onto the light of boxes that are well before the shading
    /// point, from bounds of P, Q and W: the least p and q, then the greatest.
    #[inline(always)]
    pub(crate) fn images<S: Simd>(s: S, least: &[S::F; 3], most: &[S::F; 3]) -> [[S::F; 2]; 2] {
        let near = s.splat(1.0) / least[2];
        let far = s.splat(1.0) / most[2];
        let mut image = [[near; 2]; 2];
        for k in 0..2 {
            // The margin of 1e-6 covers the two roundings of a quotient as well.
            let l = s.min(least[k] * near, least[k] * far);
            let h = s.max(most[k] * near, most[k] * far);
            image[0][k] = s.fma(s.abs(l), s.splat(-1e-6), l);
            image[1][k] = s.fma(s.abs(h), s.splat(1e-6), h);
        }
        image
    }

    /// Returns the triangles of a leaf that may be partly inside the shaft, and those among them
    /// that may hide the whole light. The bits of lanes that are not in use are arbitrary.
    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(&self, s: S, leaf: &Leaf) -> (u8, u8) {
        let vertices = self.vertices(s, leaf);
        let found = self.within(s, &vertices) & self.included(s, leaf);
        if found == 0 {
            return (0, 0);
        }
        let [a, b, c] = vertices;
        let (beside, around) = self.beside(s, a, b, c);
        (found & !beside, found & !beside & around)
    }

    /// Returns the corners of a leaf's triangles in (P, Q, W).
    #[inline(always)]
    pub(crate) fn vertices<S: Simd>(&self, s: S, leaf: &Leaf) -> [Vertex<S>; 3] {
        [
            self.vertex(s, &leaf.vertices, 0),
            self.vertex(s, &leaf.vertices, 3),
            self.vertex(s, &leaf.vertices, 6),
        ]
    }

    /// Returns a bit for each triangle with these corners that may be partly inside the shaft.
    /// Triangles outside of the shaft that cross the planes of two of its sides, beyond the edge
    /// between them, are not rejected yet.
    #[inline(always)]
    pub(crate) fn within<S: Simd>(&self, s: S, [a, b, c]: &[Vertex<S>; 3]) -> u8 {
        let (rp, rq, rw) = (
            s.splat(self.room[PQW[0]]),
            s.splat(self.room[PQW[1]]),
            s.splat(self.room[PQW[2]]),
        );
        // Some vertex has to be inside each side, some before the shading point, some before the
        // light: margin + value ≥ 0.
        let mut inside = s.min(rp + max3(s, a.0, b.0, c.0), rq + max3(s, a.1, b.1, c.1));
        let beyond = max3(s, a.2 - a.1, b.2 - b.1, c.2 - c.1);
        inside = s.min(inside, beyond + self.sums[0]);
        let beyond = max3(s, self.upper(s, *a), self.upper(s, *b), self.upper(s, *c));
        inside = s.min(inside, beyond + self.sums[1]);
        inside = s.min(inside, rw + max3(s, a.2, b.2, c.2));
        let nearest = s.min(s.min(a.2, b.2), c.2);
        inside = s.min(inside, s.splat(self.sums[2]) - nearest);
        s.le(s.splat(0.0), inside)
    }

    /// Returns a bit for each triangle of a leaf that is not excluded by the query.
    #[inline(always)]
    pub(crate) fn included<S: Simd>(&self, s: S, leaf: &Leaf) -> u8 {
        if self.exclude.1 > 0 {
            !s.in_range(&leaf.id, self.exclude.0, self.exclude.1)
        } else {
            u8::MAX
        }
    }

    /// Returns a bit for each triangle that is well before the shading point; of these, a bit for
    /// each that may be before the light and overlap it along q; and bounds of the projections of
    /// all these triangles in (p, q).
    #[inline(always)]
    pub(crate) fn triangle_images<S: Simd>(
        &self,
        s: S,
        vertices: &[Vertex<S>; 3],
    ) -> (u8, u8, [S::F; 2], [S::F; 2]) {
        let [a, b, c] = *vertices;
        let one = s.splat(1.0);
        let inverse = [one / a.2, one / b.2, one / c.2];
        let depth = min3(s, a.2, b.2, c.2);
        // (P ± a) / (W ± b) is off by (a + |p| b) / W, and a little for b² and rounding.
        let scale = one / depth * 1.25;
        let mut least = [depth; 2];
        let mut most = least;
        for (k, at) in [(0, [a.0, b.0, c.0]), (1, [a.1, b.1, c.1])] {
            let at = [at[0] * inverse[0], at[1] * inverse[1], at[2] * inverse[2]];
            let low = min3(s, at[0], at[1], at[2]);
            let high = max3(s, at[0], at[1], at[2]);
            let size = s.max(s.abs(low), s.abs(high));
            let off = s.fma(size, s.splat(self.room[PQW[2]]), s.splat(self.room[PQW[k]]));
            let off = s.fma(size, s.splat(1e-6), off * scale);
            least[k] = low - off;
            most[k] = high + off;
        }
        let before = s.le(s.splat((16.0 * self.room[PQW[2]]).max(1e-6)), depth);
        // Before the light, and overlapping it along q.
        let inside = s.min(
            s.splat(self.sums[2]) - depth,
            s.min(most[1], one - least[1]),
        );
        (before, s.le(s.splat(0.0), inside), least, most)
    }

    /// Separates triangles from the light by their own sides, and returns two masks. The first has
    /// the triangles with a side whose plane through the shading point has the light on the other
    /// side from the triangle; these are long slivers near which the light lies. The second has the
    /// triangles that may hide the whole light, for `f64` to decide: all three planes have the
    /// light on the same side.
    #[inline(always)]
    fn beside<S: Simd>(&self, s: S, a: Vertex<S>, b: Vertex<S>, c: Vertex<S>) -> (u8, u8) {
        let zero = s.splat(0.0);
        let reach = max3(s, largest(s, a), largest(s, b), largest(s, c));
        // A plane's coordinates are off by two coordinates times two error bounds, its value at a
        // corner of the unit square by three times that, and the determinant by that times three
        // coordinates.
        let room = reach * self.rooms;
        // Find the orientation, where it is certain.
        let (ab, bc, ca) = (plane(s, a, b), plane(s, b, c), plane(s, c, a));
        let det = s.fma(ab.0, c.0, s.fma(ab.1, c.1, ab.2 * c.2));
        let det_room = room * (reach * 3.0);
        let left = s.lt(det_room, det);
        let right = s.lt(det, zero - det_room);
        // Bound each side's plane over the light.
        let (x, y, z) = (
            self.over_light(s, ab),
            self.over_light(s, bc),
            self.over_light(s, ca),
        );
        // The light is outside if the largest value of one plane is negative, in the triangle's
        // orientation.
        let minus_room = zero - room;
        let beside = left & s.lt(min3(s, x.1, y.1, z.1), minus_room)
            | right & s.lt(room, max3(s, x.0, y.0, z.0));
        let around = s.lt(zero, min3(s, x.0, y.0, z.0)) | s.lt(max3(s, x.1, y.1, z.1), zero);
        (beside, around)
    }

    /// Returns the least and the largest value of a linear form over the light's unit square.
    #[inline(always)]
    fn over_light<S: Simd>(&self, s: S, n: Vertex<S>) -> (S::F, S::F) {
        let zero = s.splat(0.0);
        let mut least = n.2 + s.min(n.1, zero);
        let mut most = n.2 + s.max(n.1, zero);
        // A linear light has p = 0.
        if self.upper[0] != 0.0 {
            least = least + s.min(n.0, zero);
            most = most + s.max(n.0, zero);
        }
        (least, most)
    }

    /// Returns P, Q and W of the vertices in rows `first` to `first + 2`.
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

    /// Returns P, Q or W, chosen by the index `k` of the form, at eight positions. As for the
    /// planes, the rounding is well within the error bound.
    #[inline(always)]
    fn form<S: Simd>(&self, s: S, k: usize, x: S::F, y: S::F, z: S::F) -> S::F {
        let [nx, ny, nz] = &self.form;
        let k = PQW[k];
        let sum = s.fma(s.splat(nz[k]), z, s.splat(self.offset[k]));
        s.fma(s.splat(nx[k]), x, s.fma(s.splat(ny[k]), y, sum))
    }

    /// Returns the largest value of a plane's form over each box of a node, whose bounds are in
    /// `rows`.
    #[inline(always)]
    pub(crate) fn reach<S: Simd>(&self, s: S, plane: usize, rows: &[S::F; 6]) -> S::F {
        let mut sum = s.splat(self.offset[plane]);
        for axis in 0..3 {
            sum = s.fma(s.splat(self.negative[axis][plane]), rows[axis], sum);
            sum = s.fma(s.splat(self.positive[axis][plane]), rows[axis + 3], sum);
        }
        sum
    }

    /// Returns the value of the upper bound on p at eight vertices, k W − P − j Q, which is not
    /// negative inside.
    #[inline(always)]
    fn upper<S: Simd>(&self, s: S, v: Vertex<S>) -> S::F {
        // For a parallelogram, the upper bound is W − P.
        if self.upper[0] > self.upper[1] {
            return v.2 - v.0;
        }
        let (k, j) = (s.splat(self.upper[0]), s.splat(self.upper[1]));
        k * v.2 - s.fma(j, v.1, v.0)
    }
}

/// Returns the least `f32` that is not below `x`.
#[allow(clippy::cast_possible_truncation, reason = "rounded as it says")]
#[inline(always)]
fn least_above(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x {
        rounded.next_up()
    } else {
        rounded
    }
}

/// Returns the greatest `f32` that is not above `x`.
#[inline(always)]
fn greatest_below(x: f64) -> f32 {
    -least_above(-x)
}

/// Returns a bit for each number within `range`, ends included.
#[inline(always)]
fn within<S: Simd>(s: S, x: S::D, range: [f64; 2]) -> u8 {
    s.bits(s.dle(s.dsplat(range[0]), x) & s.dle(x, s.dsplat(range[1])))
}

/// Returns the plane through the shading point and two vertices, as the cross product of the
/// vertices.
#[inline(always)]
fn plane<S: Simd>(s: S, a: Vertex<S>, b: Vertex<S>) -> Vertex<S> {
    (
        s.fms(a.1, b.2, a.2 * b.1),
        s.fms(a.2, b.0, a.0 * b.2),
        s.fms(a.0, b.1, a.1 * b.0),
    )
}

/// Returns the largest absolute coordinate of each of eight points.
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
