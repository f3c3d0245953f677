//! These tests check visible areas of round lights, and the positions of samples on them, by
//! elementary geometry.

use linelit_geometry::{DMat3, DVec3, Segment};
use linelit_lights::{
    ChordMeasure, Cylinder, CylinderArea, CylinderLines, CylinderView, Disk, DiskCone,
    PointTechnique, Sphere, SphereCap, SphereCone, SphereProjected, TransformedCone,
};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;
use std::f64::consts::PI;

const EPS: f64 = f64::EPSILON;

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(256), ..ProptestConfig::default() })]

    /// From the distance d the cap of the height r − r²/d is visible, in the cone of the sine r/d.
    #[test]
    fn caps_and_cones_of_spheres(away in unit_vector(), sine in 0.01..0.99f64, r in 0.1..10.0f64, u in [0.001..0.999f64, 0.0..1.0]) {
        let (center, d) = (DVec3::new(0.5, -0.25, 1.0), r / sine);
        let (sphere, x) = (Sphere { center, radius: r }, center + DVec3::from(away) * d);
        // The centre and x are rounded to ε of their size, by which 1 − r/d is changed.
        let rounding = 32.0 * EPS * (1.0 + 1.0 / r) / (1.0 - sine);
        let area = 2.0 * PI * r * r * (1.0 - sine);
        let sample = SphereCap::visible(&sphere, x).sample(u);
        assert_close!(sample.pdf.value() * area, 1.0, rounding, "{sphere:?} {x}");
        let cosine = ((1.0 - sine) * (1.0 + sine)).sqrt();
        let versine = sine * sine / (1.0 + cosine);
        let cone = SphereCone::new(&sphere, x);
        assert_close!(cone.solid_angle(), 2.0 * PI * versine, rel = rounding, "{sphere:?} {x}");
        let sample = cone.sample(u);
        assert_close!(sample.pdf.value() * cone.solid_angle(), 1.0, rounding, "{sphere:?} {x}");
        // The point is on the sphere, in front, and at its fraction of the solid angle from the
        // axis.
        let to = sample.point - x;
        assert_close!(sample.point.distance(center), r, 64.0 * EPS * d.max(1.0), "{sphere:?} {x}");
        let axis = (center - x).normalize();
        prop_assert!(to.dot(axis) <= d - r * sine + 64.0 * EPS * d.max(1.0));
        let off = 1.0 - to.normalize().dot(axis);
        assert_close!(off, u[0] * versine, 64.0 * EPS * (1.0 + 1.0 / r) / cosine, "{sphere:?} {x}");
    }

    #[test]
    fn all_of_a_sphere_is_around_what_is_in_it(away in unit_vector(), share in 0.0..0.9f64, u in [0.0..1.0f64, 0.0..1.0]) {
        let sphere = Sphere { center: DVec3::new(0.5, -0.25, 1.0), radius: 2.0 };
        let x = sphere.center + DVec3::from(away) * (2.0 * share);
        let sample = SphereCone::new(&sphere, x).sample(u);
        assert_close!(sample.point.distance(sphere.center), 2.0, 32.0 * EPS, "{x}");
        assert_close!(sample.pdf.value(), 0.25 / PI, rel = 8.0 * EPS, "{x}");
    }

    /// The half turn that is seen has the cosine r/ρ, and a direction meets the side where it is on
    /// it: at the distance r from the axis.
    #[test]
    fn sides_of_cylinders(out in unit_vector(), along in unit_vector(), sine in 0.05..0.95f64, turn in -0.9..0.9f64, t in 0.0..1.0f64, u in [0.0..1.0f64, 0.0..1.0]) {
        let (out, along) = (DVec3::from(out), DVec3::from(along));
        prop_assume!(out.cross(along).length() > 0.1);
        let axis = Segment::new(DVec3::ZERO, along * 3.0);
        let radius = 0.75;
        let cylinder = Cylinder { axis, radius };
        let across = (out - along * out.dot(along) / along.length_squared()).normalize();
        let x = across * (radius / sine) + along * (4.0 * t - 0.5);
        let view = CylinderView::new(&cylinder, x).expect("outside");
        let half = sine.acos();
        // x is rounded, and the arc cosine has the slope 1/√(1 − sine²).
        let rounding = 256.0 * EPS / sine / (1.0 - sine * sine);
        assert_close!(view.half_turn(), half, rounding, "{cylinder:?} {x}");
        let area = 2.0 * half * radius * 3.0 * along.length();
        let sample = CylinderArea::visible(&cylinder, x).sample(u);
        assert_close!(sample.pdf.value() * area, 1.0, rounding / half, "{cylinder:?} {x}");
        let off = |p: DVec3| p.cross(along.normalize()).length();
        assert_close!(off(sample.point), radius, 32.0 * EPS, "{cylinder:?} {x}");
        // A place on the side that is seen, and the way to it.
        let side = along.normalize().cross(across);
        let place = (across * (turn * half).cos() + side * (turn * half).sin()) * radius + along * (3.0 * t);
        let met = view.meets(place - x).expect("in front");
        assert_close!(off(met), radius, 16.0 * rounding, "{cylinder:?} {x} {place}");
        let miss = (met - x).cross(place - x).length() / (place - x).length();
        assert_close!(miss, 0.0, 16.0 * rounding, "{cylinder:?} {x} {place}");
    }
}

/// How far a density is from one over how much the direction turns with both random numbers: by
/// differences of the fourth order, off by some h⁴ and ε/h = 1e-13 for h = 1e-3. At the median
/// place: not across pieces.
fn off_from_moves(direction: impl Fn([f64; 2]) -> DVec3, density: impl Fn([f64; 2]) -> f64) -> f64 {
    let h = 1e-3;
    let mut errors: Vec<f64> = (0..41)
        .map(|k| {
            let u = [0.01 + 0.024 * f64::from(k), 0.3 + 0.01 * f64::from(k)];
            let [a, b] = [[h, 0.0], [0.0, h]].map(|[s, t]| {
                let at = |k: f64| direction([u[0] + k * s, u[1] + k * t]);
                ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * h)
            });
            (a.cross(b).length() * density(u) - 1.0).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors[20]
}

#[test]
fn densities_on_disks_are_how_far_directions_move() {
    let (center, normal) = (DVec3::new(0.4, -0.2, 1.5), DVec3::new(0.48, 0.6, -0.64));
    let disk = Disk {
        center,
        normal,
        radius: 0.6,
    };
    let x = DVec3::new(0.1, 0.2, 0.0);
    let cone = DiskCone::new(&disk, x);
    let direction = |u| (cone.sample(u).point - x).normalize();
    let off = off_from_moves(direction, |u| cone.sample(u).pdf.value());
    assert!(off < 1e-8, "{off:e}");
    let columns = [[0.5, 0.1, 0.0], [0.0, 0.8, -0.1], [0.2, 0.0, 1.0]].map(DVec3::from);
    let map = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let lobe = TransformedCone::new(&disk, x, map).expect("seen");
    let off = off_from_moves(|u| lobe.sample(u).0, |u| lobe.sample(u).1.value());
    assert!(off < 1e-8, "{off:e}");
    // Of the cosine itself, the irradiance over π.
    let cosine = TransformedCone::new(&disk, x, DMat3::IDENTITY).expect("seen");
    let want = cone.vector_irradiance().z / PI;
    assert_close!(cosine.about_integral(), want, rel = 64.0 * EPS, "{disk:?}");
}

/// What a sample says of its density is what is said of its place: above the horizon and cut by it.
#[test]
fn samples_of_spheres_have_the_density_of_their_place() {
    let sphere = Sphere {
        center: DVec3::new(0.3, -0.4, 1.2),
        radius: 0.5,
    };
    for normal in [
        DVec3::Z,
        DVec3::new(0.96, 0.0, -0.28),
        DVec3::new(0.8, 0.6, 0.0),
    ] {
        let above = SphereProjected::new(&sphere, DVec3::ZERO, normal).expect("in sight");
        for u in [[0.1, 0.7], [0.4, 0.2], [0.8, 0.5]] {
            let sample = above.sample(u);
            let got = above.pdf(sample.point).value();
            // Points are rounded, and the cosine of what is low with them.
            assert_close!(got, sample.pdf.value(), rel = 1e-12, "{normal} {u:?}");
        }
    }
}

/// The distribution of lines over a cylinder is a choice: samples and densities have to agree for
/// any choice. The horizon leaves parts in front of the point on some lines, and on both sides on
/// others.
#[test]
fn lines_of_cylinders_are_frozen() {
    let axis = Segment::new(DVec3::new(0.5, -1.0, 1.5), DVec3::new(0.6, 1.0, 1.6));
    let cylinder = Cylinder { axis, radius: 0.45 };
    let horizon = [DVec3::new(0.6, 0.8, -0.2).normalize()];
    let lines = CylinderLines::new(&cylinder, DVec3::ZERO, &horizon, ChordMeasure::SolidAngle);
    let found = [0.1, 0.3, 0.5, 0.7, 0.9].map(|u| lines.sample(u).offset);
    let want = [
        -0.343_949_194_501_886_3,
        -0.177_330_251_467_810_06,
        -0.049_796_596_730_618_106,
        0.081_661_950_348_430_61,
        0.268_453_101_509_308_84,
    ];
    for (got, want) in found.into_iter().zip(want) {
        assert_close!(got, want, 1e-13, "{found:?}");
    }
}
