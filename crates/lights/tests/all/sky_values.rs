//! These tests compare skies with known values, to rounding.

use linelit_geometry::{ConvexPolygon, DMat3, DVec3};
use linelit_lights::{Light, SkyView, Sphere};
use linelit_lights::{PointTechnique, Sky, SkyBy, SkyEmission, SkyImage, SkyMapping, SkyPoints};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const N: DVec3 = DVec3::new(0.48, -0.6, 0.64);

fn sky(emission: SkyEmission, portal: Option<ConvexPolygon>) -> Sky {
    let (center, radius) = (DVec3::Y, 10.0);
    let scene = Sphere { center, radius };
    Sky {
        emission,
        portal,
        scene,
    }
}

fn numbers() -> impl Iterator<Item = [f64; 2]> {
    (0..64).map(|k| [(f64::from(k) + 0.5) / 64.0, f64::from(k) * 0.618_034 % 1.0])
}

/// A sun of half angle a fills 2π (1 − cos a): its points are uniform in that, in the order of
/// their numbers, and at its rim it ends. Where less than half of it is above, some of it is.
#[test]
fn suns_are_caps() {
    for half_angle in [1e-3, 0.1, 1.0, 3.0_f64] {
        let radiance = DVec3::splat(7.0);
        let direction = N;
        let sky = sky(
            SkyEmission::Sun {
                direction,
                half_angle,
                radiance,
            },
            None,
        );
        // 1 − cos, without cancellation.
        let height = half_angle.sin().powi(2) / (1.0 + half_angle.cos());
        let (solid_angle, across) = (TAU * height, PI * 100.0);
        assert!((sky.solid_angle() / solid_angle - 1.0).abs() < 1e-13);
        let power = Light::Sky(sky.clone()).power();
        assert!(
            (power / (7.0 * solid_angle * across) - 1.0).abs() < 1e-13,
            "{power}"
        );
        let points = SkyPoints::new(SkyView::new(&sky, DVec3::X), SkyBy::Radiance(DVec3::Z));
        for u in numbers() {
            let sample = points.sample(u);
            let w = (sample.point - DVec3::X).normalize();
            let depth = 0.5 * (w - N).length_squared();
            // The place is rounded to ε of its distance, and directions with it.
            let rounding = 32.0 * f64::EPSILON * (1.0 + 1.0 / height.sqrt());
            assert!(
                (depth / height - u[0]).abs() < rounding,
                "{half_angle} {u:?}: {depth}"
            );
            for density in [sample.pdf, points.pdf(sample.point)] {
                assert!((density.value() * solid_angle - 1.0).abs() < 1e-13);
            }
            let back = points.invert(sample.point).expect("a sample");
            assert!((back[0] - u[0]).abs() < rounding, "{back:?} {u:?}");
            let turn = (back[1] - u[1]).abs();
            let most = 2.0 * rounding / u[0].sqrt();
            assert!(turn.min(1.0 - turn) < most, "{back:?} {u:?}");
        }
        let side = N.any_orthonormal_vector();
        let at = |angle: f64| N * angle.cos() + side * angle.sin();
        let [inside, outside] = [1.0 - 1e-9, 1.0 + 1e-9].map(|x| at(half_angle * x));
        assert!(sky.radiance(DVec3::ZERO, inside) == radiance);
        assert!(sky.radiance(DVec3::ZERO, outside) == DVec3::ZERO);
        if half_angle < 1.5 {
            for (share, is_above) in [(0.5, true), (-0.5, true), (-0.99, true), (-1.01, false)] {
                // The horizon is this many half angles below the middle.
                let below = share * half_angle;
                let normal = N * below.sin() + side * below.cos();
                assert_eq!(
                    sky.is_above(DVec3::ZERO, normal),
                    is_above,
                    "{half_angle} {share}"
                );
            }
        }
    }
}

/// One radiance, by the cosine: cos θ/π, with sin² θ in the order of the numbers.
#[test]
fn skies_of_one_radiance_are_drawn_by_the_cosine() {
    let sky = sky(SkyEmission::Constant(DVec3::ONE), None);
    let points = SkyPoints::new(SkyView::new(&sky, DVec3::X), SkyBy::Projected(N));
    for u in numbers() {
        let sample = points.sample(u);
        let w = (sample.point - DVec3::X).normalize();
        let cosine = N.dot(w);
        assert!(
            (1.0 - cosine * cosine - u[0]).abs() < 1e-14,
            "{u:?}: {cosine}"
        );
        for density in [sample.pdf, points.pdf(sample.point)] {
            // The cosine is known to ε, not to ε of itself.
            assert!(
                (density.value() * PI - cosine).abs() < 1e-14,
                "{u:?}: {density:?}"
            );
        }
    }
}

/// Through a wall of a cube about the point a sixth of all directions is seen, each as likely;
/// with an image, half of the samples go there, and half where it is bright.
#[test]
fn portals_are_drawn_by_solid_angle() {
    let corner = DVec3::new(1.0, -1.0, 1.0);
    let portal = ConvexPolygon::parallelogram(corner, DVec3::Y * 2.0, DVec3::X * -2.0);
    let portal = portal.expect("a wall");
    let portal = match portal.normal().z < 0.0 {
        true => portal,
        false => {
            ConvexPolygon::parallelogram(corner, DVec3::X * -2.0, DVec3::Y * 2.0).expect("one")
        }
    };
    #[allow(clippy::cast_precision_loss, reason = "a few")]
    let pixels = (0..64).map(|k| [1.0 + (k % 7) as f32; 3]).collect();
    let image = SkyImage::new(
        SkyMapping::EqualArea,
        [8; 2],
        pixels,
        DMat3::IDENTITY,
        DVec3::ONE,
    );
    let image = SkyEmission::Image(Arc::new(image.expect("an image")));
    let sixth = 4.0 * PI / 6.0;
    let whole = sky(image.clone(), None);
    for (emission, by_portal) in [(SkyEmission::Constant(DVec3::ONE), 1.0), (image, 0.5)] {
        let sky = sky(emission, Some(portal));
        let of = |sky| SkyPoints::new(SkyView::new(sky, DVec3::ZERO), SkyBy::Radiance(N));
        let (points, all) = (of(&sky), of(&whole));
        let mut shown = 0;
        for u in numbers() {
            let sample = points.sample(u);
            let w = sample.point.normalize();
            if sky.radiance(DVec3::ZERO, w) == DVec3::ZERO {
                assert!(!sample.pdf.is_positive() && !points.pdf(sample.point).is_positive());
                continue;
            }
            shown += 1;
            let by_image = all
                .pdf(all.sample(u).point * 0.0 + w * sample.point.length())
                .value();
            let want = by_portal / sixth + (1.0 - by_portal) * by_image;
            for density in [sample.pdf, points.pdf(sample.point)] {
                assert!(
                    (density.value() / want - 1.0).abs() < 1e-12,
                    "{u:?}: {density:?} {want}"
                );
            }
        }
        assert!(shown >= 32);
        let behind = DVec3::Z * 3.0;
        assert_eq!(sky.radiance(behind, -DVec3::Z), DVec3::ZERO);
    }
}

/// A uniform image is its value: its mean, its power, its radiance in any direction.
#[test]
fn images_of_one_value_are_that_value() {
    for (mapping, size) in [
        (SkyMapping::EqualArea, [16; 2]),
        (SkyMapping::Equirectangular, [12, 7]),
    ] {
        let pixels = vec![[2.0; 3]; size[0] * size[1]];
        let scale = DVec3::new(1.0, 0.5, 0.25);
        let image = SkyImage::new(mapping, size, pixels, DMat3::IDENTITY, scale).expect("one");
        assert!(
            (image.mean() / (scale * 2.0) - DVec3::ONE).length() < 1e-13,
            "{}",
            image.mean()
        );
        for k in 0..40 {
            let (s, c) = f64::from(k).sin_cos();
            let w = DVec3::new(s * 0.6, s * 0.8, c);
            assert!((image.radiance(w) - scale * 2.0).length() < 1e-14);
        }
    }
}
