//! These tests check that no light, however extreme, causes a panic or a NaN.

use linelit_geometry::intervals::Interval;
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::linear::ProjectedLine;
use linelit_lights::{
    AngularLines, ImportanceImage, LineSampler, LineTechnique, OffsetDensity, PointTechnique,
    ProxySampler, SolidAngleSampler,
};

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
    let polygon = ConvexPolygon::new(&p).unwrap();
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
        ConvexPolygon::new(&p),
        Err(linelit_geometry::PolygonError::Degenerate)
    );
}

/// Solid angles, total and by lines, do not depend on the scale.
#[test]
fn samplers_are_right_at_every_scale_of_a_polygon() {
    let corners = [[-0.5, -0.5, 2.0], [0.5, -0.5, 2.0], [0.0, 0.5, 2.0]].map(DVec3::from);
    let n = DVec3::new(0.0, 0.6, 0.8);
    let values = |scale: f64| -> Option<[f64; 5]> {
        let polygon = ConvexPolygon::new(&corners.map(|p| p * scale)).ok()?;
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
        let polygon = ConvexPolygon::new(&corners.map(|p| p * scale)).unwrap();
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
        let light = ConvexPolygon::new(&corners).unwrap();
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
