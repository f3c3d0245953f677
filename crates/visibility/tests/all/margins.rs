//! Margins: occluders that touch a light, or are in its plane.

use crate::common::{InSpace, NONE};
use linelit_geometry::{DVec3, Margins, Segment};
use linelit_testkit::cases::{cases, rng};
use linelit_testkit::rng::SplitMix64;
use linelit_visibility::{Occluders, Scratch, ShaftQuery, VisibleLines};

/// A vector of integers up to 15.
fn whole(rng: &mut SplitMix64) -> DVec3 {
    DVec3::from([(); 3].map(|()| rng.in_range(-15.0, 15.0).round()))
}

/// A triangle around the whole light and in its plane hides nothing of it; moved towards the point
/// by the least amount that `f32` resolves, it hides everything; moved away, nothing. Corners are
/// integers, so that they are exact, from origins near and far and at all scales.
#[test]
fn without_margins_the_side_of_the_lights_plane_decides() {
    let (mut rng, mut scratch) = (rng(71), Scratch::new());
    let mut seen = [0; 2];
    for case in 0..cases(2000) {
        let (a, b, step) = (whole(&mut rng), whole(&mut rng), whole(&mut rng));
        let normal = a.cross(b);
        let up = normal.dot(step);
        // If the three vectors are in one plane, there is no side to move to.
        if up == 0.0 {
            continue;
        }
        let scale = 2f64.powi(i32::try_from(rng.index(60)).unwrap() - 30);
        let origin = [
            DVec3::ZERO,
            DVec3::splat(64.0),
            DVec3::new(-512.0, 3.0, 700.0),
        ][rng.index(3)];
        let place = |i: f64, j: f64| (origin + a * i + b * j) * scale;
        let light = [
            place(0.0, 0.0),
            place(1.0, 0.0),
            place(1.0, 1.0),
            place(0.0, 1.0),
        ];
        // Move by the last bit that coordinates have at the larger origins.
        let move_by = [0.0, 1.0, -1.0][rng.index(3)] * 2f64.powi(-10);
        let around = [(-2.0, -2.0), (5.0, -2.0), (-2.0, 5.0)];
        let corners = around.map(|(i, j)| place(i, j) + step * (move_by * scale));
        let positions = corners.map(|v| v.as_vec3().to_array());
        let occluders = Occluders::build(&positions, &[[0, 1, 2]]);
        let side = [-1.0, 1.0][rng.index(2)];
        let height = normal.normalize() * (side * rng.in_range(1.0, 20.0));
        let point = place(rng.next_f64(), rng.next_f64()) + height * scale;
        let way = normal.dot(point - light[0]);
        let hides = move_by * up * way > 0.0 && (move_by * up * scale).abs() < way.abs();
        let query = ShaftQuery {
            margins: Margins::NONE,
            ..ShaftQuery::new(point, &light)
        };
        let line = Segment::new(light[0].lerp(light[2], 0.1), light[0].lerp(light[2], 0.9));
        let mut out = VisibleLines::new();
        let mut shaft = occluders.shaft(query, &mut scratch);
        shaft.visible(&[line], &mut out);
        let want = if hides { 0.0 } else { 1.0 };
        let place = line.at(rng.next_f64());
        let got = (out.fraction(0), shaft.point_visible(place));
        assert_eq!(
            got,
            (want, !hides),
            "case {case}: {light:?} {corners:?} {point}"
        );
        seen[usize::from(hides)] += 1;
        // In the light's plane, rays agree.
        if move_by == 0.0 {
            let directions = [place - point; 5];
            let rays = occluders.shadow_rays(point, &directions, Margins::NONE);
            assert_eq!(
                occluders.any_hits(&rays, &NONE, &mut scratch),
                0,
                "case {case}"
            );
        }
    }
    assert!(seen.iter().all(|n| *n > cases(300)), "{seen:?}");
}
