//! The projection of a shaft's triangles onto the light's plane, in `f64`: which of them hide the
//! whole light, miss it, are back faces, or have to be clipped first.
//!
//! A vertex is projected by operations that depend on the vertex alone, and an edge that is clipped
//! is clipped from its inner end. So triangles that share an edge have bit-identical projections of
//! it. In this module, the *image* of a triangle is its projection from the shading point onto the
//! light's plane.

use crate::{
    closed_mesh::BackfaceFilter,
    lanes::ddot,
    node::{DENSE, Leaf},
    shaft::{
        frame::{LightFrame, Shape},
        sides::Vertex,
    },
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// The distance from the light, in units of the light, at which triangles are clipped that extend
/// far beyond it; the light is within [0, 1]. The distance is a power of two, so that the sign of
/// `P + GUARD W` is exact. Whether a vertex is clipped off depends on the vertex alone, so that
/// triangles clip a shared edge alike. See `docs/decisions/004-candidates-projected-once.md`.
pub(crate) const GUARD: f64 = 4096.0;

/// The capacity of [`Corners`]: the triangles of a shaft that is not dense, one more leaf, and the
/// extent of packed stores, which write eight entries at a time.
const ROOM: usize = DENSE + 16;

/// Triangles that wait to be projected, as a structure of arrays.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Corners {
    /// The rows x, y, z of vertex 0, then of vertices 1 and 2.
    rows: [[f32; ROOM]; 9],
    /// The slots of the triangles: leaf × 8 + lane.
    pub(crate) slots: [u32; ROOM],
    /// The mesh codes of the triangles, if there are closed meshes.
    meshes: [u32; ROOM],
    pub(crate) count: usize,
}

impl Default for Corners {
    fn default() -> Self {
        Self {
            rows: [[0.0; ROOM]; 9],
            slots: [0; ROOM],
            meshes: [0; ROOM],
            count: 0,
        }
    }
}

impl Corners {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    pub(crate) fn slots(&self) -> &[u32] {
        &self.slots[..self.count]
    }

    /// Returns the positions of one vertex of the eight triangles from index `start` on; `first` is
    /// the index of the vertex's first row.
    #[inline(always)]
    fn vertex<S: Simd>(&self, s: S, start: usize, first: usize) -> [S::F; 3] {
        let mut place = [s.splat(0.0); 3];
        for (place, row) in place.iter_mut().zip(&self.rows[first..]) {
            // There is always padding behind the last triangle.
            if let Some(eight) = row[start..].first_chunk() {
                *place = s.load(eight);
            }
        }
        place
    }

    /// Adds the triangles of a leaf in the mask `maybe`. There must be capacity for eight more.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        s: S,
        leaf: &Leaf,
        maybe: u8,
        slots: &[u32; 8],
        meshes: Option<&[u32; 8]>,
    ) {
        // The count is read once, and limited so that the compiler knows that stores are within
        // bounds.
        let at = self.count.min(ROOM - 8);
        for (row, from) in self.rows.iter_mut().zip(&leaf.vertices) {
            s.compress(maybe, s.load(from), row, at);
        }
        s.pack(maybe, slots, &mut self.slots, at);
        if let Some(meshes) = meshes {
            s.pack(maybe, meshes, &mut self.meshes, at);
        }
        self.count = at + maybe.count_ones() as usize;
    }
}

/// The projections of triangles onto the light's plane, in (p, q), as a structure of arrays.
#[derive(Debug, Default)]
pub(crate) struct FlatTriangles {
    /// The rows p and q of vertex 0, then of vertices 1 and 2; the rows may be longer than `count`.
    rows: [Vec<f64>; 6],
    pub(crate) count: usize,
}

/// The rows of eight projected triangles, as in [`FlatTriangles`].
pub(crate) type FlatBlock<'a> = [&'a [f64; 8]; 6];

impl FlatTriangles {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Returns the corners of the projected triangles from index `first` on.
    pub(crate) fn get_from(&self, first: usize) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        (first.min(self.count)..self.count).map(|i| self.get(i))
    }

    /// Returns the corners of one projected triangle.
    pub(crate) fn get(&self, i: usize) -> [[f64; 2]; 3] {
        [0, 2, 4].map(|k| [self.rows[k][i], self.rows[k + 1][i]])
    }

    /// Returns the rows in blocks of eight triangles; the last block may hold more than is in use.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> impl Iterator<Item = FlatBlock<'_>> {
        let [a, b, c, d, e, f] = &self.rows;
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(|r| r.as_chunks::<8>().0);
        (0..self.count.div_ceil(8)).map(move |i| [&a[i], &b[i], &c[i], &d[i], &e[i], &f[i]])
    }

    /// Ensures capacity for eight more triangles and one packed store.
    #[inline(always)]
    fn reserve(&mut self) {
        if self.rows[5].len() < self.count + 16 {
            self.grow();
        }
    }

    #[cold]
    fn grow(&mut self) {
        let room = (2 * self.count + 64).next_multiple_of(8);
        for row in &mut self.rows {
            row.resize(room, 0.0);
        }
    }

    /// Adds a triangle that covers the whole unit square.
    pub(crate) fn hide_all(&mut self) {
        self.push([-1.0, -1.0, 4.0, -1.0, -1.0, 4.0]);
    }

    fn push(&mut self, triangle: [f64; 6]) {
        self.reserve();
        for (row, value) in self.rows.iter_mut().zip(triangle) {
            row[self.count] = value;
        }
        self.count += 1;
    }

    /// Adds the projected triangles in the mask `keep`.
    #[inline(always)]
    fn add<S: Simd>(&mut self, s: S, keep: u8, image: &[[S::D; 2]; 3]) {
        self.reserve();
        for k in 0..6 {
            s.dcompress(keep, image[k / 2][k % 2], &mut self.rows[k], self.count);
        }
        self.count += keep.count_ones() as usize;
    }
}

/// Projects up to eight triangles from index `start` on, and returns a bit for each that may hide a
/// part of the light; `None` if one of them hides the whole light. Unless `SEPARATE`, most
/// triangles that miss the light are projected nevertheless.
#[allow(clippy::too_many_lines, reason = "a kernel, whose steps are one")]
#[inline(always)]
pub(crate) fn project_some<S: Simd, const SEPARATE: bool>(
    s: S,
    corners: &Corners,
    start: usize,
    point: DVec3,
    frame: &LightFrame,
    flat: &mut FlatTriangles,
    backfaces: &mut BackfaceFilter<'_>,
) -> Option<u8> {
    // Transform the vertices to (P, Q, W), and drop what is behind the point or beyond the light.
    let used = 0xff_u8 >> (8 - (corners.count - start).min(8));
    let a = to_frame(s, corners.vertex(s, start, 0), point, frame);
    let b = to_frame(s, corners.vertex(s, start, 3), point, frame);
    let c = to_frame(s, corners.vertex(s, start, 6), point, frame);
    let nearest = s.dmin(s.dmin(a[2], b[2]), c[2]);
    let farthest = s.dmax(s.dmax(a[2], b[2]), c[2]);
    let (near, end) = (s.dsplat(frame.near), s.dsplat(frame.margins.end()));
    let between = s.dlt(near, farthest) & s.dlt(nearest, end);
    let alive = s.bits(between) & used;
    if alive == 0 {
        return Some(0);
    }
    // Project the triangles, and find which have to be clipped.
    let mut whole = s.dle(near, nearest) & s.dle(farthest, end);
    for v in [&a, &b, &c] {
        whole = whole & within_guard(s, v);
    }
    let image = [to_plane(s, &a), to_plane(s, &b), to_plane(s, &c)];
    let extent = Extent::new(s, &image);
    let simple = s.bits(whole) & alive;
    let mut cut = alive & !simple;
    // Find those that hide the whole light, and drop those to be clipped that surely miss it.
    let around = simple & around_light(s, extent.low, extent.high, frame.shape);
    if cut | around != 0 {
        let (outside, covers) = cone(s, [&a, &b, &c], frame);
        if covers & (cut | around) != 0 {
            return None;
        }
        cut &= !outside;
    }
    // Drop those that miss the light, and back faces of closed meshes.
    let mut keep = simple;
    if SEPARATE {
        keep &= !misses_light(s, &image, &extent, frame);
    }
    if backfaces.any() {
        let Extent { area, room, .. } = extent;
        let negative = s.bits(s.dlt(area, s.dsplat(0.0) - room));
        let positive = s.bits(s.dlt(room, area));
        if let Some(codes) = corners.meshes[start..].first_chunk() {
            keep &= !backfaces.left_out(s, codes, keep & negative, keep & positive);
        }
    }
    // Store the images of whole triangles, then those of clipped ones.
    let mut left = keep;
    if keep != 0 {
        flat.add(s, keep, &image);
    }
    if cut != 0 {
        let mut rows = [[0.0; 8]; 9];
        for k in 0..3 {
            s.dstore(a[k], &mut rows[k]);
            s.dstore(b[k], &mut rows[3 + k]);
            s.dstore(c[k], &mut rows[6 + k]);
        }
        while cut != 0 {
            let lane = cut.trailing_zeros() as usize;
            cut &= cut - 1;
            let v = |k: usize| [rows[k][lane], rows[k + 1][lane], rows[k + 2][lane]];
            let before = flat.count;
            if let Some(sides) = &frame.sides {
                let vertices = [0, 3, 6].map(|k| {
                    let place = [0, 1, 2].map(|axis| corners.rows[k + axis][start + lane].into());
                    let place = DVec3::from_array(place);
                    sides.about_foot(place, place - point)
                });
                cut_triangle(vertices, sides.c, frame, flat);
            } else {
                cut_triangle([v(0), v(3), v(6)], [0.0; 2], frame, flat);
            }
            left |= u8::from(flat.count > before) << lane;
        }
    }
    Some(left)
}

/// Projects eight vertices to the light's plane.
#[inline(always)]
pub(crate) fn to_plane<S: Simd>(s: S, v: &Vertex<S>) -> [S::D; 2] {
    let inverse = s.dsplat(1.0) / v[2];
    [v[0] * inverse, v[1] * inverse]
}

/// Returns the mask of vertices whose projections are closer to the light than [`GUARD`]: the same
/// decision as in [`cut_triangle`].
#[inline(always)]
pub(crate) fn within_guard<S: Simd>(s: S, v: &Vertex<S>) -> S::M {
    let zero = s.dsplat(0.0);
    let limit = v[2] * GUARD;
    let p = s.dmax(v[0], zero - v[0]);
    let q = s.dmax(v[1], zero - v[1]);
    s.dle(s.dmax(p, q), limit)
}

/// Returns the coordinates (P, Q, W) of eight positions.
#[inline(always)]
pub(crate) fn to_frame<S: Simd>(
    s: S,
    place: [S::F; 3],
    point: DVec3,
    frame: &LightFrame,
) -> Vertex<S> {
    let place = [s.widen(place[0]), s.widen(place[1]), s.widen(place[2])];
    let [x, y, z] = [place[0] - point.x, place[1] - point.y, place[2] - point.z];
    if let Some(sides) = &frame.sides {
        return sides.vertex(s, place, [x, y, z]);
    }
    [
        ddot::<S>(frame.p, x, y, z),
        ddot::<S>(frame.q, x, y, z),
        ddot::<S>(frame.w, x, y, z),
    ]
}

/// Returns a bit for each triangle of a leaf that hides the whole light alone.
#[inline(always)]
pub(crate) fn hiding<S: Simd>(s: S, leaf: &Leaf, point: DVec3, frame: &LightFrame) -> u8 {
    // Not by `map`, which is not inlined here.
    let v = &leaf.vertices;
    let place = [s.load(&v[0]), s.load(&v[1]), s.load(&v[2])];
    let a = to_frame(s, place, point, frame);
    let place = [s.load(&v[3]), s.load(&v[4]), s.load(&v[5])];
    let b = to_frame(s, place, point, frame);
    let place = [s.load(&v[6]), s.load(&v[7]), s.load(&v[8])];
    let c = to_frame(s, place, point, frame);
    cone(s, [&a, &b, &c], frame).1
}

/// Returns a bit for each projected triangle with the whole light in its bounding rectangle; the
/// triangles that hide the whole light are among them.
#[inline(always)]
fn around_light<S: Simd>(s: S, low: [S::D; 2], high: [S::D; 2], shape: Shape) -> u8 {
    let upper = if shape == Shape::Line {
        0.0
    } else {
        1.0 - 1e-9
    };
    let least = s.dsplat(1e-9);
    let below = s.dle(low[0], least) & s.dle(low[1], least);
    let above = s.dle(s.dsplat(upper), high[0]) & s.dle(s.dsplat(1.0 - 1e-9), high[1]);
    s.bits(below & above)
}

/// Tests triangles as cones from the shading point, and returns two masks.
///
/// The first has the triangles that a plane separates from everything between the shading point and
/// the light: a plane through the shading point and a side of the triangle, or the triangle's own.
/// Among these are the floor under the shading point and the walls around it, which would have to
/// be clipped otherwise. It also has triangles whose plane contains the shading point up to
/// rounding, so that they can hide some of the light only within the margin near that point.
///
/// The second has the triangles that hide the whole light: all corners of the light are within the
/// cone, and the triangle is in front of them.
#[inline(always)]
fn cone<S: Simd>(s: S, [a, b, c]: [&Vertex<S>; 3], frame: &LightFrame) -> (u8, u8) {
    let zero = s.dsplat(0.0);
    // Bound the rounding, in units of 2⁻⁵³ and products of two of the largest coordinates: each
    // component of a cross product is off by 4, the sum of three by 24, its part of the value at a
    // corner of the light by 48; the determinant is off by 30 products of all three.
    let mut largest = [zero; 3];
    for v in [a, b, c] {
        for (size, x) in largest.iter_mut().zip(v) {
            *size = s.dmax(*size, s.dmax(*x, zero - *x));
        }
    }
    let [p, q, w] = largest;
    let room = (q * w + p * w + p * q) * 7e-15;
    let det_room = p * q * w * 4e-15;
    // Compute the planes through the point and each side, oriented so that the determinant is
    // positive.
    let (ab, bc, ca) = (normal::<S>(a, b), normal::<S>(b, c), normal::<S>(c, a));
    let det = ab[0] * c[0] + ab[1] * c[1] + ab[2] * c[2];
    // Turned so that the determinant is positive.
    let turn = s.select(s.dlt(det, zero), s.dsplat(1.0), s.dsplat(-1.0));
    let det = det * turn;
    let clear = s.dlt(det_room, det);
    let minus_room = zero - room;
    let own = [
        turn * (ab[0] + bc[0] + ca[0]),
        turn * (ab[1] + bc[1] + ca[1]),
        turn * (ab[2] + bc[2] + ca[2]),
    ];
    // Test the triangle's own plane. The light is beyond it where own·x > det; if that is nowhere,
    // the triangle is behind the light.
    let most = largest_over_light(s, &own, frame.shape);
    let mut outside = s.dlt(most + (room + det_room), det);
    let mut covers = clear;
    // Test the planes through the sides.
    for n in [&ab, &bc, &ca] {
        let n = [turn * n[0], turn * n[1], turn * n[2]];
        let most = largest_over_light(s, &n, frame.shape);
        outside = outside | s.dlt(most, minus_room);
        let (least, _) = over_corners(s, &n, frame);
        covers = covers & s.dlt(room, least);
    }
    // The triangle has to be in front of all corners: the value of its plane at a corner, over the
    // determinant, is 1 ÷ W of the triangle in that corner's direction.
    let (least, most) = over_corners(s, &own, frame);
    let near = det * (1.0 / frame.margins.end());
    let far = det * frame.inverse_near;
    covers = covers & s.dle(near, least - room);
    covers = covers & s.dle(most + room, far);
    // Find triangles whose plane is closer to the point than the margin, in every direction towards
    // the light.
    let beside = s.dmax(least, zero - most) - room;
    let near = s.dlt(det + det_room, beside * frame.near);
    (s.bits(clear & outside | near), s.bits(covers))
}

/// Returns the least and the largest value of a linear form over the light's corners.
#[inline(always)]
fn over_corners<S: Simd>(s: S, n: &Vertex<S>, frame: &LightFrame) -> (S::D, S::D) {
    let mut least = s.dsplat(f64::INFINITY);
    let mut most = s.dsplat(f64::NEG_INFINITY);
    for four in frame.corners_by_four() {
        for corner in four {
            let p = n[0] * corner[0];
            let q = n[1] * corner[1];
            let value = p + q + n[2];
            least = s.dmin(least, value);
            most = s.dmax(most, value);
        }
    }
    (least, most)
}

/// Returns the plane through the shading point and two vertices, as the cross product of the
/// vertices.
#[inline(always)]
fn normal<S: Simd>(a: &Vertex<S>, b: &Vertex<S>) -> Vertex<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Returns the largest value of a linear form over the square, triangle or line that bounds the
/// light, with a small margin for lines along the light's own edges.
#[inline(always)]
fn largest_over_light<S: Simd>(s: S, n: &Vertex<S>, shape: Shape) -> S::D {
    let zero = s.dsplat(0.0);
    let (p, q) = (zero - n[0], zero - n[1]);
    let sizes = s.dmax(n[0], p) + s.dmax(n[1], q);
    let mut most = n[2] + sizes * 1e-9;
    if shape != Shape::Line {
        most = most + s.dmax(n[0], zero);
    }
    most + s.dmax(n[1], zero)
}

/// The bounding rectangles, areas and rounding errors of eight projected triangles.
struct Extent<S: Simd> {
    low: [S::D; 2],
    high: [S::D; 2],
    /// Twice the signed areas: positive for triangles that are counter-clockwise in (p, q).
    area: S::D,
    /// The rounding error of a cross product of coordinate differences.
    room: S::D,
}

impl<S: Simd> Extent<S> {
    /// Computes the bounds, signed areas and rounding errors of eight images.
    #[inline(always)]
    fn new(s: S, image: &[[S::D; 2]; 3]) -> Self {
        let mut low = image[0];
        let mut high = image[0];
        for v in &image[1..] {
            for k in 0..2 {
                low[k] = s.dmin(low[k], v[k]);
                high[k] = s.dmax(high[k], v[k]);
            }
        }
        let reach = s.dmax(
            s.dmax(high[0], high[1]),
            s.dsplat(0.0) - s.dmin(low[0], low[1]),
        );
        // The largest coordinate difference, with the light's own coordinates included.
        let m = reach + 2.0;
        Self {
            low,
            high,
            area: area::<S>(image),
            room: m * m * 1e-13,
        }
    }
}

/// Returns a bit for each projected triangle that misses the light: a side of the light or of the
/// triangle separates the two.
#[inline(always)]
fn misses_light<S: Simd>(
    s: S,
    image: &[[S::D; 2]; 3],
    extent: &Extent<S>,
    frame: &LightFrame,
) -> u8 {
    let (zero, one) = (s.dsplat(0.0), s.dsplat(1.0));
    let upper = if frame.shape == Shape::Line { 0.0 } else { 1.0 };
    // A small margin for lines along the light's own edges.
    let (least, most) = (s.dsplat(-1e-9), s.dsplat(1.0 + 1e-9));
    let Extent {
        low,
        high,
        area,
        room,
    } = *extent;
    // Test the sides of the light's bounding square, or of the light.
    let mut misses = s.dlt(high[0], least) | s.dlt(s.dsplat(upper + 1e-9), low[0]);
    misses = misses | (s.dlt(high[1], least) | s.dlt(most, low[1]));
    let minus_room = zero - room;
    let [a, b, c] = image;
    if frame.shape == Shape::Triangle {
        // A triangular light has its third side at p + q = 1.
        let sums = [a[0] + a[1], b[0] + b[1], c[0] + c[1]];
        let nearest = s.dmin(s.dmin(sums[0], sums[1]), sums[2]);
        misses = misses | s.dlt(most, nearest);
    }
    // Test the sides of the image: all corners of the light on the outer side.
    let turn = s.select(s.dlt(area, zero), one, s.dsplat(-1.0));
    for (v, w) in [(a, b), (b, c), (c, a)] {
        let (ex, ey) = (turn * (w[0] - v[0]), turn * (w[1] - v[1]));
        let mut most = s.dsplat(f64::NEG_INFINITY);
        for four in frame.corners_by_four() {
            for corner in four {
                let (x, y) = (s.dsplat(corner[0]) - v[0], s.dsplat(corner[1]) - v[1]);
                let side = cross::<S>(ex, ey, x, y);
                most = s.dmax(most, side);
            }
        }
        misses = misses | s.dlt(most, minus_room);
    }
    s.bits(misses)
}

/// Twice the signed areas of eight images.
#[inline(always)]
fn area<S: Simd>([a, b, c]: &[[S::D; 2]; 3]) -> S::D {
    let (bx, by) = (b[0] - a[0], b[1] - a[1]);
    let (cx, cy) = (c[0] - a[0], c[1] - a[1]);
    cross::<S>(bx, by, cx, cy)
}

#[inline(always)]
fn cross<S: Simd>(ax: S::D, ay: S::D, bx: S::D, by: S::D) -> S::D {
    ax * by - ay * bx
}

/// Clips a triangle, given by its corners in (P, Q, W), at the margins and at the guard, and adds
/// its pieces to `flat`. The coordinates P and Q of the corners are `shift` · W too large.
#[inline(never)]
fn cut_triangle(
    triangle: [[f64; 3]; 3],
    shift: [f64; 2],
    frame: &LightFrame,
    flat: &mut FlatTriangles,
) {
    // Two buffers for the corners of the clipped polygon. Due to rounding, a plane may cross every
    // second edge of a polygon that lies along it: half as many edges more for each plane, 28 after
    // six.
    let mut rooms = [[[0.0; 3]; 32]; 2];
    let [polygon, next] = &mut rooms;
    let (mut polygon, mut next) = (polygon, next);
    let mut count = 3;
    polygon[..3].copy_from_slice(&triangle);
    // The planes: after the near margin, before the light's margin, and the guard on four sides. On
    // the first two, W of a crossing is known exactly.
    let planes: [([f64; 3], f64); 6] = [
        ([0.0, 0.0, 1.0], -frame.near),
        ([0.0, 0.0, -1.0], frame.margins.end()),
        ([1.0, 0.0, GUARD - shift[0]], 0.0),
        ([-1.0, 0.0, GUARD + shift[0]], 0.0),
        ([0.0, 1.0, GUARD - shift[1]], 0.0),
        ([0.0, -1.0, GUARD + shift[1]], 0.0),
    ];
    let depths = [
        Some(frame.near),
        Some(frame.margins.end()),
        None,
        None,
        None,
        None,
    ];
    // Clip by each plane in turn (Sutherland–Hodgman).
    for ((normal, offset), depth) in planes.into_iter().zip(depths) {
        let height = |v: &[f64; 3]| normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2] + offset;
        if polygon[..count].iter().all(|v| height(v) >= 0.0) {
            continue;
        }
        let mut kept = 0;
        for i in 0..count {
            let (v, w) = (polygon[i], polygon[(i + 1) % count]);
            let (hv, hw) = (height(&v), height(&w));
            if hv >= 0.0 {
                next[kept] = v;
                kept += 1;
            }
            // Compute the crossing from the inner end, in whichever direction the edge runs, so
            // that both of its triangles get the same bits.
            if (hv >= 0.0) != (hw >= 0.0) {
                let (inner, outer, hi, ho) = if hv >= 0.0 {
                    (v, w, hv, hw)
                } else {
                    (w, v, hw, hv)
                };
                let f = hi / (hi - ho);
                next[kept] = std::array::from_fn(|k| inner[k] + (outer[k] - inner[k]) * f);
                // The difference of large numbers may have lost the W that is divided by later.
                next[kept][2] = depth.unwrap_or(next[kept][2]);
                kept += 1;
            }
        }
        if kept < 3 {
            return;
        }
        std::mem::swap(&mut polygon, &mut next);
        count = kept;
    }
    // Project as in [`to_plane`], and store the polygon as a fan of triangles.
    let image = |i: usize| {
        let v = polygon[i];
        [0, 1].map(|k| v[k] * (1.0 / v[2]) - shift[k])
    };
    for i in 1..count - 1 {
        let [a, b, c] = [image(0), image(i), image(i + 1)];
        flat.push([a[0], a[1], b[0], b[1], c[0], c[1]]);
    }
}
