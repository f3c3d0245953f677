//! Pictures by several estimators, for the same time or the same samples, and how wrong each is.

use super::spec::{Budget, Gallery, StudySpec};
use super::{Targets, all_pixels};
use indicatif::ProgressBar;
use linelit_film::Image;
use linelit_integrator::{Estimator, Renderer, Settings};
use linelit_scene::Scene;
use linelit_study::engine::{Cell, Reference, reference, run_cell, score};

/// One picture of a gallery.
#[derive(Clone, Debug)]
pub(super) struct GalleryPicture {
    /// The estimator.
    pub(super) estimator: Estimator,
    /// Samples at each shading point and light.
    pub(super) samples: u32,
    /// Processor seconds.
    pub(super) cpu_seconds: f64,
    /// Mean relative squared error.
    pub(super) mrse: f64,
    /// Linear radiance.
    pub(super) image: Image,
}

/// Lines in each replicate of the reference.
const REFERENCE_SAMPLES: u32 = 256;
/// Samples by which the cost of a picture is found: what each adds, and what comes before the
/// first.
pub(super) const PROBES: [u32; 2] = [4, 32];

/// Renders the gallery of a study on one scene.
pub(super) fn gallery(
    spec: &StudySpec,
    gallery: &Gallery,
    scene: &mut Scene,
    progress: &ProgressBar,
) -> Vec<GalleryPicture> {
    scene.set_resolution(gallery.width, gallery.height);
    let renderer = Renderer::new(scene);
    let targets = Targets::find(&renderer, &all_pixels(gallery.width, gallery.height));
    let limit = gallery.reference_limit;
    let reference = reference(
        &targets,
        &targets.truth(spec.spheres),
        REFERENCE_SAMPLES,
        0.0,
        limit,
    );
    let one = |estimator: &Estimator| {
        progress.inc(1);
        picture(spec, gallery, &targets, &reference, *estimator)
    };
    gallery.estimators.iter().map(one).collect()
}

fn picture(
    spec: &StudySpec,
    gallery: &Gallery,
    targets: &Targets<'_>,
    reference: &Reference,
    estimator: Estimator,
) -> GalleryPicture {
    let cell = |samples| Cell {
        settings: Settings {
            estimator,
            sampler: gallery.sampler,
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
    GalleryPicture {
        estimator,
        samples,
        cpu_seconds: run.times.seconds(),
        mrse: score(&run, &reference.values, targets.pixels).mrse,
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
