//! Measurements of estimators on the shading points that `claims.toml` lists, all cells of the same
//! points side by side.

use super::data::{Cell, Only, Points};
use super::formula::Figures;
use crate::Context;
use crate::measured::Measured;
use anyhow::{Context as _, Result, bail};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Spheres};
use linelit_samplers::SamplerKind;
use linelit_study::engine::{self, CellRun, Counts, Reference, run_cell, score};
use linelit_study::scene_study::{Targets, all_pixels};
use linelit_study::stats::metrics::MRSE_EPSILON;
use linelit_study::stats::slopes::SlopePoint;
use std::collections::BTreeMap;

/// The amount of measuring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Effort {
    /// Every step is run once, and results do not matter.
    Smallest,
    /// Enough measuring for every verdict, within minutes.
    Quick,
    /// Four times as many trials, so that intervals are half as wide.
    Full,
}

/// The context and effort of all measurements.
#[derive(Debug)]
pub(super) struct Bench<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) effort: Effort,
}

/// The result of measuring a cell (an estimator on some shading points) with one number of samples.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    samples: u32,
    /// The variance of one estimate, trial by trial.
    variance: Vec<f64>,
    /// The mean relative squared error, trial by trial.
    mrse: Vec<f64>,
    /// The mean of all estimates, trial by trial.
    mean: Vec<f64>,
    /// The mean error over its standard error.
    bias_z: f64,
    /// The processor seconds of a trial, with an interval from the deviation over passes.
    seconds: Measured,
    counts: Counts,
}

/// All measured numbers, by the paths of their cells.
#[derive(Debug, Default)]
pub(super) struct Measurements {
    /// The results of each cell, by the path of the cell: one result for each number of samples. If
    /// a cell had no shading point to measure, its entry is instead the count of its numbers of
    /// samples, for each of which the statistics are then unknown.
    cells: BTreeMap<String, Result<Vec<Answer>, usize>>,
    pub(super) special: BTreeMap<String, Measured>,
}

impl Figures for Measurements {
    /// Returns the numbers of a statistic of a cell: one for each number of samples, or a single
    /// one for the order of convergence.
    fn find(&self, statistic: &str, cell: &str) -> Result<Vec<Measured>> {
        // Look up a number that a function of its own measured.
        if statistic == "special" {
            let found = self.special.get(cell);
            return Ok(vec![
                *found.with_context(|| format!("nothing measures `{cell}`"))?,
            ]);
        }
        // Look up the cell; what was not measured is unknown.
        let found = self.cells.get(cell);
        let answers = match found.with_context(|| format!("nothing measures `{cell}`"))? {
            Ok(answers) => answers,
            Err(_) if statistic == "order" => return Ok(vec![Measured::UNKNOWN]),
            Err(count) => return Ok(vec![Measured::UNKNOWN; *count]),
        };
        // Fit the order over all numbers of samples.
        if statistic == "order" {
            let point = |a: &Answer| SlopePoint {
                samples: f64::from(a.samples),
                trial_variances: a.variance.clone(),
            };
            let points: Vec<SlopePoint> = answers.iter().map(point).collect();
            return Ok(vec![Measured::order_of(&points)]);
        }
        answers
            .iter()
            .map(|answer| answer.statistic(statistic))
            .collect()
    }
}

impl Answer {
    /// Returns the statistic of this name.
    fn statistic(&self, name: &str) -> Result<Measured> {
        let count = |n: u64| Measured::exact(n as f64);
        Ok(match name {
            "variance" => Measured::positive_mean(&self.variance),
            "mrse" => Measured::positive_mean(&self.mrse),
            "mean" => Measured::mean(&self.mean),
            "bias" => Measured::exact(self.bias_z.abs()),
            "seconds" => self.seconds,
            "cost" => Measured::positive_mean(&self.mrse).times(self.seconds),
            "rays" => count(self.counts.rays),
            "lines" => count(self.counts.lines),
            "queries" => count(self.counts.line_queries),
            "pieces" => count(self.counts.intervals),
            "boxes" => count(self.counts.node_tests),
            "triangles" => count(self.counts.triangle_tests),
            _ => bail!("there is no statistic `{name}`"),
        })
    }
}

impl Bench<'_> {
    /// Returns the one of three values that belongs to this bench's effort.
    pub(super) fn pick<T>(&self, smallest: T, quick: T, full: T) -> T {
        match self.effort {
            Effort::Smallest => smallest,
            Effort::Quick => quick,
            Effort::Full => full,
        }
    }

    /// Measures all cells of an entry of points, in all its scenes and spots.
    pub(super) fn measure(&self, points: &Points, out: &mut Measurements) -> Result<()> {
        for name in &points.scenes {
            let mut path = points.name.clone();
            if points.scenes.len() > 1 {
                path = format!("{path}/{name}");
            }
            let mut scene = self.context.library.load(name)?.scene;
            // Measure the pixels of a grid as one view, or each spot as a view of its own.
            if points.spots.is_empty() {
                let [width, height] = points.grid.unwrap_or([64; 2]);
                let [w, h] = self.pick([4, 4], [width, height], [width, height]);
                scene.set_resolution(w, h);
                let renderer = Renderer::new(&scene);
                self.view(points, &renderer, &all_pixels(w, h), &path, out)?;
                continue;
            }
            let renderer = Renderer::new(&scene);
            for (spot, pixel) in &points.spots {
                self.view(points, &renderer, &[*pixel], &format!("{path}/{spot}"), out)?;
            }
        }
        Ok(())
    }

    /// Measures all cells of an entry on some pixels.
    fn view(
        &self,
        points: &Points,
        renderer: &Renderer<'_>,
        pixels: &[[u32; 2]],
        path: &str,
        out: &mut Measurements,
    ) -> Result<()> {
        // Find the shading points.
        let mut targets = Targets::find(renderer, pixels);
        if let Some(only) = points.only {
            self.keep(&mut targets, only)?;
        }
        // Run each cell with each of its numbers of samples.
        let mut runs = Vec::new();
        for (label, cell) in &points.cells {
            let path = format!("{path}/{label}");
            let samples = self.samples(points, cell);
            if targets.points.is_empty() {
                out.cells.insert(path, Err(samples.len()));
                continue;
            }
            for count in samples {
                let cell = self.cell(points, cell, count);
                runs.push((path.clone(), run_cell(&targets, cell)));
            }
        }
        // Time the runs in turns, then score them.
        if points.timed {
            self.time(&targets, &mut runs);
        }
        let reference = points.reference.then(|| self.reference(&targets));
        for (path, run) in &runs {
            let answer = answer(run, reference.as_deref(), targets.pixels);
            let answers = out.cells.entry(path.clone()).or_insert(Ok(Vec::new()));
            if let Ok(answers) = answers {
                answers.push(answer);
            }
        }
        Ok(())
    }

    /// Times runs in turns, until each has been timed for long enough.
    fn time(&self, targets: &Targets<'_>, runs: &mut [(String, CellRun<Settings>)]) {
        let enough = self.pick(0.0, TIMED_SECONDS, 4.0 * TIMED_SECONDS);
        loop {
            // Every run has its turn, even after one that needs more time was found.
            let again = runs
                .iter_mut()
                .map(|(_, run)| run.time_again(targets, enough));
            if again.filter(|known| !known).count() == 0 {
                break;
            }
        }
    }

    /// Returns the numbers of samples of a cell.
    fn samples(&self, points: &Points, cell: &Cell) -> Vec<u32> {
        let all = cell.samples.as_ref().unwrap_or(&points.samples);
        match self.effort {
            Effort::Smallest if all.len() > 1 => vec![1, 4],
            _ => all.clone(),
        }
    }

    /// Returns the cell of the engine for one number of samples.
    fn cell(&self, points: &Points, cell: &Cell, samples: u32) -> engine::Cell<Settings> {
        let trials = cell.trials.unwrap_or(points.trials);
        engine::Cell {
            settings: Settings {
                estimator: cell.estimator.0,
                sampler: cell.sampler.unwrap_or(points.sampler).0,
                lights: cell.lights.map_or(Settings::default().lights, |l| l.0),
                // As the papers mean it, no work is skipped.
                skip: false,
                ..Settings::default()
            },
            samples,
            seed: self.context.seed ^ u64::from(samples),
            trials: self.pick(trials.min(3), trials, trials.saturating_mul(4)),
        }
    }

    /// Keeps only the points where estimates by projected solid angle have noise (`Noisy`), or
    /// where they have light but no noise (`Calm`).
    fn keep(&self, targets: &mut Targets<'_>, only: Only) -> Result<()> {
        // Estimate each point by points uniform in projected solid angle.
        let cell = engine::Cell {
            settings: Settings {
                estimator: "point-projected-solid-angle".parse()?,
                sampler: SamplerKind::Independent,
                ..Settings::default()
            },
            samples: 16,
            seed: self.context.seed,
            trials: 8,
        };
        let run = run_cell(targets, cell);
        // Keep the points by the spread of these estimates.
        let wanted = |k: usize| {
            let values = run.trials_of(k);
            let is_noisy = variance(values) > ROUNDING;
            match only {
                Only::Noisy => is_noisy,
                Only::Calm => !is_noisy && values[0] != DVec3::ZERO,
            }
        };
        let mut place = 0..;
        targets.points.retain(|_| place.next().is_some_and(&wanted));
        Ok(())
    }

    /// Computes the reference that errors are measured by: many samples of the best method for
    /// these points.
    fn reference(&self, targets: &Targets<'_>) -> Vec<DVec3> {
        let trials = 4;
        let cell = engine::Cell {
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
}

/// The least processor time, in seconds, for which each estimator is timed: ten passes.
const TIMED_SECONDS: f64 = 0.1;

/// The variance of the estimates at a shading point, in linear radiance squared, up to which the
/// point counts as one without noise. Rounding leaves a variance of 1e-24 of the squared radiance;
/// an occluder in front of a thousandth of the light causes 1e-6 of it.
const ROUNDING: f64 = 1e-12;

/// Returns the variance of some estimates about their mean, summed over channels.
fn variance(values: &[DVec3]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().copied().sum::<DVec3>() / n;
    let squares = values.iter().map(|v| (*v - mean).length_squared());
    squares.sum::<f64>() / (n - 1.0)
}

/// Scores a run. Without a reference, errors are taken from zero.
fn answer(run: &CellRun<Settings>, reference: Option<&[DVec3]>, pixels: usize) -> Answer {
    let points = run.values.len() / run.cell.trials as usize;
    let truth = reference.map_or_else(|| vec![DVec3::ZERO; points], <[DVec3]>::to_vec);
    // Sum relative squared errors and estimates, trial by trial.
    let trials = run.cell.trials as usize;
    let (mut mrse, mut mean) = (vec![0.0; trials], vec![0.0; trials]);
    for (k, want) in truth.iter().enumerate() {
        for (trial, value) in run.trials_of(k).iter().enumerate() {
            let square = (*value - *want) * (*value - *want);
            mrse[trial] += (square / (*want * *want + MRSE_EPSILON)).element_sum();
            mean[trial] += value.element_sum();
        }
    }
    // Average them, and take variance and bias from the engine's score.
    let scale = 1.0 / (3.0 * pixels.max(1) as f64);
    let scored = score(run, &Reference::known(truth), pixels);
    let scaled = |list: Vec<f64>| list.into_iter().map(|v| v * scale).collect();
    Answer {
        samples: run.cell.samples,
        mrse: scaled(mrse),
        mean: scaled(mean),
        bias_z: scored.bias / scored.bias_stderr,
        variance: scored.trial_variance,
        seconds: Measured::time(run.times.seconds(), run.times.error()),
        counts: run.counts,
    }
}
