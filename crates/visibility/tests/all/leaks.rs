//! No light passes through closed surfaces: not along a shared edge, not through a shared corner,
//! not far from the origin, not past slivers.

use crate::common::{InSpace, NONE, chord, closed, light};
use linelit_geometry::DVec3;
use linelit_visibility::{
    LightCorners, Occluders, Ray, Scratch, ShaftClass, ShaftQuery, VisibleLines,
};

const PLACES: [(DVec3, f64); 4] = [
    (DVec3::ZERO, 1.0),
    (DVec3::new(1e5, -1e5, 1e5), 1.0),
    (DVec3::new(148_376.0, 1234.0, -223_423.0), 100.0),
    (DVec3::new(0.0, 1e5, 0.0), 10.0),
];

/// Queries lights outside from points inside until `pairs` pairs of a line and an edge of the
/// surface have been tried.
#[allow(clippy::too_many_lines, reason = "one case after the other")]
fn look_out(seed: u64, pairs: u64) {
    let mut rng = linelit_testkit::cases::rng(seed);
    let mut scratch = Scratch::new();
    let mut out = VisibleLines::new();
    let mut tried = 0;
    let mut case = 0_usize;
    while tried < pairs {
        let (centre, scale) = PLACES[case % 4];
        let (nu, nv) = [(12, 8), (40, 30), (7, 5), (60, 40)][(case / 4) % 4];
        let squash = [1.0, 0.3, 0.05][case % 3];
        let mesh = closed(&mut rng, nu, nv, squash, centre, scale);
        let edges = 3 * mesh.triangles.len() as u64 / 2;
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        case += 1;
        for look in 0..8 {
            let point = centre + rng.in_cube(0.01) * squash * scale;
            let direction = rng.direction();
            let distance = rng.in_range(1.5, 4.0) * scale;
            let corners = [4, 3, 6, 2][look % 4];
            let size = [0.1, 1.0, 3.0][look % 3] * scale;
            let light = light(&mut rng, corners, centre + direction * distance, size);
            // A light that reaches into the surface is visible there.
            let reach = light
                .iter()
                .map(|v| (*v - centre).length())
                .fold(0.0, f64::max);
            let nearest = (light[1] - light[0])
                .cross(light[light.len() - 1] - light[0])
                .normalize();
            let apart = if corners == 2 {
                let e = (light[1] - light[0]).normalize();
                let a = light[0] - centre;
                (a - e * a.dot(e)).length()
            } else {
                nearest.dot(light[0] - centre).abs()
            };
            if apart < 1.25 * scale || reach.is_nan() {
                continue;
            }
            // Through the surface's own vertices, too: lines from the light's plane above them.
            let angle = (look % 2 == 0).then(|| rng.in_range(0.0, 3.0));
            let mut lines: Vec<_> = (0..32).map(|_| chord(&mut rng, &light, angle)).collect();
            if corners == 2 {
                lines.truncate(1);
            }
            tried += edges * lines.len() as u64;
            let query = ShaftQuery::new(point, LightCorners::new(&light).unwrap());
            let mut shaft = occluders.shaft(query, &mut scratch);
            assert_ne!(shaft.class(), ShaftClass::Empty, "case {case}");
            shaft.visible(&lines, &mut out);
            for (i, line) in lines.iter().enumerate() {
                assert!(
                    out.line(i).is_empty(),
                    "case {case}, look {look}: {:?} of {line:?} from {point} leaks",
                    out.line(i)
                );
                assert!(
                    !shaft.point_visible(line.at(0.3)),
                    "case {case}, look {look}"
                );
            }
        }
    }
}

#[test]
fn closed_surfaces_do_not_leak() {
    look_out(1, 120_000_000);
}

#[test]
#[ignore = "long: 3e9 pairs of a line and a shared edge"]
fn closed_surfaces_do_not_leak_long() {
    look_out(2, 3_000_000_000);
}

/// Rays towards vertices and along edges, where a test that is not watertight would let some pass.
#[test]
fn rays_do_not_slip_between_triangles() {
    let mut rng = linelit_testkit::cases::rng(5);
    let mut scratch = Scratch::new();
    for case in 0..40 {
        let (centre, scale) = PLACES[case % 4];
        let mesh = closed(&mut rng, 24, 16, [1.0, 0.2][case % 2], centre, scale);
        let occluders = Occluders::build(&mesh.positions, &mesh.triangles);
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t);
            let s = rng.next_f64();
            for target in [a, (a + b) * 0.5, b + (c - b) * s, a + (c - a) * s] {
                let origin = centre + rng.in_cube(0.01) * scale * 0.2;
                let ray = Ray {
                    origin,
                    direction: target - origin,
                    t_min: 0.0,
                    t_max: f64::INFINITY,
                };
                assert!(occluders.any_hit(&ray, &NONE, &mut scratch), "case {case}");
                assert!(occluders.closest_hit(&ray, &mut scratch).is_some());
            }
        }
    }
}
