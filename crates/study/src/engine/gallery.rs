//! Pictures by several estimators, for the same time or the same samples, and how wrong each is.

use super::{Cell, Reference, Targets, run_cell, score};
use crate::spec::{Budget, Gallery, StudySpec};
use indicatif::ProgressBar;
use linelit_film::Image;
use linelit_integrator::{Estimator, Renderer, Settings};
use linelit_scene::Scene;

/// One picture of a gallery.
#[derive(Clone, Debug)]
pub struct GalleryPicture {
    /// The estimator.
    pub estimator: Estimator,
    /// Samples at each shading point and light.
    pub samples: u32,
    /// Processor seconds.
    pub cpu_seconds: f64,
    /// Mean relative squared error.
    pub mrse: f64,
    /// Linear radiance.
    pub image: Image,
}

/// Lines in each replicate of the reference.
const REFERENCE_SAMPLES: u32 = 256;
/// Samples by which the cost of a picture is found: what each adds, and what comes before the
/// first.
const PROBES: [u32; 2] = [4, 32];

/// Renders the gallery of a study on one scene.
pub(super) fn gallery(
    spec: &StudySpec,
    gallery: &Gallery,
    scene: &mut Scene,
    progress: &ProgressBar,
) -> Vec<GalleryPicture> {
    scene.set_resolution(gallery.width, gallery.height);
    let renderer = Renderer::new(scene);
    let pixels: Vec<[u32; 2]> = (0..gallery.height)
        .flat_map(|y| (0..gallery.width).map(move |x| [x, y]))
        .collect();
    let targets = Targets::find(&renderer, &pixels);
    let limit = gallery.reference_limit;
    let reference = super::reference(&renderer, &targets, REFERENCE_SAMPLES, 0.0, limit);
    let one = |estimator: &Estimator| {
        progress.inc(1);
        picture(spec, gallery, &renderer, &targets, &reference, *estimator)
    };
    gallery.estimators.iter().map(one).collect()
}

fn picture(
    spec: &StudySpec,
    gallery: &Gallery,
    renderer: &Renderer<'_>,
    targets: &Targets,
    reference: &Reference,
    estimator: Estimator,
) -> GalleryPicture {
    let cell = |samples| Cell {
        settings: Settings {
            estimator,
            sampler: gallery.sampler,
            samples,
            seed: spec.seed,
            skip: spec.skip,
            show_lights: false,
            ..Settings::default()
        },
        trials: 1,
    };
    let samples = match gallery.budget {
        Budget::Samples(samples) => samples,
        Budget::Seconds(seconds) => {
            let cost = |n| run_cell(renderer, targets, cell(n)).times.seconds();
            fitting(seconds, PROBES.map(cost))
        }
    };
    let run = run_cell(renderer, targets, cell(samples));
    let mut image = Image::new(gallery.width, gallery.height);
    for ((pixel, _), value) in targets.points.iter().zip(&run.values) {
        #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
        image.set(pixel[0], pixel[1], value.to_array().map(|v| v as f32));
    }
    GalleryPicture {
        estimator,
        samples,
        cpu_seconds: run.times.seconds(),
        mrse: score(&run, reference, targets).mrse,
        image,
    }
}

/// The samples that fit into the seconds, by the times that [`PROBES`] took.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the range first"
)]
fn fitting(seconds: f64, [few, many]: [f64; 2]) -> u32 {
    let [a, b] = PROBES.map(f64::from);
    let each = ((many - few) / (b - a)).max(1e-3 * many / b);
    let first = (few - a * each).max(0.0);
    ((seconds - first) / each).clamp(1.0, 65536.0) as u32
}
