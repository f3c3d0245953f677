//! From estimates and a reference to errors.

use super::{CellRun, Reference};
use crate::stats::metrics::{MRSE_EPSILON, MeanError};
use linelit_elementary::hypot;
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};

/// The errors of one cell.
#[derive(Clone, Debug)]
pub struct Score {
    /// Mean squared error of one estimate over pixels and channels, less the reference's own: the
    /// mean of (estimate − reference)² − s², s² the variance of the reference by its replicates.
    ///
    /// Unbiased, as estimates and reference are independent, but for a clamp: 0 where it would be
    /// negative, that is, below what the reference can tell.
    pub mse: f64,
    /// Standard error of `mse`: of its spread over the trials, and of the reference's own error,
    /// which all trials share, as if that were normal and its channels one (which is the most).
    pub mse_stderr: f64,
    /// Mean of ((estimate − reference)² − s²)/(reference² + ε), 0 where it would be negative;
    /// unbiased but for a relative error of the order of s²/(reference² + ε).
    pub mrse: f64,
    /// Mean of estimate − reference over pixels, channels and trials.
    pub bias: f64,
    /// Standard error of `bias`: of its spread over the trials, of the reference's own error, which
    /// all trials share, as if its channels were one (which is the most), and of rounding.
    pub bias_stderr: f64,
    /// Mean squared error of each trial less the reference's own, not clamped.
    pub trial_mse: Vec<f64>,
    /// Variance of one estimate around the mean of its trials, averaged over pixels and channels:
    /// needs no reference. Zero where it is rounding alone (below 1e-18 of `power`), as that of a
    /// closed form is.
    pub variance: f64,
    /// Square of the mean of the trials, averaged over pixels and channels: what a squared error is
    /// relative to.
    pub power: f64,
    /// The variance again, trial by trial, as the squared distance of each from the mean of the
    /// others' (jackknife-free: n/(n−1) times the squared deviation).
    pub trial_variance: Vec<f64>,
}

/// Share of the power below which a variance is rounding: (10⁻⁹)². Closed forms in `f64` leave
/// (10⁻¹²)² and less, 10¹⁶ independent samples a hundred times more.
const ROUNDING: f64 = 1e-18;

/// Scores a run against a reference; sums are divided by a number of `pixels`.
#[must_use]
pub fn score<S>(run: &CellRun<S>, reference: &Reference, pixels: usize) -> Score {
    TrialSums::of(run, reference).score(pixels)
}

/// Sums over integrals, trial by trial: what scores are made of. Sums over blocks of integrals are
/// added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TrialSums {
    pub(super) mse: Vec<f64>,
    pub(super) bias: Vec<f64>,
    pub(super) variance: Vec<f64>,
    pub(super) mrse: f64,
    pub(super) power: f64,
    /// The variance of what the reference's own error leaves in a sum of squared errors.
    pub(super) reference: f64,
    /// The variance of what it leaves in a sum of errors.
    pub(super) reference_bias: f64,
}

impl TrialSums {
    /// Sums of a run on some integrals of those that the reference is of.
    pub(super) fn of<S>(run: &CellRun<S>, reference: &Reference) -> Self {
        let trials = run.cell.trials as usize;
        let mut sums = Self {
            mse: vec![0.0; trials],
            bias: vec![0.0; trials],
            variance: vec![0.0; trials],
            mrse: 0.0,
            power: 0.0,
            reference: 0.0,
            reference_bias: 0.0,
        };
        for k in 0..run.span.count {
            let integral = run.span.first + k * run.span.step;
            let own = reference.variances.get(integral).copied();
            let own = own.unwrap_or(DVec3::ZERO);
            sums.add(run.trials_of(k), reference.values[integral], own);
            sums.reference += reference.variance_of_square(own);
            // Channels that err together add up before the square.
            let deviations: f64 = own.to_array().map(f64::sqrt).iter().sum();
            sums.reference_bias += deviations * deviations;
        }
        sums
    }

    /// Adds the trials of an integral, and the value that they are held to with its variance.
    fn add(&mut self, values: &[DVec3], want: DVec3, own: DVec3) {
        let n = values.len() as f64;
        let mean = values.iter().copied().sum::<DVec3>() / n;
        self.power += mean.length_squared();
        for (trial, value) in values.iter().enumerate() {
            let error = *value - want;
            self.mse[trial] += error.length_squared() - own.element_sum();
            self.bias[trial] += error.element_sum();
            self.variance[trial] += (*value - mean).length_squared() * n / (n - 1.0);
            let relative = (error * error - own) / (want * want + MRSE_EPSILON);
            self.mrse += relative.element_sum() / n;
        }
    }

    /// Adds the sums over other integrals, of as many trials.
    pub(super) fn join(&mut self, other: &Self) {
        let add = |ours: &mut [f64], theirs: &[f64]| {
            for (a, b) in ours.iter_mut().zip(theirs) {
                *a += b;
            }
        };
        add(&mut self.mse, &other.mse);
        add(&mut self.bias, &other.bias);
        add(&mut self.variance, &other.variance);
        self.mrse += other.mrse;
        self.power += other.power;
        self.reference += other.reference;
        self.reference_bias += other.reference_bias;
    }

    /// The errors; sums are divided by a number of `pixels`.
    pub(super) fn score(self, pixels: usize) -> Score {
        let scale = 1.0 / (3.0 * pixels.max(1) as f64);
        let scaled = |v: Vec<f64>| v.into_iter().map(|x| x * scale).collect::<Vec<f64>>();
        let (trial_mse, trial_bias, trial_variance) =
            (scaled(self.mse), scaled(self.bias), scaled(self.variance));
        let mse = MeanError::of(&trial_mse);
        let bias = MeanError::of(&trial_bias);
        let variance = MeanError::of(&trial_variance).mean;
        let power = self.power * scale;
        // Two closed forms differ by rounding, of which neither trials nor replicates say anything.
        let rounding = (ROUNDING * power).sqrt();
        let reference_bias = hypot(self.reference_bias.sqrt() * scale, rounding);
        // What is not a number stays none.
        let clamped = |v: f64| if v < 0.0 { 0.0 } else { v };
        Score {
            mse: clamped(mse.mean),
            mse_stderr: hypot(mse.stderr, self.reference.sqrt() * scale),
            mrse: clamped(self.mrse * scale),
            bias: bias.mean,
            bias_stderr: hypot(bias.stderr, reference_bias),
            trial_mse,
            variance: if variance <= ROUNDING * power {
                0.0
            } else {
                variance
            },
            power,
            trial_variance,
        }
    }
}
