//! Shadow triangles, compared with exact rays, and the laws of visibility along lines.

use linelit_geometry::intervals::{IntervalSet, VisibleSet};
use linelit_geometry::{DVec3, Margins, Segment, ShadowTriangle, predicates::determinant};
use proptest::prelude::*;

fn vector(range: std::ops::Range<f64>) -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(range).prop_map(DVec3::from_array)
}

/// Whether the open segment from `x` to `y` meets the triangle, by signed volumes.
fn ray_is_blocked(x: DVec3, y: DVec3, t: &[DVec3; 3]) -> bool {
    let d = y - x;
    let [a, b, c] = t.map(|p| p - x);
    let (u, v, w) = (
        determinant(d, c, b),
        determinant(d, a, c),
        determinant(d, b, a),
    );
    if !((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)) {
        return false;
    }
    let sum = u + v + w;
    if sum.abs() == 0.0 {
        return false;
    }
    let hit = (a * u + b * v + c * w) / sum;
    let s = hit.dot(d) / d.length_squared();
    s > 0.0 && s < Margins::default().end()
}

fn visible(x: DVec3, line: &Segment, triangles: &[[DVec3; 3]]) -> IntervalSet {
    let mut set = IntervalSet::full();
    if let Some(shadow) = ShadowTriangle::new(x, line) {
        for t in triangles {
            if let Some(i) = shadow.blocked_by(t) {
                set.clip(i.lo, i.hi);
            }
        }
    }
    set
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, max_global_rejects: 1 << 20, ..ProptestConfig::default() })]

    #[test]
    fn agrees_with_rays(
        x in vector(-1.0..1.0),
        p0 in vector(-3.0..3.0), p1 in vector(-3.0..3.0),
        t in prop::array::uniform3(vector(-3.0..3.0)),
    ) {
        let line = Segment::new(p0, p1);
        let set = visible(x, &line, &[t]);
        for k in 0..64 {
            let s = (f64::from(k) + 0.5) / 64.0;
            let near_end = set.as_slice().iter().any(|i| (i.lo - s).abs() < 1e-9 || (i.hi - s).abs() < 1e-9);
            let seen = set.as_slice().iter().any(|i| i.lo <= s && s <= i.hi);
            prop_assert!(near_end || seen != ray_is_blocked(x, line.at(s), &t), "t = {s}: {set:?}");
        }
    }

    #[test]
    fn reversing_the_line_mirrors(
        x in vector(-1.0..1.0),
        p0 in vector(-3.0..3.0), p1 in vector(-3.0..3.0),
        t in prop::array::uniform3(vector(-3.0..3.0)),
    ) {
        let line = Segment::new(p0, p1);
        let a = ShadowTriangle::new(x, &line).and_then(|s| s.blocked_by(&t));
        let b = ShadowTriangle::new(x, &line.reversed()).and_then(|s| s.blocked_by(&t));
        // The cross product only changes sign, so the coordinates swap to the bit; but the sides
        // are clipped in the other order. Each of two clips and the chord's ends are convex
        // combinations of the vertices' coordinates, rounded by a few eps of the largest, M; the
        // projection divides by the depth.
        let Some(frame) = ShadowTriangle::new(x, &line) else { return Ok(()) };
        let c = t.map(|p| frame.vertex(p));
        let largest = c.iter().map(|v| v.lam0.abs().max(v.lam1.abs())).fold(1.0, f64::max);
        let nearest = [(0, 1), (1, 2), (2, 0)]
            .into_iter()
            .filter(|&(i, j): &(usize, usize)| (c[i].sigma >= 0.0) != (c[j].sigma >= 0.0))
            .map(|(i, j)| {
                let w = c[j].sigma / (c[j].sigma - c[i].sigma);
                w * (c[i].lam0 + c[i].lam1) + (1.0 - w) * (c[j].lam0 + c[j].lam1)
            })
            .fold(f64::INFINITY, f64::min);
        prop_assume!(nearest > 1e-3);
        let tolerance = 16.0 * f64::EPSILON * largest / nearest.min(1.0);
        match (a, b) {
            (Some(a), Some(b)) => {
                prop_assert!((a.lo - (1.0 - b.hi)).abs() <= tolerance);
                prop_assert!((a.hi - (1.0 - b.lo)).abs() <= tolerance);
            }
            (None, None) => {}
            _ => {
                // only an interval of rounding length may vanish
                let i = a.or(b).unwrap();
                prop_assert!(i.length() <= tolerance);
            }
        }
    }

    #[test]
    fn powers_of_two_change_no_bit(
        p0 in vector(-3.0..3.0), p1 in vector(-3.0..3.0),
        t in prop::array::uniform3(vector(-3.0..3.0)), k in -40i32..40,
    ) {
        let s = 2f64.powi(k);
        let a = ShadowTriangle::new(DVec3::ZERO, &Segment::new(p0, p1)).and_then(|f| f.blocked_by(&t));
        let b = ShadowTriangle::new(DVec3::ZERO, &Segment::new(p0 * s, p1 * s))
            .and_then(|f| f.blocked_by(&t.map(|p| p * s)));
        prop_assert_eq!(a, b);
    }

    /// A closed surface around the shading point hides the whole line, for any triangulation of it.
    #[test]
    fn closed_surfaces_do_not_leak(
        seed in any::<u64>(), x in vector(-0.3..0.3), flip in any::<u64>(),
        d in vector(-1.0..1.0), e in vector(-1.0..1.0), flat in any::<bool>(),
    ) {
        // A box from a jittered lattice of quads, each split along either diagonal.
        let n = 5u32;
        let jitter = |i: u32, j: u32, face: u32| {
            let h = (u64::from(i * 31 + j * 17 + face * 7) ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            f64::from(u32::try_from(h >> 40).unwrap()) / f64::from(1u32 << 24) * 0.2
        };
        let mut triangles = Vec::new();
        for face in 0..6u32 {
            let axis = usize::try_from(face / 2).unwrap();
            let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
            let vertex = |i: u32, j: u32| {
                let (a, b) = (f64::from(i) * 0.4 - 1.0, f64::from(j) * 0.4 - 1.0);
                let inner = i > 0 && i < n && j > 0 && j < n;
                let h = if inner && !flat { 1.0 + jitter(i, j, face) } else { 1.0 };
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign * h, a, b);
                DVec3::from_array(p)
            };
            for i in 0..n {
                for j in 0..n {
                    let q = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                    let turn = usize::try_from((flip >> ((i * n + j) % 60)) & 1).unwrap();
                    triangles.push([q[turn], q[1 + turn], q[2 + turn]]);
                    triangles.push([q[2 + turn], q[(3 + turn) % 4], q[turn]]);
                }
            }
        }
        // Half of the shading points lie in the plane of lattice vertices.
        let x = if flat { DVec3::new(-0.2, x.y, 0.2) } else { x };
        // The lattice bulges to 1.2: the line keeps z >= 1.5, so that it is outside.
        let line = Segment::new(d * 5.0 + DVec3::new(0.0, 0.0, 6.5), e * 5.0 + DVec3::new(0.0, 0.0, 6.5));
        let set = visible(x, &line, &triangles);
        prop_assert!(set.is_empty() || ShadowTriangle::new(x, &line).is_none(), "{set:?}");
        // fewer occluders never show less
        let half = visible(x, &line, &triangles[..triangles.len() / 2]);
        prop_assert!(half.measure() >= set.measure());
    }
}

#[test]
fn degenerate_lines_have_no_shadow_triangle() {
    let p = DVec3::new(1.0, 2.0, 3.0);
    assert!(ShadowTriangle::new(DVec3::ZERO, &Segment::new(p, p)).is_none());
    assert!(ShadowTriangle::new(DVec3::ZERO, &Segment::new(p, 2.0 * p)).is_none());
    assert!(ShadowTriangle::new(DVec3::ZERO, &Segment::new(DVec3::ZERO, p)).is_none());
    assert!(ShadowTriangle::new(DVec3::ZERO, &Segment::new(p, DVec3::NAN)).is_none());
}

#[test]
fn occluders_behind_beyond_and_in_the_plane_do_not_block() {
    let line = Segment::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
    let at = |z: f64| {
        [
            DVec3::new(-9.0, -9.0, z),
            DVec3::new(9.0, -9.0, z),
            DVec3::new(0.0, 9.0, z),
        ]
    };
    let shadow = ShadowTriangle::new(DVec3::ZERO, &line).unwrap();
    for z in [-1.0, -1e-9, 2.0, 2.0 + 1e-9, 3.0, 0.0] {
        assert!(shadow.blocked_by(&at(z)).is_none(), "z = {z}");
    }
    for z in [1e-6, 1.0, 1.99] {
        let i = shadow.blocked_by(&at(z)).unwrap();
        assert_eq!(
            (i.lo.to_bits(), i.hi.to_bits()),
            (0.0f64.to_bits(), 1.0f64.to_bits()),
            "z = {z}"
        );
    }
    let flat = [
        DVec3::ZERO,
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(-1.0, 0.0, 1.0),
    ];
    assert!(shadow.blocked_by(&flat).is_none());
}
