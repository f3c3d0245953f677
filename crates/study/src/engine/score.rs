//! From estimates and a reference to errors.

use super::CellRun;
use crate::stats::metrics::{MRSE_EPSILON, MeanError};
use linelit_geometry::DVec3;

/// The errors of one cell.
#[derive(Clone, Debug)]
pub struct Score {
    /// Mean squared error of one estimate over pixels and channels.
    pub mse: f64,
    /// Standard error of `mse`, from its spread over the trials.
    pub mse_stderr: f64,
    /// Mean of (estimate − reference)²/(reference² + ε).
    pub mrse: f64,
    /// Mean of estimate − reference over pixels, channels and trials.
    pub bias: f64,
    /// Standard error of `bias`, from its spread over the trials.
    pub bias_stderr: f64,
    /// Mean squared error of each trial: what the fits resample.
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

/// Scores a run against the integrals' values; sums are divided by a number of `pixels`.
#[must_use]
pub fn score<S>(run: &CellRun<S>, values: &[DVec3], pixels: usize) -> Score {
    let trials = run.cell.trials as usize;
    let mut sums = TrialSums::new(trials);
    for (integral, want) in values.iter().enumerate() {
        sums.add(run.trials_of(integral), *want);
    }
    sums.finish(pixels.max(1))
}

struct TrialSums {
    mse: Vec<f64>,
    bias: Vec<f64>,
    variance: Vec<f64>,
    mrse: f64,
    power: f64,
}

impl TrialSums {
    fn new(trials: usize) -> Self {
        Self {
            mse: vec![0.0; trials],
            bias: vec![0.0; trials],
            variance: vec![0.0; trials],
            mrse: 0.0,
            power: 0.0,
        }
    }

    fn add(&mut self, values: &[DVec3], want: DVec3) {
        let n = values.len() as f64;
        let mean = values.iter().copied().sum::<DVec3>() / n;
        self.power += mean.length_squared();
        for (trial, value) in values.iter().enumerate() {
            let error = *value - want;
            self.mse[trial] += error.length_squared();
            self.bias[trial] += error.element_sum();
            self.variance[trial] += (*value - mean).length_squared() * n / (n - 1.0);
            let relative = error * error / (want * want + MRSE_EPSILON);
            self.mrse += relative.element_sum() / n;
        }
    }

    fn finish(self, pixels: usize) -> Score {
        let scale = 1.0 / (3.0 * pixels as f64);
        let scaled = |v: Vec<f64>| v.into_iter().map(|x| x * scale).collect::<Vec<f64>>();
        let (trial_mse, trial_bias, trial_variance) =
            (scaled(self.mse), scaled(self.bias), scaled(self.variance));
        let mse = MeanError::of(&trial_mse);
        let bias = MeanError::of(&trial_bias);
        let variance = MeanError::of(&trial_variance).mean;
        let power = self.power * scale;
        Score {
            mse: mse.mean,
            mse_stderr: mse.stderr,
            mrse: self.mrse * scale,
            bias: bias.mean,
            bias_stderr: bias.stderr,
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
