//! Projecting the triangles of a shaft onto the light's plane, in `f64`.
//!
//! A vertex is projected by operations that depend on the vertex alone, and an edge that has to
//! be cut is cut from its inner end: triangles that share an edge share its image to the bit.

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

/// The distance at which far-reaching triangles are cut: well outside the light, which is within
/// [0, 1]; a power of two, so that the sign of `P + GUARD W` is exact. Whether a vertex is cut off
/// depends on the vertex alone, so that triangles cut a shared edge alike.
/// `docs/decisions/004-candidates-projected-once.md`.
pub(crate) const GUARD: f64 = 4096.0;

/// Room for a shaft's triangles, for one more leaf, and for packed stores, which write eight.
const ROOM: usize = DENSE + 16;

/// Triangles waiting to be projected, side by side.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Corners {
    /// x, y, z of vertex 0, then of 1 and 2.
    rows: [[f32; ROOM]; 9],
    /// The places of the triangles: leaf × 8 + lane.
    pub(crate) slots: [u32; ROOM],
    /// The meshes of the triangles, if there are any.
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

    /// The places of a vertex of eight triangles, in three rows from `first` on.
    #[inline(always)]
    fn vertex<S: Simd>(&self, s: S, start: usize, first: usize) -> [S::F; 3] {
        let mut place = [s.splat(0.0); 3];
        for (place, row) in place.iter_mut().zip(&self.rows[first..]) {
            // There is always room behind.
            if let Some(eight) = row[start..].first_chunk() {
                *place = s.load(eight);
            }
        }
        place
    }

    /// Adds the triangles of a leaf named by `maybe`. There must be room for eight more.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        s: S,
        leaf: &Leaf,
        maybe: u8,
        slots: &[u32; 8],
        meshes: Option<&[u32; 8]>,
    ) {
        // Read once, and within bounds for the compiler, too.
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

/// Images of triangles in the light's (p, q) plane.
#[derive(Debug, Default)]
pub(crate) struct FlatTriangles {
    /// p and q of vertex 0, then of 1 and 2; longer than `count`.
    rows: [Vec<f64>; 6],
    pub(crate) count: usize,
}

/// Eight of them.
pub(crate) type FlatBlock<'a> = [&'a [f64; 8]; 6];

impl FlatTriangles {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// The images from the one of this number on.
    pub(crate) fn get_from(&self, first: usize) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> {
        (first.min(self.count)..self.count).map(|i| self.get(i))
    }

    /// One image: three places.
    pub(crate) fn get(&self, i: usize) -> [[f64; 2]; 3] {
        [0, 2, 4].map(|k| [self.rows[k][i], self.rows[k + 1][i]])
    }

    /// The rows in blocks of eight; the last block may hold more than is in use.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> impl Iterator<Item = FlatBlock<'_>> {
        let [a, b, c, d, e, f] = &self.rows;
        let [a, b, c, d, e, f] = [a, b, c, d, e, f].map(|r| r.as_chunks::<8>().0);
        (0..self.count.div_ceil(8)).map(move |i| [&a[i], &b[i], &c[i], &d[i], &e[i], &f[i]])
    }

    /// Makes room for eight more.
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

    /// Adds one that hides the whole square around the light.
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

    /// Adds the images named by `keep`.
    #[inline(always)]
    fn add<S: Simd>(&mut self, s: S, keep: u8, image: &[[S::D; 2]; 3]) {
        self.reserve();
        for k in 0..6 {
            s.dcompress(keep, image[k / 2][k % 2], &mut self.rows[k], self.count);
        }
        self.count += keep.count_ones() as usize;
    }
}

/// Projects up to eight triangles from `start` on and tells which are left (a bit each), or `None`
/// if one of them hides the light as a whole. Unless `SEPARATE`, few of those that miss the light
/// are dropped.
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
    let mut whole = s.dle(near, nearest) & s.dle(farthest, end);
    for v in [&a, &b, &c] {
        whole = whole & within_guard(s, v);
    }
    let image = [to_plane(s, &a), to_plane(s, &b), to_plane(s, &c)];
    let extent = Extent::new(s, &image);
    let simple = s.bits(whole) & alive;
    let mut cut = alive & !simple;
    let around = simple & around_light(s, extent.low, extent.high, frame.shape);
    if cut | around != 0 {
        let (outside, covers) = cone(s, [&a, &b, &c], frame);
        if covers & (cut | around) != 0 {
            return None;
        }
        cut &= !outside;
    }
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

/// The image of a vertex.
#[inline(always)]
pub(crate) fn to_plane<S: Simd>(s: S, v: &Vertex<S>) -> [S::D; 2] {
    let inverse = s.dsplat(1.0) / v[2];
    [v[0] * inverse, v[1] * inverse]
}

/// Whether a vertex is within the guard: the same decision as in [`cut_triangle`].
#[inline(always)]
pub(crate) fn within_guard<S: Simd>(s: S, v: &Vertex<S>) -> S::M {
    let zero = s.dsplat(0.0);
    let limit = v[2] * GUARD;
    let p = s.dmax(v[0], zero - v[0]);
    let q = s.dmax(v[1], zero - v[1]);
    s.dle(s.dmax(p, q), limit)
}

/// P, Q, W of eight places.
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

/// The triangles of a leaf that hide the light as a whole.
#[inline(always)]
pub(crate) fn hiding<S: Simd>(s: S, leaf: &Leaf, point: DVec3, frame: &LightFrame) -> u8 {
    // Not by `map`, which would be called for each.
    let v = &leaf.vertices;
    let place = [s.load(&v[0]), s.load(&v[1]), s.load(&v[2])];
    let a = to_frame(s, place, point, frame);
    let place = [s.load(&v[3]), s.load(&v[4]), s.load(&v[5])];
    let b = to_frame(s, place, point, frame);
    let place = [s.load(&v[6]), s.load(&v[7]), s.load(&v[8])];
    let c = to_frame(s, place, point, frame);
    cone(s, [&a, &b, &c], frame).1
}

/// Returns which images have the whole light in their bounds, among them those that hide it.
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

/// Looks at triangles as cones from the shading point. First, those that a plane separates from
/// everything between there and the light: one through the shading point and a side of the
/// triangle, or the triangle's own. Such are the floor under the shading point and its walls,
/// which would have to be cut otherwise; and those whose plane holds the shading point up to
/// rounding, so that they hide some of the light only within the margin near that point. Second,
/// those that hide the light as a whole: all its corners are within the cone, and the triangle is
/// in front of them.
#[inline(always)]
fn cone<S: Simd>(s: S, [a, b, c]: [&Vertex<S>; 3], frame: &LightFrame) -> (u8, u8) {
    let zero = s.dsplat(0.0);
    // In units of 2⁻⁵³ and products of two of these: each component of a cross product is off by 4,
    // of the sum of three by 24, its part of the value at a corner of the light by 48; the
    // determinant by 30 of all three.
    let mut largest = [zero; 3];
    for v in [a, b, c] {
        for (size, x) in largest.iter_mut().zip(v) {
            *size = s.dmax(*size, s.dmax(*x, zero - *x));
        }
    }
    let [p, q, w] = largest;
    let room = (q * w + p * w + p * q) * 7e-15;
    let det_room = p * q * w * 4e-15;
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
    // The light beyond the triangle's plane, the shading point before it: own·x > det.
    let most = largest_over_light(s, &own, frame.shape);
    let mut outside = s.dlt(most + (room + det_room), det);
    let mut covers = clear;
    for n in [&ab, &bc, &ca] {
        let n = [turn * n[0], turn * n[1], turn * n[2]];
        let most = largest_over_light(s, &n, frame.shape);
        outside = outside | s.dlt(most, minus_room);
        let (least, _) = over_corners(s, &n, frame);
        covers = covers & s.dlt(room, least);
    }
    // The corners are in units of how far the triangle is: 1 ÷ its W.
    let (least, most) = over_corners(s, &own, frame);
    let near = det * (1.0 / frame.margins.end());
    let far = det * frame.inverse_near;
    covers = covers & s.dle(near, least - room);
    covers = covers & s.dle(most + room, far);
    // What the triangle's plane hides of the light is at this part of the way.
    let beside = s.dmax(least, zero - most) - room;
    let near = s.dlt(det + det_room, beside * frame.near);
    (s.bits(clear & outside | near), s.bits(covers))
}

/// The least and the largest value of a linear form at the light's corners.
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

/// The plane through the shading point and two vertices: their cross product.
#[inline(always)]
fn normal<S: Simd>(a: &Vertex<S>, b: &Vertex<S>) -> Vertex<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The largest value of a linear form over the square around the light, with a little room for
/// lines along the light's own edges.
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

/// The bounds of images.
struct Extent<S: Simd> {
    low: [S::D; 2],
    high: [S::D; 2],
    /// Twice their areas: positive one way round, negative the other.
    area: S::D,
    /// Rounding of a cross product.
    room: S::D,
}

impl<S: Simd> Extent<S> {
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
        // Of coordinates up to m, and of the coordinates themselves.
        let m = reach + 2.0;
        Self {
            low,
            high,
            area: area::<S>(image),
            room: m * m * 1e-13,
        }
    }
}

/// Returns which images miss the light: a side of the light or of the triangle separates them.
#[inline(always)]
fn misses_light<S: Simd>(
    s: S,
    image: &[[S::D; 2]; 3],
    extent: &Extent<S>,
    frame: &LightFrame,
) -> u8 {
    let (zero, one) = (s.dsplat(0.0), s.dsplat(1.0));
    let upper = if frame.shape == Shape::Line { 0.0 } else { 1.0 };
    // A little room for lines along the light's own edges.
    let (least, most) = (s.dsplat(-1e-9), s.dsplat(1.0 + 1e-9));
    let Extent {
        low,
        high,
        area,
        room,
    } = *extent;
    let mut misses = s.dlt(high[0], least) | s.dlt(s.dsplat(upper + 1e-9), low[0]);
    misses = misses | (s.dlt(high[1], least) | s.dlt(most, low[1]));
    let minus_room = zero - room;
    let [a, b, c] = image;
    if frame.shape == Shape::Triangle {
        // Beyond its third side.
        let sums = [a[0] + a[1], b[0] + b[1], c[0] + c[1]];
        let nearest = s.dmin(s.dmin(sums[0], sums[1]), sums[2]);
        misses = misses | s.dlt(most, nearest);
    }
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

/// Twice the areas of images.
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

/// Cuts a triangle at the margins and the guard and adds its pieces. Its corners have P and Q that
/// are `shift` W too large.
#[inline(never)]
fn cut_triangle(
    triangle: [[f64; 3]; 3],
    shift: [f64; 2],
    frame: &LightFrame,
    flat: &mut FlatTriangles,
) {
    // Rounding may have a plane cross each second edge of what lies along it: half as many more
    // each time, 28 after six.
    let mut rooms = [[[0.0; 3]; 32]; 2];
    let [polygon, next] = &mut rooms;
    let (mut polygon, mut next) = (polygon, next);
    let mut count = 3;
    polygon[..3].copy_from_slice(&triangle);
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
            // From the inner end, whichever way round: the same bits for both triangles.
            if (hv >= 0.0) != (hw >= 0.0) {
                let (inner, outer, hi, ho) = if hv >= 0.0 {
                    (v, w, hv, hw)
                } else {
                    (w, v, hw, hv)
                };
                let f = hi / (hi - ho);
                next[kept] = std::array::from_fn(|k| inner[k] + (outer[k] - inner[k]) * f);
                // The difference of large numbers may have lost what it is divided by.
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
    // As in [`place`].
    let image = |i: usize| {
        let v = polygon[i];
        [0, 1].map(|k| v[k] * (1.0 / v[2]) - shift[k])
    };
    for i in 1..count - 1 {
        let [a, b, c] = [image(0), image(i), image(i + 1)];
        flat.push([a[0], a[1], b[0], b[1], c[0], c[1]]);
    }
}
