//! Points and lines for the same time: two pictures under a slider.

use super::gallery::{PROBES, fitting};
use super::shown::Shown;
use super::spec::{Duel, StudySpec};
use super::{Targets, all_pixels};
use crate::engine::{Cell, CellRun, run_cell};
use crate::report::{Comparison, Named};
use crate::tables::ResultRow;
use linelit_elementary::{ln, pow};
use linelit_estimators::Estimator;
use linelit_film::{FilmError, Image};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;

/// Samples and trials of the picture that others are held to, where no estimator is without noise.
const TRUE_SAMPLES: u32 = 256;
const TRUE_TRIALS: u32 = 4;

/// Each of both pictures is timed so often again, in turns, until that many seconds are measured.
const TIMES: u32 = 4;
const TIMED_SECONDS: f64 = 0.5;

/// A scene's best points, its best lines and the picture that both are held to, by what the study
/// found; `None` if it had not both.
pub(super) fn duel(
    spec: &StudySpec,
    wanted: &Duel,
    rows: &[ResultRow],
    scene: &Scene,
    size: [u32; 2],
) -> Option<Vec<Shown>> {
    let rows: Vec<&ResultRow> = rows.iter().collect();
    let stratified = spec
        .samplers
        .iter()
        .find(|s| **s == SamplerKind::Stratified);
    let sampler = *stratified.or(spec.samplers.first())?;
    let best = |kind: &str| best(spec, &rows, kind, sampler, wanted.samples);
    let (points, lines) = (best("point")?, best("line")?);
    let renderer = Renderer::new(scene);
    let easel = Easel {
        targets: Targets::find(&renderer, &all_pixels(size[0], size[1])),
        spec,
        sampler,
        size,
    };
    let mut right = easel.run(easel.by(lines), wanted.samples, 1);
    let samples = as_long(&rows, sampler, [points, lines], wanted.samples).unwrap_or_else(|| {
        let cost = |n| easel.run(easel.by(points), n, 1).times.seconds();
        fitting(right.times.seconds(), PROBES.map(cost))
    });
    let mut left = easel.run(easel.by(points), samples, 1);
    for _ in 0..TIMES {
        left.time_again(&easel.targets, TIMED_SECONDS);
        right.time_again(&easel.targets, TIMED_SECONDS);
    }
    let left = easel.show(&left, format!("{samples} × {points}"));
    let right = easel.show(&right, format!("{} × {lines}", wanted.samples));
    let truth = easel.truth(noiseless(spec, &rows));
    Some(vec![left, right, truth])
}

/// The comparison of what [`duel`] left; `None` of anything else.
///
/// # Errors
/// [`FilmError`] if a picture has no pixels.
pub(super) fn comparison(shown: &[Shown]) -> Result<Option<Comparison>, FilmError> {
    let [left, right, truth] = shown else {
        return Ok(None);
    };
    let all = [left, right, truth].map(|p| Named {
        image: &p.image,
        name: &p.name,
        seconds: p.seconds,
    });
    Comparison::new(all[0], all[1], all[2]).map(Some)
}

/// How many points take as long as so many lines, by the times of the study: straight between
/// numbers of samples on logarithmic scales. `None` outside them.
fn as_long(
    rows: &[&ResultRow],
    sampler: SamplerKind,
    [points, lines]: [Estimator; 2],
    samples: u32,
) -> Option<u32> {
    let pattern = sampler.to_string();
    let of = |estimator: Estimator| {
        let name = estimator.to_string();
        let own = |r: &&ResultRow| r.sampler == pattern && r.estimator == name;
        rows.iter().copied().filter(own).collect::<Vec<_>>()
    };
    let time = of(lines).iter().find(|r| r.samples == samples)?.cpu_seconds;
    let curve = of(points);
    let within = |w: &&[&ResultRow]| w[0].cpu_seconds <= time && time < w[1].cpu_seconds;
    let [few, many] = *curve.windows(2).find(within)? else {
        return None;
    };
    let t = ln(time / few.cpu_seconds) / ln(many.cpu_seconds / few.cpu_seconds);
    let growth = f64::from(many.samples) / f64::from(few.samples);
    #[allow(clippy::cast_possible_truncation, reason = "between two of u32")]
    let fitting = (f64::from(few.samples) * pow(growth, t)).round() as u32;
    Some(fitting)
}

/// What pictures of a scene are made with.
struct Easel<'a> {
    targets: Targets<'a>,
    spec: &'a StudySpec,
    sampler: SamplerKind,
    size: [u32; 2],
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

    /// By the estimator without noise, if there is one, else by many samples.
    fn truth(&self, noiseless: Option<Estimator>) -> Shown {
        if let Some(estimator) = noiseless {
            let run = self.run(self.by(estimator), 1, 1);
            return self.show(&run, estimator.to_string());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_points_fit_as_the_times_say() {
        let row = |estimator: &str, samples, cpu_seconds| ResultRow {
            estimator: estimator.to_owned(),
            sampler: "stratified".to_owned(),
            samples,
            cpu_seconds,
            ..ResultRow::default()
        };
        let rows = [
            row("point-area", 16, 1.0),
            row("point-area", 64, 4.0),
            row("line-analytic", 16, 2.0),
            row("line-analytic", 64, 9.0),
        ];
        let rows: Vec<&ResultRow> = rows.iter().collect();
        let both = ["point-area", "line-analytic"].map(|e| e.parse().unwrap());
        let found = |samples| as_long(&rows, SamplerKind::Stratified, both, samples);
        // Halfway between 1 and 4 s in logarithms: halfway between 16 and 64.
        assert_eq!(found(16), Some(32));
        assert_eq!((found(64), found(4)), (None, None));
    }
}
