//! Nothing panics and nothing is NaN, whatever the light.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_lights::linear::{LinearSampler, LinearTechnique, LtcSampler, ProjectedLine};
use linelit_lights::{
    AngularLines, AreaSampler, Disk, LineSampler, OffsetDensity, ProxySampler, SolidAngleSampler,
    Sphere, SphereCap, SphereCone,
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
        let v = |i: usize| [p[3 * i], p[3 * i + 1], p[3 * i + 2]];
        if let Some(line) = ProjectedLine::new(v(0), v(1), v(2)) {
            let arc = line.sample(xi);
            prop_assert!(!arc.lambda.is_nan());
        }
        let sphere = Sphere { center: v(0).into(), radius: p[8].abs() };
        for cap in [SphereCap::visible(&sphere, v(1).into()), SphereCap::whole(&sphere)] {
            prop_assert!(!cap.sample([xi, xi]).pdf.value().is_nan());
        }
        prop_assert!(!SphereCone::new(&sphere, v(1).into()).sample([xi, xi]).pdf.value().is_nan());
        let disk = Disk { center: v(0).into(), normal: DVec3::Z, radius: p[8] };
        prop_assert!(!disk.sample([xi, xi]).pdf.value().is_nan());
    }
}
