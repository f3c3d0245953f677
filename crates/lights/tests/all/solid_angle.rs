//! The solid angle from 1e-13 to 2π, in one technique: against closed forms, by additivity, and
//! through the inverse.

use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AngularLines, LineTechnique, PointTechnique, SolidAngleSampler};
use linelit_testkit::assert_close;

/// A rectangle with its corner over x: Ω = atan(a b/(d √(a² + b² + d²))).
fn corner(a: f64, b: f64, d: f64) -> f64 {
    (a * b).atan2(d * (a * a + b * b + d * d).sqrt())
}

#[test]
fn centred_squares_at_every_distance() {
    for exponent in -80..65 {
        let d = 10_f64.powf(f64::from(exponent) / 10.0);
        let o = DVec3::new(-1.0, -1.0, d);
        let square =
            ConvexPolygon::parallelogram(o, 2.0 * DVec3::X, 2.0 * DVec3::Y).expect("a square");
        let want = 4.0 * corner(1.0, 1.0, d);
        let got = SolidAngleSampler::new(&square, DVec3::ZERO).solid_angle();
        // Two triangles of five relatively accurate factors each; the diagonal passes over x, at
        // which the angle between its ends, nearly π, is the accurate 1 + cos.
        assert_close!(got, want, rel = 16.0 * f64::EPSILON, "distance {d}");
        let lines = AngularLines::by_solid_angle(&square, 0.3, DVec3::ZERO).total();
        // The offsets of turned lines are rounded coordinates, which count against the distance.
        let rel = 32.0 * f64::EPSILON * (1.0 + 1.0 / d);
        assert_close!(lines, want, rel = rel, "lines at distance {d}");
    }
}

#[test]
fn rectangles_beside_the_point() {
    // A rectangle whose corner is over x, and its four parts, from flat to steep.
    for exponent in -60..20 {
        let d = 10_f64.powf(f64::from(exponent) / 10.0);
        for (a, b) in [(1.0, 1.0), (3.0, 0.01), (1e-4, 2.0)] {
            let o = DVec3::new(0.0, 0.0, d);
            let quad =
                ConvexPolygon::parallelogram(o, a * DVec3::X, b * DVec3::Y).expect("a rectangle");
            let got = SolidAngleSampler::new(&quad, DVec3::ZERO).solid_angle();
            assert_close!(
                got,
                corner(a, b, d),
                rel = 32.0 * f64::EPSILON,
                "{a} × {b} at {d}"
            );
        }
    }
}

#[test]
fn inverse_at_every_distance() {
    let mut rng = linelit_testkit::cases::rng(19);
    for exponent in -60..65 {
        let d = 10_f64.powf(f64::from(exponent) / 10.0);
        let light = ConvexPolygon::triangle(
            DVec3::new(-1.0, -0.7, d),
            DVec3::new(1.3, -0.4, d),
            DVec3::new(0.1, 0.9, d),
        )
        .expect("a triangle");
        let sampler = SolidAngleSampler::new(&light, DVec3::ZERO);
        for _ in 0..200 {
            let u = [rng.next_f64(), rng.next_f64()];
            let point = sampler.sample(u).point;
            let back = sampler.invert(point).expect("on the light");
            // A point is resolved to ε of its coordinates, of the size of the light; seen from d
            // that turns the direction by ε/d, and the solid angle is spread over 2π or less.
            let slack = 64.0 * f64::EPSILON * (1.0 + 1.0 / d)
                / (1.0 - u[0]).min(u[0]).min(1.0 - u[1]).min(u[1]);
            for k in 0..2 {
                assert_close!(
                    back[k],
                    u[k],
                    slack,
                    "coordinate {k} of {u:?} at distance {d}"
                );
            }
        }
    }
}

#[test]
fn edge_on_and_on_the_light() {
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).expect("a square");
    // In the plane beside it, on an edge, on a corner, inside.
    for x in [(2.0, 0.5), (0.5, 0.0), (0.0, 0.0), (0.4, 0.6)] {
        let x = DVec3::new(x.0, x.1, 1.0);
        let sampler = SolidAngleSampler::new(&quad, x);
        assert_close!(sampler.solid_angle(), 0.0, 0.0, "in the plane at {x}");
        assert!(!sampler.sample([0.3, 0.3]).pdf.is_positive());
        assert!(sampler.invert(DVec3::new(0.5, 0.5, 1.0)).is_none());
        let lines = AngularLines::by_solid_angle(&quad, 0.2, x);
        assert!(!lines.sample(0.5).pdf.is_positive());
    }
}
