//! These tests check a lobe with the exponent zero, in every integral: it is one where its cosine
//! is positive, and zero elsewhere.

use linelit_bsdf::Phong;
use linelit_geometry::DVec3;
use linelit_shading::{cylinder, phong, ribbon};
use linelit_testkit::assert_close;
use linelit_testkit::strategies::unit_vector;
use proptest::prelude::*;

fn unit() -> impl Strategy<Value = DVec3> {
    unit_vector().prop_map(DVec3::from_array)
}

fn point() -> impl Strategy<Value = DVec3> {
    (unit(), -1.0..1.0f64).prop_map(|(w, e)| w * 10f64.powf(e))
}

#[test]
fn value_and_density_end_at_the_lobes_horizon() {
    for exponent in [0.0, 1e-12, 1.0, 40.0] {
        let lobe = Phong {
            specular: DVec3::ONE,
            exponent,
        };
        for cosine in [-1.0, -0.5, -1e-300, 0.0] {
            assert_eq!(lobe.value(cosine), DVec3::ZERO, "{exponent} {cosine}");
            assert_eq!(lobe.pdf(cosine).to_bits(), 0, "{exponent} {cosine}");
        }
        for cosine in [1e-300, 0.5, 1.0] {
            // (k + 2)/(k + 1) of each other.
            let want = lobe.pdf(cosine) * (exponent + 2.0) / (exponent + 1.0);
            let why = "five roundings";
            assert_close!(
                lobe.value(cosine).x,
                want,
                rel = 8.0 * f64::EPSILON,
                "{why}"
            );
        }
    }
}

/// A case that was answered in two ways: a light behind the lobe.
#[test]
fn behind_the_lobe_is_dark() {
    let (p0, p1) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 0.0, 2.0));
    let lobe = phong::ribbon(p0, p1, DVec3::Z, DVec3::NEG_Z, 0.0);
    assert_eq!(lobe.to_bits(), 0);
}

proptest! {
    /// The lobe and its opposite together give all of the light, in every form.
    #[test]
    fn two_opposite_lobes_are_diffuse(p0 in point(), p1 in point(), n in unit(), r in unit()) {
        // Along the border of both there is neither.
        prop_assume!(r.dot(p0) != 0.0 || r.dot(p1) != 0.0);
        let both = |f: &dyn Fn(DVec3) -> f64| f(r) + f(-r);
        // The lobes' published goal.
        let line = 1e-10;
        assert_close!(both(&|r| phong::ribbon(p0, p1, n, r, 0.0)), ribbon::line_integral(p0, p1, n), rel = line, "ribbon");
        assert_close!(both(&|r| phong::cylinder(p0, p1, n, r, 0.0)), cylinder::irradiance(p0, p1, n), rel = line, "cylinder");
    }

    /// Exponents that go to zero have its integrals as their limit: 1 − zᵏ ≤ −k ln z, and what has
    /// a cosine below e⁻¹⁰⁰⁰ is nothing.
    #[test]
    fn the_limit_of_small_exponents(p0 in point(), p1 in point(), n in unit(), r in unit(), e in -15.0..-5.0f64) {
        let k = 10f64.powf(e);
        let forms: [(&str, &dyn Fn(f64) -> f64); 2] = [
            ("ribbon", &|k| phong::ribbon(p0, p1, n, r, k)),
            ("cylinder", &|k| phong::cylinder(p0, p1, n, r, k)),
        ];
        let tolerance = 1000.0 * k + 2e-10;
        for (name, form) in &forms {
            assert_close!(form(k), form(0.0), rel = tolerance, "{name}, exponent {k}");
        }
    }
}
