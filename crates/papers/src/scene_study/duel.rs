//! Points and lines for the same time: two pictures under a slider.

use super::gallery::{PROBES, fitting};
use super::spec::{Duel, StudySpec};
use super::{Targets, all_pixels};
use linelit_estimators::Estimator;
use linelit_film::{FilmError, Image};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::engine::{Cell, CellRun, run_cell};
use linelit_study::report::{Comparison, Named};
use linelit_study::tables::{ResultRow, StudyRecord};

/// Samples and trials of the picture that others are held to, where no estimator is without noise.
const TRUE_SAMPLES: u32 = 256;
const TRUE_TRIALS: u32 = 4;

/// The comparison of a scene's best points with its best lines, by what the study found; `None`
/// if it had not both.
///
/// # Errors
/// [`FilmError`] if a picture has no pixels.
pub(super) fn duel(
    spec: &StudySpec,
    wanted: &Duel,
    label: &str,
    record: &StudyRecord,
    scene: &mut Scene,
    size: [u32; 2],
) -> Result<Option<Comparison>, FilmError> {
    let rows: Vec<&ResultRow> = record.rows.iter().filter(|r| r.scene == label).collect();
    let stratified = spec
        .samplers
        .iter()
        .find(|s| **s == SamplerKind::Stratified);
    let Some(&sampler) = stratified.or(spec.samplers.first()) else {
        return Ok(None);
    };
    let best = |kind: &str| best(spec, &rows, kind, sampler, wanted.samples);
    let (Some(points), Some(lines)) = (best("point"), best("line")) else {
        return Ok(None);
    };
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(scene);
    let easel = Easel {
        targets: Targets::find(&renderer, &all_pixels(size[0], size[1])),
        spec,
        sampler,
        size,
    };
    let right = easel.paint(lines, wanted.samples);
    let cost = |n| easel.run(easel.by(points), n, 1).times.seconds();
    let left = easel.paint(points, fitting(right.seconds, PROBES.map(cost)));
    let truth = easel.truth(noiseless(spec, &rows));
    let all = [&left, &right, &truth].map(|p| Named {
        image: &p.image,
        name: &p.name,
        seconds: p.seconds,
    });
    Comparison::new(all[0], all[1], all[2]).map(Some)
}

/// What pictures of a scene are made with.
struct Easel<'a> {
    targets: Targets<'a>,
    spec: &'a StudySpec,
    sampler: SamplerKind,
    size: [u32; 2],
}

/// A picture, how it is called, and what it took.
struct Painted {
    image: Image,
    name: String,
    seconds: f64,
}

impl Easel<'_> {
    fn by(&self, estimator: Estimator) -> Settings {
        Settings {
            estimator,
            sampler: self.sampler,
            lights: self.spec.lights,
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
        run_cell(&self.targets, cell)
    }

    fn paint(&self, estimator: Estimator, samples: u32) -> Painted {
        let run = self.run(self.by(estimator), samples, 1);
        self.show(&run, format!("{samples} × {estimator}"))
    }

    /// By the estimator without noise, if there is one, else by many samples.
    fn truth(&self, noiseless: Option<Estimator>) -> Painted {
        if let Some(estimator) = noiseless {
            let run = self.run(self.by(estimator), 1, 1);
            return self.show(&run, estimator.to_string());
        }
        let settings = self.targets.true_settings(self.spec.spheres);
        let name = format!("{TRUE_TRIALS} × {TRUE_SAMPLES} × {}", settings.estimator);
        self.show(&self.run(settings, TRUE_SAMPLES, TRUE_TRIALS), name)
    }

    /// The mean of the trials.
    fn show(&self, run: &CellRun<Settings>, name: String) -> Painted {
        let mut image = Image::new(self.size[0], self.size[1]);
        for (k, (pixel, _)) in self.targets.points.iter().enumerate() {
            let values = run.trials_of(k);
            let mean = values.iter().copied().sum::<DVec3>() / values.len() as f64;
            #[allow(clippy::cast_possible_truncation, reason = "the film is f32")]
            image.set(pixel[0], pixel[1], mean.to_array().map(|v| v as f32));
        }
        Painted {
            image,
            name,
            seconds: run.times.seconds(),
        }
    }
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
    let cost = |r: &ResultRow| (r.samples, r.mse * r.cpu_seconds);
    let row = rows.iter().filter(of_kind).min_by(|a, b| {
        let (a, b) = (cost(a), cost(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    })?;
    spec.estimators
        .iter()
        .find(|e| e.to_string() == row.estimator)
        .copied()
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
