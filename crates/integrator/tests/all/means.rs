//! The mean light of a picture is right for every combination, to two parts in ten thousand.

use crate::common::{
    CLUTTER, MIXES, ON_THE_FLOOR, PHONG, QUAD_AND_SPHERE, SQUARE, THROUGH_THE_FLOOR, TOUCHING,
    TRIANGLE, clear_of_the_light, microfacets, room, room_with_floor, settings,
};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use linelit_testkit::{chi2::sidak, ztest::critical_z};

/// The largest relative difference that is allowed.
const ALLOWED: f64 = 2e-4;

/// The mean over the picture and its standard error; each seed takes the next point.
fn mean(scene: &SceneDescription, name: &str, samples: u32, seeds: u64) -> (f64, f64) {
    let renderer = Renderer::new(scene);
    let all = clear_of_the_light(&renderer);
    let mut workspace = Workspace::new();
    let mut picture = |seed: u64| -> f64 {
        let settings = Settings {
            sampler: SamplerKind::Sobol,
            ..settings(name, samples, seed)
        };
        let direct = |(pixel, point): &([u32; 2], _)| {
            renderer.direct(&settings, point, *pixel, &mut workspace)
        };
        all.iter().map(direct).sum::<DVec3>().element_sum()
    };
    let values: Vec<f64> = (0..seeds).map(|k| picture(1 + k)).collect();
    let n = seeds as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, (square / (n * (n - 1.0))).sqrt())
}

/// Compares every combination on one scene with `truth`.
fn agree(scene: &SceneDescription, truth: (f64, f64)) {
    // The reference has an error, too. The difference may exceed its limit by the deviation that a
    // z test at 1 % over all ten scenes allows.
    let z = critical_z(sidak(0.01, MIXES.len() * 10));
    for name in MIXES {
        let (mut samples, seeds) = (512, 16);
        let (mut got, mut error) = mean(scene, name, samples, seeds);
        // Take more samples, until the error is small compared with the limit.
        while error > 0.25 * ALLOWED * got && samples < 1 << 17 {
            samples *= 4;
            (got, error) = mean(scene, name, samples, seeds);
        }
        let is_likely = (got - truth.0).abs() <= z * error.hypot(truth.1);
        let relative = (got / truth.0 - 1.0).abs();
        assert!(
            error <= 0.25 * ALLOWED * got && relative <= ALLOWED && is_likely,
            "{name}: {got} +- {error}, reference {truth:?}, {samples} samples: {relative:e}"
        );
    }
}

/// The closed form has no noise, except where a shaft has too many triangles for it.
fn agree_with_exact(scene: &SceneDescription) {
    let truth = mean(scene, "exact", 1 << 11, 16);
    agree(scene, truth);
}

#[test]
#[ignore = "long: minutes"]
fn diffuse_scenes() {
    for light in [SQUARE, TRIANGLE] {
        agree_with_exact(&room(light, CLUTTER));
    }
    agree_with_exact(&room(SQUARE, ""));
    agree_with_exact(&room(SQUARE, QUAD_AND_SPHERE));
    agree_with_exact(&room(SQUARE, TOUCHING));
}

#[test]
#[ignore = "long: minutes"]
fn lights_at_the_floor() {
    for light in [ON_THE_FLOOR, THROUGH_THE_FLOOR] {
        agree_with_exact(&room(light, CLUTTER));
    }
}

#[test]
#[ignore = "long: minutes"]
fn glossy_floors() {
    agree_with_exact(&room_with_floor(PHONG));
    for alpha in [0.3, 0.05] {
        let scene = room_with_floor(&microfacets(alpha));
        // Without a closed form: points by solid angle, with 32 times as many samples as most of
        // the others.
        agree(&scene, mean(&scene, "point-solid-angle", 1 << 14, 16));
    }
}
