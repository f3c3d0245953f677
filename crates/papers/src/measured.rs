//! Measured numbers, each with the interval that it lies in.

use crate::scene_study::Targets;
use linelit_elementary::{exp, hypot, ln};
use linelit_geometry::DVec3;
use linelit_integrator::Settings;
use linelit_study::engine::{Cell, run_cell};
use linelit_study::stats::metrics::MeanError;
use linelit_study::stats::slopes::{LEAST_TRIALS, Order, SlopePoint, fit_trials};
use linelit_study::stats::student;
use serde::Serialize;
use std::fmt;

/// Confidence of all intervals.
const CONFIDENCE: f64 = 0.95;

/// A number that a study measured, with the interval that holds it in 95 % of all runs; none where
/// there were too few trials to tell ([`LEAST_TRIALS`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Measured {
    /// The number.
    pub value: f64,
    /// Lower and upper end of its interval.
    pub interval: Option<[f64; 2]>,
}

impl Measured {
    /// A number without noise: a count, or what a formula gives.
    pub(crate) const fn exact(value: f64) -> Self {
        Self {
            value,
            interval: Some([value; 2]),
        }
    }

    /// A number ± t times its standard error.
    fn around(value: f64, stderr: f64, values: usize) -> Self {
        let enough = values >= LEAST_TRIALS && stderr.is_finite();
        let interval = enough.then(|| {
            let half = quantile(values) * stderr;
            [value - half, value + half]
        });
        Self { value, interval }
    }

    /// The mean of independent values.
    pub(crate) fn mean(values: &[f64]) -> Self {
        let MeanError { mean, stderr } = MeanError::of(values);
        Self::around(mean, stderr, values.len())
    }

    /// The root of the mean of independent squares, as of the squared errors of trials.
    pub(crate) fn root_mean(squares: &[f64]) -> Self {
        Self::mean(squares).map(|square| square.max(0.0).sqrt())
    }

    /// The mean of some positive values over that of others, both independent: the interval is
    /// that of its logarithm, to first order in the standard errors.
    pub(crate) fn ratio(top: &[f64], bottom: &[f64]) -> Self {
        let [a, b] = [top, bottom].map(MeanError::of);
        let stderr = hypot(a.stderr / a.mean, b.stderr / b.mean);
        let fewest = top.len().min(bottom.len());
        Self::around(ln(a.mean / b.mean), stderr, fewest).map(exp)
    }

    /// The geometric mean of positive values, such as ratios of times taken in turns.
    pub(crate) fn geometric_mean(values: &[f64]) -> Self {
        let logarithms: Vec<f64> = values.iter().map(|v| ln(*v)).collect();
        Self::mean(&logarithms).map(exp)
    }

    /// Both ends and the number through an increasing function.
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            interval: self.interval.map(|ends| ends.map(f)),
        }
    }

    /// The difference of two independent numbers: half widths add as standard errors do.
    pub(crate) fn minus(self, other: Self) -> Self {
        let value = self.value - other.value;
        let half = |m: Self| m.interval.map(|[low, high]| 0.5 * (high - low));
        let both = half(self).zip(half(other)).map(|(a, b)| hypot(a, b));
        Self {
            value,
            interval: both.map(|half| [value - half, value + half]),
        }
    }

    /// Whether all of the interval is below a number; not without an interval.
    pub(crate) fn is_below(self, other: f64) -> bool {
        self.interval.is_some_and(|[_, high]| high < other)
    }

    /// Whether all of the interval is above a number; not without an interval.
    pub(crate) fn is_above(self, other: f64) -> bool {
        self.interval.is_some_and(|[low, _]| low > other)
    }
}

impl From<&Order> for Measured {
    fn from(order: &Order) -> Self {
        let ends = [order.ci_low, order.ci_high];
        Self {
            value: order.order,
            interval: ends.iter().all(|end| end.is_finite()).then_some(ends),
        }
    }
}

/// Three digits, and the interval in brackets.
impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = |v: f64| match v.abs() {
            0.0 => "0".to_owned(),
            0.01..1e4 => format!("{v:.3}"),
            _ => format!("{v:.2e}"),
        };
        write!(f, "{}", digits(self.value))?;
        match self.interval {
            Some([low, high]) if low < high => {
                write!(f, " [{}, {}]", digits(low), digits(high))
            }
            Some(_) => Ok(()),
            None => write!(f, " [–]"),
        }
    }
}

/// Student's t of an interval from so many values.
fn quantile(values: usize) -> f64 {
    let freedom = u32::try_from(values.saturating_sub(1)).unwrap_or(u32::MAX);
    student::quantile(CONFIDENCE, freedom)
}

/// The variance of one estimate as each trial sees it, averaged over points and channels.
pub(crate) fn trial_variances(
    targets: &Targets<'_>,
    settings: Settings,
    samples: u32,
    trials: u32,
    seed: u64,
) -> Vec<f64> {
    trial_variances_and_seconds(targets, settings, samples, trials, seed).0
}

/// [`trial_variances`], and the processor seconds of a trial.
pub(crate) fn trial_variances_and_seconds(
    targets: &Targets<'_>,
    settings: Settings,
    samples: u32,
    trials: u32,
    seed: u64,
) -> (Vec<f64>, f64) {
    let cell = Cell {
        settings,
        samples,
        seed,
        trials,
    };
    let run = run_cell(targets, cell);
    let n = f64::from(trials);
    let scale = n / (n - 1.0) / (3.0 * targets.pixels.max(1) as f64);
    let mut variances = vec![0.0; trials as usize];
    for integral in 0..targets.points.len() {
        let values = run.trials_of(integral);
        let mean = values.iter().copied().sum::<DVec3>() / n;
        for (variance, value) in variances.iter_mut().zip(values) {
            *variance += (*value - mean).length_squared() * scale;
        }
    }
    (variances, run.times.seconds())
}

/// Errors over the number of samples: the variances of trials at each.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Ascending numbers of samples, and the variance as each trial sees it.
    pub points: Vec<SlopePoint>,
}

impl Curve {
    /// Measures an estimator.
    pub(crate) fn of(
        targets: &Targets<'_>,
        settings: Settings,
        samples: &[u32],
        trials: u32,
        seed: u64,
    ) -> Self {
        let point = |&n: &u32| SlopePoint {
            samples: f64::from(n),
            trial_variances: trial_variances(targets, settings, n, trials, seed ^ u64::from(n)),
        };
        Self {
            points: samples.iter().map(point).collect(),
        }
    }

    /// The order of the variance (twice that of the standard deviation); NaN where there is none.
    pub(crate) fn variance_order(&self) -> Measured {
        let order = fit_trials(&self.points, CONFIDENCE);
        order.map_or(
            Measured {
                value: f64::NAN,
                interval: None,
            },
            |order| Measured::from(&order).map(|order| 2.0 * order),
        )
    }

    /// The variances of trials with the most samples.
    pub(crate) fn last(&self) -> &[f64] {
        self.points
            .last()
            .map_or(&[], |point| &point.trial_variances)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_students() {
        let mean = Measured::mean(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        // t(95 %, 4) = 2.776, standard error √(10/(5·4)).
        let half = 2.776_445 * 0.5_f64.sqrt();
        let [low, high] = mean.interval.unwrap();
        assert!((low - (3.0 - half)).abs() < 1e-6 && (high - (3.0 + half)).abs() < 1e-6);
        assert!(mean.is_above(0.9) && !mean.is_above(1.1) && mean.is_below(5.1));
        assert_eq!(Measured::mean(&[1.0, 2.0, 3.0, 4.0]).interval, None);
        assert_eq!(Measured::exact(2.0).to_string(), "2.000");
        assert_eq!(Measured::mean(&[1.0; 2]).to_string(), "1.000 [–]");
    }

    /// Of 2,000 simulated ratios of means of eight uniform numbers in [1, 2], 95 % are in their
    /// intervals: ± 3.3 standard deviations of a binomial (α = 0.001), and 0.7 % for the first
    /// order.
    #[test]
    fn ratios_are_covered() {
        let mut state = 1_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            1.0 + (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut covered = 0;
        for _ in 0..2000 {
            let [a, b] = [(); 2].map(|()| [(); 8].map(|()| next()));
            let [low, high] = Measured::ratio(&a, &b).interval.unwrap();
            covered += u32::from(low <= 1.0 && 1.0 <= high);
        }
        // t(7) where Welch has 14 degrees of freedom: a little wide.
        let share = f64::from(covered) / 2000.0;
        let spread = 3.3 * (0.05 * 0.95 / 2000.0_f64).sqrt();
        assert!(
            share > 0.95 - spread - 0.007 && share < 0.98 + spread,
            "{share}"
        );
    }
}
