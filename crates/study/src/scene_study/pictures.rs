//! Pictures of a scene for reports: the gallery, and the two pictures under the slider, by points
//! and by lines that took the same time.

use super::spec::{Budget, Duel, Gallery, StudySpec};
use super::{Targets, all_pixels};
use crate::engine::{Cell, CellRun, Reference, run_cell, score};
use crate::report::{Comparison, Named};
use crate::tables::ResultRow;
use linelit_estimators::Estimator;
use linelit_film::{FilmError, Image};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::SceneDescription;
use serde::{Deserialize, Serialize};

/// A picture with its name, cost and error.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct RenderedPicture {
    /// The name, a few words.
    pub(super) name: String,
    /// The number of light samples; 0 where the name states it.
    pub(super) samples: u32,
    /// The processor seconds.
    pub(super) seconds: f64,
    /// The mean relative squared error; NaN where it was not measured.
    pub(super) mrse: f64,
    /// The picture in linear radiance.
    #[serde(with = "Pixels")]
    pub(super) image: Image,
}

/// The fields of an image, for serde.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Image")]
struct Pixels {
    width: u32,
    height: u32,
    rgb: Vec<[f32; 3]>,
}

/// The two numbers of light samples with which a picture is timed to find its cost: the time of
/// each sample, and the set-up before the first.
const PROBES: [u32; 2] = [4, 32];

/// The samples and trials of the true picture, where no estimator is without noise.
pub(super) const TRUE_SAMPLES: u32 = 256;
pub(super) const TRUE_TRIALS: u32 = 4;

/// How many times each of the two pictures is timed again, in turns; a picture that has been timed
/// for [`TIMED_SECONDS`] is not timed again.
const TIMES: u32 = 4;
/// The measured processor seconds after which a picture is not timed again.
const TIMED_SECONDS: f64 = 0.5;

/// The processor seconds for which both pictures together are timed.
pub(super) const DUEL_SECONDS: f64 = 2.0 * TIMES as f64 * TIMED_SECONDS;

/// Renders the pictures of one scene: it has the shading points, the study and the size of the
/// pictures.
struct PictureMaker<'a> {
    targets: &'a Targets<'a>,
    spec: &'a StudySpec,
    size: [u32; 2],
}

impl PictureMaker<'_> {
    /// Returns the settings of an estimator, with the first of the study's choices of lights.
    fn settings(&self, estimator: Estimator, sampler: SamplerKind) -> Settings {
        Settings {
            estimator,
            sampler,
            lights: self.spec.lights[0],
            spheres: self.spec.spheres,
            skip: self.spec.skip,
            ..Settings::default()
        }
    }

    /// Renders some trials of a picture.
    fn run(&self, settings: Settings, samples: u32, trials: u32) -> CellRun<Settings> {
        let cell = Cell {
            settings,
            samples,
            seed: self.spec.seed,
            trials,
        };
        run_cell(self.targets, cell)
    }

    /// Returns the number of samples that fit into some seconds, from the times of [`PROBES`] on a
    /// straight line.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "clamped to the range first"
    )]
    fn fitting(&self, seconds: f64, settings: Settings) -> u32 {
        let [few, many] = PROBES.map(|n| self.run(settings, n, 1).times.seconds());
        let [a, b] = PROBES.map(f64::from);
        let sample = ((many - few) / (b - a)).max(1e-3 * many / b);
        let setup = (few - a * sample).max(0.0);
        ((seconds - setup) / sample).clamp(1.0, 65536.0) as u32
    }

    /// Returns the true picture: by an estimator without noise if there is one, otherwise by many
    /// samples.
    fn truth(&self, noiseless: Option<Settings>) -> RenderedPicture {
        if let Some(settings) = noiseless {
            return self.show(&self.run(settings, 1, 1), settings.estimator.to_string());
        }
        let settings = self.targets.true_settings(self.spec.spheres);
        let name = format!("{TRUE_TRIALS} × {TRUE_SAMPLES} × {}", settings.estimator);
        self.show(&self.run(settings, TRUE_SAMPLES, TRUE_TRIALS), name)
    }

    /// Returns the mean of the trials of a run as a picture with this name.
    fn show(&self, run: &CellRun<Settings>, name: String) -> RenderedPicture {
        let mut image = Image::new(self.size[0], self.size[1]);
        for (k, (pixel, _)) in self.targets.points.iter().enumerate() {
            let values = run.trials_of(k);
            let mean = values.iter().copied().sum::<DVec3>() / values.len() as f64;
            #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
            image.set(pixel[0], pixel[1], mean.to_array().map(|v| v as f32));
        }
        RenderedPicture {
            image,
            name,
            samples: 0,
            seconds: run.times.seconds(),
            mrse: f64::NAN,
        }
    }
}

/// Renders one picture of the gallery.
pub(super) fn picture(
    spec: &StudySpec,
    gallery: &Gallery,
    targets: &Targets<'_>,
    reference: &Reference,
    settings: Settings,
) -> RenderedPicture {
    // Find the number of samples.
    let easel = PictureMaker {
        targets,
        spec,
        size: [gallery.width, gallery.height],
    };
    let samples = match gallery.budget {
        Budget::Samples(samples) => samples,
        Budget::Seconds(seconds) => easel.fitting(seconds, settings),
    };
    // Render, and score.
    let run = easel.run(settings, samples, 1);
    let mut name = spec.name(&settings);
    if gallery.samplers.len() > 1 {
        name = format!("{name}, {}", settings.sampler);
    }
    RenderedPicture {
        samples,
        mrse: score(&run, reference, targets.pixels).mrse,
        ..easel.show(&run, name)
    }
}

/// Renders the best points and the best lines of a study for the same time, and the true picture;
/// `None` if the study has no points or no lines.
pub(super) fn duel(
    spec: &StudySpec,
    wanted: &Duel,
    rows: &[&ResultRow],
    scene: &SceneDescription,
    size: [u32; 2],
) -> Option<Vec<RenderedPicture>> {
    // Choose the sampling pattern, and the best of either kind.
    let mut samplers = spec.samplers.iter();
    let stratified = samplers.find(|s| **s == SamplerKind::Stratified);
    let sampler = *stratified.or(spec.samplers.first())?;
    let best = |kind: &str| best(spec, rows, kind, sampler, wanted.samples);
    let renderer = Renderer::new(scene);
    let easel = PictureMaker {
        targets: &Targets::find(&renderer, &all_pixels(size[0], size[1])),
        spec,
        size,
    };
    let by = |estimator| easel.settings(estimator, sampler);
    // Render lines, and as many points as take the same time.
    let (points, lines) = (by(best("point")?), by(best("line")?));
    let mut right = easel.run(lines, wanted.samples, 1);
    let samples = easel.fitting(right.times.seconds(), points);
    let mut left = easel.run(points, samples, 1);
    for _ in 0..TIMES {
        left.time_again(easel.targets, TIMED_SECONDS);
        right.time_again(easel.targets, TIMED_SECONDS);
    }
    Some(vec![
        easel.show(&left, format!("{samples} × {}", points.estimator)),
        easel.show(&right, format!("{} × {}", wanted.samples, lines.estimator)),
        easel.truth(noiseless(spec, rows).map(by)),
    ])
}

/// Returns the comparison of the three pictures of [`duel`]; `None` of any other number of
/// pictures.
///
/// # Errors
/// [`FilmError`] if a picture has no pixels.
pub(super) fn comparison(shown: &[RenderedPicture]) -> Result<Option<Comparison>, FilmError> {
    let [left, right, truth] = shown else {
        return Ok(None);
    };
    let [left, right, truth] = [left, right, truth].map(|p| Named {
        image: &p.image,
        name: &p.name,
        seconds: p.seconds,
    });
    Comparison::new(left, right, truth).map(Some)
}

/// Returns the estimator whose name begins with `kind` that was the most efficient with this
/// sampler, at the least measured number of samples from `samples` on.
fn best(
    spec: &StudySpec,
    rows: &[&ResultRow],
    kind: &str,
    sampler: SamplerKind,
    samples: u32,
) -> Option<Estimator> {
    let pattern = sampler.to_string();
    let of_kind = |r: &&&ResultRow| {
        r.estimator.starts_with(kind) && r.sampler == pattern && r.samples >= samples
    };
    let row = rows.iter().filter(of_kind).min_by(|a, b| {
        let by_samples = a.samples.cmp(&b.samples);
        by_samples.then(a.cost().total_cmp(&b.cost()))
    })?;
    let mut all = spec.estimators.iter();
    all.find(|e| e.to_string() == row.estimator).copied()
}

/// Returns an estimator of the study that had no noise on any pixel at any number of samples, if
/// there is one.
fn noiseless(spec: &StudySpec, rows: &[&ResultRow]) -> Option<Estimator> {
    let never = |e: &&Estimator| {
        let name = e.to_string();
        let mut own = rows.iter().filter(|r| r.estimator == name).peekable();
        own.peek().is_some() && own.all(|r| r.is_noiseless())
    };
    spec.estimators.iter().find(never).copied()
}
