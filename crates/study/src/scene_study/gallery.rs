//! Pictures by several estimators, for the same time or the same samples, and how wrong each is.

use super::shown::Shown;
use super::spec::{Budget, Gallery, StudySpec};
use super::{Targets, all_pixels};
use crate::engine::{Cell, Design, Job, Reference, run_cell, score};
use linelit_film::Image;
use linelit_integrator::{Estimator, Renderer, Settings};
use linelit_scene::Scene;

/// Samples by which the cost of a picture is found: what each adds, and what comes before the
/// first.
pub(super) const PROBES: [u32; 2] = [4, 32];

/// Calls a function with what the gallery is held to on a scene of its resolution: a job that
/// measures nothing but its reference.
pub(super) fn with_job<T>(
    spec: &StudySpec,
    gallery: &Gallery,
    scene: &Scene,
    call: impl FnOnce(Job<'_, Targets<'_>>) -> T,
) -> T {
    let renderer = Renderer::new(scene);
    let targets = Targets::find(&renderer, &all_pixels(gallery.width, gallery.height));
    let truth = targets.truth(spec.spheres);
    let mut design = Design::new(Vec::new(), Vec::new());
    design.reference_rounds = gallery.reference_rounds;
    call(Job {
        problem: &targets,
        truth: &truth,
        design: &design,
    })
}

/// One picture of the gallery.
pub(super) fn picture(
    spec: &StudySpec,
    gallery: &Gallery,
    targets: &Targets<'_>,
    reference: &Reference,
    estimator: Estimator,
) -> Shown {
    let cell = |samples| Cell {
        settings: Settings {
            estimator,
            sampler: gallery.sampler,
            lights: spec.lights,
            spheres: spec.spheres,
            skip: spec.skip,
            ..Settings::default()
        },
        samples,
        seed: spec.seed,
        trials: 1,
    };
    let samples = match gallery.budget {
        Budget::Samples(samples) => samples,
        Budget::Seconds(seconds) => {
            let cost = |n| run_cell(targets, cell(n)).times.seconds();
            fitting(seconds, PROBES.map(cost))
        }
    };
    let run = run_cell(targets, cell(samples));
    let mut image = Image::new(gallery.width, gallery.height);
    for ((pixel, _), value) in targets.points.iter().zip(&run.values) {
        #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
        image.set(pixel[0], pixel[1], value.to_array().map(|v| v as f32));
    }
    Shown {
        name: estimator.to_string(),
        samples,
        seconds: run.times.seconds(),
        mrse: score(&run, reference, targets.pixels).mrse,
        image,
    }
}

/// The samples that fit into the seconds, by the times that [`PROBES`] took.
#[allow(
    clippy::cast_possible_truncation,
    reason = "clamped to the range first"
)]
pub(super) fn fitting(seconds: f64, [few, many]: [f64; 2]) -> u32 {
    let [a, b] = PROBES.map(f64::from);
    let sample = ((many - few) / (b - a)).max(1e-3 * many / b);
    let setup = (few - a * sample).max(0.0);
    ((seconds - setup) / sample).clamp(1.0, 65536.0) as u32
}
