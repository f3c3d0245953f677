//! These tests check skies in the space of a light, under reflections and uneven scales.

use crate::profiles::profiles;
use crate::skies::{X, sky, turned};
use linelit_geometry::{DMat3, DVec3};
use linelit_lights::octahedral::square_to_sphere;
use linelit_lights::{
    LightSpace, PointTechnique, Profile, SkyBy, SkyEmission, SkyFilter, SkyImage, SkyMapping,
    SkyPoints, SkyView,
};
use linelit_testkit::cases::cases;
use linelit_testkit::chi2::sidak;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::hostile_vector;
use linelit_testkit::ztest::{Welford, critical_z};
use proptest::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// The integral of a function over the sphere, by midpoints of n × n equal areas.
fn over_sphere(n: u32, f: impl Fn(DVec3) -> f64) -> f64 {
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
    let rows = (0..n).map(|j| {
        (0..n)
            .map(|i| f(square_to_sphere([at(i), at(j)])))
            .sum::<f64>()
    });
    rows.sum::<f64>() * 4.0 * PI / f64::from(n * n)
}

/// An image is looked up where the inverse of the light's transform leads, and drawn there: what is
/// drawn has the density that is said and comes back, and estimates of the irradiance by it are the
/// sum over directions of the world; so are the irradiance and the mean that the image gives.
#[test]
fn images_under_any_transform_follow_the_laws() {
    let scale = |x: f64, y: f64, z: f64| DMat3::from_diagonal(DVec3::new(x, y, z));
    let transforms = [
        scale(-1.0, 1.0, 1.0) * turned(),
        turned() * scale(2.0, 1.0, 1.0),
        scale(0.5, -3.0, 1.0) * turned(),
    ];
    let z = critical_z(sidak(1e-4, 2 * 2 * transforms.len()));
    let n = DVec3::new(0.48, -0.6, 0.64);
    for to_world in transforms {
        for mapping in [SkyMapping::Equirectangular, SkyMapping::EqualArea] {
            let value = |k: u8| f32::from(k % 7 * (k % 3)) + 0.5;
            let pixels: Vec<_> = (0..144)
                .map(|k| [value(k), value(k / 2), value(k / 5)])
                .collect();
            let space = LightSpace::new(to_world).unwrap();
            let size = [12, 12];
            let at_home = (DMat3::IDENTITY, DVec3::ONE);
            let plain = SkyImage::new(mapping, size, pixels.clone(), at_home.0, at_home.1).unwrap();
            let filter = SkyFilter::Linear;
            let image = SkyImage::placed(filter, mapping, size, pixels, space, DVec3::ONE).unwrap();
            let local = |w: DVec3| plain.radiance((to_world.inverse() * w).normalize());
            let lit = |w: DVec3| local(w).x * n.dot(w).max(0.0);
            let (coarse, want) = (over_sphere(256, lit), over_sphere(512, lit));
            // Midpoints err by the square of their step, and by its half at kinks.
            let tolerance = 2.0 * (want - coarse).abs() + 1e-4 * want;
            let off = (image.irradiance(n).x - want).abs();
            assert!(off < tolerance, "{mapping:?} {to_world}: {off:e} {want}");
            let mean = over_sphere(512, |w| local(w).x) / (4.0 * PI);
            // The solid angle of a cell, 1/16 of the image across, by its middle.
            assert!(
                (image.mean().x / mean - 1.0).abs() < 0.02,
                "{} {mean}",
                image.mean()
            );
            let sky = sky(SkyEmission::Image(Arc::new(image)), None);
            for by in [SkyBy::Radiance(n), SkyBy::Projected(n)] {
                let points = SkyPoints::new(SkyView::new(&sky, X), by);
                let (mut rng, mut estimate) = (SplitMix64::new(5), Welford::new());
                for _ in 0..100_000 {
                    let sample = points.sample([rng.next_f64(), rng.next_f64()]);
                    let (w, pdf) = ((sample.point - X).normalize(), sample.pdf.value());
                    assert!((points.pdf(sample.point).value() / pdf - 1.0).abs() < 1e-6);
                    let back = points.invert(sample.point).expect("a positive density");
                    let again = (points.sample(back).point - X).normalize();
                    assert!(again.distance(w) < 1e-9, "{back:?}");
                    assert!((sky.along(w) - local(w)).length() < 1e-9);
                    estimate.push(lit(w) / pdf);
                }
                let off = estimate.mean() - want;
                let bound = z * estimate.standard_error() + tolerance;
                assert!(off.abs() < bound, "{mapping:?} {to_world} {by:?}: {off:e}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(2000)))]

    /// Any matrix flattens space, or gives unit vectors and factors that are numbers.
    #[test]
    fn any_matrix_is_a_space_or_none(
        x in hostile_vector(), y in hostile_vector(), z in hostile_vector(), n in hostile_vector(),
    ) {
        let n = DVec3::from(n);
        let to_world = DMat3::from_cols(DVec3::from(x), DVec3::from(y), DVec3::from(z));
        for matrix in [to_world, to_world * turned(), DMat3::from_diagonal(DVec3::from(x))] {
            let Some(space) = LightSpace::new(matrix) else {
                continue;
            };
            prop_assert!(matrix.is_finite());
            prop_assert!((space.to_light(DVec3::Y).length() - 1.0).abs() < 1e-9);
            prop_assert!((space.to_world(DVec3::Y).length() - 1.0).abs() < 1e-9);
            prop_assert!(space.stretch(DVec3::Y) > 0.0 && space.stretch(DVec3::Y).is_finite());
            let both = space.within(&space);
            for (_, kind) in profiles() {
                let profile = Profile::new(kind, LightSpace::WORLD).placed(&both);
                for factor in [profile.factor(n), profile.on_surface(n, DVec3::Y)] {
                    prop_assert!(factor.min_element() >= 0.0 && factor.is_finite());
                }
                prop_assert!(!profile.has_angles() && profile.part_behind().to_bits() == 0);
            }
        }
    }
}
