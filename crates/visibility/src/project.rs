//! Projecting the triangles of a shaft onto the light's plane, in `f64`.
//!
//! A vertex is projected by operations that depend on the vertex alone, and an edge that has to
//! be cut is cut from its inner end: triangles that share an edge share its image to the bit.

use crate::{
    Occluders, Scratch,
    block::ddot,
    dispatch::dispatch,
    frame::{LightFrame, Shape},
    simd::Simd,
    sweep::Lanes,
};
use linelit_geometry::{DVec3, LIGHT_MARGIN, POINT_MARGIN};

/// Eight triangles in the light's (p, q) plane: p and q of vertex 0, then of 1 and 2.
pub(crate) type FlatBlock = Lanes<[[f64; 8]; 6]>;

/// A lane that holds no triangle: all three vertices in one place.
const UNUSED: FlatBlock = Lanes([[2.0; 8]; 6]);

/// Where far-reaching triangles are cut: well outside the light, which is within [0, 1]; a power
/// of two, so that the sign of `P + GUARD W` is exact. Whether a vertex is cut off depends on the
/// vertex alone, so that triangles cut a shared edge alike.
const GUARD: f64 = 4096.0;

/// Images of triangles, in blocks of eight.
#[derive(Debug, Default)]
pub(crate) struct FlatTriangles {
    pub(crate) blocks: Vec<FlatBlock>,
    pub(crate) count: usize,
}

impl FlatTriangles {
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
        self.count = 0;
    }

    #[inline(always)]
    fn push(&mut self, triangle: [f64; 6]) {
        let lane = self.count % 8;
        if lane == 0 {
            self.blocks.push(UNUSED);
        }
        self.count += 1;
        if let Some(block) = self.blocks.last_mut() {
            for (row, value) in block.iter_mut().zip(triangle) {
                row[lane] = value;
            }
        }
    }
}

/// Homogeneous coordinates of one vertex in eight lanes.
type Vertex<S> = [<S as Simd>::D; 3];

/// Projects the triangles in `scratch.slots` into `scratch.flat`, dropping those that miss the
/// light from both; true if one of them hides the light as a whole.
#[inline(always)]
fn project_kernel<S: Simd>(
    s: S,
    occluders: &Occluders,
    point: DVec3,
    frame: &LightFrame,
    scratch: &mut Scratch,
) -> bool {
    let Scratch { flat, slots, .. } = scratch;
    flat.clear();
    let mut kept = 0;
    let mut start = 0;
    while start < slots.len() {
        let end = slots.len().min(start + 8);
        let few = &slots[start..end];
        let Some(mut inside) = project_slots::<S, true>(s, occluders, few, point, frame, flat)
        else {
            return true;
        };
        while inside != 0 {
            slots[kept] = slots[start + inside.trailing_zeros() as usize];
            kept += 1;
            inside &= inside - 1;
        }
        start = end;
    }
    slots.truncate(kept);
    false
}

/// Projects up to eight triangles and tells which are left (a bit each), or `None` if one of them
/// hides the light as a whole. Unless `SEPARATE`, only a triangle that needs cutting is seen to
/// hide the light, and none to miss it.
#[inline(always)]
pub(crate) fn project_slots<S: Simd, const SEPARATE: bool>(
    s: S,
    occluders: &Occluders,
    slots: &[u32],
    point: DVec3,
    frame: &LightFrame,
    flat: &mut FlatTriangles,
) -> Option<u8> {
    let mut corners = [[0.0_f32; 8]; 9];
    for (lane, &slot) in slots.iter().enumerate() {
        let leaf = &occluders.hierarchy.leaves[slot as usize / 8];
        for (to, from) in corners.iter_mut().zip(&leaf.vertices) {
            to[lane & 7] = from[slot as usize % 8];
        }
    }
    let used = 0xff_u8 >> (8 - slots.len().min(8));
    project_eight::<S, SEPARATE>(s, &corners, used, point, frame, flat)
}

#[inline(always)]
fn project_eight<S: Simd, const SEPARATE: bool>(
    s: S,
    corners: &[[f32; 8]; 9],
    used: u8,
    point: DVec3,
    frame: &LightFrame,
    flat: &mut FlatTriangles,
) -> Option<u8> {
    let a = homogeneous(s, corners, 0, point, frame);
    let b = homogeneous(s, corners, 3, point, frame);
    let c = homogeneous(s, corners, 6, point, frame);
    let nearest = s.dmin(s.dmin(a[2], b[2]), c[2]);
    let farthest = s.dmax(s.dmax(a[2], b[2]), c[2]);
    let before = s.dlt(s.dsplat(POINT_MARGIN), farthest);
    let between = s.and(before, s.dlt(nearest, s.dsplat(1.0 - LIGHT_MARGIN)));
    let alive = s.bits(between) & used;
    if alive == 0 {
        return Some(0);
    }
    let mut whole = s.and(
        s.dle(s.dsplat(POINT_MARGIN), nearest),
        s.dle(farthest, s.dsplat(1.0 - LIGHT_MARGIN)),
    );
    for v in [&a, &b, &c] {
        whole = s.and(whole, within_guard(s, v));
    }
    let image = [
        [s.ddiv(a[0], a[2]), s.ddiv(a[1], a[2])],
        [s.ddiv(b[0], b[2]), s.ddiv(b[1], b[2])],
        [s.ddiv(c[0], c[2]), s.ddiv(c[1], c[2])],
    ];
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
        s.dsub(s.dsplat(0.0), s.dmin(low[0], low[1])),
    );
    let simple = s.bits(whole) & alive;
    let (misses, covers) = if SEPARATE {
        against_light(s, &image, low, high, reach, frame)
    } else {
        (0, 0)
    };
    let mut keep = simple & !misses;
    if keep & covers != 0 {
        return None;
    }
    let mut left = keep;
    if keep != 0 {
        let mut rows = [[0.0; 8]; 6];
        for k in 0..3 {
            s.dstore(image[k][0], &mut rows[2 * k]);
            s.dstore(image[k][1], &mut rows[2 * k + 1]);
        }
        while keep != 0 {
            let lane = keep.trailing_zeros() as usize;
            keep &= keep - 1;
            flat.push([
                rows[0][lane],
                rows[1][lane],
                rows[2][lane],
                rows[3][lane],
                rows[4][lane],
                rows[5][lane],
            ]);
        }
    }
    let mut cut = alive & !simple;
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
            if cut_triangle([v(0), v(3), v(6)], frame, flat) {
                return None;
            }
            left |= u8::from(flat.count > before) << lane;
        }
    }
    Some(left)
}

/// Whether a vertex is within the guard: the same decision as in [`cut_triangle`].
#[inline(always)]
fn within_guard<S: Simd>(s: S, v: &Vertex<S>) -> S::M {
    let zero = s.dsplat(0.0);
    let limit = s.dmul(s.dsplat(GUARD), v[2]);
    let p = s.dmax(v[0], s.dsub(zero, v[0]));
    let q = s.dmax(v[1], s.dsub(zero, v[1]));
    s.dle(s.dmax(p, q), limit)
}

/// P, Q, W of the vertices in rows `first` to `first + 2`.
#[inline(always)]
fn homogeneous<S: Simd>(
    s: S,
    corners: &[[f32; 8]; 9],
    first: usize,
    point: DVec3,
    frame: &LightFrame,
) -> Vertex<S> {
    let x = s.dsub(s.widen(s.load(&corners[first])), s.dsplat(point.x));
    let y = s.dsub(s.widen(s.load(&corners[first + 1])), s.dsplat(point.y));
    let z = s.dsub(s.widen(s.load(&corners[first + 2])), s.dsplat(point.z));
    [
        ddot(s, frame.p, x, y, z),
        ddot(s, frame.q, x, y, z),
        ddot(s, frame.w, x, y, z),
    ]
}

/// Which images miss the light (a side of the light or of the triangle separates them) and which
/// hide it as a whole.
#[inline(always)]
fn against_light<S: Simd>(
    s: S,
    image: &[[S::D; 2]; 3],
    low: [S::D; 2],
    high: [S::D; 2],
    reach: S::D,
    frame: &LightFrame,
) -> (u8, u8) {
    let (zero, one) = (s.dsplat(0.0), s.dsplat(1.0));
    let upper = if frame.shape == Shape::Line { 0.0 } else { 1.0 };
    // A little room for lines along the light's own edges.
    let (least, most) = (s.dsplat(-1e-9), s.dsplat(1.0 + 1e-9));
    let mut misses = s.or(s.dlt(high[0], least), s.dlt(s.dsplat(upper + 1e-9), low[0]));
    misses = s.or(misses, s.or(s.dlt(high[1], least), s.dlt(most, low[1])));
    // Rounding of a cross product of coordinates up to m, and of the coordinates themselves.
    let m = s.dadd(reach, s.dsplat(2.0));
    let room = s.dmul(s.dsplat(1e-13), s.dmul(m, m));
    let minus_room = s.dsub(zero, room);
    let [a, b, c] = image;
    let area = cross(
        s,
        s.dsub(b[0], a[0]),
        s.dsub(b[1], a[1]),
        s.dsub(c[0], a[0]),
        s.dsub(c[1], a[1]),
    );
    let turn = s.select(s.dlt(area, zero), one, s.dsplat(-1.0));
    let mut covers = s.dlt(room, s.dmul(area, turn));
    for (v, w) in [(a, b), (b, c), (c, a)] {
        let (ex, ey) = (
            s.dmul(turn, s.dsub(w[0], v[0])),
            s.dmul(turn, s.dsub(w[1], v[1])),
        );
        let mut least = s.dsplat(f64::INFINITY);
        let mut most = s.dsplat(f64::NEG_INFINITY);
        for corner in &frame.corners[..frame.corner_count] {
            let (x, y) = (
                s.dsub(s.dsplat(corner[0]), v[0]),
                s.dsub(s.dsplat(corner[1]), v[1]),
            );
            let side = cross(s, ex, ey, x, y);
            least = s.dmin(least, side);
            most = s.dmax(most, side);
        }
        misses = s.or(misses, s.dlt(most, minus_room));
        covers = s.and(covers, s.dlt(room, least));
    }
    (s.bits(misses), s.bits(covers))
}

#[inline(always)]
fn cross<S: Simd>(s: S, ax: S::D, ay: S::D, bx: S::D, by: S::D) -> S::D {
    s.dsub(s.dmul(ax, by), s.dmul(ay, bx))
}

/// Cuts a triangle at the margins and the guard and adds what is left; true if that is in front
/// of the whole light.
#[inline(never)]
fn cut_triangle(triangle: [[f64; 3]; 3], frame: &LightFrame, flat: &mut FlatTriangles) -> bool {
    // Seven planes add at most a vertex each.
    let mut polygon = [[0.0; 3]; 10];
    let mut count = 3;
    polygon[..3].copy_from_slice(&triangle);
    let planes: [([f64; 3], f64); 6] = [
        ([0.0, 0.0, 1.0], -POINT_MARGIN),
        ([0.0, 0.0, -1.0], 1.0 - LIGHT_MARGIN),
        ([1.0, 0.0, GUARD], 0.0),
        ([-1.0, 0.0, GUARD], 0.0),
        ([0.0, 1.0, GUARD], 0.0),
        ([0.0, -1.0, GUARD], 0.0),
    ];
    for (normal, offset) in planes {
        let mut next = [[0.0; 3]; 10];
        let mut kept = 0;
        let height = |v: &[f64; 3]| normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2] + offset;
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
                kept += 1;
            }
        }
        if kept < 3 {
            return false;
        }
        polygon = next;
        count = kept;
    }
    let image = polygon.map(|v| [v[0] / v[2], v[1] / v[2]]);
    let image = &image[..count];
    for i in 1..count - 1 {
        let [a, b, c] = [image[0], image[i], image[i + 1]];
        flat.push([a[0], a[1], b[0], b[1], c[0], c[1]]);
    }
    hides(image, frame)
}

/// Whether every corner of the light is strictly inside a convex polygon.
fn hides(image: &[[f64; 2]], frame: &LightFrame) -> bool {
    let side = |i: usize, c: [f64; 2]| {
        let (v, w) = (image[i], image[(i + 1) % image.len()]);
        (w[0] - v[0]) * (c[1] - v[1]) - (w[1] - v[1]) * (c[0] - v[0])
    };
    // As above for coordinates within the guard; edges without length say nothing.
    let room = 1e-13 * (GUARD + 2.0) * (GUARD + 2.0);
    let corners = &frame.corners[..frame.corner_count];
    let all =
        |sign: f64| (0..image.len()).all(|i| corners.iter().all(|c| sign * side(i, *c) > room));
    all(1.0) || all(-1.0)
}

dispatch! {
    /// Projects a shaft's triangles on an instruction set.
    project = project_kernel(occluders: &Occluders, point: DVec3, frame: &LightFrame, scratch: &mut Scratch) -> bool
}
