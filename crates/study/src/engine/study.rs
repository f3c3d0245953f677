//! A whole convergence study of one problem: methods × numbers of samples.
#![allow(clippy::disallowed_methods, reason = "compares with the deadline")]

use super::{
    CELL_SECONDS, Cell, CellRun, Counts, Method, Problem, Reference, Score, Times, Truth,
    reference, run_cell, score,
};
use crate::tables::LeftOutRow;
use linelit_geometry::DVec3;
use std::time::{Duration, Instant};

/// The longest that the reference of a study may take beyond its first round, unless told.
pub const REFERENCE_LIMIT: Duration = Duration::from_secs(60);

/// Methods, numbers of samples and limits of a study.
#[derive(Clone, Debug)]
pub struct Design<S> {
    /// The methods to compare.
    pub methods: Vec<Method<S>>,
    /// Numbers of samples, ascending.
    pub samples: Vec<u32>,
    /// Seed of each method's first trial.
    pub seed: u64,
    /// When no more measurements are begun.
    pub deadline: Option<Instant>,
    /// The longest that a computed reference may take beyond its first round.
    pub reference_limit: Duration,
    /// Processor seconds that each method is measured for at least, at each number of samples.
    pub cell_seconds: f64,
}

impl<S> Design<S> {
    /// All methods at these numbers of samples, with seed 1 and no deadline.
    #[must_use]
    pub const fn new(methods: Vec<Method<S>>, samples: Vec<u32>) -> Self {
        Self {
            methods,
            samples,
            seed: 1,
            deadline: None,
            reference_limit: REFERENCE_LIMIT,
            cell_seconds: CELL_SECONDS,
        }
    }
}

/// Errors and times of all methods on one problem.
#[derive(Clone, Debug)]
pub struct Results {
    /// Number of integrals.
    pub integrals: usize,
    /// Number of pixels, by which sums of errors are divided ([`Problem::pixels`]).
    pub pixels: usize,
    /// The reference.
    pub reference: Reference,
    /// Mean over pixels and channels of the reference's square: what squared errors are relative
    /// to.
    pub power: f64,
    /// All measurements, in the order they were made.
    pub cells: Vec<CellResult>,
    /// Measurements that the deadline left out; the scene's name is still empty.
    pub left_out: Vec<LeftOutRow>,
}

/// Error and time of one method at one number of samples.
#[derive(Clone, Debug)]
pub struct CellResult {
    /// The estimator's name.
    pub estimator: String,
    /// The pattern's name.
    pub sampler: String,
    /// Samples.
    pub samples: u32,
    /// Trials.
    pub trials: u32,
    /// Errors.
    pub score: Score,
    /// Seconds of one trial.
    pub times: Times,
    /// Counts of all trials.
    pub counts: Counts,
}

/// Measures all methods on a problem, on the threads of the rayon pool that it is called in. The
/// error of a computed reference is below a tenth of the smallest variance found, if it can be;
/// what has none but rounding ([`Score::variance`]) does not count.
///
/// Only times depend on how many those are. `begun` is called once for each method and number of
/// samples, before they are measured or left out: for those who show progress.
///
/// # Panics
/// If known values are not one for each integral.
pub fn measure<P: Problem>(
    problem: &P,
    truth: &Truth<P::Settings>,
    design: &Design<P::Settings>,
    mut begun: impl FnMut(),
) -> Results {
    let over = || design.deadline.is_some_and(|d| Instant::now() > d);
    let (mut runs, mut left_out) = (Vec::new(), Vec::new());
    for &samples in &design.samples {
        for method in &design.methods {
            begun();
            if over() {
                left_out.push(LeftOutRow {
                    scene: String::new(),
                    estimator: method.estimator.clone(),
                    sampler: method.sampler.clone(),
                    samples,
                });
                continue;
            }
            let cell = Cell {
                settings: method.settings.clone(),
                samples,
                seed: design.seed,
                trials: method.trials,
            };
            runs.push((method, run_cell(problem, cell)));
        }
    }
    // Short ones are measured again and again, in turns.
    let mut known = false;
    while !known && !over() {
        known = true;
        for (_, run) in &mut runs {
            known &= run.time_again(problem, design.cell_seconds);
        }
    }
    // The variance needs no reference, and is what is left of the error of an unbiased estimate.
    let zeros = vec![DVec3::ZERO; problem.integrals()];
    let variances = runs
        .iter()
        .map(|(_, run)| score(run, &zeros, problem.pixels()).variance);
    let smallest = variances.filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
    let most = design.samples.last().copied().unwrap_or(1);
    let samples = most.saturating_mul(4).clamp(256, 4096);
    let limit = design.reference_limit;
    let reference = reference(problem, truth, samples, 0.1 * smallest, limit);
    let result = |(method, run): &(&Method<P::Settings>, CellRun<P::Settings>)| CellResult {
        estimator: method.estimator.clone(),
        sampler: method.sampler.clone(),
        samples: run.cell.samples,
        trials: run.cell.trials,
        score: score(run, &reference.values, problem.pixels()),
        times: run.times.clone(),
        counts: run.counts,
    };
    let cells = runs.iter().map(result).collect();
    let squares: f64 = reference.values.iter().map(|v| v.length_squared()).sum();
    Results {
        integrals: problem.integrals(),
        pixels: problem.pixels(),
        power: squares / (3.0 * problem.pixels().max(1) as f64),
        reference,
        cells,
        left_out,
    }
}
