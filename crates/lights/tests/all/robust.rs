//! Nothing panics and nothing is NaN, whatever the light.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_lights::linear::{LinearSampler, LinearTechnique, LtcSampler, ProjectedLine};
use linelit_lights::{
    AngularLines, AreaSampler, ImportanceImage, LineSampler, LineTechnique, LinearPointTechnique,
    OffsetDensity, PointTechnique, ProxySampler, SolidAngleSampler,
};
use linelit_testkit::cases::cases;
use linelit_testkit::strategies::{finite, unit_interval, unit_vector};
use proptest::prelude::*;

/// Coordinates of a few magnitudes that occur together in a scene, and exact coincidences.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0f64,
        1 => Just(0.0),
        1 => Just(1.0),
        1 => (-12i32..6, -1.0..1.0f64).prop_map(|(e, m)| m * 10f64.powi(e)),
    ]
}

fn place() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(coordinate()).prop_map(DVec3::from)
}

fn point_is_sound(point: DVec3, pdf: f64, polygon: &ConvexPolygon) -> Result<(), TestCaseError> {
    prop_assert!(pdf >= 0.0 && pdf.is_finite());
    if pdf > 0.0 {
        let center = polygon.centroid();
        // Samples lie within the light's extent up to the rounding of its coordinates.
        let slack = 1e-12 * (center.length() + polygon.diameter());
        prop_assert!(
            (point - center).length() <= polygon.diameter() + slack,
            "{point} {pdf}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(4000)))]

    #[test]
    fn polygons(
        points in prop::collection::vec(place(), 3..6),
        x in place(),
        n in unit_vector(),
        u in [unit_interval(), unit_interval()],
        angle in -7.0..7.0f64,
        hidden in [unit_interval(), unit_interval()],
    ) {
        let Ok(polygon) = ConvexPolygon::try_new(&points[..3]).or_else(|_| ConvexPolygon::try_new(&points)) else {
            return Ok(());
        };
        let n = DVec3::from(n);
        let s = AreaSampler::new(&polygon).sample(u);
        point_is_sound(s.point, s.pdf.value(), &polygon)?;
        let solid = SolidAngleSampler::new(&polygon, x);
        let most = std::f64::consts::TAU * (1.0 + 8.0 * f64::EPSILON);
        prop_assert!((0.0..=most).contains(&solid.solid_angle()));
        let s = solid.sample(u);
        point_is_sound(s.point, s.pdf.value(), &polygon)?;
        let proxy = ProxySampler::new(&polygon, x);
        let s = proxy.sample(u);
        point_is_sound(s.point, s.pdf.value(), &polygon)?;
        let visible = [Interval::new(0.0, hidden[0].min(hidden[1])), Interval::new(hidden[0].max(hidden[1]), 1.0)];
        for density in [OffsetDensity::Uniform, OffsetDensity::Length] {
            let lines = LineSampler::new(&polygon, angle, density);
            let line = lines.sample(u[0]);
            let s = lines.point(&line, &visible, u[1]);
            point_is_sound(s.point, s.pdf.value(), &polygon)?;
            prop_assert!(lines.invert(line.offset).is_none_or(|v| (0.0..1.0).contains(&v)));
        }
        for lines in [
            AngularLines::by_solid_angle(&polygon, angle, x),
            AngularLines::by_warped_solid_angle(&polygon, angle, x),
            AngularLines::by_projected_solid_angle(&polygon, angle, x, n),
        ] {
            prop_assert!(lines.total() >= 0.0 && lines.total().is_finite());
            let line = lines.sample(u[0]);
            prop_assert!(line.pdf.value().is_finite());
            let s = lines.point(&line, &visible, u[1]);
            point_is_sound(s.point, s.pdf.value(), &polygon)?;
            prop_assert!(lines.joint_pdf(s.point, &visible).value().is_finite());
            let back = lines.invert_point(s.point, &visible);
            prop_assert!(back.is_none_or(|b| b.iter().all(|v| (0.0..1.0).contains(v))));
        }
    }

    #[test]
    fn lines(
        ends in [place(), place()],
        x in place(),
        n in unit_vector(),
        xi in unit_interval(),
        columns in [place(), place(), place()],
    ) {
        let (light, n) = (Segment::new(ends[0], ends[1]), DVec3::from(n));
        for technique in LinearTechnique::ALL {
            if let Some(s) = LinearSampler::new(technique, &light, x, n) {
                let q = s.sample(xi);
                prop_assert!((0.0..=1.0).contains(&q.t), "{technique:?} {q:?}");
                prop_assert!(q.offset.is_finite() && q.direction.is_finite());
                // A direction is unit to the rounding of a normalisation.
                prop_assert!((q.direction.length() - 1.0).abs() < 1e-9, "{technique:?} {q:?}");
                prop_assert!(s.invert(q.t).is_none_or(|v| (0.0..1.0).contains(&v)));
            }
        }
        let m = DMat3::from_cols(columns[0], columns[1], columns[2]);
        if let Some(s) = LtcSampler::new(&light, x, n, m) {
            prop_assert!((0.0..=1.0).contains(&s.sample(xi).t));
        }
    }

    #[test]
    fn any_floats(p in prop::array::uniform9(finite()), xi in unit_interval()) {
        let v = |i: usize| DVec3::new(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
        if let Some(line) = ProjectedLine::new(v(0), v(1), v(2)) {
            let arc = line.sample(xi);
            prop_assert!(!arc.lambda.is_nan());
        }
    }
}

/// The shading point on the light's edge, an interval of no length and the smallest random number:
/// back into [0, 1).
#[test]
fn an_inversion_stays_below_one() {
    let p = [
        [1.0, 1.0, 1.076_328_412_522_286],
        [1.0, 1.0, 0.0],
        [-1.096_271_925_636_526_8, 0.0, 0.0],
    ]
    .map(DVec3::from);
    let polygon = ConvexPolygon::try_new(&p).unwrap();
    let x = DVec3::new(1.0, 1.0, 0.267_296_250_953_152_57);
    let n = DVec3::new(-0.58359, 0.26780, 0.76662);
    let angle = -4.276_739_165_001_764;
    let visible = [Interval::new(0.0, 0.0), Interval::new(0.0, 1.0)];
    for u in [
        [f64::MIN_POSITIVE, 0.0],
        [0.0, 0.0],
        [0.5, 0.0],
        [1.0 - f64::EPSILON, 0.0],
    ] {
        for lines in [
            AngularLines::by_solid_angle(&polygon, angle, x),
            AngularLines::by_warped_solid_angle(&polygon, angle, x),
            AngularLines::by_projected_solid_angle(&polygon, angle, x, n),
        ] {
            let drawn = lines.point(&lines.sample(u[0]), &visible, u[1]);
            for point in [drawn.point, p[0], p[1], p[2], x] {
                let back = lines.invert_point(point, &visible);
                assert!(
                    back.is_none_or(|b| b.iter().all(|v| (0.0..1.0).contains(v))),
                    "{point} {back:?}"
                );
            }
        }
    }
}

/// Lines at an angle that is none: no density, no point, no panic.
#[test]
fn angles_that_are_none() {
    let square = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).unwrap();
    let on = DVec3::new(0.5, 0.5, 1.0);
    for angle in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for density in [OffsetDensity::Uniform, OffsetDensity::Length] {
            let lines = LineSampler::new(&square, angle, density);
            assert!(!lines.joint_pdf(on, &[Interval::UNIT]).is_positive());
            assert_eq!(lines.invert_point(on, &[Interval::UNIT]), None);
            assert!(!lines.sample(0.5).pdf.is_positive());
        }
        for lines in [
            AngularLines::by_solid_angle(&square, angle, DVec3::ZERO),
            AngularLines::by_warped_solid_angle(&square, angle, DVec3::ZERO),
            AngularLines::by_projected_solid_angle(&square, angle, DVec3::ZERO, DVec3::Z),
        ] {
            assert!(!lines.joint_pdf(on, &[Interval::UNIT]).is_positive());
            assert_eq!(lines.invert_point(on, &[Interval::UNIT]), None);
            assert!(!lines.sample(0.5).pdf.is_positive() && !lines.pdf(0.0).is_positive());
            assert_eq!(lines.total().to_bits(), 0);
        }
    }
}

/// A sliver that was taken for a polygon, of one knot to its lines: refused now.
#[test]
fn slivers_have_no_lines() {
    let p = [
        DVec3::Z,
        DVec3::Z,
        DVec3::Z,
        DVec3::new(
            1.543_522_015_850_11,
            0.550_444_750_253_984_4,
            2.127_109_811_778_84,
        ),
        DVec3::new(
            -6.123_345_878_323_881e-133,
            -2.115_893_462_351_821e-133,
            1.0,
        ),
    ];
    assert_eq!(
        ConvexPolygon::try_new(&p),
        Err(linelit_geometry::PolygonError::Degenerate)
    );
}

/// Solid angles, total and by lines, do not depend on the scale.
#[test]
fn samplers_are_right_at_every_scale_of_a_polygon() {
    let corners = [[-0.5, -0.5, 2.0], [0.5, -0.5, 2.0], [0.0, 0.5, 2.0]].map(DVec3::from);
    let n = DVec3::new(0.0, 0.6, 0.8);
    let values = |scale: f64| -> Option<[f64; 5]> {
        let polygon = ConvexPolygon::try_new(&corners.map(|p| p * scale)).ok()?;
        let solid = SolidAngleSampler::new(&polygon, DVec3::ZERO);
        let by = AngularLines::by_projected_solid_angle(&polygon, 0.3, DVec3::ZERO, n);
        let point = solid.sample([0.3, 0.6]).point / scale;
        let drawn = by.point(&by.sample(0.4), &[Interval::UNIT], 0.7);
        let proxy = ProxySampler::new(&polygon, DVec3::ZERO).sample([0.3, 0.6]);
        Some([
            solid.solid_angle(),
            by.total(),
            point.x,
            drawn.pdf.value(),
            proxy.pdf.value(),
        ])
    };
    let want = values(1.0).unwrap();
    let mut held = 0;
    for e in -70..=70 {
        let Some(got) = values(10f64.powi(e)) else {
            assert!(!(-60..60).contains(&e), "refused at 1e{e}");
            continue;
        };
        held += 1;
        for (got, want) in got.iter().zip(want) {
            // Condition numbers of about one; the lines are inverted to 4 ε of a piece and more.
            assert!((got / want - 1.0).abs() < 1e-13, "1e{e}: {got} {want}");
        }
    }
    assert!(held >= 120, "{held}");
    // A value known from elsewhere.
    let up = |scale: f64| {
        let polygon = ConvexPolygon::try_new(&corners.map(|p| p * scale)).unwrap();
        AngularLines::by_projected_solid_angle(&polygon, 0.0, DVec3::ZERO, DVec3::Z).total()
    };
    assert!((up(1e59) / up(1.0) - 1.0).abs() < 1e-14);
    assert!((up(1.0) - 0.11776).abs() < 1e-5, "{}", up(1.0));
}

/// Lines as far as they are long keep their projected solid angle, and `None` comes beyond.
#[test]
fn line_kernels_have_the_scales_that_they_name() {
    let [p0, p1, n] = [[0.3, -0.5, 1.0], [0.9, 0.6, 0.7], [0.0, 0.6, 0.8]].map(DVec3::from);
    let wide = |s: f64| ProjectedLine::new(p0 * s, p1 * s, n);
    let want = wide(1.0).unwrap();
    for e in -71..=75 {
        let s = 10f64.powi(e);
        let got = wide(s).unwrap();
        let ratio = got.projected_solid_angle() * s / want.projected_solid_angle();
        assert!((ratio - 1.0).abs() < 1e-14, "1e{e} {ratio}");
        assert!((got.sample(0.3).lambda - want.sample(0.3).lambda).abs() < 1e-14);
    }
    assert!(wide(1e80).is_none() && wide(1e-80).is_none());
}

/// Numbers near the ends of the range: densities, not ∞, NaN or π.
#[test]
fn ends_of_the_range() {
    let image = ImportanceImage::new(2, 1, &[f64::MAX, 0.5 * f64::MAX]).unwrap();
    let (dark, bright) = (image.density([0.75, 0.5]), image.density([0.25, 0.5]));
    assert!((bright - 4.0 / 3.0).abs() < 1e-15 && (dark - 2.0 / 3.0).abs() < 1e-15);
    let tiny = ImportanceImage::new(2, 1, &[f64::from_bits(1), f64::from_bits(3)]).unwrap();
    assert!((tiny.density([0.75, 0.5]) - 1.5).abs() < 1e-15);
}

/// Next to the light's plane the plain measure keeps its digits to the last distance.
#[test]
fn next_to_the_plane() {
    let n = DVec3::new(0.6, 0.0, 0.8);
    for e in [-10, -12, -16, -100, -300] {
        let z = 10f64.powi(e);
        let corners = [[1.0, 0.0, z], [-0.5, 0.75, z], [-0.5, -0.75, z]].map(DVec3::from);
        let light = ConvexPolygon::try_new(&corners).unwrap();
        let by = AngularLines::by_projected_solid_angle(&light, 0.3, DVec3::ZERO, n);
        let drawn = by.point(&by.sample(0.5), &[Interval::UNIT], 0.5);
        // From 1e-14 on, points of the light are rounded to other directions than drawn, perhaps
        // below the horizon.
        assert!(by.total() > 3.0, "1e{e}");
        assert!(drawn.pdf.is_positive() || e < -14, "1e{e}");
        let solid = SolidAngleSampler::new(&light, DVec3::ZERO).solid_angle();
        // 2π less what passes below the rim: of the order of z.
        let tau = std::f64::consts::TAU;
        assert!(
            (solid - tau).abs() < 32.0 * (f64::EPSILON + z),
            "1e{e} {solid}"
        );
    }
}
