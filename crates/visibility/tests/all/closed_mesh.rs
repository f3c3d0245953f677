//! Closed meshes, for which shafts need only half of the triangles.

use crate::common::{InSpace, Mesh, NONE, chord, closed, light, past_all};
use linelit_geometry::DVec3;
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{
    InstructionSet, LightCorners, Occluders, Scratch, ShaftClass, ShaftQuery, VisibleLines,
};

const PLACES: [(DVec3, f64); 4] = [
    (DVec3::ZERO, 1.0),
    (DVec3::new(1e5, -1e5, 1e5), 10.0),
    (DVec3::ZERO, 1e6),
    (DVec3::new(0.0, 1.0, 0.0), 1e-4),
];

/// Closed bodies in a cube of half side one around `centre`, some of them intersecting, some with a
/// third of their triangles reversed.
fn bodies(rng: &mut SplitMix64, count: usize, centre: DVec3, scale: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for k in 0..count {
        let at = centre + rng.in_cube(1.0) * scale;
        let squash = [1.0, 0.2][k % 2];
        let body = closed(rng, 5, 4, squash, at, 0.15 * scale);
        let first = u32::try_from(mesh.positions.len()).unwrap();
        mesh.positions.extend(body.positions);
        for mut t in body.triangles {
            if k % 3 == 0 && rng.index(3) == 0 {
                t.swap(0, 1);
            }
            mesh.triangles.push(t.map(|i| i + first));
        }
    }
    mesh
}

/// Points and lights anywhere: inside bodies, through them, between them; and a body with triangles
/// missing. Intervals agree with brute force over all triangles, and on all instruction sets to the
/// bit.
#[test]
fn lines_past_bodies_agree_with_brute_force() {
    let mut rng = linelit_testkit::cases::rng(21);
    let mut scratch = Scratch::new();
    let (mut out, mut plain) = (VisibleLines::new(), VisibleLines::new());
    let (mut kept, mut crossed) = (0, 0);
    for case in 0..400 {
        let (centre, scale) = PLACES[case % 4];
        let mesh = bodies(&mut rng, [3, 12][case % 2], centre, scale);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        let scalar =
            Occluders::build(&mesh.positions, &mesh.triangles).limited_to(InstructionSet::Scalar);
        let inside = mesh.corners(rng.index(mesh.triangles.len()));
        let point = match case % 3 {
            // Inside a body or just outside of it, or anywhere.
            0 => (inside[0] + inside[1] + inside[2]) / 3.0 + rng.in_cube(0.02) * scale,
            _ => centre + rng.in_cube(1.5) * scale,
        };
        let at = centre + rng.in_cube(1.5) * scale;
        let light = light(
            &mut rng,
            [4, 3, 2, 6][case % 4],
            at,
            [0.1, 0.8][case % 2] * scale,
        );
        let lines: Vec<_> = (0..8).map(|_| chord(&mut rng, &light, Some(0.3))).collect();
        // Exclude some of a body's triangles, so that it is open.
        let first = u32::try_from(rng.index(mesh.triangles.len() - 8)).unwrap();
        let exclude = if case % 2 == 0 {
            first..first + 8
        } else {
            NONE
        };
        let query = || {
            ShaftQuery::new(point, LightCorners::new(&light).unwrap()).excluding(exclude.clone())
        };
        let mut shaft = scalar.shaft(query(), &mut scratch);
        shaft.visible(&lines, &mut plain);
        let mut shaft = occluders.shaft(query(), &mut scratch);
        shaft.visible(&lines, &mut out);
        if let (ShaftClass::Partial, Some(images)) = (shaft.class(), shaft.images()) {
            kept += images.len();
        }
        for (i, line) in lines.iter().enumerate() {
            assert_eq!(out.line(i), plain.line(i));
            let want = past_all(&mesh, point, line, &exclude);
            crossed += want.len();
            let ends = |v: &[linelit_geometry::intervals::Interval]| {
                v.iter().flat_map(|i| [i.lo, i.hi]).collect::<Vec<_>>()
            };
            let (got, want) = (ends(out.line(i)), ends(&want));
            assert_eq!(got.len(), want.len(), "case {case}: {got:?} {want:?}");
            for (a, b) in got.iter().zip(&want) {
                assert!((a - b).abs() <= 1e-9, "case {case}: {got:?} {want:?}");
            }
        }
    }
    assert!(kept > 1000 && crossed > 500, "{kept} {crossed}");
}

/// A body between a point and a light hides it wholly, no matter which half of its triangles is
/// left out; and if one half is excluded, the other half hides it, even if it would be the one to
/// leave out.
#[test]
fn bodies_in_between_hide_everything() {
    let mut rng = linelit_testkit::cases::rng(22);
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let mut classes = [0; 2];
    for case in 0..200 {
        let (centre, scale) = PLACES[case % 4];
        let (nu, nv) = [(12, 8), (40, 30), (60, 40)][case % 3];
        let mut mesh = closed(&mut rng, nu, nv, 1.0, centre, scale);
        let direction = rng.direction();
        let point = centre + direction * (rng.in_range(1.5, 3.0) * scale);
        let at = centre - direction * (rng.in_range(1.6, 2.0) * scale);
        // Well within the shadow of a ball of radius 0.8 · cos(π / 8).
        let light = light(&mut rng, [4, 3, 2, 5][case % 4], at, 0.25 * scale);
        let lines: Vec<_> = (0..24)
            .map(|k| chord(&mut rng, &light, (k < 16).then_some(1.0)))
            .collect();
        // The triangles that face the point come first.
        let old = mesh.clone();
        let faces = |t: &[u32; 3]| {
            let id = old.triangles.iter().position(|o| o == t).unwrap();
            let [a, b, c] = old.corners(id);
            (b - a).cross(c - a).dot(point - a) > 0.0
        };
        mesh.triangles.sort_by_cached_key(|t| !faces(t));
        let half = mesh.triangles.iter().filter(|t| faces(t)).count();
        let [half, all] = [half, mesh.triangles.len()].map(|n| u32::try_from(n).unwrap());
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        for exclude in [NONE, 0..half, half..all] {
            let query =
                ShaftQuery::new(point, LightCorners::new(&light).unwrap()).excluding(exclude);
            let mut shaft = occluders.shaft(query, &mut scratch);
            classes[usize::from(shaft.class() == ShaftClass::Partial)] += 1;
            shaft.visible(&lines, &mut out);
            for i in 0..lines.len() {
                assert!(out.line(i).is_empty(), "case {case}: {:?}", out.line(i));
            }
        }
    }
    // Most are found hidden as a whole, by triangles that share edges.
    assert!(classes[0] > 450 && classes[1] > 0, "{classes:?}");
}
