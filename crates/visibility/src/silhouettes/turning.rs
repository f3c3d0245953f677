//! The test that finds which sides of a leaf's triangles may be silhouettes: in `f32`, with an
//! error bound, from the data of the leaf alone.

use crate::{
    lanes::Lanes,
    node::Leaf,
    surfaces::{BEND_ROOM, Bends},
};
use linelit_geometry::DVec3;
use linelit_simd::Simd;

/// An upper bound of the error of products that are less than the least normal `f32`.
const LEAST: f32 = 1e-30;

/// How a leaf's triangles and their neighbours face.
pub(crate) struct Turning {
    /// For the side that begins at each corner, a bit for each triangle whose neighbour beyond that
    /// side may face the other way than the triangle.
    pub(crate) sides: [u8; 3],
    /// A bit for each triangle whose plane the shading point is surely behind, in the orientation
    /// of the triangle's corners.
    pub(crate) front: u8,
    /// A bit for each triangle whose plane the shading point is surely before.
    pub(crate) back: u8,
    /// For the side that begins at each corner, a bit for each triangle whose neighbour beyond that
    /// side has a plane that the shading point is surely before.
    pub(crate) backs_beyond: [u8; 3],
}

/// Finds how a leaf's triangles and their neighbours face, as seen from `point`, where `room` is
/// [`FACING_ROOM`](crate::surfaces::FACING_ROOM) times the scene's size.
///
/// With S the size of the scene, ε = 2⁻²⁴ and |e||f| ≤ L²/2 for two sides, L² the sum of their
/// squares: a vector A to a corner is off by 5.2 εS, the normal N by 9 ε|e||f|, and N·A, |A| ≤ 3.5
/// S, by 24 εL²S in all. N·(A × e) times the bend, which is 1/|e| at most, is off by 33 εL²S more,
/// and by 7 εL²S for the [bend](crate::surfaces::bend)'s normals: together 3.8e-6 L²S. The margin
/// is 4e-6 L²S, plus what products may lose that are below normal numbers, and what was cut off of
/// the bend.
#[inline(always)]
pub(crate) fn turning<S: Simd>(
    s: S,
    leaf: &Leaf,
    bends: &Bends,
    point: [f32; 3],
    room: f32,
) -> Turning {
    // Compute the vectors from the point to the corners, and the sides.
    let v = &leaf.vertices;
    let mut to = [[s.splat(0.0); 3]; 3];
    for (k, to) in to.iter_mut().enumerate() {
        for (axis, to) in to.iter_mut().enumerate() {
            *to = s.load(&v[3 * k + axis]) - s.splat(point[axis]);
        }
    }
    let mut sides = to;
    for (k, side) in sides.iter_mut().enumerate() {
        for (axis, side) in side.iter_mut().enumerate() {
            *side = s.load(&v[3 * ((k + 1) % 3) + axis]) - s.load(&v[3 * k + axis]);
        }
    }
    // Find which triangles face front or back.
    let normal = cross_product(s, &sides[2], &sides[0]);
    let size = dot_product(s, &sides[0], &sides[0]) + dot_product(s, &sides[2], &sides[2]);
    let room = s.fma(size, s.splat(0.4 * room), s.splat(LEAST));
    let own = dot_product(s, &normal, &to[0]);
    let (front, back) = (s.lt(room, own), s.lt(own, s.splat(0.0) - room));
    // For each side, turn the plane by the bend to find how the neighbour faces.
    let (mut turning, mut backs_beyond) = ([0; 3], [0; 3]);
    for (k, (turning, back_beyond)) in turning.iter_mut().zip(&mut backs_beyond).enumerate() {
        let across = dot_product(s, &normal, &cross_product(s, &to[k], &sides[k]));
        let mut bend = Lanes([0.0; 8]);
        for (bend, bits) in bend.iter_mut().zip(&bends[k]) {
            *bend = f32::from_bits(u32::from(*bits) << 16);
        }
        let change = s.load(&bend) * across;
        let room = s.fma(s.abs(change), s.splat(BEND_ROOM), room);
        let other = own + change;
        *back_beyond = s.lt(other, s.splat(0.0) - room);
        *turning = !((front & s.lt(room, other)) | (back & *back_beyond));
    }
    Turning {
        sides: turning,
        front,
        back,
        backs_beyond,
    }
}

/// Whether `point` is behind a triangle's plane, in the orientation of its corners.
#[inline(always)]
pub(crate) fn is_front([a, b, c]: [[f64; 3]; 3], point: DVec3) -> bool {
    let (ex, ey, ez) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    let (fx, fy, fz) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
    let n = [ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx];
    let (x, y, z) = (a[0] - point.x, a[1] - point.y, a[2] - point.z);
    n[0] * x + n[1] * y + n[2] * z > 0.0
}

#[inline(always)]
fn cross_product<S: Simd>(s: S, a: &[S::F; 3], b: &[S::F; 3]) -> [S::F; 3] {
    [
        s.fms(a[1], b[2], a[2] * b[1]),
        s.fms(a[2], b[0], a[0] * b[2]),
        s.fms(a[0], b[1], a[1] * b[0]),
    ]
}

#[inline(always)]
fn dot_product<S: Simd>(s: S, a: &[S::F; 3], b: &[S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], a[0] * b[0]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::{FACING_ROOM, bend};
    use linelit_simd::Scalar;
    use linelit_testkit::rng::SplitMix64;

    /// Decisions in `f32` on how triangles and their neighbours face also hold in `f64`, for
    /// triangles of all sizes, heights and bends, seen from points far from their planes and close
    /// to them; and most sides are decided if nothing is tiny.
    #[test]
    #[allow(clippy::cast_possible_truncation, reason = "places are in f32")]
    fn what_surely_faces_one_way_does() {
        let mut random = SplitMix64::new(19);
        let (mut said, mut all) = (0, 0);
        for round in 0..20_000 {
            let scale = [1.0, 1e-12, 1e9][round % 3];
            let mut cube =
                |size: f64| DVec3::from([0; 3].map(|_| size * random.in_range(-1.0, 1.0)));
            let at = |v: DVec3| v.as_vec3().as_dvec3();
            let (mut leaf, mut bends) = (Leaf::EMPTY, [[0; 8]; 3]);
            let mut far = [[[DVec3::ZERO; 3]; 8]; 3];
            let (mut own, mut seen_from) = ([[DVec3::ZERO; 3]; 8], DVec3::ZERO);
            for lane in 0..8 {
                let size = 10_f64.powf(-3.0 - 3.0 * cube(1.0).x.abs());
                let a = cube(0.9);
                let v = [a, a + cube(size), a + cube(size)].map(|v| at(v * scale));
                for (k, row) in leaf.vertices.iter_mut().enumerate() {
                    row[lane] = v[k / 3][k % 3] as f32;
                }
                own[lane] = v;
                let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize_or_zero();
                for k in 0..3 {
                    let (from, to) = (v[k], v[(k + 1) % 3]);
                    let outward = (to - from).cross(normal);
                    let tilt = cube(1.0);
                    let beyond = at(from
                        + outward * (0.2 + tilt.x.abs())
                        + (to - from) * tilt.y
                        + normal * (outward.length() * tilt.z));
                    far[k][lane] = [to, from, beyond];
                    let unit = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize().as_vec3();
                    bends[k][lane] = bend(to - from, unit(v), unit(far[k][lane]));
                }
                if lane == round % 8 {
                    // As close to the plane as 1e-12, or as far as the scene is wide.
                    let height =
                        scale * 10_f64.powf(-12.0 * cube(1.0).x.abs()) * cube(1.0).x.signum();
                    let along = v[0] + (v[1] - v[0]) * (1e3 * cube(1.0).x) + normal * height;
                    seen_from = along.clamp(DVec3::splat(-scale), DVec3::splat(scale));
                }
            }
            let room = (FACING_ROOM * scale) as f32;
            let place = seen_from.as_vec3().to_array();
            let found = turning(Scalar, &leaf, &bends, place, room);
            for lane in 0..8 {
                let is_said = |bits: u8| bits >> lane & 1 != 0;
                let faces = |v: [DVec3; 3]| is_front(v.map(|v| v.to_array()), seen_from);
                assert!(!is_said(found.front) || faces(own[lane]), "{round} {lane}");
                assert!(!is_said(found.back) || !faces(own[lane]), "{round} {lane}");
                for (k, turning) in found.sides.into_iter().enumerate() {
                    let back_beyond = is_said(found.backs_beyond[k]);
                    assert!(!back_beyond || !faces(far[k][lane]), "{round} {lane} {k}");
                    all += usize::from(round % 3 == 0);
                    if !is_said(turning) {
                        said += usize::from(round % 3 == 0);
                        assert_eq!(faces(own[lane]), faces(far[k][lane]), "{round} {lane} {k}");
                    }
                }
            }
        }
        assert!(2 * said > all, "{said} of {all}");
    }
}
