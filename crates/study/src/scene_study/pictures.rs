//! Pictures of a scene: side by side, and points and lines for the same time under a slider.

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

/// A picture, how it is called, what it took and how wrong it is.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Shown {
    /// A few words.
    pub(super) name: String,
    /// Light samples; 0 where the name says it.
    pub(super) samples: u32,
    /// Processor seconds.
    pub(super) seconds: f64,
    /// Mean relative squared error; NaN where it was not asked for.
    pub(super) mrse: f64,
    /// Linear radiance.
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

/// Samples by which the cost of a picture is found: what each adds, and what comes before the
/// first.
const PROBES: [u32; 2] = [4, 32];

/// Samples and trials of the picture that others are held to, where no estimator is without noise.
pub(super) const TRUE_SAMPLES: u32 = 256;
pub(super) const TRUE_TRIALS: u32 = 4;

/// Each of both pictures is timed so often again, in turns, until that many seconds are measured.
const TIMES: u32 = 4;
const TIMED_SECONDS: f64 = 0.5;

/// The processor seconds for which both are timed.
pub(super) const DUEL_SECONDS: f64 = 2.0 * TIMES as f64 * TIMED_SECONDS;

/// The integrals, the study and the size of the pictures of a scene.
struct Easel<'a> {
    targets: &'a Targets<'a>,
    spec: &'a StudySpec,
    size: [u32; 2],
}

impl Easel<'_> {
    /// The settings of an estimator, with the first choice of lights.
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

    fn run(&self, settings: Settings, samples: u32, trials: u32) -> CellRun<Settings> {
        let cell = Cell {
            settings,
            samples,
            seed: self.spec.seed,
            trials,
        };
        run_cell(self.targets, cell)
    }

    /// The samples that fit into the seconds, by the times that [`PROBES`] take.
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

    /// The picture without noise by an estimator that has none, if there is one, else by many
    /// samples.
    fn truth(&self, noiseless: Option<Settings>) -> Shown {
        if let Some(settings) = noiseless {
            return self.show(&self.run(settings, 1, 1), settings.estimator.to_string());
        }
        let settings = self.targets.true_settings(self.spec.spheres);
        let name = format!("{TRUE_TRIALS} × {TRUE_SAMPLES} × {}", settings.estimator);
        self.show(&self.run(settings, TRUE_SAMPLES, TRUE_TRIALS), name)
    }

    /// The mean of the trials.
    fn show(&self, run: &CellRun<Settings>, name: String) -> Shown {
        let mut image = Image::new(self.size[0], self.size[1]);
        for (k, (pixel, _)) in self.targets.points.iter().enumerate() {
            let values = run.trials_of(k);
            let mean = values.iter().copied().sum::<DVec3>() / values.len() as f64;
            #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
            image.set(pixel[0], pixel[1], mean.to_array().map(|v| v as f32));
        }
        Shown {
            image,
            name,
            samples: 0,
            seconds: run.times.seconds(),
            mrse: f64::NAN,
        }
    }
}

/// One picture of the gallery.
pub(super) fn picture(
    spec: &StudySpec,
    gallery: &Gallery,
    targets: &Targets<'_>,
    reference: &Reference,
    settings: Settings,
) -> Shown {
    let easel = Easel {
        targets,
        spec,
        size: [gallery.width, gallery.height],
    };
    let samples = match gallery.budget {
        Budget::Samples(samples) => samples,
        Budget::Seconds(seconds) => easel.fitting(seconds, settings),
    };
    let run = easel.run(settings, samples, 1);
    let mut name = spec.name(&settings);
    if gallery.samplers.len() > 1 {
        name = format!("{name}, {}", settings.sampler);
    }
    Shown {
        samples,
        mrse: score(&run, reference, targets.pixels).mrse,
        ..easel.show(&run, name)
    }
}

/// A scene's best points, its best lines and the picture that both are held to, by what the study
/// found; `None` if it had not both.
pub(super) fn duel(
    spec: &StudySpec,
    wanted: &Duel,
    rows: &[&ResultRow],
    scene: &SceneDescription,
    size: [u32; 2],
) -> Option<Vec<Shown>> {
    // Choose the sampling pattern, and the best of either kind.
    let mut samplers = spec.samplers.iter();
    let stratified = samplers.find(|s| **s == SamplerKind::Stratified);
    let sampler = *stratified.or(spec.samplers.first())?;
    let best = |kind: &str| best(spec, rows, kind, sampler, wanted.samples);
    let renderer = Renderer::new(scene);
    let easel = Easel {
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

/// The comparison of what [`duel`] left; `None` of anything else.
///
/// # Errors
/// [`FilmError`] if a picture has no pixels.
pub(super) fn comparison(shown: &[Shown]) -> Result<Option<Comparison>, FilmError> {
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

/// The estimator of a kind, points or lines, that was the most efficient with this pattern and at
/// least that many samples.
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

/// An estimator that had no noise on any pixel, whatever the samples.
fn noiseless(spec: &StudySpec, rows: &[&ResultRow]) -> Option<Estimator> {
    let never = |e: &&Estimator| {
        let name = e.to_string();
        let mut own = rows.iter().filter(|r| r.estimator == name).peekable();
        own.peek().is_some() && own.all(|r| r.is_noiseless())
    };
    spec.estimators.iter().find(never).copied()
}
