//! The light at a point of a scene is compared with sums over the lights, and the parts of a scene
//! that an estimator does without are tested.
#![allow(clippy::unwrap_used, reason = "tests")]

use linelit_direct::bsdf::{Bsdf, Lambert};
use linelit_direct::estimators::{
    Buffers, Estimator, Query, RandomNumbers, ShadingPoint, estimate,
};
use linelit_direct::geometry::DVec3;
use linelit_direct::lights::Light;
use linelit_direct::samplers::SamplerKind;
use linelit_direct::visibility::{BuildOptions, Occluders};
use linelit_direct::{
    Illumination, LightChoice, Luminaire, Luminaires, PROBES, SampleNames, Settings, Workspace,
    needs_occlusion, needs_shafts, points_on, probe,
};
use std::sync::Arc;

/// Slats between a floor and its lamps, and a bumpy sheet to one side.
fn slats() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..7_u16 {
        let x = -0.9 + 0.3 * f32::from(k);
        let first = u32::from(k) * 4;
        positions.extend([[x, -1.0, 0.9], [x + 0.12, -1.0, 1.0]]);
        positions.extend([[x + 0.12, 1.0, 1.0], [x, 1.0, 0.9]]);
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    const SIDE: u16 = 24;
    let first = u32::try_from(positions.len()).unwrap();
    for (i, j) in (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|k| f32::from(k) / f32::from(SIDE));
        positions.push([0.3 + 0.4 * x, 0.4 * y, 0.5 + 0.2 * x * (1.0 - x) * y]);
    }
    let side = u32::from(SIDE);
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        let corner = |i, j| first + i * (side + 1) + j;
        let [a, b, c, d] = [
            corner(i, j),
            corner(i + 1, j),
            corner(i + 1, j + 1),
            corner(i, j + 1),
        ];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    (positions, triangles)
}

/// Five lamps of different size and brightness, the last below the floor.
fn lamps() -> Vec<Luminaire> {
    let heights = [2.0, 1.5, 2.5, 2.0, -1.0];
    let lamp = |(i, z): (u32, f64)| {
        let (x, size) = (-1.0 + 0.5 * f64::from(i), 0.2 + 0.1 * f64::from(i));
        let radiance = [1.0 + f64::from(i), 2.0, 0.5];
        let light = Light::rectangle([x, -0.3, z], [0., size, 0.], [size, 0., 0.], radiance);
        Luminaire::new(i, Arc::new(light.unwrap()))
    };
    (0..).zip(heights).map(lamp).collect()
}

fn floor(x: f64, y: f64) -> ShadingPoint {
    let white = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    ShadingPoint::new(DVec3::new(x, y, 0.0), DVec3::Z, DVec3::Z, white)
}

#[test]
fn groups_of_lights_that_cannot_reach_a_point_change_no_bit() {
    // Lamps that shine upwards, downwards and sideways, above and below the floor.
    let lamp = |i: u32| {
        let at = [0.618_034, 0.754_878, 0.569_840].map(|turn| (f64::from(i) * turn).fract());
        let [x, y, z] = at.map(|share| 4.0 * share - 2.0);
        // A third of them, which are neighbours, are below the floor, as are some of the others.
        let at = [x, y, if (20..40).contains(&i) { z - 2.5 } else { z }];
        let ([u, v], side) = ([[0.0, 0.3, 0.0], [0.2, 0.0, 0.1]], i as usize / 5 % 3);
        let sides = [[u, v], [v, u], [u, [0.0, 0.1, 0.4]]];
        let [u, v] = sides[side];
        let light = Light::rectangle(at, u, v, [1.0; 3]);
        Luminaire::new(i, Arc::new(light.unwrap()))
    };
    let lights = Luminaires::new((0..60).map(lamp).collect(), 60);
    let (positions, triangles) = slats();
    let occluders = Occluders::build(&positions, &triangles);
    let (mut workspace, estimator) = (Workspace::new(), "point-area".parse().unwrap());
    let mut left_out = 0;
    for k in 0..200_u32 {
        let (x, y) = (
            f64::from(k % 20) / 10.0 - 1.0,
            f64::from(k / 20) / 5.0 - 1.0,
        );
        let names = SampleNames::of_pixel([k, 0]);
        let [skipping, all] = [true, false].map(|skip| {
            let settings = Settings {
                skip,
                ..Settings::new(&estimator, 2)
            };
            let illumination = Illumination {
                occluders: &occluders,
                lights: &lights,
                settings,
            };
            illumination.radiance(&floor(x, y), names, &mut workspace)
        });
        assert_eq!(skipping, all, "{x} {y}");
        let counts = workspace.take_counts().plan;
        // Each pair is counted once, also if it is left out with its group.
        assert_eq!(counts.point_lights, 60);
        left_out += counts.groups_left_out;
    }
    assert!(left_out > 0, "groups are left out");
}

#[test]
fn the_light_at_a_point_is_the_sum_of_the_estimates_of_its_lights() {
    let (positions, triangles) = slats();
    let occluders = Occluders::build(&positions, &triangles);
    let lights = Luminaires::new(lamps(), 5);
    let mut workspace = Workspace::new();
    for estimator in ["point-area", "line-analytic", "exact", "hybrid"] {
        let estimator: Estimator = estimator.parse().unwrap();
        let settings = Settings::new(&estimator, 4);
        let illumination = Illumination {
            occluders: &occluders,
            lights: &lights,
            settings,
        };
        for k in 0..20 {
            let point = floor(-0.8 + 0.08 * f64::from(k), 0.1);
            let pixel = [k, 3];
            let mut sum = DVec3::ZERO;
            for light in lights.as_slice() {
                let (source, mut buffers) = (light.source(), Buffers::default());
                if !source.reaches(&point, &mut buffers.counts.plan) {
                    continue;
                }
                let numbers = RandomNumbers::new(SamplerKind::Auto, 0, pixel, light.index);
                let mut query = Query::new(&occluders, &source, &point, &estimator, numbers, 4);
                query.margins = light.margins;
                sum += estimate(&query, &mut buffers);
            }
            let names = SampleNames::of_pixel(pixel);
            let found = illumination.radiance(&point, names, &mut workspace);
            assert_eq!(found, sum, "{estimator} at {k}");
        }
    }
}

#[test]
fn estimators_that_need_no_shafts_have_the_same_bits_without_them() {
    let (positions, triangles) = slats();
    let whole = Occluders::build(&positions, &triangles);
    let for_rays = Occluders::build_for_rays(&positions, &triangles);
    assert!(for_rays.memory() < whole.memory(), "nothing was left out");
    let lights = Luminaires::new(lamps(), 5);
    let all = [
        "point-area",
        "point-solid-angle",
        "line-analytic",
        "exact",
        "hybrid",
    ];
    let mut without = 0;
    for text in all {
        let estimator: Estimator = text.parse().unwrap();
        if needs_shafts(&estimator) {
            continue;
        }
        without += 1;
        let mut workspace = Workspace::new();
        let mut light = |occluders| {
            let settings = Settings::new(&estimator, 16);
            let lights = &lights;
            let illumination = Illumination {
                occluders,
                lights,
                settings,
            };
            let names = SampleNames::of_pixel([7, 1]);
            illumination.radiance(&floor(0.1, 0.2), names, &mut workspace)
        };
        assert_eq!(light(&whole), light(&for_rays), "{text}");
    }
    assert_eq!(without, 2, "points with a shadow ray each");
}

#[test]
fn statistics_of_occlusion_change_only_the_estimates_of_estimators_that_need_them() {
    let (positions, triangles) = slats();
    let occluders = Occluders::build_with(&positions, &triangles, BuildOptions::default());
    let corners = |t: &[u32; 3]| t.map(|i| DVec3::from_array(positions[i as usize].map(f64::from)));
    let points = PROBES.map(|count| {
        let points = points_on(corners, &triangles, count);
        let white = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
        let point = |[p, n]: [DVec3; 2]| {
            let n = n.normalize();
            ShadingPoint::new(p - DVec3::Z, n, n, white.clone())
        };
        points.into_iter().map(point).collect::<Vec<_>>()
    });
    let (plain, mut probed) = (lamps(), lamps());
    let points = points.each_ref().map(Vec::as_slice);
    probe(&occluders, &mut probed, points, &mut Workspace::new());
    let differ = plain
        .iter()
        .zip(&probed)
        .any(|(a, b)| a.occlusion != b.occlusion);
    assert!(differ, "slats hide parts of the lamps");
    let [plain, probed] = [plain, probed].map(|lights| Luminaires::new(lights, 5));
    for (text, needed) in [
        ("point-area", false),
        ("point-solid-angle", false),
        ("exact", true),
        ("line-analytic", true),
        ("hybrid", true),
    ] {
        let estimator: Estimator = text.parse().unwrap();
        assert_eq!(needs_occlusion(&estimator), needed, "{text}");
        let light = |lights| {
            let illumination = Illumination {
                occluders: &occluders,
                lights,
                settings: Settings::new(&estimator, 2),
            };
            let names = SampleNames::of_pixel([7, 1]);
            illumination.radiance(&floor(0.1, 0.2), names, &mut Workspace::new())
        };
        if !needed {
            assert_eq!(light(&plain), light(&probed), "{text}");
        }
    }
}

#[test]
fn choices_among_lights_have_names_that_they_are_read_by() {
    for name in [
        "all",
        "one:uniform",
        "one:power",
        "one:estimate",
        "one:exact",
        "one:centre",
        "tree",
    ] {
        let choice: LightChoice = name.parse().unwrap();
        assert_eq!(choice.to_string(), name);
    }
    let error = "one:best".parse::<LightChoice>().unwrap_err();
    assert!(
        error.starts_with("lights `one:best`; expected one of all, one:uniform"),
        "{error}"
    );
}
