//! These tests check the laws of lines along cylinders and of points on them, the visible part of a
//! cylinder, and its irradiance.

use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{
    ChordMeasure, Cylinder, CylinderArea, CylinderLines, CylinderView, PointTechnique,
};
use linelit_testkit::cases::cases;
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::laws::Technique;
use linelit_testkit::quadrature::gauss_legendre;
use linelit_testkit::rng::SplitMix64;
use proptest::prelude::*;
use std::f64::consts::PI;

const MEASURES: [ChordMeasure; 4] = [
    ChordMeasure::Uniform,
    ChordMeasure::Length,
    ChordMeasure::SolidAngle,
    ChordMeasure::Projected,
];

struct View {
    name: &'static str,
    cylinder: Cylinder,
    x: DVec3,
    horizons: Vec<DVec3>,
}

fn views() -> Vec<View> {
    let up = || vec![DVec3::Z];
    let view = |name, [p0, p1]: [[f64; 3]; 2], radius, horizons| {
        let axis = Segment::new(p0.into(), p1.into());
        let (cylinder, x) = (Cylinder { axis, radius }, DVec3::ZERO);
        View {
            name,
            cylinder,
            x,
            horizons,
        }
    };
    let both = vec![DVec3::Z, DVec3::new(-0.3, 0.9, 0.5).normalize()];
    let upright = [[2.0, 0.3, -0.4], [2.1, 0.4, 1.2]];
    let far = DVec3::new(1e5, -2e5, 3e5);
    let mut there = view(
        "far from the origin",
        [[1.0, -1.0, 2.0], [0.5, 1.0, 1.8]],
        0.3,
        up(),
    );
    there.x += far;
    there.cylinder.axis.p0 += far;
    there.cylinder.axis.p1 += far;
    vec![
        view("above", [[-1.0, -0.5, 1.5], [1.2, 0.1, 1.8]], 0.4, up()),
        view("thin", [[-1.0, -0.5, 1.5], [1.2, 0.1, 1.8]], 1e-6, up()),
        view(
            "touching",
            [[-0.7, -0.5, 1.001], [1.2, 0.1, 1.002]],
            1.0,
            up(),
        ),
        view(
            "beyond the end",
            [[0.5, 0.2, 1.5], [0.6, 0.1, 4.0]],
            0.45,
            up(),
        ),
        view("short", [[0.7, 0.2, 1.5], [0.7, 0.2001, 1.5]], 0.3, up()),
        view("long", [[0.7, -3e3, 1.5], [0.7, 4e3, 1.5]], 0.3, up()),
        view("cut along", [[1.0, -1.0, 0.1], [1.0, 1.0, 0.12]], 0.4, up()),
        view("cut across", upright, 0.3, up()),
        view("cut twice", upright, 0.3, both),
        there,
    ]
}

/// ε of the coordinates over the radius, and over how near the point is to the surface.
fn resolution(view: &View) -> f64 {
    let Cylinder { axis, radius } = view.cylinder;
    let extent = [axis.p0, axis.p1, view.x].map(|p| p.abs().max_element());
    let near = CylinderView::new(&view.cylinder, view.x).expect("outside");
    let gap = (view.x - near.front()[0]).dot(near.towards());
    f64::EPSILON * (1.0 + extent.into_iter().fold(0.0, f64::max) * (1.0 / radius + 1.0 / gap))
}

/// Offsets, and places along a line with a part hidden, follow their densities.
#[test]
fn lines_obey_the_laws() {
    let views = views();
    let tests = views.len() * MEASURES.len() * 2;
    for (view, measure) in views.iter().flat_map(|v| MEASURES.map(|m| (v, m))) {
        let lines = CylinderLines::new(&view.cylinder, view.x, &view.horizons, measure);
        let [first, last] = [0.0, 1.0 - 1e-16].map(|u| lines.sample(u).offset);
        let range = last - first;
        let eps = resolution(view);
        let laws = Technique::new(format!("{} {measure:?}", view.name))
            .samples(cases(250_000) as usize)
            .alpha(sidak(1e-4, tests))
            .round_trip(1024.0 * eps)
            // At the rim, where heights go to zero, the angle is the root of rounding.
            .mass(1e-7 + 1024.0 * eps);
        laws.clone().resolution(1e-7 * range).check_1d(
            [first - 1e-12 * range, last + 1e-12 * range],
            |u| lines.sample(u.clamp(1e-9, 1.0 - 1e-9)).offset,
            |offset| lines.offset_pdf(offset).value(),
            |offset| lines.invert_offset(offset),
        );
        let line = lines.sample(0.4);
        let (p0, along) = (line.segment.p0, line.segment.direction());
        let length = line.segment.length();
        let visible = [Interval::new(0.1, 0.3), Interval::new(0.6, 0.9)];
        let t_of = |p: DVec3| (p - p0).dot(along) / length;
        let height = lines.height(&line);
        let density = |t: f64| {
            let p = line.segment.at(t);
            let to = p - view.x;
            let r = to.length();
            let joint = lines.joint_pdf(p, &visible).value();
            joint * height / (r * r * r) / line.pdf.value() * length
        };
        laws.kinks(&[0.1, 0.3, 0.6, 0.9]).round_trip(1.0).check_1d(
            [0.0, 1.0],
            |u| t_of(lines.point(&line, &visible, u).point),
            density,
            |_| Some(0.5),
        );
    }
}

/// The strip that faces the point, as azimuth and fraction of the axis.
fn strip(view: &View) -> (f64, impl Fn(f64, f64) -> (DVec3, DVec3)) {
    let seen = CylinderView::new(&view.cylinder, view.x).expect("outside");
    let (out, axis, radius) = (seen.towards(), view.cylinder.axis, view.cylinder.radius);
    let across = axis.direction().cross(out);
    (seen.half_turn(), move |turn: f64, t: f64| {
        let normal = out * turn.cos() + across * turn.sin();
        (axis.at(t) + normal * radius, normal)
    })
}

/// What a diffuse surface reflects of the part above the horizons, by quadrature.
fn integral(view: &View) -> f64 {
    let n = view.horizons[0];
    let above = |p: DVec3| view.horizons.iter().all(|n| n.dot(p) > 0.0);
    let (half, at) = strip(view);
    let Cylinder { axis, radius } = view.cylinder;
    // Places by the third root of the distance to the foot of the point, where long ones peak.
    let to = view.x - axis.p0;
    let foot = (to.dot(axis.direction()) / axis.length()).clamp(0.0, 1.0);
    let rule = gauss_legendre(400);
    let value = |turn: f64, s: f64| {
        let t = foot + s * s * s;
        let (point, normal) = at(turn, t);
        let p = point - view.x;
        let d = p.length();
        let seen = f64::from(u8::from(above(p))) * n.dot(p) / d;
        let area = radius * axis.length() * 3.0 * s * s;
        seen * area * -normal.dot(p) / d.powi(3)
    };
    let ends = [-foot.cbrt(), (1.0 - foot).cbrt()];
    rule.integrate_2d([-half, half], ends, value)
}

/// The mean of f/p is the integral over the part above the horizons, and samples come back.
#[test]
fn lines_cover_the_part_above_the_horizons() {
    let mut rng = SplitMix64::new(5);
    for view in views() {
        let n = view.horizons[0];
        let Cylinder { axis, radius } = view.cylinder;
        let integral = integral(&view);
        let eps = resolution(&view);
        for measure in MEASURES {
            let lines = CylinderLines::new(&view.cylinder, view.x, &view.horizons, measure);
            let (count, mut sum, mut squares) = (40_000, 0.0, 0.0);
            for _ in 0..count {
                let u = [rng.next_f64(), rng.next_f64()];
                let s = PointTechnique::sample(&lines, u);
                // Of what a horizon cuts, some lines have nothing above it.
                let cut = view.name.starts_with("cut");
                if cut && !s.pdf.is_positive() {
                    continue;
                }
                let to = s.point - view.x;
                let value = n.dot(to) / to.length() / s.pdf.value();
                assert!(
                    s.pdf.is_positive() && value > -1e-12,
                    "{} {measure:?} {u:?}",
                    view.name
                );
                sum += value;
                squares += value * value;
                let Some(back) = lines.invert(s.point) else {
                    assert!(
                        u.iter().any(|u| (u - 0.5).abs() > 0.499),
                        "{} {u:?}",
                        view.name
                    );
                    continue;
                };
                let again = PointTechnique::sample(&lines, back);
                let error = again.point.distance(s.point) / (radius + axis.length());
                // Next to the rim and to horizons, places are the roots of numbers.
                assert!(
                    error < 1e-6 + 1e4 * eps,
                    "{} {measure:?} {u:?} {back:?} {error:e}",
                    view.name
                );
            }
            let mean = sum / f64::from(count);
            let variance = squares / f64::from(count) - mean * mean;
            let sigma = (variance.max(0.0) / f64::from(count)).sqrt();
            // Five σ, and 3e-3 of quadrature over the edge of the horizon.
            let cut = if view.name.starts_with("cut") {
                3e-3
            } else {
                1e-7
            };
            let slack = 5.0 * sigma + integral.abs() * (cut + 1e4 * eps);
            assert!(
                (mean - integral).abs() < slack,
                "{} {measure:?}: {mean} {integral} {sigma}",
                view.name
            );
        }
    }
}

/// How even points by solid angle are where nothing is cut: the largest density over the least.
#[test]
fn points_are_nearly_uniform_in_solid_angle() {
    for view in views() {
        let lines = CylinderLines::new(&view.cylinder, view.x, &[], ChordMeasure::SolidAngle);
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for k in 0..2000 {
            let density = PointTechnique::sample(&lines, [(f64::from(k) + 0.5) / 2000.0, 0.3]).pdf;
            least = least.min(density.value());
            most = most.max(density.value());
        }
        // Distances behave as the root of the distance to the rim, whose part of the visible strip
        // is larger as seen from beyond an end.
        let bound = match view.name {
            "beyond the end" => 1.2,
            _ => 1.02,
        };
        assert!(most / least < bound, "{}: {least} {most}", view.name);
    }
}

/// There are no lines from inside the infinite cylinder, below a horizon, and on degenerate
/// cylinders.
#[test]
fn what_is_not_seen_has_no_density() {
    let cylinder = |p0: [f64; 3], p1: [f64; 3], radius| Cylinder {
        axis: Segment::new(p0.into(), p1.into()),
        radius,
    };
    let cases = [
        (cylinder([0.0, 0.0, 1.0], [0.0, 0.1, 3.0], 0.5), DVec3::Z),
        (cylinder([0.0, 0.5, 1.0], [0.0, 0.5, 3.0], 0.5), DVec3::Z),
        (cylinder([-1.0, 2.0, -0.5], [1.0, 2.0, -0.6], 0.4), DVec3::Z),
        (cylinder([-1.0, 2.0, 1.5], [-1.0, 2.0, 1.5], 0.4), DVec3::Z),
        (cylinder([-1.0, 2.0, 1.5], [1.0, 2.0, 1.6], 0.0), DVec3::Z),
        (
            cylinder([-1.0, 2.0, 1.5], [f64::NAN, 2.0, 1.6], 0.4),
            DVec3::Z,
        ),
    ];
    for ((cylinder, normal), measure) in cases.iter().flat_map(|c| MEASURES.map(|m| (c, m))) {
        let lines = CylinderLines::new(cylinder, DVec3::ZERO, &[*normal], measure);
        assert!(!lines.sample(0.4).pdf.is_positive(), "{cylinder:?}");
        assert!(!PointTechnique::sample(&lines, [0.4, 0.3]).pdf.is_positive());
        let nearest = cylinder.axis.p0 - DVec3::Y * cylinder.radius;
        assert!(!lines.joint_pdf(nearest, &[Interval::UNIT]).is_positive());
        assert!(lines.invert(nearest).is_none() && lines.direction().is_finite());
    }
}

/// Samples of each χ² test of points.
const SAMPLES: usize = 1_000_000;

/// χ² of points by area over azimuths and places, of the strip and of the whole side; round trips.
#[test]
fn points_by_area_obey_the_laws() {
    let mut rng = SplitMix64::new(18);
    let views = views();
    for view in &views {
        let Cylinder { axis, radius } = view.cylinder;
        let seen = CylinderView::new(&view.cylinder, view.x).expect("outside");
        let eps = resolution(view) * (1.0 + radius / axis.length());
        let whole = CylinderArea::whole(&view.cylinder);
        let strip = CylinderArea::visible(&view.cylinder, view.x);
        for (by_area, half) in [(whole, PI), (strip, seen.half_turn())] {
            let area = 2.0 * half * radius * axis.length();
            let mut counts = vec![0_u64; 96];
            for _ in 0..SAMPLES {
                let u = [rng.next_f64(), rng.next_f64()];
                let s = by_area.sample(u);
                // A dozen products and quotients.
                let share = s.pdf.value() * area;
                assert!((share - 1.0).abs() < 12.0 * f64::EPSILON, "{}", view.name);
                let back = by_area.invert(s.point).expect("on it");
                let error = (back[0] - u[0]).abs() + (back[1] - u[1]).abs();
                assert!(error < 1024.0 * eps, "{}: {u:?} {back:?}", view.name);
                let turn = seen.azimuth(s.point);
                assert!(turn.abs() <= half + 1024.0 * eps, "{}", view.name);
                assert!(
                    (view.cylinder.normal(s.point) - (s.point - axis.at(u[1])) / radius).length()
                        < 1024.0 * eps * (1.0 + axis.length() / radius)
                );
                let z = (s.point - axis.p0).dot(axis.direction()) / axis.length();
                let bin = |x: f64, n: usize| {
                    #[allow(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "below n"
                    )]
                    let k = (x.max(0.0) * n as f64) as usize;
                    k.min(n - 1)
                };
                counts[bin(0.5 + 0.5 * turn / half, 12) * 8 + bin(z, 8)] += 1;
            }
            let expected = vec![SAMPLES as f64 / 96.0; 96];
            let p = chi2_test(&counts, &expected, 5.0).p_value;
            assert!(p > sidak(1e-4, 2 * views.len()), "{}: p = {p:e}", view.name);
        }
    }
}

fn cylinders() -> impl Strategy<Value = Cylinder> {
    let coordinates = || prop::array::uniform3(-2.0..2.0f64).prop_map(DVec3::from);
    (coordinates(), coordinates(), -3.0..0.3f64).prop_map(|(p0, p1, radius)| Cylinder {
        axis: Segment::new(p0, p1),
        radius: 10f64.powf(radius),
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: cases(300), max_global_rejects: 100_000, ..ProptestConfig::default() })]

    /// The closed form against the integral over the strip.
    #[test]
    fn the_vector_irradiance_is_the_integral(cylinder in cylinders()) {
        let Some(view) = CylinderView::new(&cylinder, DVec3::ZERO) else { return Ok(()) };
        let Cylinder { axis, radius } = cylinder;
        let height = view.towards().dot(view.position() - view.front()[0]);
        // Nearer, and along thinner ones, the quadrature does not follow.
        prop_assume!(height > 0.3 * radius && height > 0.15 * axis.length() && axis.length() > 0.1);
        let seen = View { name: "", cylinder, x: DVec3::ZERO, horizons: Vec::new() };
        let (half, at) = strip(&seen);
        let rule = gauss_legendre(120);
        let integral = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| {
            rule.integrate_2d([-half, half], [0.0, 1.0], |turn, t| {
                let (p, normal) = at(turn, t);
                let d = p.length();
                a.dot(p) / d * radius * axis.length() * -normal.dot(p) / d.powi(3)
            })
        });
        let closed = view.vector_irradiance();
        let error = (DVec3::from(integral) - closed).length() / closed.length();
        prop_assert!(error < 1e-10, "{cylinder:?}: {integral:?} {closed} {error:e}");
    }

    /// The visible side is within the outline and in front of it, and within the front and behind
    /// it. Triangles between the side and the outline are noticed, and triangles outside the
    /// infinite cylinder are not.
    #[test]
    fn outlines_hold_what_is_seen(cylinder in cylinders(), turn in -1.0..1.0f64, t in 0.0..1.0f64, beyond in 0.0..1.0f64, to in prop::array::uniform3(-1.0..1.0f64)) {
        let x = DVec3::ZERO;
        let Some(view) = CylinderView::new(&cylinder, x) else { return Ok(()) };
        prop_assume!(cylinder.axis.length() > 1e-2);
        let seen = View { name: "", cylinder, x, horizons: Vec::new() };
        let (half, at) = strip(&seen);
        let (point, normal) = at(half * turn, t);
        let line = Segment::new(at(half * turn, 0.0).0, at(half * turn, 1.0).0);
        let flat = view.onto_outline(&line).at(t);
        let slack = 1e-9 * (point.length() + flat.length());
        // The same direction, and beyond.
        prop_assert!(flat.normalize().distance(point.normalize()) < 1e-9);
        prop_assert!(flat.length() >= point.length() - slack);
        for (corners, on_it) in [(view.outline(), flat), (view.front(), point * ((view.front()[0] - x).dot(view.towards()) / point.dot(view.towards())))] {
            let inside = |k: usize| {
                let (a, b) = (corners[k], corners[(k + 1) % 4]);
                (b - a).cross(on_it - a).dot(view.towards()) >= -slack * (b - a).length()
            };
            prop_assert!((0..4).all(inside), "{corners:?} {on_it}");
            prop_assert!((on_it - corners[0]).dot(view.towards()).abs() < slack);
        }
        // A ray there meets it there, and the cylinder is as high as its highest point.
        if half * (1.0 - turn.abs()) > 1e-3 && t > 1e-6 && t < 1.0 - 1e-6 {
            let met = view.meets(point.normalize()).expect("in view");
            prop_assert!(met.distance(point) < 1e-7 * (1.0 + point.length()), "{met} {point}");
        }
        prop_assert!(view.meets(-point.normalize()).is_none());
        prop_assert!(view.normal(point).distance(normal) < 1e-9 * (1.0 + 1.0 / cylinder.radius));
        let up = DVec3::from(to).try_normalize().unwrap_or(DVec3::Z);
        let [low, high] = view.heights(up);
        prop_assert!(up.dot(point) >= low - slack && up.dot(point) <= high + slack);
        // The segment across holds the point, and ends where the rim is seen.
        let wide = view.across(point);
        prop_assert!((wide.at(0.5) - point).dot(view.towards()).abs() < slack && (wide.p0 - point).cross(wide.p1 - point).length() < slack);
        let rim = at(half, 0.0).0.normalize().cross(cylinder.axis.direction()).normalize();
        prop_assert!(rim.dot(wide.p1).abs() < slack);
        prop_assert!(point.dot(view.towards()) <= (view.front()[0] - x).dot(view.towards()) + slack);
        // A triangle with one corner in between, and any other corners.
        let between = point + (flat - point) * beyond;
        let depth = (between - point).length();
        prop_assume!(depth > 1e-6 && (flat - between).length() > 1e-6);
        let far = [DVec3::from(to) * 10.0, DVec3::from(to).cross(normal) * 10.0];
        prop_assert!(!view.is_clear_of([between, between + far[0], between + far[1]]));
        // One that touches from outside.
        let beside = cylinder.axis.direction().cross(normal);
        let out = normal * (cylinder.radius * 1e-9);
        let tangent = [point + out, point + out + beside * 10.0, point + out + cylinder.axis.direction()];
        prop_assert!(view.is_clear_of(tangent));
    }
}

/// From a large distance, irradiance and density are the ones of the outline.
#[test]
fn from_afar_a_cylinder_is_its_outline() {
    let axis = Segment::new(DVec3::new(0.0, 0.0, -0.5), DVec3::new(0.0, 0.0, 0.5));
    let cylinder = Cylinder { axis, radius: 0.25 };
    let far = 1e4;
    for angle in [0.0, 0.4, 1.0] {
        let x = DVec3::new(f64::cos(angle), 0.0, f64::sin(angle)) * far;
        let view = CylinderView::new(&cylinder, x).expect("outside");
        let seen = view.vector_irradiance().length() * far * far;
        // The outline's rectangle, 2R l cos: to a few sizes over distances.
        let want = 2.0 * 0.25 * angle.cos();
        assert!((seen / want - 1.0).abs() < 1e-3, "{seen} {want}");
        let by = CylinderLines::new(&cylinder, x, &[], ChordMeasure::SolidAngle);
        let density = PointTechnique::sample(&by, [0.3, 0.3]).pdf.value();
        assert!((density * want / (far * far) - 1.0).abs() < 1e-3);
    }
}
