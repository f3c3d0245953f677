//! These tests check the solid angle from 1e-13 to 2π, by one technique: with closed forms, by
//! additivity, and through the inverse.

use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AngularLines, LineTechnique, PointTechnique, SolidAngleSampler};
use linelit_testkit::assert_close;
use linelit_testkit::quadrature::gauss_legendre;

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
    // In the plane: outside the light, on an edge, on a corner, and inside.
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

/// Offsets from the foot at which a rule over [a, b] is cut, `z` from the plane: panels four times
/// as long as the one before, in which the error of 24 points is below 3⁻⁴⁸.
fn panels(a: f64, b: f64, z: f64) -> Vec<f64> {
    let mut cuts = vec![a, b, 0.0];
    let mut step = z;
    while step < a.abs().max(b.abs()) {
        cuts.extend([step, -step]);
        step *= 4.0;
    }
    cuts.retain(|u| (a..=b).contains(u));
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts
}

/// ∫ f over [a, b], by its panels.
fn integral(a: f64, b: f64, z: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rule = gauss_legendre(24);
    let cuts = panels(a, b, z);
    cuts.windows(2)
        .map(|p| rule.integrate(p[0], p[1], &f))
        .sum()
}

/// Solid angle, offset, density and inverse of lines along an edge of a rectangle in the plane z,
/// against ∫∫ z/r³, whose terms have one sign.
fn check_rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) {
    let rectangle = ConvexPolygon::parallelogram(
        DVec3::new(x0, y0, z),
        DVec3::new(x1 - x0, 0.0, 0.0),
        DVec3::new(0.0, y1 - y0, 0.0),
    )
    .expect("a rectangle");
    let name = format!("[{x0:e}, {x1:e}] × [{y0:e}, {y1:e}] at {z:e}");
    let far = [x0, x1, y0, y1].map(f64::abs).into_iter().fold(z, f64::max);
    let way = DVec3::new(0.0_f64.clamp(x0, x1), 0.0_f64.clamp(y0, y1), z).length();
    // Forty roundings, few of which count more than once; coordinates that are rounded to ε of the
    // farthest count against the nearest of the light.
    let rounding = 64.0 * f64::EPSILON * (1.0 + far / way);
    for (angle, u, v) in [
        (0.0, [y0, y1], [x0, x1]),
        (std::f64::consts::FRAC_PI_2, [x0, x1], [y0, y1]),
    ] {
        // The angle, rounded to ε, shears a rectangle that is longer along its lines than wide.
        let rounding = rounding + f64::EPSILON * (v[1] - v[0]) / (u[1] - u[0]);
        let lines = AngularLines::by_solid_angle(&rectangle, angle, DVec3::ZERO);
        let axis = if angle > 0.0 { DVec3::X } else { DVec3::Y };
        let upwards = lines.lines().across().dot(axis) > 0.0;
        // The density of a line, and the solid angle between two.
        let of_line = |u: f64| {
            let density = |v: f64| {
                let square = u * u + v * v + z * z;
                z / (square * square.sqrt())
            };
            integral(v[0], v[1], u.hypot(z), density)
        };
        let whole = integral(u[0], u[1], z, of_line);
        assert_close!(lines.total(), whole, rel = rounding, "Ω of {name} {angle}");
        for xi in [1e-9, 1e-3, 0.1, 0.31, 0.5, 0.72, 0.9, 0.999, 1.0 - 1e-9] {
            let line = lines.sample(xi);
            let at = line.segment.p0.dot(axis);
            let want = of_line(at) / whole;
            // An offset is rounded, and moves the share below it by its density.
            let slack = 4.0 * f64::EPSILON * far * want + rounding;
            let below = integral(u[0], at.clamp(u[0], u[1]), z, of_line) / whole;
            let below = if upwards { below } else { 1.0 - below };
            assert_close!(below, xi, slack, "share of {xi} on {name} {angle}");
            let back = lines.invert(line.offset).expect("on the light");
            assert_close!(back, xi, slack, "back to {xi} on {name} {angle}");
            // The place itself is rounded to ε of the coordinates.
            let pdf = line.pdf.value();
            assert_close!(
                pdf,
                want,
                rel = rounding,
                "density of {xi} on {name} {angle}"
            );
        }
    }
}

#[test]
fn lines_along_edges_of_rectangles_match_quadrature() {
    // An ordinary rectangle, one outside the foot, one around it, and a square above it.
    check_rectangle([-0.7, 1.1], [0.2, 1.3], 0.9);
    check_rectangle([1.0, 2.5], [-3.0, -0.5], 0.4);
    check_rectangle([0.0, 1.0], [-1.0, 1.0], 1.0);
    for exponent in 0..7 {
        let far = 10_f64.powi(exponent);
        // Far and small, in the middle of the plane and at a slant.
        check_rectangle([far, far + 1.0], [-0.5 * far, 1.0 - 0.5 * far], far);
        check_rectangle([-0.5, 0.5], [-0.25, 0.75], far);
        // Grazing, with the foot before an edge or a corner.
        check_rectangle([1.0, 3.0], [-1.0, 2.0], 1.0 / far);
        check_rectangle([-3.0, -1.0], [2.0, 2.5], 1.0 / far);
        check_rectangle([far, 2.0 * far], [-1.0, 1e-3], 0.1);
    }
    for exponent in 0..5 {
        // Huge, and near: the foot inside or on an edge.
        let size = 10_f64.powi(exponent);
        check_rectangle([-0.3 * size, 0.7 * size], [-size, 0.2 * size], 1.0);
        check_rectangle([0.0, size], [-size, size], 0.5);
        // Thin, along the lines and across.
        check_rectangle([0.5, 0.5 + 0.1 / size], [-2.0, 1.0], 1.0);
    }
}
