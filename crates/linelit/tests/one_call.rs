//! Tests of `Scene` and its builder: the light at points, visible parts of lights, and errors.
#![allow(clippy::float_cmp, reason = "answers are compared bit by bit")]

use linelit::bsdf::{Bsdf, Lambert};
use linelit::estimators::MOST_SAMPLES;
use linelit::geometry::{ConvexPolygon, DVec3, Frame, Margins, vector};
use linelit::lights::{Profile, ProfileKind};
use linelit::shading::polygon;
use linelit::{Error, Estimator, Light, Measure, Scene, SceneBuilder};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::PI;
use std::sync::Arc;

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// A square lamp with sides of 2, at the height 2 over the origin.
fn lamp() -> Light {
    Light::rectangle(
        [-1.0, -1.0, 2.0],
        [0.0, 2.0, 0.0],
        [2.0, 0.0, 0.0],
        [3.0, 2.0, 1.0],
    )
    .expect("a square")
}

/// Random triangles between the floor and the lamp.
fn soup(count: u32, seed: u64) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut positions = Vec::new();
    for _ in 0..count {
        let at = [0, 1, 2].map(|k| match k {
            2 => random.random_range(0.4..1.6_f32),
            _ => random.random_range(-1.2..1.2_f32),
        });
        for _ in 0..3 {
            positions.push(at.map(|x| x + random.random_range(-0.25..0.25_f32)));
        }
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    (positions, triangles)
}

fn points(count: u32, seed: u64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut at = |low: f64, high: f64| random.random_range(low..high);
    let points = (0..count)
        .map(|_| [at(-1.5, 1.5), at(-1.5, 1.5), at(0.0, 0.2)])
        .collect();
    let normals = (0..count)
        .map(|_| [at(-0.5, 0.5), at(-0.5, 0.5), 1.0])
        .collect();
    (points, normals)
}

#[test]
fn an_open_lamp_gives_lamberts_sum_and_half_of_it_behind_a_half_plane() -> Result<(), Error> {
    let Light::Area(area) = lamp() else {
        panic!("a polygon")
    };
    let whole = polygon::irradiance(area.polygon.vertices(), DVec3::Z);
    let open = Scene::builder(&[], &[]).light(lamp()).build()?;
    let wall = [[0.0, -6.0, 1.0], [12.0, 0.0, 1.0], [0.0, 6.0, 1.0]];
    let half = Scene::builder(&wall, &[[0, 1, 2]]).light(lamp()).build()?;
    for (scene, share) in [(open, 1.0), (half, 0.5)] {
        let got = scene.irradiance([0.0; 3], [0.0, 0.0, 7.0])?;
        for (got, radiance) in got.into_iter().zip([3.0, 2.0, 1.0]) {
            // The value is a sum of a dozen terms, each with a few roundings.
            let error = got / (share * radiance * whole) - 1.0;
            assert!(error.abs() < 1e-12, "{error}");
        }
        let lambert = Bsdf::Lambert(Lambert {
            albedo: DVec3::splat(0.5),
        });
        let reflected = scene.radiance([0.0; 3], UP, &lambert, [1.0, 0.0, 1.0])?;
        assert!((reflected[0] / (got[0] * 0.5 / PI) - 1.0).abs() < 1e-12);
        let fraction = scene.visible_fraction([0.0; 3], 0, Measure::Area)?;
        assert!((fraction - share).abs() < 1e-12, "{fraction}");
    }
    Ok(())
}

#[test]
fn exact_answers_agree_with_each_other() -> Result<(), Error> {
    let Light::Area(area) = lamp() else {
        panic!("a polygon")
    };
    let (positions, triangles) = soup(40, 1);
    let builder = Scene::builder(&positions, &triangles).light(lamp());
    let scene = builder.method(Estimator::exact()).build()?;
    let (points, normals) = points(200, 2);
    let mut partial = 0;
    for (&point, &normal) in points.iter().zip(&normals) {
        let x = vector(point);
        let relative: Vec<_> = area.polygon.vertices().iter().map(|v| *v - x).collect();
        let n = vector(normal).normalize();
        let whole = 3.0 * polygon::irradiance(&relative, n);
        let seen = scene.irradiance(point, normal)?[0];
        let fraction = scene.visible_fraction(point, 0, Measure::Cosine(vector(normal)))?;
        // Both are right to 1e-12 of the light. Lifting the point by 1e-14 of its coordinates moves
        // shadows by 1e-14 over the distance of the nearest edges, which is at least a hundredth.
        assert!(
            (seen / whole - fraction).abs() < 1e-10,
            "{seen} {whole} {fraction}"
        );
        partial += u32::from(fraction > 0.05 && fraction < 0.95);
        // The rings have the area of the visible part, and run counter-clockwise as the point sees
        // them.
        let rings = scene.visible_polygons(point, 0)?;
        let twice = |ring: &Vec<[f64; 3]>| -> f64 {
            let next = ring.iter().cycle().skip(1);
            ring.iter()
                .zip(next)
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
                .sum()
        };
        let share = rings.iter().map(twice).sum::<f64>() / 8.0;
        let by_area = scene.visible_fraction(point, 0, Measure::Area)?;
        // The corners are rounded to 1e-15 of their size, and a ring has at most a hundred.
        assert!((share.abs() - by_area).abs() < 1e-9, "{share} {by_area}");
        assert!(
            rings.is_empty() || share < 0.0,
            "the lamp is seen from below: {share}"
        );
    }
    assert!(partial > 100, "{partial}");
    Ok(())
}

#[test]
fn fractions_are_those_of_rays() -> Result<(), Error> {
    let (positions, triangles) = soup(60, 3);
    let scene = Scene::builder(&positions, &triangles)
        .light(lamp())
        .build()?;
    let corner = |i: u32| positions[i as usize].map(f64::from);
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let (points, _) = points(12, 5);
    // 24 comparisons, one false alarm in 10⁴ runs of other seeds.
    let most = 4.6;
    for point in points {
        let (count, x) = (20_000, vector(point));
        // Trace rays to random points of the lamp, and sum the visible and the whole light by area
        // and by solid angle.
        let mut sums = [[0.0_f64; 3]; 2];
        for _ in 0..count {
            let to = [0, 1].map(|_| random.random_range(-1.0..1.0));
            let d = DVec3::new(to[0], to[1], 2.0) - x;
            let hides = |t: &[u32; 3]| hits(x, d, t.map(corner).map(DVec3::from));
            let seen = f64::from(u8::from(!triangles.iter().any(hides)));
            let angle = d.z / d.length().powi(3);
            for (sum, weight) in sums.iter_mut().zip([1.0, angle]) {
                *sum = [
                    sum[0] + weight * seen,
                    sum[1] + weight,
                    sum[2] + weight * weight,
                ];
            }
        }
        for (sum, measure) in sums.into_iter().zip([Measure::Area, Measure::SolidAngle]) {
            let exact = scene.visible_fraction(point, 0, measure)?;
            let [seen, all, squares] = sum;
            // Compare by the variance of a ratio of sums whose weights vary little.
            let sigma = (exact * (1.0 - exact) * squares).sqrt() / all;
            let z = (seen / all - exact) / sigma.max(1e-9);
            assert!(
                z.abs() < most,
                "{measure:?}: {exact} {} z = {z}",
                seen / all
            );
        }
    }
    Ok(())
}

/// Whether the ray x + t d with t in (0, 1) meets a triangle, in `f64`.
fn hits(x: DVec3, d: DVec3, [a, b, c]: [DVec3; 3]) -> bool {
    let (u, v, from) = (b - a, c - a, x - a);
    let (p, q) = (d.cross(v), from.cross(u));
    let volume = u.dot(p);
    let [s, r, t] = [from.dot(p), d.dot(q), v.dot(q)].map(|x| x / volume);
    s >= 0.0 && r >= 0.0 && s + r <= 1.0 && t > 1e-9 && t < 1.0 - 1e-9
}

/// A light of each kind.
fn lights() -> Vec<Light> {
    vec![
        lamp(),
        Light::line([-1.0, 0.5, 1.9], [1.0, 0.4, 1.8], [0.5; 3]),
        Light::point([0.3, 0.2, 1.8], [2.0; 3]),
        Light::distant([0.2, 0.1, 1.0], [1.0; 3]),
        Light::sphere([0.2, -0.4, 2.0], 0.2, [5.0; 3]),
        Light::disk([0.5, 0.5, 2.0], [0.0, 0.0, -1.0], 0.3, [5.0; 3]),
        Light::sky([0.5; 3]),
        Light::sun([0.5, 0.0, 1.0], 0.1, [9.0; 3]),
    ]
}

#[test]
fn every_light_keeps_its_mean_by_hybrid_and_by_points() -> Result<(), Error> {
    let (positions, triangles) = soup(25, 6);
    let (points, normals) = points(3, 7);
    // 24 comparisons, one false alarm in 10⁴ runs of other seeds.
    let most = 4.6;
    for (i, light) in lights().into_iter().enumerate() {
        let build = |method: &str| {
            let builder = Scene::builder(&positions, &triangles).light(light.clone());
            builder
                .method(method.parse().expect("an estimator"))
                .samples(4)
                .build()
        };
        let [hybrid, by_points] = [build("hybrid")?, build("point-area")?];
        for (&point, &normal) in points.iter().zip(&normals) {
            let mut moments = [[0.0_f64; 2]; 2];
            let seeds = 1500;
            for seed in 0..seeds {
                for (scene, moment) in [&hybrid, &by_points].into_iter().zip(&mut moments) {
                    let value = scene.with_seed(seed).irradiance(point, normal)?[0];
                    *moment = [moment[0] + value, moment[1] + value * value];
                }
            }
            let n = f64::from(u32::try_from(seeds).unwrap_or(u32::MAX));
            let [a, b] = moments.map(|[sum, squares]| {
                let mean = sum / n;
                (mean, ((squares / n - mean * mean) / (n - 1.0)).max(0.0))
            });
            // Where an estimate has no noise, both agree to the 1e-9 that `exact` promises.
            let sigma = (a.1 + b.1).sqrt() + 1e-9 * (a.0 + b.0);
            let z = if sigma > 0.0 {
                (a.0 - b.0) / sigma
            } else {
                0.0
            };
            assert!(z.abs() < most, "light {i}: {} {} z = {z}", a.0, b.0);
        }
    }
    Ok(())
}

#[test]
fn answers_depend_on_neither_batch_nor_order_nor_threads() -> Result<(), Error> {
    let (positions, triangles) = soup(300, 8);
    let builder = Scene::builder(&positions, &triangles);
    let builder = lights()
        .into_iter()
        .fold(builder, |builder, light| builder.light(light));
    let scene = builder.seed(11).samples(3).build()?;
    let (points, normals) = points(500, 9);
    let mut whole = vec![[0.0; 3]; points.len()];
    scene.irradiances(&points, &normals, &mut whole)?;
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let again = pool.expect("a pool").install(|| {
            let mut out = vec![[0.0; 3]; points.len()];
            scene.irradiances(&points, &normals, &mut out).map(|()| out)
        });
        assert_eq!(again?, whole, "{threads} threads");
    }
    // Query the points one by one backwards, and then in two calls.
    for i in (0..points.len()).rev().step_by(7) {
        assert_eq!(scene.irradiance(points[i], normals[i])?, whole[i], "{i}");
    }
    let mut part = vec![[0.0; 3]; 123];
    scene.irradiances(&points[300..423], &normals[300..423], &mut part)?;
    assert_eq!(part, whole[300..423]);
    // Another seed gives another estimate.
    let [x, n] = [points[0], normals[0]];
    assert_ne!(scene.with_seed(12).irradiance(x, n)?, whole[0]);
    Ok(())
}

#[test]
fn points_to_prepare_with_keep_the_mean() -> Result<(), Error> {
    let (positions, triangles) = soup(400, 10);
    let mut scene = Scene::builder(&positions, &triangles)
        .light(lamp())
        .build()?;
    let exact = Scene::builder(&positions, &triangles).light(lamp());
    let exact = exact.method(Estimator::exact()).build()?;
    let (points, normals) = points(40, 11);
    scene.prepare(&points, &normals)?;
    let (mut sums, count) = ([0.0_f64; 2], 2000.0);
    let truth = exact.irradiance(points[0], normals[0])?[0];
    for seed in 0..2000 {
        let value = scene.with_seed(seed).irradiance(points[0], normals[0])?[0];
        sums = [sums[0] + value, sums[1] + value * value];
    }
    let mean = sums[0] / count;
    let sigma = ((sums[1] / count - mean * mean) / count).max(0.0).sqrt() + 1e-12 * truth;
    assert!((mean - truth).abs() < 4.0 * sigma, "{mean} {truth} {sigma}");
    Ok(())
}

#[test]
fn of_nothing_there_is_no_share() -> Result<(), Error> {
    // Without occluders, polygons, lines, points and parallel light are wholly visible, unless
    // their measure is zero.
    let builder = lights()
        .into_iter()
        .fold(Scene::builder(&[], &[]), |b, light| b.light(light));
    let scene = builder.build()?;
    let share = |x: [f64; 3], light, measure| scene.visible_fraction(x, light, measure);
    assert!(
        share([5.0, 0.0, 2.0], 0, Measure::Area)?.is_nan(),
        "in the plane"
    );
    let down = Measure::Cosine(-DVec3::Z);
    for light in 0..4 {
        assert!(
            share([0.0; 3], light, down)?.is_nan(),
            "below the horizon: {light}"
        );
        assert_eq!(share([0.0; 3], light, Measure::Area)?, 1.0);
        assert_eq!(share([0.0; 3], light, Measure::Cosine(DVec3::Z))?, 1.0);
    }
    // Disks and spheres are wholly visible, too, by every measure.
    for light in 4..6 {
        for measure in [
            Measure::Area,
            Measure::SolidAngle,
            Measure::Cosine(DVec3::Z),
        ] {
            assert_eq!(share([0.0; 3], light, measure)?, 1.0);
        }
        assert!(share([0.0; 3], light, down)?.is_nan());
    }
    // Cylinders and skies have no exact answer.
    for light in 6..8 {
        assert_eq!(
            share([0.0; 3], light, Measure::Area),
            Err(Error::NotExact(light))
        );
    }
    let rings = scene.visible_polygons([0.0; 3], 0)?;
    assert_eq!((rings.len(), rings[0].len()), (1, 4));
    Ok(())
}

#[test]
fn what_is_far_away_changes_nothing() -> Result<(), Error> {
    let blade = [[-0.2_f32, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]];
    let near = Scene::builder(&blade, &[[0, 1, 2]]).light(lamp()).build()?;
    let mut positions = blade.to_vec();
    positions.push([1e15, 0.0, 0.0]);
    let far = Scene::builder(&positions, &[[0, 1, 2]])
        .light(lamp())
        .build()?;
    let [a, b] = [&near, &far].map(|scene| scene.irradiance([0.0; 3], UP));
    assert_eq!(a?, b?);
    Ok(())
}

#[test]
fn light_without_size_is_visible_or_not_whatever_it_emits() -> Result<(), Error> {
    let narrow = Light::spot([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], [0.1, 0.2], [1.0; 3]);
    let dark = Light::point([0.0, 0.0, 2.0], [0.0; 3]);
    let night = Light::distant(UP, [0.0; 3]);
    let tube = Light::cylinder([-1.0, 0.0, 2.0], [1.0, 0.0, 2.0], 0.1, [1.0; 3]);
    let builder = Scene::builder(&[], &[])
        .light(narrow)
        .light(dark)
        .light(night);
    let scene = builder.light(tube).build()?;
    for light in 0..3 {
        assert_eq!(
            scene.visible_fraction([1.0, 0.0, 0.0], light, Measure::Area)?,
            1.0
        );
    }
    assert!(
        scene
            .visible_fraction([0.0, 0.0, 2.0], 0, Measure::Area)?
            .is_nan()
    );
    // The spot light does not reach this point, but the cylinder does.
    assert!(scene.irradiance([1.0, 0.0, 0.0], UP)?[0] > 0.0);
    let own = scene.visible_fraction([0.0; 3], 3, Measure::Area);
    assert_eq!(own, Err(Error::NotExact(3)));
    // Query a line behind a wall.
    let wall = [[-9.0_f32, -9.0, 1.0], [9.0, -9.0, 1.0], [0.0, 9.0, 1.0]];
    let line = Light::line([-0.1, 0.0, 2.0], [0.1, 0.0, 2.0], [1.0; 3]);
    let hidden = Scene::builder(&wall, &[[0, 1, 2]]).light(line).build()?;
    for measure in [Measure::Area, Measure::Cosine(DVec3::Z)] {
        let share = hidden.visible_fraction([0.0; 3], 0, measure)?;
        assert_eq!(share.to_bits(), 0.0_f64.to_bits(), "not minus zero");
    }
    Ok(())
}

/// Empty slices of points, scenes without triangles and scenes without lights are valid.
#[test]
fn empty_slices_and_empty_scenes_have_answers() -> Result<(), Error> {
    // Take scenes without triangles, with one, and with one that has no area.
    let none: [[f64; 3]; 0] = [];
    let mesh = [[0.0_f32, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    for (positions, triangles) in [
        (&[][..], &[][..]),
        (&mesh[..], &[]),
        (&mesh, &[[0, 1, 2]]),
        (&mesh, &[[0, 0, 0]]),
    ] {
        let dark = Scene::builder(positions, triangles).build()?;
        let lit = dark.with_lights([lamp()])?;
        for mut scene in [
            dark.clone(),
            lit.clone(),
            lit.with_lights([] as [Light; 0])?,
        ] {
            // Query no points, then one.
            scene.irradiances(&none, &none, &mut [])?;
            scene.radiances(&none, &none, &[], &none, &mut [])?;
            assert_eq!(scene.visible_intervals(&none, &[])?.len(), 0);
            scene.prepare(&none, &none)?;
            let light = scene.irradiance([0.1, 0.2, 0.0], UP)?;
            let is_lit = scene
                .visible_fractions(&none, 0, |_| Measure::Area, &mut [])
                .is_ok()
                && light[0] > 0.0;
            assert!(is_lit || light == [0.0; 3], "{light:?}");
        }
        assert!(lit.irradiance([0.1, 0.2, 0.0], UP)?[0] > 0.0);
        assert_eq!(dark.irradiance([0.1, 0.2, 0.0], UP)?, [0.0; 3]);
        let no_light = dark.visible_fraction([0.0; 3], 0, Measure::Area);
        let (light, lights) = (0, 0);
        assert_eq!(no_light, Err(Error::NoLight { light, lights }));
    }
    Ok(())
}

/// Spheres and cylinders emit outwards: inside of them there is no light, by any estimator, and
/// outside there is.
#[test]
fn inside_of_round_lights_there_is_no_light() -> Result<(), Error> {
    let sphere = Light::sphere([0.1, 0.2, 0.3], 0.5, [3.0; 3]);
    let cylinder = Light::cylinder([0.1, 0.2, -0.3], [0.1, 0.2, 1.0], 0.5, [3.0; 3]);
    let inside = [
        [0.1, 0.2, 0.3],
        [0.1, 0.2, 0.3 + 0.25],
        [0.1 + 0.4999, 0.2, 0.3],
        [0.1, 0.2 - 0.499_999_999, 0.3],
    ];
    for (k, light) in [sphere, cylinder].into_iter().enumerate() {
        let scene = Scene::builder(&[], &[]).light(light).build()?;
        for name in [
            "hybrid",
            "point-area",
            "point-visible-area",
            "point-solid-angle",
        ]
        .into_iter()
        .chain(["point-projected-solid-angle", "point-ltc", "point-bsdf"])
        .chain([
            "line-area",
            "line-solid-angle",
            "line-analytic",
            "point-area+point-bsdf",
        ]) {
            let scene = scene.with_method(name.parse().expect("an estimator"), 7)?;
            for n in [UP, [0.0, 1.0, 0.0], [-1.0, 0.3, -0.2]] {
                for x in inside {
                    assert_eq!(scene.irradiance(x, n)?, [0.0; 3], "{k} {name} {x:?} {n:?}");
                }
            }
            // Facing it from outside; points may miss the lower half of a small light.
            let seeds = (0..16).map(|seed| scene.with_seed(seed));
            let outside = [-0.6, 0.2, 0.3];
            let light = seeds.map(|s| s.irradiance(outside, [1.0, 0.0, 0.0]).map(|e| e[0]));
            let sum: f64 = light.collect::<Result<Vec<_>, _>>()?.iter().sum();
            assert!(sum > 0.0 && sum.is_finite(), "{k} {name} {sum}");
        }
    }
    Ok(())
}

#[test]
fn bad_settings_are_refused() {
    // At the bounds and beyond.
    let most = MOST_SAMPLES;
    for (samples, refused) in [
        (0, false),
        (most, false),
        (most + 1, true),
        (u32::MAX, true),
    ] {
        let wrong = refused.then_some(Error::Samples(samples));
        let scene = Scene::builder(&[], &[]).light(lamp());
        assert_eq!(scene.clone().samples(samples).build().err(), wrong);
        let scene = scene.build().expect("a scene");
        assert_eq!(scene.with_method(Estimator::hybrid(), samples).err(), wrong);
    }
    let text = Error::Samples(most + 1).to_string();
    assert_eq!(text, "16777217 samples are more than 16777216");
    let build = |set: fn(SceneBuilder<'static>) -> SceneBuilder<'static>| {
        set(Scene::builder(&[], &[]).light(lamp())).build().err()
    };
    assert_eq!(build(|b| b.surface_offset(f64::NAN)), Some(Error::Setting));
    assert_eq!(build(|b| b.surface_offset(-1.0)), Some(Error::Setting));
    assert_eq!(
        build(|b| b.margins(Margins {
            point: f64::NAN,
            light: 0.0
        })),
        Some(Error::Setting)
    );
    assert_eq!(
        build(|b| b.margins(Margins {
            point: 0.0,
            light: 1.0
        })),
        Some(Error::Setting)
    );
    assert_eq!(build(|b| b.margins(Margins::NONE)), None);
    let power = || {
        Arc::new(Profile::new(
            ProfileKind::CosinePower(2.0),
            Frame::from_normal(DVec3::Z),
        ))
    };
    let early = Scene::builder(&[], &[])
        .profile(power())
        .light(lamp())
        .build()
        .err();
    assert_eq!(early, Some(Error::Profile(0)));
    let point = Scene::builder(&[], &[])
        .light(lights()[2].clone())
        .profile(power())
        .build();
    assert_eq!(point.err(), Some(Error::Profile(0)));
}

#[test]
fn a_hole_in_a_shadow_is_a_ring_of_its_own() -> Result<(), Error> {
    // A small triangle amid the lamp.
    let positions = [[-0.1, -0.1, 1.0], [0.1, -0.1, 1.0], [0.0, 0.1, 1.0]];
    let scene = Scene::builder(&positions, &[[0, 1, 2]])
        .light(lamp())
        .build()?;
    let mut counts: Vec<_> = scene
        .visible_polygons([0.0; 3], 0)?
        .iter()
        .map(Vec::len)
        .collect();
    counts.sort_unstable();
    assert_eq!(counts, [3, 4]);
    Ok(())
}

#[test]
fn bad_input_is_refused_with_its_number() {
    let good = [[0.0_f32, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let build = |positions: &[[f32; 3]], triangles: &[[u32; 3]], light: Light| {
        Scene::builder(positions, triangles)
            .light(lamp())
            .light(light)
            .build()
            .err()
    };
    // Vertices that are not finite, and triangles with a vertex that does not exist.
    let mut bad = good;
    bad[1][2] = f32::NAN;
    assert_eq!(build(&bad, &[[0, 1, 2]], lamp()), Some(Error::Vertex(1)));
    bad[1][2] = f32::INFINITY;
    assert_eq!(build(&bad, &[], lamp()), Some(Error::Vertex(1)));
    let missing = Error::Triangle {
        triangle: 1,
        vertex: 3,
        vertices: 3,
    };
    assert_eq!(build(&good, &[[0, 1, 2], [0, 3, 1]], lamp()), Some(missing));
    // Lights with a position, an emission, a size or a direction that is not valid.
    let no_lights = [
        Light::point([0.0, f64::NAN, 0.0], [1.0; 3]),
        Light::point([0.0; 3], [1.0, -1.0, 1.0]),
        Light::sphere([0.0; 3], 0.0, [1.0; 3]),
        Light::sphere([0.0; 3], -1.0, [1.0; 3]),
        Light::disk([0.0; 3], [0.0; 3], 1.0, [1.0; 3]),
        Light::line([1.0; 3], [1.0; 3], [1.0; 3]),
        Light::distant([0.0; 3], [1.0; 3]),
        Light::sky([f64::INFINITY; 3]),
        Light::sun(UP, 2.0, [1.0; 3]),
        Light::sun(UP, 0.0, [1.0; 3]),
    ];
    for (k, light) in no_lights.into_iter().enumerate() {
        assert_eq!(build(&good, &[], light), Some(Error::Light(1)), "{k}");
    }
    // Lights without an exact irradiance, and a range of triangles that do not exist.
    for light in &lights()[4..] {
        let builder = Scene::builder(&good, &[]).light(light.clone());
        let error = builder.method(Estimator::exact()).build().err();
        assert_eq!(error, Some(Error::NotExact(0)));
    }
    let of_none = Scene::builder(&good, &[[0, 1, 2]])
        .light_of(lamp(), 0..2)
        .build()
        .err();
    assert_eq!(of_none, Some(Error::LightTriangles(0)));
}

#[test]
fn bad_queries_are_refused_with_their_number() {
    let mesh = [[0.0_f32, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let scene = Scene::builder(&mesh, &[[0, 1, 2]])
        .light(lamp())
        .build()
        .expect("a scene");
    assert_eq!(
        scene.irradiance([f64::NAN, 0.0, 0.0], UP),
        Err(Error::Point(0))
    );
    assert_eq!(scene.irradiance([1e19, 0.0, 0.0], UP), Err(Error::Point(0)));
    assert_eq!(scene.irradiance([0.0; 3], [0.0; 3]), Err(Error::Normal(0)));
    let lambert = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    let radiance = scene.radiance([0.0; 3], UP, &lambert, [f64::NAN; 3]);
    assert_eq!(radiance, Err(Error::Outgoing(0)));
    let no_light = Error::NoLight {
        light: 1,
        lights: 1,
    };
    assert_eq!(
        scene.visible_fraction([0.0; 3], 1, Measure::Area),
        Err(no_light)
    );
    assert_eq!(scene.visible_polygons([0.0; 3], 1), Err(no_light));
    let down = Measure::Cosine(DVec3::ZERO);
    assert_eq!(
        scene.visible_fraction([0.0; 3], 0, down),
        Err(Error::Normal(0))
    );
    // In a slice, the error is the first of several, with its number.
    let mut points = vec![[0.0; 3]; 500];
    let (normals, mut out) = (vec![UP; 500], vec![[0.0; 3]; 500]);
    points[433][1] = f64::NAN;
    points[217][0] = f64::NEG_INFINITY;
    assert_eq!(
        scene.irradiances(&points, &normals, &mut out),
        Err(Error::Point(217))
    );
    let short = Error::Length {
        of: "normals",
        points: 500,
        found: 499,
    };
    assert_eq!(
        scene.irradiances(&points, &normals[1..], &mut out),
        Err(short)
    );
    let message = short.to_string();
    assert_eq!(message, "499 normals for 500 points");
    let mut fractions = [0.0; 500];
    let fractions = scene.visible_fractions(&points, 0, |_| Measure::Area, &mut fractions);
    assert_eq!(fractions, Err(Error::Point(217)));
}

#[test]
fn a_light_that_is_a_part_of_the_mesh_is_not_hidden_by_itself() -> Result<(), Error> {
    let corners = [
        [-1.0_f32, -1.0, 2.0],
        [-1.0, 1.0, 2.0],
        [1.0, 1.0, 2.0],
        [1.0, -1.0, 2.0],
    ];
    let polygon = ConvexPolygon::new(&corners).expect("a square");
    let own = Scene::builder(&corners, &[[0, 1, 2], [0, 2, 3]]);
    let own = own.light_of(lamp(), 0..2).build()?;
    let bare = Scene::builder(&[], &[]).light(lamp()).build()?;
    let x = [0.3, 0.2, 0.0];
    assert_eq!(own.visible_fraction(x, 0, Measure::SolidAngle)?, 1.0);
    let [a, b] = [own.irradiance(x, UP)?[0], bare.irradiance(x, UP)?[0]];
    assert!((a / b - 1.0).abs() < 1e-13, "{a} {b} {polygon:?}");
    Ok(())
}

#[test]
fn other_lights_and_methods_on_the_same_triangles_answer_as_built_with_them() -> Result<(), Error> {
    let (positions, triangles) = soup(60, 21);
    let (points, normals) = points(50, 22);
    let bare = Scene::builder(&positions, &triangles).build()?;
    let lights = [lamp(), Light::sphere([0.0, 1.0, 3.0], 0.5, [2.0; 3])];
    for method in ["hybrid", "point-area", "line-analytic"] {
        let method: Estimator = method.parse().expect("an estimator");
        let mut builder = Scene::builder(&positions, &triangles)
            .method(method)
            .samples(8);
        for light in lights.clone() {
            builder = builder.light(light);
        }
        let built = builder.build()?;
        // Set the lights or the method first: `hybrid` measures the lights in both cases.
        let lit_first = bare.with_lights(lights.clone())?.with_method(method, 8)?;
        let lit_last = bare.with_method(method, 8)?.with_lights(lights.clone())?;
        for (&point, &normal) in points.iter().zip(&normals) {
            let want = built.irradiance(point, normal)?;
            assert_eq!(lit_first.irradiance(point, normal)?, want);
            assert_eq!(lit_last.irradiance(point, normal)?, want);
        }
    }
    let exact = bare.with_method(Estimator::exact(), 1)?;
    let refused = exact.with_lights(lights.clone()).map(|_| ());
    assert_eq!(refused, Err(Error::NotExact(1)));
    let lit = bare.with_lights(lights)?;
    let refused = lit.with_method(Estimator::exact(), 1).map(|_| ());
    assert_eq!(refused, Err(Error::NotExact(1)));
    Ok(())
}

#[test]
fn intervals_of_lines_are_what_rays_see() -> Result<(), Error> {
    // Find the visible intervals of random lines.
    let (positions, triangles) = soup(60, 23);
    let scene = Scene::builder(&positions, &triangles).build()?;
    let (points, ends) = (points(300, 24).0, points(600, 25).0);
    let up = |[x, y, _]: [f64; 3]| [x, y, 2.0];
    let lines: Vec<_> = ends.chunks(2).map(|e| [up(e[0]), up(e[1])]).collect();
    let visible = scene.visible_intervals(&points, &lines)?;
    let (mut near, mut hidden) = (0, 0);
    for (i, (point, line)) in points.iter().zip(&lines).enumerate() {
        let alone = scene.visible_intervals(&[*point], &[*line])?;
        assert_eq!(alone.line(0), visible.line(i));
        // Compare them with rays to points of the line that are not next to an end of an interval.
        for k in 0..64 {
            let t = (f64::from(k) + 0.5) / 64.0;
            let ends = visible.line(i).iter().flat_map(|part| [part.lo, part.hi]);
            if ends.into_iter().any(|end| (end - t).abs() < 1e-6) {
                near += 1;
                continue;
            }
            let at = vector(line[0]).lerp(vector(line[1]), t);
            let beam = scene.with_lights([Light::point(at, [1.0; 3])])?;
            let seen = beam.visible_fraction(*point, 0, Measure::Area)? > 0.5;
            let inside = visible
                .line(i)
                .iter()
                .any(|part| part.lo < t && t < part.hi);
            assert_eq!(seen, inside, "{i} {t}");
            hidden += u32::from(!seen);
        }
    }
    assert!(near < 10 && hidden > 2_000, "{near} {hidden}");
    assert_eq!(
        scene.visible_intervals(&points, &lines[1..]).map(|_| ()),
        Err(Error::Length {
            of: "lines",
            points: 300,
            found: 299,
        })
    );
    // A line that is not finite is an error.
    let nan = [[[f64::NAN; 3]; 2]];
    assert_eq!(
        scene.visible_intervals(&points[..1], &nan).map(|_| ()),
        Err(Error::Point(0))
    );
    Ok(())
}
