//! From estimates and a reference to errors: mean squared error, bias and variance with their
//! standard errors.
//!
//! Every sum has its own correction for the error s² of the reference, which the replicates of the
//! reference reveal.

use super::{CellRun, Reference};
use crate::stats::metrics::{MRSE_EPSILON, MeanError};
use linelit_elementary::hypot;
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};

/// The errors of one cell: one method at one number of samples.
#[derive(Clone, Debug)]
pub struct Score {
    /// The mean squared error of one estimate over pixels and channels, less the error of the
    /// reference: the mean of (estimate − reference)² − s², where s² is the variance of the
    /// reference according to its replicates.
    ///
    /// It is unbiased, as estimates and reference are independent, except for a clamp: it is 0
    /// where it would be negative, that is, where the reference is too noisy to show the error.
    pub mse: f64,
    /// The standard error of `mse`. It combines the spread over the trials with the error of the
    /// reference, which all trials share; the latter is taken to be normal and equal in all
    /// channels, which gives an upper bound.
    pub mse_stderr: f64,
    /// The mean of ((estimate − reference)² − s²)/(reference² + ε), or 0 where it would be
    /// negative. It is unbiased up to a relative error of the order of s²/(reference² + ε).
    pub mrse: f64,
    /// The mean of estimate − reference over pixels, channels and trials.
    pub bias: f64,
    /// The standard error of `bias`. It combines the spread over the trials, rounding, and the
    /// error of the reference, which all trials share; the latter is taken to be equal in all
    /// channels, which gives an upper bound.
    pub bias_stderr: f64,
    /// The mean squared error of each trial less the error of the reference, not clamped.
    pub trial_mse: Vec<f64>,
    /// The variance of one estimate around the mean of its trials, averaged over pixels and
    /// channels; it needs no reference. It is zero where there is only rounding (below 1e-18 of
    /// `power`), as for a closed form.
    pub variance: f64,
    /// The square of the mean of the trials, averaged over pixels and channels, which squared
    /// errors are relative to.
    pub power: f64,
    /// The variance trial by trial: n/(n − 1) times the squared deviation of each trial from the
    /// mean of all n trials. Its mean over trials is `variance`.
    pub trial_variance: Vec<f64>,
}

/// The variance, as a fraction of the power of the estimates, below which a variance counts as
/// rounding and is set to zero: (10⁻⁹)². Closed forms in `f64` leave (10⁻¹²)² and less, 10¹⁶
/// independent samples leave a hundred times more.
const ROUNDING: f64 = 1e-18;

/// Scores a run against a reference; sums over integrals are divided by a number of `pixels`.
#[must_use]
pub fn score<S>(run: &CellRun<S>, reference: &Reference, pixels: usize) -> Score {
    TrialSums::of(run, reference).score(pixels)
}

/// The sums over integrals, trial by trial, that scores are made of. The sums over several blocks
/// of integrals can be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TrialSums {
    pub(super) mse: Vec<f64>,
    pub(super) bias: Vec<f64>,
    pub(super) variance: Vec<f64>,
    pub(super) mrse: f64,
    pub(super) power: f64,
    /// The variance that the error of the reference adds to a sum of squared errors.
    pub(super) reference: f64,
    /// The variance that the error of the reference adds to a sum of errors.
    pub(super) reference_bias: f64,
}

impl TrialSums {
    /// Returns the sums of the errors of a run, which may cover only some of the reference's
    /// integrals.
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
            // Channels may err together, so that their deviations add up before the square.
            let deviations: f64 = own.to_array().map(f64::sqrt).iter().sum();
            sums.reference_bias += deviations * deviations;
        }
        sums
    }

    /// Adds the trials of one integral, whose true value is `want` with variance `own`.
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

    /// Adds the sums over other integrals, which must have the same number of trials.
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

    /// Returns the errors; sums over integrals are divided by a number of `pixels`.
    pub(super) fn score(self, pixels: usize) -> Score {
        // Average over pixels and channels, then over trials.
        let scale = 1.0 / (3.0 * pixels.max(1) as f64);
        let scaled = |v: Vec<f64>| v.into_iter().map(|x| x * scale).collect::<Vec<f64>>();
        let (trial_mse, trial_bias, trial_variance) =
            (scaled(self.mse), scaled(self.bias), scaled(self.variance));
        let mse = MeanError::of(&trial_mse);
        let bias = MeanError::of(&trial_bias);
        let variance = MeanError::of(&trial_variance).mean;
        let power = self.power * scale;
        // Widen the error of the bias by rounding: two closed forms differ by rounding, which
        // neither trials nor replicates show.
        let rounding = (ROUNDING * power).sqrt();
        let reference_bias = hypot(self.reference_bias.sqrt() * scale, rounding);
        // Clamp negative means to zero, and let NaN pass.
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
