//! How claims are measured: scenes, estimators side by side, and how much of it.

use crate::measured::{Curve, Measured, settings};
use crate::picture_study::{Context, Row};
use anyhow::{Result, bail};
use linelit_formats::LoadOptions;
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Spheres};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use linelit_study::engine::{Cell, CellRun, Counts, Reference, run_cell, score};
use linelit_study::scene_study::{StudySpec, Targets, all_pixels, with_work};
use linelit_study::stats::metrics::MRSE_EPSILON;
use linelit_study::tables::StudyRecord;
use std::collections::BTreeMap;

/// Figures by the names that claims ask for.
pub(super) type Figures = BTreeMap<String, Measured>;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effort {
    /// Every step once, whatever comes out.
    Smallest,
    /// Enough for every verdict, within minutes.
    Quick,
    /// As much as the studies themselves.
    Full,
}

/// What measurements are made with.
#[derive(Debug)]
pub(super) struct Bench<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) effort: Effort,
}

/// An estimator that is asked for something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ask<'a> {
    pub(super) estimator: &'a str,
    pub(super) sampler: SamplerKind,
    pub(super) samples: u32,
    pub(super) trials: u32,
}

/// What came of an [`Ask`].
#[derive(Clone, Debug)]
pub(super) struct Answer {
    /// Variance of one estimate, trial by trial.
    pub(super) variance: Vec<f64>,
    /// Mean relative squared error, trial by trial.
    pub(super) mrse: Vec<f64>,
    /// Mean error over its standard error.
    pub(super) bias_z: f64,
    /// Processor seconds of a trial, with the deviation over passes as an interval.
    pub(super) seconds: Measured,
    /// Work of all trials.
    pub(super) counts: Counts,
}

impl Answer {
    /// MRSE times seconds over those of another: independent samples do not change it, so that it
    /// compares pictures for the same time.
    pub(super) fn cost_ratio(&self, other: &Self) -> Measured {
        let errors = Measured::ratio(&self.mrse, &other.mrse);
        errors.times(self.time_ratio(other))
    }

    /// Seconds over those of another.
    pub(super) fn time_ratio(&self, other: &Self) -> Measured {
        self.seconds.over(other.seconds)
    }

    /// The ratio of variances.
    pub(super) fn variance_ratio(&self, other: &Self) -> Measured {
        Measured::ratio(&self.variance, &other.variance)
    }
}

impl Bench<'_> {
    /// One of three by how much is measured.
    pub(super) fn pick<T>(&self, smallest: T, quick: T, full: T) -> T {
        match self.effort {
            Effort::Smallest => smallest,
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }

    /// The figures of a convergence study without its pictures; changed as the caller wants and, at
    /// the smallest, shrunk.
    pub(super) fn record(&self, mut spec: StudySpec) -> Result<StudyRecord> {
        spec.gallery = None;
        spec.duel = None;
        spec.seed = self.context.seed;
        if self.effort == Effort::Smallest {
            let spots = std::mem::take(&mut spec.spots);
            spec.shrink();
            spec.spots = spots;
            // An order wants two numbers of samples, few.
            spec.samples = vec![1, 4];
        }
        let load = |name: &str| Ok(self.context.library.load(name)?.scene);
        let mut record = spec.record(String::new());
        with_work(&spec, &load, |work| {
            work.whole_without_pictures(&mut record)
        })?;
        Ok(record)
    }

    /// What a study of pictures is run with: at most so many pixels on a side but in full, and
    /// another seed each time.
    pub(super) fn pictures_of(&self, side: u32, time: u64) -> Context<'_> {
        Context {
            library: self.context.library.clone(),
            seed: self.context.seed.wrapping_add(time * 1000),
            most_side: self.pick(8, side, u32::MAX),
            ..*self.context
        }
    }

    /// The rows of a study of pictures, several times with a seed of its own each.
    pub(super) fn repeated(
        &self,
        side: u32,
        study: impl Fn(&Context<'_>) -> Result<Vec<Row>>,
    ) -> Result<Repeated> {
        let times = self.pick(2, 6, 8);
        let runs = (0..times).map(|time| study(&self.pictures_of(side, time)));
        Ok(Repeated(runs.collect::<Result<_>>()?))
    }

    /// A built-in scene.
    pub(super) fn scene(&self, name: &str) -> Result<Scene> {
        Ok(self.context.library.load(name)?.scene)
    }

    /// A scene from its text.
    pub(super) fn text(&self, text: &str) -> Result<Scene> {
        let options = LoadOptions {
            strict: true,
            ..LoadOptions::default()
        };
        Ok(linelit_formats::from_pbrt_str(text, "claims.pbrt", &options)?.scene)
    }

    /// Calls a function with a scene's shading points on a grid.
    pub(super) fn on_grid<T>(
        &self,
        mut scene: Scene,
        [width, height]: [u32; 2],
        call: impl FnOnce(&Targets<'_>) -> Result<T>,
    ) -> Result<T> {
        let [width, height] = self.pick([4, 4], [width, height], [2 * width, 2 * height]);
        scene.set_resolution(width, height);
        let renderer = Renderer::new(&scene);
        let targets = Targets::find(&renderer, &all_pixels(width, height));
        if targets.points.is_empty() {
            bail!("a scene of the claims has nothing to shade");
        }
        call(&targets)
    }

    /// Runs some estimators on the same points; their times are taken in turns.
    pub(super) fn ask(&self, targets: &Targets<'_>, asks: &[Ask<'_>]) -> Result<Vec<Answer>> {
        let reference = self.reference(targets);
        let run = |ask: &Ask<'_>| self.run(targets, ask);
        let mut runs = asks.iter().map(run).collect::<Result<Vec<_>>>()?;
        let enough = self.pick(0.0, TIMED_SECONDS, 4.0 * TIMED_SECONDS);
        loop {
            // All of them are asked.
            let again = runs.iter_mut().map(|run| run.time_again(targets, enough));
            if again.filter(|known| !known).count() == 0 {
                break;
            }
        }
        let answer = |run: &CellRun<Settings>| answer(run, &reference, targets.pixels);
        Ok(runs.iter().map(answer).collect())
    }

    /// What errors are measured by: many samples of what is best there.
    fn reference(&self, targets: &Targets<'_>) -> Vec<DVec3> {
        let trials = 4;
        let cell = Cell {
            settings: Settings {
                sampler: SamplerKind::Sobol,
                ..targets.true_settings(Spheres::default())
            },
            samples: self.pick(4, 512, 1024),
            // Far from the trials' seeds.
            seed: self.context.seed ^ 0x5EED_0000_0000_0001,
            trials,
        };
        let run = run_cell(targets, cell);
        let mean = |k: usize| run.trials_of(k).iter().copied().sum::<DVec3>() / f64::from(trials);
        (0..targets.points.len()).map(mean).collect()
    }

    /// The order of convergence of an estimator on some points.
    pub(super) fn order(
        &self,
        targets: &Targets<'_>,
        estimator: &str,
        sampler: SamplerKind,
        samples: &[u32],
        trials: u32,
    ) -> Result<Measured> {
        let samples = self.pick(&[1, 4][..], samples, samples);
        let (settings, trials) = (settings(estimator, sampler)?, self.trials(trials));
        let curve = Curve::of(targets, settings, samples, trials, self.context.seed);
        Ok(curve.order())
    }

    /// The points where an estimator has noise. By projected solid angle they are those that see a
    /// part of the light.
    pub(super) fn noisy<'a>(&self, targets: &Targets<'a>, estimator: &str) -> Result<Targets<'a>> {
        self.kept(targets, estimator, |values| variance(values) > ROUNDING)
    }

    /// The points where an estimator has light and no noise.
    pub(super) fn calm<'a>(&self, targets: &Targets<'a>, estimator: &str) -> Result<Targets<'a>> {
        self.kept(targets, estimator, |values| {
            values[0] != DVec3::ZERO && variance(values) <= ROUNDING
        })
    }

    /// The points where some trials of an estimator are as they are wanted.
    fn kept<'a>(
        &self,
        targets: &Targets<'a>,
        estimator: &str,
        keep: impl Fn(&[DVec3]) -> bool,
    ) -> Result<Targets<'a>> {
        let ask = Ask {
            estimator,
            sampler: SamplerKind::Independent,
            samples: 16,
            trials: 8,
        };
        let run = self.run(targets, &ask)?;
        let points = targets.points.iter().enumerate();
        let kept = points.filter(|(k, _)| keep(run.trials_of(*k)));
        Ok(Targets {
            renderer: targets.renderer,
            points: kept.map(|(_, point)| point.clone()).collect(),
            pixels: targets.pixels,
        })
    }

    fn run(&self, targets: &Targets<'_>, ask: &Ask<'_>) -> Result<CellRun<Settings>> {
        let cell = Cell {
            settings: settings(ask.estimator, ask.sampler)?,
            samples: ask.samples,
            seed: self.context.seed,
            trials: self.trials(ask.trials),
        };
        Ok(run_cell(targets, cell))
    }

    fn trials(&self, quick: u32) -> u32 {
        self.pick(quick.min(3), quick, 4 * quick)
    }
}

/// Variances up to this are none: rounding leaves 1e-24 of the square, an edge before a thousandth
/// of the light 1e-6.
const ROUNDING: f64 = 1e-12;

/// The variance of some estimates about their mean, all channels added.
fn variance(values: &[DVec3]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let squares = values.iter().map(|v| (*v - mean).length_squared());
    squares.sum::<f64>() / (n - 1.0)
}

/// Rows of a study that was run several times.
#[derive(Debug)]
pub(super) struct Repeated(Vec<Vec<Row>>);

impl Repeated {
    /// A number of a row, each time; `what` is the row's label or a part of it.
    pub(super) fn values(&self, what: &str, key: &str) -> Vec<f64> {
        let find = |rows: &Vec<Row>| {
            let exact = rows.iter().find(|row| row.what == what);
            let found = exact.or_else(|| rows.iter().find(|row| row.what.contains(what)));
            found.and_then(|row| row.values.get(key)).copied()
        };
        self.0.iter().filter_map(find).collect()
    }

    /// The mean of a number over the runs.
    pub(super) fn mean(&self, what: &str, key: &str) -> Measured {
        Measured::mean(&self.values(what, key))
    }

    /// The ratio of the same number of two rows, run by run: what disturbs one disturbs both.
    pub(super) fn ratio(&self, a: &str, b: &str, key: &str) -> Measured {
        let (a, b) = (self.values(a, key), self.values(b, key));
        let ratios: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a / b).collect();
        Measured::geometric_mean(&ratios)
    }
}

/// Processor seconds that each estimator is timed for at least: ten passes.
const TIMED_SECONDS: f64 = 0.1;

fn answer(run: &CellRun<Settings>, reference: &[DVec3], pixels: usize) -> Answer {
    let scored = score(run, &Reference::known(reference.to_vec()), pixels);
    let trials = run.cell.trials as usize;
    let mut mrse = vec![0.0; trials];
    for (k, want) in reference.iter().enumerate() {
        let values = run.trials_of(k);
        for (sum, value) in mrse.iter_mut().zip(values) {
            let square = (*value - *want) * (*value - *want);
            *sum += (square / (*want * *want + MRSE_EPSILON)).element_sum();
        }
    }
    let scale = 1.0 / (3.0 * pixels.max(1) as f64);
    mrse.iter_mut().for_each(|sum| *sum *= scale);
    Answer {
        variance: scored.trial_variance,
        mrse,
        bias_z: scored.bias / scored.bias_stderr,
        seconds: Measured::time(run.times.seconds(), run.times.error()),
        counts: run.counts,
    }
}
