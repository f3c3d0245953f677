//! These tests check delta lights and skies: laws of their points, radiance, and hostile input.
#![allow(
    clippy::cast_possible_truncation,
    reason = "pixels are f32, and bins a few thousand"
)]
#![allow(
    clippy::type_complexity,
    reason = "maps there and back, whose types have no names"
)]

use crate::profiles::profiles;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use linelit_lights::octahedral::{sphere_to_square, square_to_sphere};
use linelit_lights::{
    DeltaSample, DistantLight, Light, LightPoint, LightSpace, NoTexture, PointDensity, PointLight,
    PointSample, PointSource, PointTechnique, Profile, Shape, Sky, SkyBy, SkyEmission, SkyError,
    SkyFilter, SkyImage, SkyMapping, SkyPoints, SkyView, SolidAngle, Sphere,
    Surface as LightSurface, Viewer,
};
use linelit_testkit::cases::cases;
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::laws::{Surface, Technique};
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::strategies::{hostile, hostile_unit, hostile_vector};
use linelit_testkit::ztest::{Welford, critical_z};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};
use std::sync::Arc;

pub(crate) const X: DVec3 = DVec3::new(1.0, -2.0, 0.5);
const SCENE: Sphere = Sphere {
    center: DVec3::new(0.0, 1.0, 0.0),
    radius: 10.0,
};

pub(crate) fn sky(emission: SkyEmission, portal: Option<ConvexPolygon>) -> Sky {
    Sky {
        emission,
        portal,
        scene: SCENE,
    }
}

fn sun(direction: DVec3, half_angle: f64) -> SkyEmission {
    SkyEmission::Sun {
        direction: direction.normalize(),
        half_angle,
        radiance: DVec3::splat(7.0),
    }
}

/// A rotation that leaves no axis alone.
pub(crate) fn turned() -> DMat3 {
    DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1)
}

/// Pixels: random, with a third of them black; or black but for one.
fn pixels(count: usize, one: Option<usize>) -> Vec<[f32; 3]> {
    let mut rng = SplitMix64::new(3);
    let mut value = |k: usize| match one {
        Some(bright) => f32::from(u8::from(k == bright)) * 1e3,
        None => (rng.in_range(-0.5, 1.0).max(0.0) * 4.0) as f32,
    };
    (0..count).map(|k| [value(k), value(k), value(k)]).collect()
}

fn image(mapping: SkyMapping, size: [usize; 2], one: Option<usize>) -> SkyEmission {
    filtered(SkyFilter::Linear, mapping, size, one)
}

fn filtered(
    filter: SkyFilter,
    mapping: SkyMapping,
    size: [usize; 2],
    one: Option<usize>,
) -> SkyEmission {
    let pixels = pixels(size[0] * size[1], one);
    let scale = DVec3::new(1.0, 2.0, 0.5);
    let space = LightSpace::new(turned().transpose()).unwrap();
    let image = SkyImage::placed(filter, mapping, size, pixels, space, scale);
    SkyEmission::Image(Arc::new(image.expect("good pixels")))
}

/// Directions about an axis up to 1 − cos = `height`, as a surface of points of a view.
fn cap(
    axis: DVec3,
    height: f64,
    view: &SkyView<'_>,
) -> Surface<impl Fn([f64; 2]) -> ([f64; 3], f64), impl Fn([f64; 3]) -> Option<[f64; 2]>> {
    let frame = Frame::from_normal(axis);
    let far = view.meets(X, axis).expect("the axis shows").distance(X);
    Surface {
        place: move |[a, b]: [f64; 2]| {
            let down = height * a;
            let sine = (down * (2.0 - down)).sqrt();
            let (s, c) = (TAU * b).sin_cos();
            let w = frame.to_world(DVec3::new(sine * c, sine * s, 1.0 - down));
            ((X + w * far).to_array(), TAU * height)
        },
        locate: move |p: [f64; 3]| {
            let w = (DVec3::from(p) - X).normalize();
            let local = frame.to_local(w);
            let down = 0.5 * (w - axis).length_squared() / height;
            let turn = (local.y.atan2(local.x) / TAU).rem_euclid(1.0);
            (down <= 1.0 + 1e-9).then(|| [down.min(1.0), turn])
        },
        seams: Vec::new(),
    }
}

/// Suns are uniform in their caps, constant skies in the hemisphere or by the cosine: χ² of a
/// million samples, the integral, the Jacobian, and there and back.
#[test]
fn caps_follow_the_laws() {
    let n = DVec3::new(0.48, -0.6, 0.64);
    let constant = sky(SkyEmission::Constant(DVec3::ONE), None);
    let radiance = SkyBy::Radiance(n);
    let angles = [1e-4, 0.004_65, 0.3, FRAC_PI_2];
    let suns = angles.map(|half| sky(sun(DVec3::new(-1.0, 0.5, 2.0), half), None));
    let hemispheres = [(&constant, radiance), (&constant, SkyBy::Projected(n))];
    let all = suns.iter().map(|sky| (sky, radiance)).chain(hemispheres);
    for (sky, by) in all {
        let (axis, height) = match sky.emission {
            SkyEmission::Sun {
                direction,
                half_angle,
                ..
            } => (direction, 2.0 * (0.5 * half_angle).sin().powi(2)),
            _ => (n, 1.0),
        };
        let view = SkyView::new(sky, X);
        let points = SkyPoints::new(view, by);
        let far = view.meets(X, axis).expect("the axis shows").distance(X);
        // A place is rounded to ε of the coordinates, which are `far`; of the cosine c at the
        // horizon, c² is known to ε and c to ε/2c.
        let at_horizon = if matches!(by, SkyBy::Projected(_)) {
            1e3
        } else {
            8.0
        };
        let resolution = at_horizon * f64::EPSILON * far;
        Technique::new(format!("{:?} {by:?}", sky.emission))
            .samples(1_000_000)
            .alpha(sidak(1e-4, 6))
            .resolution(resolution)
            // The densities of a cap of 10⁻⁴ are accurate to 10⁻⁴, since its positions are to
            // 10⁻¹².
            .density(if height < 1e-6 { 1e-3 } else { 1e-6 })
            .check_2d(
                &cap(axis, height, &view),
                |u| points.sample(u).point.to_array(),
                |p| points.pdf(DVec3::from(p)).value(),
                |p| points.invert(DVec3::from(p)),
            );
    }
}

/// The direction of a sample, whose density is the one that it was drawn with, and whose random
/// numbers lead back to it.
fn hold(points: &SkyPoints<'_>, sample: &PointSample<SolidAngle>) -> DVec3 {
    let w = (sample.point - X).normalize();
    let pdf = points.pdf(sample.point).value();
    assert!(
        (pdf / sample.pdf.value() - 1.0).abs() < 1e-6,
        "{pdf} {sample:?}"
    );
    let back = points.invert(sample.point).expect("a positive density");
    let again = (points.sample(back).point - X).normalize();
    assert!(again.distance(w) < 1e-9, "{back:?}");
    w
}

/// A histogram of samples over n × n cells of the image's square against the mean density at
/// `fine`² places of each.
fn histogram(
    points: &SkyPoints<'_>,
    mapping: SkyMapping,
    [n, fine]: [usize; 2],
    samples: usize,
    alpha: f64,
) -> f64 {
    let is_flat = mapping == SkyMapping::EqualArea;
    let mut observed = vec![0_u64; n * n + 1];
    let mut rng = SplitMix64::new(11);
    let view = |w: DVec3| X + w * 50.0;
    for _ in 0..samples {
        let u = [rng.next_f64(), rng.next_f64()];
        let sample = points.sample(u);
        if !sample.pdf.is_positive() {
            observed[n * n] += 1;
            continue;
        }
        let w = hold(points, &sample);
        // The bins are the bins of the image, rotated with it.
        let local = turned() * w;
        let place = match is_flat {
            true => sphere_to_square(local),
            false => [
                (local.y.atan2(local.x) / TAU).rem_euclid(1.0),
                local.x.hypot(local.y).atan2(local.z) / PI,
            ],
        };
        let [i, j] = place.map(|c| ((c * n as f64) as usize).min(n - 1));
        observed[j * n + i] += 1;
    }
    let mut total = 0.0;
    let share = |k: usize| -> f64 {
        let at = |a: usize, b: usize| {
            let c = [(k % n) * fine + a, (k / n) * fine + b];
            let [x, y] = c.map(|c| (c as f64 + 0.5) / (n * fine) as f64);
            let (local, solid_angle) = match is_flat {
                true => (square_to_sphere([x, y]), 4.0 * PI / (n * fine) as f64),
                false => {
                    let ((s, c), (sine, cosine)) = ((TAU * x).sin_cos(), (PI * y).sin_cos());
                    let band = 2.0 * sine * (0.5 * PI / (n * fine) as f64).sin();
                    (DVec3::new(sine * c, sine * s, cosine), TAU * band)
                }
            };
            points.pdf(view(turned().transpose() * local)).value() * solid_angle
        };
        let sum: f64 = (0..fine * fine).map(|p| at(p % fine, p / fine)).sum();
        sum / (n * fine) as f64
    };
    let mut expected: Vec<f64> = (0..n * n).map(share).collect();
    total += expected.iter().sum::<f64>();
    expected.push((1.0 - total).max(0.0));
    let expected: Vec<f64> = expected.iter().map(|e| e * samples as f64).collect();
    let result = chi2_test(&observed, &expected, 8.0);
    assert!(result.p_value > alpha, "{result:?}");
    total
}

/// Images: the density is constant in the cells of the hierarchy, 8 × 8 to 64 × 64 here, so that
/// the means over bins are exact; it integrates to one.
#[test]
fn images_follow_the_laws() {
    let n = DVec3::new(0.48, -0.6, 0.64);
    let (linear, nearest) = (SkyFilter::Linear, SkyFilter::Nearest);
    let images = [
        (linear, SkyMapping::Equirectangular, [40, 23], None),
        (nearest, SkyMapping::Equirectangular, [23, 40], None),
        (linear, SkyMapping::Equirectangular, [64, 32], Some(700)),
        (linear, SkyMapping::Equirectangular, [16, 8], Some(127)),
        (linear, SkyMapping::EqualArea, [33, 33], None),
        (nearest, SkyMapping::EqualArea, [13, 13], Some(12)),
        (linear, SkyMapping::EqualArea, [1, 1], None),
        (nearest, SkyMapping::Equirectangular, [1, 1], Some(0)),
    ];
    let alpha = sidak(1e-4, 2 * images.len());
    for (filter, mapping, size, one) in images {
        let sky = sky(filtered(filter, mapping, size, one), None);
        for by in [SkyBy::Radiance(n), SkyBy::Projected(n)] {
            let points = SkyPoints::new(SkyView::new(&sky, X), by);
            let total = histogram(&points, mapping, [16, 4], 200_000, alpha);
            assert!((total - 1.0).abs() < 1e-6, "{total} {size:?} {by:?}");
        }
    }
}

/// A million samples of one image.
#[test]
fn a_million_directions_of_an_image() {
    let sky = sky(image(SkyMapping::EqualArea, [64, 64], None), None);
    let by = SkyBy::Projected(DVec3::Z);
    let points = SkyPoints::new(SkyView::new(&sky, X), by);
    histogram(&points, SkyMapping::EqualArea, [64, 1], 1_000_000, 1e-4);
}

fn portal(center: DVec3, size: f64) -> ConvexPolygon {
    // It faces the shading point.
    let frame = Frame::from_normal((X - center).normalize());
    let (a, b) = (frame.x * size, frame.y * (0.6 * size));
    ConvexPolygon::parallelogram(center - a - b, a * 2.0, b * 2.0).expect("flat")
}

/// Portals that face the shading point: large, small, grazing, and next to a point.
pub(crate) fn portals() -> [ConvexPolygon; 5] {
    let toward = DVec3::new(1.0, 2.0, 1.5).normalize();
    let grazing = |far: f64| {
        let frame = Frame::from_normal(-toward);
        let edges = [frame.x + frame.z * 14.0, frame.y].map(|e| e.normalize());
        let corner = X + toward * far - (edges[0] + edges[1]) * 0.5;
        ConvexPolygon::parallelogram(corner, edges[0], edges[1]).expect("flat")
    };
    [
        portal(X + toward, 3.0),
        portal(X + toward * 2.7, 0.7),
        portal(X + toward * 2.7, 0.05),
        portal(X + toward * 2.7, 1e-5),
        grazing(2.7),
    ]
}

/// Parts of a portal along each side, and places of each part along each side.
const PARTS: usize = 6;
const PLACES: usize = 128;

/// The samples of a million that the density sends to each part of a rectangular portal, by sums
/// over its places, and the red light over the places.
fn through_parts(points: &SkyPoints<'_>, sky: &Sky, portal: &ConvexPolygon) -> (Vec<f64>, Welford) {
    let view = SkyView::new(sky, X);
    let corners = portal.vertices();
    let edges = [corners[1] - corners[0], corners[3] - corners[0]];
    let across = edges[0].cross(edges[1]);
    let count = PARTS * PLACES;
    let (mut expected, mut light) = (vec![0.0; PARTS * PARTS], Welford::default());
    for (i, j) in (0..count * count).map(|k| (k % count, k / count)) {
        let [a, b] = [i, j].map(|c| (c as f64 + 0.5) / count as f64);
        let to = corners[0] + edges[0] * a + edges[1] * b - X;
        let w = to.normalize();
        let at = view.meets(X, w).expect("through the portal");
        let solid_angle = across.dot(w).abs() / to.length_squared();
        let share = points.pdf(at).value() * solid_angle / (count * count) as f64;
        expected[j / PLACES * PARTS + i / PLACES] += share * 1e6;
        light.push(sky.radiance(X, w).x * w.z * solid_angle);
    }
    (expected, light)
}

/// Counts of a million samples in the parts of portals, and of samples that do not pass, compared
/// with the density; the half that is uniform passes. The light by samples agrees with the light by
/// positions on the portal.
#[test]
fn portals_follow_the_laws() {
    let n = DVec3::Z;
    let even = image(SkyMapping::EqualArea, [8, 8], None);
    let bright = image(SkyMapping::Equirectangular, [8, 4], Some(2));
    let images = [(even, SkyBy::Projected(n)), (bright, SkyBy::Radiance(n))];
    let level = sidak(1e-4, 2 * portals().len() * images.len());
    for (k, portal) in portals().into_iter().enumerate() {
        for (emission, by) in &images {
            let sky = sky(emission.clone(), Some(portal));
            let points = SkyPoints::new(SkyView::new(&sky, X), *by);
            let (mut expected, light) = through_parts(&points, &sky, &portal);
            let corners = portal.vertices();
            let edges = [corners[1] - corners[0], corners[3] - corners[0]];
            let mut observed = vec![0_u64; PARTS * PARTS + 1];
            let mut drawn = Welford::default();
            let mut rng = SplitMix64::new(7);
            for round in 0..1_000_000 {
                let u = [rng.next_f64(), rng.next_f64()];
                let sample = points.sample(u);
                if !sample.pdf.is_positive() {
                    assert!(u[0] >= 0.5, "portal {k} {by:?}: {u:?}");
                    observed[PARTS * PARTS] += 1;
                    drawn.push(0.0);
                    continue;
                }
                if round % 16 == 0 {
                    hold(&points, &sample);
                }
                let w = (sample.point - X).normalize();
                let to = portal.meets(X, w).expect("through the portal") - corners[0];
                let [a, b] = edges.map(|e| to.dot(e) / e.length_squared());
                let [i, j] = [a, b].map(|c| ((c * PARTS as f64) as usize).min(PARTS - 1));
                observed[j * PARTS + i] += 1;
                drawn.push(sky.radiance(X, w).x * w.z / sample.pdf.value());
            }
            expected.push(1e6 - expected.iter().sum::<f64>());
            let result = chi2_test(&observed, &expected, 8.0);
            assert!(result.p_value > level, "portal {k} {by:?}: {result:?}");
            let z = drawn.z_score(light.mean());
            assert!(z.abs() < critical_z(level), "portal {k} {by:?}: {z}");
        }
    }
}

/// A portal that faces away or is seen from its plane shows nothing.
#[test]
fn portals_show_nothing_from_behind() {
    let aside = ConvexPolygon::parallelogram(X + DVec3::Y, DVec3::Y, DVec3::X).expect("flat");
    for portal in portals()
        .map(|p| p.flipped())
        .into_iter()
        .chain([aside, aside.flipped()])
    {
        let sky = sky(image(SkyMapping::EqualArea, [8, 8], None), Some(portal));
        assert!(!sky.is_above(X, DVec3::Y));
        let points = SkyPoints::new(SkyView::new(&sky, X), SkyBy::Projected(DVec3::Z));
        let mut rng = SplitMix64::new(5);
        for _ in 0..1000 {
            let sample = points.sample([rng.next_f64(), rng.next_f64()]);
            assert!(!sample.pdf.is_positive() && points.invert(sample.point).is_none());
            assert_eq!(sky.radiance(X, (sample.point - X).normalize()), DVec3::ZERO);
        }
    }
}

/// Points of any sky have a density where the sky is visible, and none outside a portal or from
/// behind it: for a sun that the portal cuts, one outside it, and a portal that faces away.
#[test]
fn no_point_is_beside_a_portal() {
    let towards = DVec3::new(1.0, 2.0, 1.5);
    let facing = portal(X + towards, 0.7);
    let emissions = [
        sun(towards, 0.5),
        sun(towards, 0.05),
        sun(-towards, 0.5),
        SkyEmission::Constant(DVec3::ONE),
        image(SkyMapping::Equirectangular, [16, 8], None),
    ];
    for (k, emission) in emissions.into_iter().enumerate() {
        for (faces, portal) in [(true, facing), (false, facing.flipped())] {
            let sky = sky(emission.clone(), Some(portal));
            for by in [SkyBy::Radiance(DVec3::Z), SkyBy::Projected(DVec3::Z)] {
                let points = SkyPoints::new(SkyView::new(&sky, X), by);
                let mut rng = SplitMix64::new(13);
                let mut drawn = 0;
                for _ in 0..2000 {
                    let sample = points.sample([rng.next_f64(), rng.next_f64()]);
                    let w = (sample.point - X).normalize();
                    let shows = sky.radiance(X, w) != DVec3::ZERO;
                    let pdf = points.pdf(sample.point);
                    // Black parts of the image are drawn, too.
                    assert!(
                        shows || k == 4 || !sample.pdf.is_positive(),
                        "{k} {w} {faces}"
                    );
                    assert_eq!(
                        sample.pdf.is_positive(),
                        pdf.is_positive(),
                        "{k} {w} {faces}"
                    );
                    drawn += u32::from(pdf.is_positive());
                }
                assert_eq!(drawn > 20, faces && k != 2, "{k} {faces}: {drawn}");
            }
        }
    }
}

/// The mean of an image is its power's, and what is drawn in proportion to it has the same
/// estimate everywhere: radiance over density, within the floor of a hundredth.
#[test]
fn images_are_drawn_in_proportion() {
    let sky = sky(image(SkyMapping::EqualArea, [8, 8], None), None);
    let SkyEmission::Image(picture) = &sky.emission else {
        unreachable!("an image")
    };
    let points = SkyPoints::new(SkyView::new(&sky, X), SkyBy::Radiance(DVec3::Z));
    let mut rng = SplitMix64::new(5);
    let count = 200_000;
    let sum: f64 = (0..count)
        .map(|_| {
            let sample = points.sample([rng.next_f64(), rng.next_f64()]);
            let w = (sample.point - X).normalize();
            picture.radiance(w).element_sum() / 3.0 / sample.pdf.value()
        })
        .sum();
    let want = sky.mean().element_sum() / 3.0 * sky.solid_angle();
    // 4 × 4 positions in a pixel give its mean to 2 %, and samples to 1 % / √(2 · 10⁵) or better.
    assert!(
        (sum / f64::from(count) / want - 1.0).abs() < 0.02,
        "{sum} {want}"
    );
    assert!(picture.memory() >= 8 * 8 * 12 && sky.memory() == picture.memory());
    // Made again of what it was made of, it is the same image.
    let (mapping, size, pixels, to_image, scale) = picture.made_of();
    let again = SkyImage::new(mapping, size, pixels.to_vec(), to_image, scale);
    assert_eq!(again.as_ref(), Ok(&**picture));
    // A sphere of the scene's size is lit by as much.
    let power = Light::Sky(sky.clone()).power();
    assert!((power / (PI * 100.0 * want) - 1.0).abs() < 1e-12);
}

/// The units of radiance do not matter, even far beyond the range of `f32`.
#[test]
fn images_of_any_scale_are_drawn_alike() {
    let drawn = |scale: f64| {
        let pixels = pixels(32 * 16, None);
        let image = SkyImage::new(
            SkyMapping::Equirectangular,
            [32, 16],
            pixels,
            turned(),
            DVec3::new(1.0, 2.0, 0.5) * scale,
        );
        let sky = sky(SkyEmission::Image(Arc::new(image.unwrap())), None);
        let points = SkyPoints::new(SkyView::new(&sky, X), SkyBy::Radiance(DVec3::Z));
        [[0.2, 0.3], [0.5, 0.9], [0.8, 0.6]].map(|u| points.sample(u))
    };
    for exponent in [-700, -150, -100, 100, 150, 700] {
        // Powers of two change no digits.
        assert_eq!(drawn(f64::from(2).powi(exponent)), drawn(1.0), "{exponent}");
    }
}

/// Where things lie: pbrt's longitude and latitude, and its octahedral map; the seam of longitude
/// and the poles are continuous.
#[test]
fn orientations_are_those_of_pbrt() {
    let of = |mapping, size: [usize; 2], bright: usize| {
        let mut pixels = vec![[0.0; 3]; size[0] * size[1]];
        pixels[bright] = [1.0, 2.0, 3.0];
        SkyImage::new(mapping, size, pixels, DMat3::IDENTITY, DVec3::ONE).unwrap()
    };
    // Column 1 of 4 is at longitude 3π/4, row 0 of 2 at π/4 from z.
    let image = of(SkyMapping::Equirectangular, [4, 2], 1);
    let (s, c) = (3.0 * FRAC_PI_4).sin_cos();
    let w = DVec3::new(FRAC_PI_4.sin() * c, FRAC_PI_4.sin() * s, FRAC_PI_4.cos());
    assert!(image.radiance(w).distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12);
    assert!(image.radiance(-w).length() < 1e-12);
    // The first and the last column meet at x > 0, y = 0.
    let image = of(SkyMapping::Equirectangular, [4, 1], 0);
    let near = |y: f64| image.radiance(DVec3::new(1.0, y, 0.0).normalize()).x;
    assert!((near(1e-9) - 0.5).abs() < 1e-8 && (near(-1e-9) - 0.5).abs() < 1e-8);
    // Row 1, column 2 of 4: the octahedral place (0.625, 0.375).
    let image = of(SkyMapping::EqualArea, [4, 4], 4 + 2);
    let w = square_to_sphere([0.625, 0.375]);
    assert!((image.radiance(w).x - 1.0).abs() < 1e-12);
}

#[test]
fn images_that_are_none_are_refused() {
    let new = |size, pixels: Vec<[f32; 3]>, matrix, scale| {
        SkyImage::new(SkyMapping::EqualArea, size, pixels, matrix, scale)
    };
    let (one, id) = (DVec3::ONE, DMat3::IDENTITY);
    let of = |error: SkyError| error.to_string();
    let count = new([2, 2], vec![[1.0; 3]; 3], id, one).unwrap_err();
    assert_eq!(count, SkyError::Count);
    assert_eq!(new([0, 0], vec![], id, one).unwrap_err(), SkyError::Count);
    let flat = new([2, 1], vec![[1.0; 3]; 2], id, one).unwrap_err();
    assert_eq!(of(flat), "an equal-area map is square");
    for bad in [f32::NAN, -1.0, f32::INFINITY] {
        let pixels = vec![[1.0; 3], [1.0, bad, 1.0], [1.0; 3], [1.0; 3]];
        assert_eq!(
            new([2, 2], pixels, id, one).unwrap_err(),
            SkyError::Pixel(1)
        );
    }
    let skewed = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z);
    let skewed = new([1, 1], vec![[1.0; 3]], skewed, one).unwrap_err();
    assert_eq!(skewed, SkyError::Transform);
    let black = new([1, 1], vec![[0.0; 3]], id, one).unwrap();
    let black = sky(SkyEmission::Image(Arc::new(black)), None);
    assert_eq!(Light::Sky(black.clone()).power().to_bits(), 0);
    let points = SkyPoints::new(SkyView::new(&black, X), SkyBy::Radiance(DVec3::Z));
    assert!(!points.sample([0.5, 0.5]).pdf.is_positive());
}

/// Intensity over the square of the distance, and the same everywhere.
#[test]
fn beams_are_what_arrives() {
    let lamp = PointLight {
        position: DVec3::new(0.0, 3.0, 4.0),
        intensity: DVec3::new(5.0, 10.0, 15.0),
        profile: None,
    };
    let DeltaSample {
        to_light,
        direction,
        irradiance,
    } = lamp.beam(DVec3::ZERO).unwrap();
    assert_eq!(to_light, lamp.position);
    assert!(direction.distance(DVec3::new(0.0, 0.6, 0.8)) < 1e-15);
    assert!(irradiance.distance(DVec3::new(0.2, 0.4, 0.6)) < 1e-15);
    assert!(lamp.beam(lamp.position).is_none());
    assert!((Light::Point(lamp).power() - 40.0 * PI).abs() < 1e-12);
    let far = DistantLight {
        direction: DVec3::Y,
        irradiance: DVec3::splat(3.0),
        scene: SCENE,
    };
    let mut light = Light::Distant(far);
    let beam = light.beam(X).unwrap();
    assert_eq!(
        (beam.direction, beam.irradiance),
        (DVec3::Y, DVec3::splat(3.0))
    );
    // The end is beyond the scene, for all margins.
    let end = X + beam.to_light * (1.0 - 1e-3);
    assert!(end.distance(SCENE.center) > SCENE.radius);
    assert!((light.power() - 300.0 * PI).abs() < 1e-9);
    light.set_scene(Sphere {
        radius: 0.0,
        ..SCENE
    });
    assert_eq!(light.power().to_bits(), 0);
    assert!(light.beam(X).is_some());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(400)))]

    /// Whatever the numbers: finite densities, points that are there, factors that are numbers.
    #[test]
    fn hostile_numbers(
        x in hostile_vector(), n in hostile_vector(), at in hostile_vector(),
        scene in hostile_vector(), radius in hostile(), angle in hostile(),
        u in [hostile_unit(), hostile_unit()], kind in 0..5usize,
    ) {
        let [x, n, at, center] = [x, n, at, scene].map(DVec3::from);
        let emission = match kind {
            0 => SkyEmission::Constant(DVec3::ONE),
            1 => SkyEmission::Sun { direction: n, half_angle: angle, radiance: DVec3::ONE },
            2 => image(SkyMapping::EqualArea, [4, 4], None),
            _ => image(SkyMapping::Equirectangular, [4, 2], Some(3)),
        };
        let portal = (kind > 2).then(|| portal(DVec3::new(2.0, 3.0, 4.0), 1.0));
        let sky = Sky { emission, portal, scene: Sphere { center, radius } };
        let view = SkyView::new(&sky, x);
        for by in [SkyBy::Radiance(n), SkyBy::Projected(n)] {
            let points = SkyPoints::new(view, by);
            let sample = points.sample(u);
            prop_assert!(sample.pdf.value() >= 0.0 && sample.pdf.value().is_finite());
            prop_assert!(points.pdf(at).value() >= 0.0);
            prop_assert!(points.invert(at).is_none_or(|u| u.iter().all(|u| (0.0..1.0).contains(u))));
        }
        let viewer = Viewer { position: x, normal: n, geometric_normal: n, cosines: None };
        let surface = LightSurface::Sky(&view);
        let source = PointSource::new::<NoTexture>(PointDensity::Area, surface, None, &viewer);
        prop_assert!(source.density(&LightPoint::new(at, x, &surface)) >= 0.0);
        let _ = (sky.is_above(x, n), sky.radiance(x, n), sky.solid_angle(), sky.mean());
        let lamp = PointLight { position: at, intensity: DVec3::splat(radius), profile: None };
        for light in [
            Light::Point(lamp.clone()),
            Light::Distant(DistantLight { direction: n, irradiance: at, scene: sky.scene }),
        ] {
            prop_assert!(light.power() >= 0.0);
            if let Some(beam) = light.beam(x) {
                prop_assert!(beam.irradiance.is_finite() && beam.irradiance.min_element() >= 0.0);
                prop_assert!(beam.to_light.is_finite());
            }
        }
        for (_, kind) in profiles() {
            let factor = Profile::new(kind, Frame::from_normal(DVec3::Z)).factor(n);
            prop_assert!(factor.min_element() >= 0.0 && factor.is_finite());
        }
    }
}
