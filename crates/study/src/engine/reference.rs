//! The reference that estimates are scored against, and how wrong it is itself.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::{Cell, CellRun, Method, Problem, Truth, run_cell};
use linelit_geometry::DVec3;
use std::time::{Duration, Instant};

/// The seed of references is far from that of any trial.
const REFERENCE_SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;

/// Reference value of each integral.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Per integral; of a computed one the mean over all replicates.
    pub values: Vec<DVec3>,
    /// Mean squared error of `values`, from the spread of the replicates: the average over pixels
    /// and channels. Zero where the values are known.
    pub mse: f64,
    /// Text for the report: estimator, samples and replicates. Empty for known values.
    pub source: String,
}

impl Reference {
    /// Values without an error of their own.
    #[must_use]
    pub const fn known(values: Vec<DVec3>) -> Self {
        Self {
            values,
            mse: 0.0,
            source: String::new(),
        }
    }
}

/// The reference of a problem. A computed one takes `samples` to a replicate, until the error of
/// the replicates' mean is below `target` or `limit` has passed; at least one round is run.
///
/// # Panics
/// If known values are not one for each integral.
#[must_use]
pub fn reference<P: Problem>(
    problem: &P,
    truth: &Truth<P::Settings>,
    samples: u32,
    target: f64,
    limit: Duration,
) -> Reference {
    let start = Instant::now();
    let method = match truth {
        Truth::Known(values) => {
            assert_eq!(values.len(), problem.integrals(), "a value per integral");
            return Reference::known(values.clone());
        }
        Truth::Computed(method) => method,
    };
    let mut rounds = Vec::new();
    loop {
        let seed = REFERENCE_SEED.wrapping_add(rounds.len() as u64 * 0x0123_4567_89AB_CDEF);
        let cell = Cell {
            settings: method.settings.clone(),
            samples,
            seed,
            trials: method.trials,
        };
        rounds.push(run_cell(problem, cell));
        let reference = merge(problem, method, samples, &rounds);
        if reference.mse <= target || start.elapsed() > limit {
            return reference;
        }
    }
}

fn merge<P: Problem>(
    problem: &P,
    method: &Method<P::Settings>,
    samples: u32,
    rounds: &[CellRun<P::Settings>],
) -> Reference {
    let count = u32::try_from(rounds.len()).unwrap_or(u32::MAX);
    let replicates = method.trials.saturating_mul(count);
    let r = f64::from(replicates);
    let mut values = Vec::with_capacity(problem.integrals());
    let mut total = 0.0;
    for integral in 0..problem.integrals() {
        let all = || rounds.iter().flat_map(|run| run.trials_of(integral));
        let mean = all().copied().sum::<DVec3>() / r;
        let square: f64 = all().map(|v| (*v - mean).length_squared()).sum();
        total += square / (3.0 * (r - 1.0) * r);
        values.push(mean);
    }
    let (estimator, sampler) = (&method.estimator, &method.sampler);
    Reference {
        values,
        mse: total / problem.pixels().max(1) as f64,
        source: format!("{replicates} replicates of {estimator} with {samples} {sampler} samples"),
    }
}
