//! How much of what is round is seen, and where samples of it are, by elementary geometry.

use linelit_geometry::{DVec3, Segment};
use linelit_lights::{Cylinder, PointTechnique, Sphere};
use linelit_spheres::{CylinderArea, CylinderView, SphereCap, SphereCone};
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
        // On the sphere, in front, and at its share of the solid angle from the axis.
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
