//! These tests check laws that every integral obeys, with awkward floats.

use linelit_geometry::{DMat3, DVec3, Frame, Segment};
use linelit_shading::ltc::Ltc;
use linelit_shading::{cylinder, phong, polygon, ribbon, solid_angle};
use linelit_testkit::assert_close;
use linelit_testkit::laws;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;

type Integral = fn(DVec3, DVec3, DVec3) -> f64;

const MODELS: [(&str, Integral); 2] = [
    ("ribbon", ribbon::line_integral),
    ("cylinder", cylinder::irradiance),
];

type Lobe = fn(DVec3, DVec3, DVec3, DVec3, f64) -> f64;

/// The bound of every line form in `docs/accuracy.md`.
const LINE: f64 = 1e-13;

fn unit() -> impl Strategy<Value = DVec3> {
    unit_vector().prop_map(DVec3::from_array)
}

/// Points whose distances spread over decades.
fn point() -> impl Strategy<Value = DVec3> {
    (unit(), -3.0..3.0f64).prop_map(|(u, e)| u * 10f64.powf(e))
}

fn rotation(axis: DVec3, angle: f64) -> DMat3 {
    DMat3::from_axis_angle(axis.normalize(), angle)
}

/// The height above a triangle's plane over the distance of its nearest corner, at most 1.
fn height(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let nearest = a.length().min(b.length()).min(c.length());
    (normal.dot(a).abs() / nearest).min(1.0)
}

proptest! {
    #![proptest_config(ProptestConfig {
        max_global_rejects: 1_000_000,
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn pieces_add_up(p0 in point(), p1 in point(), n in unit(), t in 0.0..1.0f64) {
        let middle = Segment::new(p0, p1).at(t);
        // The split point is rounded: it may leave the line by eps times its coordinates, which
        // moves the distance h of both pieces relatively by r/h.
        let closeness = p0.cross(p1).length() / (p0 - p1).length() / (p0.length() + p1.length());
        prop_assume!(closeness > 1e-6);
        for (name, f) in MODELS {
            let (whole, parts) = (f(p0, p1, n), f(p0, middle, n) + f(middle, p1, n));
            let scale = f(p0, p1, n) + f(p0, p1, -n);
            assert_close!(parts, whole, rel = 64.0 * f64::EPSILON / closeness, scale = scale, "{name} split at {t}");
        }
    }

    /// ∫ n·p/|p|⁴ dt above the horizon, whole and in parts; below it the integrand has a corner,
    /// near which quadrature errs by more than it says.
    #[test]
    fn a_ribbon_is_its_integral(
        directions in [unit(), unit()],
        distances in [0.5..2.0f64, 0.5..2.0f64],
        n in unit(),
    ) {
        // Ends about as far as each other: quadrature sees all that there is.
        let [p0, p1] = [0, 1].map(|k| directions[k] * distances[k]);
        prop_assume!(n.dot(p0) > 0.0 && n.dot(p1) > 0.0);
        let (line, length) = (Segment::new(p0, p1), (p1 - p0).length());
        let closeness = p0.cross(p1).length() / length / (p0.length() + p1.length());
        prop_assume!(closeness > 0.01);
        // Ends of parts are rounded, which moves the distance of the line by ε over its closeness.
        laws::Integral::new("ribbon").tolerance(LINE + 64.0 * f64::EPSILON / closeness).check_1d(
            [0.0, 1.0],
            |a, b| ribbon::line_integral(line.at(a), line.at(b), n),
            |t| {
                let p = line.at(t);
                n.dot(p) / p.length().powi(4) * length
            },
        );
    }

    #[test]
    fn more_of_the_line_is_more_light(p0 in point(), p1 in point(), n in unit(), a in 0.0..1.0f64, b in 0.0..1.0f64) {
        let s = Segment::new(p0, p1);
        for (name, f) in MODELS {
            let (part, whole) = (f(s.at(a.min(b)), s.at(a.max(b)), n), f(p0, p1, n));
            let closeness = p0.cross(p1).length() / (p0 - p1).length() / (p0.length() + p1.length());
            prop_assume!(closeness > 1e-6);
            prop_assert!(part <= whole + 64.0 * f64::EPSILON / closeness * (whole + f(p0, p1, -n)), "{}", name);
        }
    }

    #[test]
    fn powers_of_two_scale_exactly(p0 in point(), p1 in point(), n in unit(), e in -20i32..20) {
        let s = 2f64.powi(e);
        for (name, f) in MODELS {
            let degree = if name == "ribbon" { 2 } else { 1 };
            let scaled = f(p0 * s, p1 * s, n) * s.powi(degree);
            prop_assert_eq!(scaled.to_bits(), f(p0, p1, n).to_bits(), "{}", name);
        }
    }

    #[test]
    fn turning_everything_changes_nothing(p0 in point(), p1 in point(), n in unit(), axis in unit(), angle in 0.0..6.3f64) {
        let m = rotation(axis, angle);
        let closeness = p0.cross(p1).length() / (p0 - p1).length() / (p0.length() + p1.length());
        let grazing = (n.dot(p0) / p0.length()).abs().min((n.dot(p1) / p1.length()).abs());
        prop_assume!(closeness > 1e-4 && grazing > 1e-4);
        for (name, f) in MODELS {
            // Rotated points are rounded (4 eps): the condition of distance and cosines.
            let tolerance = 64.0 * f64::EPSILON / closeness / grazing;
            assert_close!(f(m * p0, m * p1, m * n), f(p0, p1, n), rel = tolerance, "{name}");
        }
    }

    #[test]
    fn either_way_round(p0 in point(), p1 in point(), n in unit()) {
        for (name, f) in MODELS {
            assert_close!(f(p1, p0, n), f(p0, p1, n), rel = 2.0 * LINE, "{name}, both within the table's bound");
        }
    }

    /// Swapping receiver and emitter of two small patches: the kernel cos cos'/r² is symmetric.
    #[test]
    fn form_factors_are_reciprocal(p in unit(), n in unit(), m in unit()) {
        let (n, m) = (if n.dot(p) < 0.0 { -n } else { n }, if m.dot(p) > 0.0 { -m } else { m });
        let (n, m) = ((n + p * 0.1).normalize(), (m - p * 0.1).normalize());
        // Each patch as a tiny square about its centre, seen from the other's centre.
        let patch = |centre: DVec3, normal: DVec3| {
            let u = normal.any_orthonormal_vector() * 1e-5;
            let v = normal.cross(u);
            [centre - u - v, centre + u - v, centre + u + v, centre - u + v]
        };
        let there = polygon::irradiance(&patch(p, m), n);
        let back = polygon::irradiance(&patch(-p, n), m);
        // The patches are 1e-5 wide: their second moments differ relatively by 1e-10 / cos².
        assert_close!(there, back, rel = 1e-7, "second order in the width of the patches");
    }

    /// Narrow polygon → ribbon.
    #[test]
    fn a_narrow_polygon_is_a_ribbon(p0 in unit(), p1 in unit(), m in unit(), n in unit()) {
        // Overhead, so that few cases are rejected.
        let (p0, p1) = (p0 + DVec3::Z * 2.5, p1 + DVec3::Z * 2.5);
        let n = (n * 0.4 + DVec3::Z).normalize();
        let d = (p1 - p0).normalize_or_zero();
        let m = (m - d * m.dot(d)).normalize_or_zero();
        // A strip of no length has no direction.
        prop_assume!(m.length() > 0.5 && (p1 - p0).length() > 1e-3);
        let width = 1e-6;
        let side = m.cross(d) * (0.5 * width);
        let strip = [p0 - side, p1 - side, p1 + side, p0 + side];
        let h = p0.cross(p1).length() / (p1 - p0).length();
        let height = ribbon::emitter(p0, p1, m, ribbon::Sides::Both);
        prop_assume!(h > 0.05 && height > 0.01 && n.dot(p0).min(n.dot(p1)) > 0.01);
        // The integrand is a product of distances over the horizons and powers of the distance of
        // the line: across the strip each changes by its width over the least of them, and the
        // first order cancels.
        let least = n.dot(p0).min(n.dot(p1)).min(height).min(h);
        let second_order = (4.0 * width / least).powi(2);
        // The corners are rounded, and with them the width, from both sides.
        let rounding = 8.0 * f64::EPSILON * p0.length().max(p1.length()) / width;
        let tolerance = second_order + rounding;
        let want = ribbon::line_integral(p0, p1, n) * height * width;
        assert_close!(polygon::irradiance(&strip, n), want, rel = tolerance, "diffuse");
    }

    /// A triangle is its two parts, for every integral over polygons.
    #[test]
    fn parts_of_a_polygon_add_up(a in point(), b in point(), c in point(), n in unit(), t in 0.0..1.0f64, flat in 0.1..1.0f64) {
        let d = Segment::new(b, c).at(t);
        // The split point is rounded, by 2 ε of the larger end, which turns its direction by so
        // much …
        let off = 4.0 * f64::EPSILON * b.length().max(c.length()) / d.length();
        // … and makes or hides the triangle of the three points of that side: that angle times the
        // tangents of half the arcs on both sides of it.
        let half_tan = |p: DVec3, q: DVec3| (0.5 * p.cross(q).length().atan2(p.dot(q))).tan();
        // Determinants are good to 30 ε² of the products of differences.
        let sizes = [a, b, c, d].map(|p| p.length());
        let ratio = sizes.into_iter().fold(0.0, f64::max) / sizes.into_iter().fold(f64::INFINITY, f64::min);
        let torn = off * (half_tan(b, d) + half_tan(d, c)) + 100.0 * (f64::EPSILON * ratio).powi(2);
        // In the plane of the shading point, rounding decides from which side the parts are seen: a
        // half-space of light or none.
        let height = height(a, b, c);
        prop_assume!(torn < 1e-6 && height > 10.0 * off);
        let (whole, parts) = ([a, b, c], [[a, b, d], [a, d, c]]);
        let sum = |f: &dyn Fn(&[DVec3]) -> f64| (f(&whole), parts.iter().map(|p| f(p)).sum::<f64>());
        let (one, two) = sum(&|p| solid_angle::polygon(p));
        assert_close!(two, one, torn + 2e-12 * one, "solid angle");
        let (one, two) = sum(&|p| polygon::irradiance(p, n));
        assert_close!(two, one, torn + 2e-12 * one, "diffuse");
        // A lobe that is 1/flat² as high as the cosine's, of points that are mapped: 1/flat times
        // the arcs, and eight roundings of 1/flat for two; mapping rounds each corner.
        let lobe = Ltc::new(DMat3::from_diagonal(DVec3::new(flat, flat, 1.0)), 1.0);
        let frame = Frame::from_normal(n);
        let (one, two) = sum(&|p| lobe.polygon(&frame, p));
        let tolerance = 8.0 * (torn + 4.0 * f64::EPSILON) / flat.powi(4) + 2e-12 * one;
        assert_close!(two, one, tolerance, "transformed cosine, {flat}");
    }

    /// Lobes add up over split intervals, and do not grow when a part is hidden.
    #[test]
    fn lobes_add_up(p0 in point(), p1 in point(), n in unit(), r in unit(), t in 0.0..1.0f64, e in 0.0..3.5f64) {
        let k = 10f64.powf(e).floor();
        let middle = Segment::new(p0, p1).at(t);
        let closeness = p0.cross(p1).length() / (p0 - p1).length() / (p0.length() + p1.length());
        // The ends' own roundings move the lobe's exponent by k eps/closeness.
        prop_assume!(closeness > 1e-3);
        for (name, f) in [("ribbon", phong::ribbon as Lobe), ("cylinder", phong::cylinder)] {
            let (whole, first, second) = (f(p0, p1, n, r, k), f(p0, middle, n, r, k), f(middle, p1, n, r, k));
            // Each within the table's 1e-11; relative to what the whole would be facing the lobe.
            let tolerance = 4e-11 + 64.0 * f64::EPSILON * (k + 1.0) / closeness;
            let scale = f(p0, p1, n, r, k) + f(p0, p1, -n, r, k);
            // Below the range of normal numbers digits are lost.
            prop_assume!(scale == 0.0 || scale > 1e-280);
            assert_close!(first + second, whole, rel = tolerance, scale = scale, "{name} split at {t}, exponent {k}");
            prop_assert!(first <= whole + tolerance * scale && second <= whole + tolerance * scale, "{}", name);
        }
    }

    #[test]
    fn lobes_scale_by_powers_of_two_exactly(p0 in point(), p1 in point(), n in unit(), r in unit(), e in -20i32..20, k in 0.0..50.0f64) {
        // Both towards the line, so that it is lit.
        let towards = p0.normalize() + p1.normalize();
        let [n, r] = [n, r].map(|v| (v * 0.5 + towards).normalize());
        let s = 2f64.powi(e);
        let (one, many) = (phong::ribbon(p0, p1, n, r, k), phong::ribbon(p0 * s, p1 * s, n, r, k));
        // Below the range of normal numbers digits are lost.
        prop_assume!(one > 1e-280);
        prop_assert_eq!((many * s * s).to_bits(), one.to_bits());
        let (one, many) = (phong::cylinder(p0, p1, n, r, k), phong::cylinder(p0 * s, p1 * s, n, r, k));
        prop_assert_eq!((many * s).to_bits(), one.to_bits());
    }

    /// The light does not depend on the order of the ends, nor on the frame in which it is given.
    #[test]
    fn lobes_turn_and_turn_around(p0 in point(), p1 in point(), n in unit(), r in unit(), axis in unit(), angle in 0.0..6.3f64, e in 0.0..3.0f64) {
        let (m, k) = (rotation(axis, angle), 10f64.powf(e).floor());
        let closeness = p0.cross(p1).length() / (p0 - p1).length() / (p0.length() + p1.length());
        let grazing = [n, r].into_iter().flat_map(|v| [p0, p1].map(|p| (v.dot(p) / p.length()).abs())).fold(1.0, f64::min);
        prop_assume!(closeness > 1e-3 && grazing > 1e-3);
        // Rotated vectors are rounded: relative to what the line would be facing both.
        let tolerance = 4e-11 + 128.0 * f64::EPSILON * (k + 1.0) / closeness / grazing;
        let scale = ribbon::line_integral(p0, p1, n) + ribbon::line_integral(p0, p1, -n);
        let one = phong::ribbon(p0, p1, n, r, k);
        assert_close!(phong::ribbon(m * p0, m * p1, m * n, m * r, k), one, rel = tolerance, scale = scale, "turned, exponent {k}");
        assert_close!(phong::ribbon(p1, p0, n, r, k), one, rel = tolerance, scale = scale, "turned around, exponent {k}");
    }

    #[test]
    fn exponent_zero_is_diffuse(p0 in point(), p1 in point(), n in unit()) {
        // With the lobe's axis along the normal its horizon is the receiver's.
        let tolerance = 1e-11;
        assert_close!(phong::ribbon(p0, p1, n, n, 0.0), ribbon::line_integral(p0, p1, n), rel = tolerance, "ribbon: the bound of the lobes");
        assert_close!(phong::cylinder(p0, p1, n, n, 0.0), cylinder::irradiance(p0, p1, n), rel = tolerance, "cylinder");
    }
}

#[test]
fn a_long_line_is_an_infinite_line() {
    // Height h over the line's foot, normal towards it: π/h for a cylinder, and π/(2h²) for a
    // ribbon's integral; what is missing falls like (h/L)² and faster.
    let h = 0.7;
    for length in [1e3, 1e5, 1e8] {
        let (a, b) = (DVec3::new(-length, 0.0, h), DVec3::new(length, 0.0, h));
        let gap = (h / length).powi(2) + LINE;
        assert_close!(
            cylinder::irradiance(a, b, DVec3::Z),
            std::f64::consts::PI / h,
            rel = gap,
            "cylinder"
        );
        let want = std::f64::consts::FRAC_PI_2 / (h * h);
        assert_close!(
            ribbon::line_integral(a, b, DVec3::Z),
            want,
            rel = gap,
            "ribbon"
        );
    }
}

#[test]
fn a_distant_line_is_a_point() {
    let n = DVec3::new(0.0, 0.6, 0.8);
    for r in [1e3, 1e6, 1e9] {
        let (a, b) = (DVec3::new(-0.5, 0.0, r), DVec3::new(0.5, 0.0, r));
        let gap = 2.0 / (r * r) + LINE;
        assert_close!(
            ribbon::line_integral(a, b, n),
            n.z / r.powi(3),
            rel = gap,
            "ribbon: n.p/r^4"
        );
        assert_close!(
            cylinder::irradiance(a, b, n),
            2.0 * n.z / (r * r),
            rel = gap,
            "cylinder: 2 n.w/r^2"
        );
    }
}

/// A cylinder of 64 facets, radius R → 0: its irradiance for each unit of radius tends to the thin
/// cylinder's with an error of the order of R.
#[test]
fn a_thin_cylinder_is_the_limit_of_finite_ones() {
    let (p0, p1) = (DVec3::new(-1.0, 0.2, 1.5), DVec3::new(0.8, -0.3, 1.2));
    let axis = (p1 - p0).normalize();
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    let n = DVec3::new(0.1, 0.2, 0.9).normalize();
    let thin = cylinder::irradiance(p0, p1, n);
    let mut last = f64::INFINITY;
    for radius in [0.1, 0.01, 0.001] {
        let at = |i: u32| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 256.0).sin_cos();
            (u * c + v * s) * radius
        };
        let mut sum = 0.0;
        for i in 0..256 {
            let (a, b) = (at(i), at(i + 1));
            let outward = a + b;
            // Facets that face the shading point.
            if outward.dot(p0 + a) < 0.0 {
                sum += polygon::irradiance(&[p0 + a, p1 + a, p1 + b, p0 + b], n);
            }
        }
        let error = (sum / radius / thin - 1.0).abs();
        // 256 facets leave 1 − sinc: 1e-4.
        assert!(error < 0.5 * radius + 2e-4, "radius {radius}: {error}");
        assert!(error < last + 1e-6);
        last = error;
    }
}
