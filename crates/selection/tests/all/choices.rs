//! These tests check the choice among lights: probabilities add up, frequencies fit them, only
//! lights that cannot contribute have the probability zero, and the tree has little noise.

use linelit_bsdf::{Bsdf, Lambert};
use linelit_geometry::{ConvexPolygon, DVec3, Frame, Segment};
use linelit_lights::{
    AreaLight, Cylinder, CylinderLight, Disk, DiskLight, DistantLight, Emission, Falloff, Light,
    LinearLight, PointLight, Profile, ProfileKind, Sky, SkyEmission, Sphere, SphereLight,
};
use linelit_selection::{
    Discrete, Estimated, LightTree, LtcReceiver, can_contribute, diffuse, unshadowed,
    unshadowed_at_center,
};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::rng::SplitMix64;
use std::f64::consts::PI;
use std::sync::Arc;

fn random_in(rng: &mut SplitMix64, lo: f64, hi: f64) -> DVec3 {
    DVec3::new(
        rng.in_range(lo, hi),
        rng.in_range(lo, hi),
        rng.in_range(lo, hi),
    )
}

/// Lights of all kinds in a box, radiances over three decades.
pub(crate) fn mixed(n: u32, seed: u64) -> Vec<Light> {
    let mut rng = SplitMix64::new(seed);
    (0..n)
        .map(|i| {
            let o = random_in(&mut rng, -5.0, 5.0);
            let radiance = DVec3::splat(10_f64.powf(rng.in_range(-2.0, 1.0)));
            let size = rng.in_range(0.05, 0.4);
            let two_sided = rng.next_f64() < 0.3;
            let emission = Emission {
                radiance,
                two_sided,
            };
            let normal = DVec3::from(rng.unit_vector());
            match i % 5 {
                0 => {
                    let (a, b) = (
                        random_in(&mut rng, -size, size),
                        random_in(&mut rng, -size, size),
                    );
                    let polygon = ConvexPolygon::triangle(o, o + a, o + b).expect("a triangle");
                    Light::Area(AreaLight { polygon, emission })
                }
                1 => Light::Linear(LinearLight {
                    segment: Segment::new(o, o + normal * size),
                    radiance_radius: radiance * 0.1,
                }),
                2 => Light::Sphere(SphereLight {
                    sphere: Sphere {
                        center: o,
                        radius: size,
                    },
                    radiance,
                }),
                3 => Light::Cylinder(CylinderLight {
                    cylinder: Cylinder {
                        axis: Segment::new(o, o + normal * size * 2.0),
                        radius: size * 0.5,
                    },
                    radiance,
                }),
                _ => Light::Disk(DiskLight {
                    disk: Disk {
                        center: o,
                        normal,
                        radius: size,
                    },
                    emission,
                }),
            }
        })
        .collect()
}

/// Points, a spot, parallel light and skies around such a box.
fn without_size() -> [Light; 6] {
    let scene = Sphere {
        center: DVec3::ZERO,
        radius: 8.0,
    };
    let half = 0.5_f64;
    let cone = ProfileKind::Cone {
        cos_inner: half,
        cos_outer: half - 0.3,
        falloff: Falloff::Smooth,
    };
    let spot = Profile::new(cone, Frame::from_normal(DVec3::new(0.0, 0.6, -0.8)));
    let point = |position, profile: Option<Profile>| {
        Light::Point(PointLight {
            position,
            intensity: DVec3::new(1.0, 2.0, 3.0),
            profile: profile.map(Arc::new),
        })
    };
    let sky = |emission| {
        Light::Sky(Sky {
            emission,
            portal: None,
            scene,
        })
    };
    let direction = DVec3::new(0.48, 0.6, 0.64);
    [
        point(DVec3::new(1.0, -2.0, 3.0), None),
        point(DVec3::new(-1.0, 2.0, 1.0), Some(spot)),
        Light::Distant(DistantLight {
            direction,
            irradiance: DVec3::splat(0.3),
            scene,
        }),
        sky(SkyEmission::Constant(DVec3::splat(0.1))),
        sky(SkyEmission::Sun {
            direction: -direction,
            half_angle: 0.1,
            radiance: DVec3::splat(9.0),
        }),
        Light::Distant(DistantLight {
            direction,
            irradiance: DVec3::ZERO,
            scene,
        }),
    ]
}

/// Lights of every kind there is; the last one is dark.
fn every_kind(n: u32, seed: u64) -> Vec<Light> {
    let mut lights = mixed(n, seed);
    lights.extend(without_size());
    lights
}

pub(crate) fn receivers(count: usize) -> Vec<(DVec3, DVec3)> {
    let mut rng = SplitMix64::new(77);
    (0..count)
        .map(|_| {
            (
                random_in(&mut rng, -4.0, 4.0),
                DVec3::from(rng.unit_vector()),
            )
        })
        .collect()
}

#[test]
fn frequencies_fit_probabilities() {
    let lights = every_kind(60, 1);
    let tree = LightTree::new(&lights);
    assert_eq!(tree.len(), 65);
    for (x, n) in receivers(10) {
        let mut counts = vec![0_u64; lights.len() + 1];
        let mut rests = vec![0_u64; 10];
        let mut rng = SplitMix64::new(2);
        for _ in 0..50_000 {
            match tree.pick(|i| &lights[i], &diffuse(x, n), rng.next_f64()) {
                Some(p) => {
                    counts[p.index] += 1;
                    #[allow(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "below 10"
                    )]
                    let bin = (p.rest * 10.0) as usize;
                    rests[bin] += 1;
                    let again = tree.probability(|i| &lights[i], &diffuse(x, n), p.index);
                    assert_eq!(p.probability.to_bits(), again.to_bits());
                }
                None => counts[lights.len()] += 1,
            }
        }
        let mut expected: Vec<f64> = (0..lights.len())
            .map(|i| tree.probability(|i| &lights[i], &diffuse(x, n), i))
            .collect();
        assert_eq!(counts[lights.len()], 0, "a walk that ends without a light");
        counts.truncate(lights.len());
        for e in &mut expected {
            *e *= 50_000.0;
        }
        // Frequencies and rests at 10 points: α = 0.01 in all.
        let least = sidak(0.01, 20);
        assert!(chi2_test(&counts, &expected, 5.0).p_value > least);
        let each = rests.iter().sum::<u64>() as f64 / 10.0;
        assert!(chi2_test(&rests, &[each; 10], 5.0).p_value > least);
    }
}

#[test]
fn zeros_are_true() {
    let lights = every_kind(200, 3);
    let mut rng = linelit_testkit::cases::rng(4);
    let tree = LightTree::new(&lights);
    for (x, n) in receivers(50) {
        for (i, light) in lights.iter().enumerate() {
            let possible = can_contribute(light, x, n);
            let most = (0..16)
                .map(|_| unshadowed(light, &diffuse(x, n), [rng.next_f64(), rng.next_f64()]))
                .fold(unshadowed_at_center(light, &diffuse(x, n)), f64::max);
            assert!(
                possible || most <= 0.0,
                "{light:?} contributes {most} to {x} {n}"
            );
            assert!(
                most <= 0.0 || tree.probability(|i| &lights[i], &diffuse(x, n), i) > 0.0,
                "{light:?}"
            );
        }
    }
}

/// The light in closed form, and what random points of the light say in the mean, of lights that
/// have no size or that are about a cap: zero together, and within a factor of each other.
#[test]
fn closed_forms_are_near_the_light_of_points() {
    let matte = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    let lights = without_size();
    let mut rng = linelit_testkit::cases::rng(6);
    for (x, n) in receivers(50) {
        let cosines = LtcReceiver::new(&matte, x, n, n);
        let at = diffuse(x, n);
        for light in &lights[..5] {
            let count = 400;
            let mut one = || unshadowed(light, &at, [rng.next_f64(), rng.next_f64()]);
            let mean = (0..count).map(|_| one()).sum::<f64>() / f64::from(count);
            let got = cosines.light(light) * PI;
            assert_eq!(got > 0.0, can_contribute(light, x, n), "{light:?}");
            // A twentieth of the albedo is added. Of a sun whose centre is a fifth of its radius r
            // above the horizon, .325 r of the cosine is seen in the mean, and .2 r counted.
            let (low, high) = (0.6 * mean, 1.06 * mean + 0.25);
            assert!(got >= low && got <= high, "{light:?}: {got} {mean}");
        }
    }
}

#[test]
fn estimated_keeps_a_floor() {
    let mut buffer = [0.0; 4];
    let alpha = Estimated::new(&mut buffer, |i| [8.0, 0.0, f64::NAN, 2.0][i], |i| i != 3);
    let total: f64 = (0..4).map(|i| alpha.probability(i)).sum();
    assert!((total - 1.0).abs() < 4.0 * f64::EPSILON);
    assert!(alpha.probability(1) > 0.0 && alpha.probability(2) > 0.0);
    assert!(
        alpha.probability(3).abs() < f64::MIN_POSITIVE
            && alpha.probability(9).abs() < f64::MIN_POSITIVE
    );
    let picked = alpha.pick(0.999_999).expect("a light");
    assert_eq!(picked.index, 2);
    // All estimates zero: every possible light alike.
    let alpha = Estimated::new(&mut buffer, |_| 0.0, |i| i < 2);
    assert!((alpha.probability(0) - 0.5).abs() < f64::EPSILON);
    assert!(
        Estimated::new(&mut buffer, |_| 1.0, |_| false)
            .pick(0.5)
            .is_none()
    );
}

#[test]
fn tables_pick_by_weight() {
    let lights = every_kind(12, 9);
    let table = Discrete::by_power(&lights).expect("power");
    let total: f64 = lights.iter().map(Light::power).sum();
    let all = lights.len();
    for (i, l) in lights.iter().enumerate() {
        // Running sums of 18 terms round by as many ε of the total.
        assert!((table.probability(i) - l.power() / total).abs() < 24.0 * f64::EPSILON);
    }
    let mut rng = SplitMix64::new(8);
    let mut counts = vec![0_u64; all];
    for _ in 0..100_000 {
        counts[table.pick(rng.next_f64()).expect("a light").index] += 1;
    }
    let expected: Vec<f64> = (0..all).map(|i| table.probability(i) * 100_000.0).collect();
    assert!(chi2_test(&counts, &expected, 5.0).p_value > 0.001);
    assert!(Discrete::uniform(0).is_none() && Discrete::new(&[0.0, 0.0]).is_none());
    assert!(Discrete::new(&[1.0, -1.0]).is_none());
}

/// Ceiling and wall lamps of a hall, in clusters of different brightness.
fn hall(n: u32) -> Vec<Light> {
    let mut rng = SplitMix64::new(31);
    (0..n)
        .map(|i| {
            let cluster = f64::from(i % 97);
            let o = DVec3::new(
                40.0 * (cluster * 0.618).fract() + rng.next_f64(),
                40.0 * (cluster * 0.382).fract() + rng.next_f64(),
                4.0 + rng.next_f64(),
            );
            let tilt =
                DVec3::new(rng.in_range(-0.5, 0.5), rng.in_range(-0.5, 0.5), -1.0).normalize();
            let f = Frame::from_normal(tilt);
            let polygon = ConvexPolygon::parallelogram(o, f.x * 0.05, f.y * 0.05).expect("a quad");
            let radiance = DVec3::splat(1.0 + (cluster % 7.0).exp());
            Light::Area(AreaLight {
                polygon,
                emission: Emission::one_sided(radiance),
            })
        })
        .collect()
}

/// Root mean square over receivers of the relative standard deviation of one sample, with half of
/// the clusters in shadow.
fn noise(lights: &[Light], probability: impl Fn(DVec3, DVec3, usize, &[f64]) -> f64) -> f64 {
    let mut rng = SplitMix64::new(41);
    let mut sum = 0.0;
    const RECEIVERS: u32 = 40;
    for _ in 0..RECEIVERS {
        let x = DVec3::new(rng.in_range(0.0, 40.0), rng.in_range(0.0, 40.0), 0.0);
        let n = DVec3::new(rng.in_range(-0.6, 0.6), rng.in_range(-0.6, 0.6), 1.0).normalize();
        let f: Vec<f64> = lights
            .iter()
            .map(|l| unshadowed_at_center(l, &diffuse(x, n)))
            .collect();
        let lit = |i: usize| (i % 97).is_multiple_of(2);
        let (mut mean, mut square) = (0.0, 0.0);
        for (i, &f_i) in f.iter().enumerate().filter(|(i, v)| lit(*i) && **v > 0.0) {
            mean += f_i;
            square += f_i * f_i / probability(x, n, i, &f);
        }
        sum += (square / (mean * mean) - 1.0) / f64::from(RECEIVERS);
    }
    sum.sqrt()
}

#[test]
fn the_tree_is_within_a_tenth_of_the_ideal_error() {
    let lights = hall(10_000);
    let ideal = noise(&lights, |_, _, i, f| f[i] / f.iter().sum::<f64>());
    let power = Discrete::by_power(&lights).expect("power");
    let by_power = noise(&lights, |_, _, i, _| power.probability(i));
    let tree = LightTree::new(&lights);
    let by_tree = noise(&lights, |x, n, i, _| {
        tree.probability(|i| &lights[i], &diffuse(x, n), i)
    });
    assert!(
        by_tree < 1.1 * ideal && by_tree < by_power,
        "ideal {ideal:.3}, tree {by_tree:.3}, power {by_power:.3}"
    );
}
