//! What a measurement gives: a figure with its interval.

use linelit_study::stats::metrics::MeanError;
use linelit_study::stats::student;
use linelit_study::tables::{ResultRow, SlopeRow};
use std::collections::BTreeMap;

/// A measured figure with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// The figure.
    pub(super) value: f64,
    /// Lower end of its interval: the figure itself where nothing is random, NaN where it is not
    /// known.
    pub(super) low: f64,
    /// Upper end.
    pub(super) high: f64,
}

/// Figures by the names that claims ask for.
pub(super) type Figures = BTreeMap<String, Measured>;

impl Measured {
    /// A figure in which nothing is random.
    pub(super) const fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// An order of convergence with the jackknife's interval of its fit.
    pub(super) fn of_order(row: &SlopeRow) -> Self {
        Self {
            value: row.order,
            low: row.ci_low,
            high: row.ci_high,
        }
    }

    /// The ratio of two means with relative standard errors `errors` and the fewest trials of both:
    /// ln of it ± t(95 %, trials − 1) · √(e₀² + e₁²), by the delta method.
    fn of_ratio([a, b]: [f64; 2], errors: [f64; 2], trials: usize) -> Self {
        let freedom = u32::try_from(trials.saturating_sub(1)).unwrap_or(u32::MAX);
        let half = if freedom == 0 {
            f64::NAN
        } else {
            student::quantile(0.95, freedom) * errors[0].hypot(errors[1])
        };
        let value = a / b;
        Self {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        }
    }

    /// The mean of some independent values with Student's interval.
    pub(super) fn mean(values: &[f64]) -> Self {
        let found = MeanError::of(values);
        let freedom = u32::try_from(values.len().saturating_sub(1)).unwrap_or(u32::MAX);
        let half = student::quantile(0.95, freedom) * found.stderr;
        Self {
            value: found.mean,
            low: found.mean - half,
            high: found.mean + half,
        }
    }

    /// The geometric mean of some independent positive values with Student's interval, which is one
    /// of their logarithms.
    pub(super) fn geometric(values: &[f64]) -> Self {
        let logarithms: Vec<f64> = values.iter().map(|v| v.ln()).collect();
        Self::mean(&logarithms).map(f64::exp)
    }

    /// The ratio of the means of two sets of independent values.
    pub(super) fn ratio(a: &[f64], b: &[f64]) -> Self {
        let (x, y) = (MeanError::of(a), MeanError::of(b));
        let errors = [x.stderr / x.mean, y.stderr / y.mean];
        Self::of_ratio([x.mean, y.mean], errors, a.len().min(b.len()))
    }

    /// The ratio of the mean squared errors of two rows of a study.
    pub(super) fn mse_ratio(a: &ResultRow, b: &ResultRow) -> Self {
        let errors = [a, b].map(|r| r.mse_stderr / r.mse);
        Self::of_ratio([a.mse, b.mse], errors, a.trials.min(b.trials) as usize)
    }

    /// The ratio of the processor times of two rows; the deviation over passes stands for the
    /// standard error, as what disturbs one disturbs the next.
    pub(super) fn time_ratio(a: &ResultRow, b: &ResultRow) -> Self {
        let errors = [a, b].map(|r| r.cpu_error / r.cpu_seconds);
        let value = a.cpu_seconds / b.cpu_seconds;
        // A normal interval: passes are many.
        let half = 1.96 * errors[0].hypot(errors[1]);
        Self {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        }
    }

    /// The geometric mean of independent positive figures: half widths of the logarithms add in
    /// squares. `None` of none.
    pub(super) fn pooled(all: &[Self]) -> Option<Self> {
        let n = all.len() as f64;
        let value = (all.iter().map(|m| m.value.ln()).sum::<f64>() / n).exp();
        let square = |m: &Self| ((m.high / m.low).ln() / 2.0).powi(2);
        let half = all.iter().map(square).sum::<f64>().sqrt() / n;
        (!all.is_empty()).then(|| Self {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        })
    }

    /// An increasing function of the figure.
    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            low: f(self.low),
            high: f(self.high),
        }
    }

    /// The product of two independent positive figures: half widths of the logarithms add in
    /// squares.
    pub(super) fn times(self, other: Self) -> Self {
        let half = |m: Self| (m.high / m.low).ln() / 2.0;
        let half = half(self).hypot(half(other));
        let value = self.value * other.value;
        Self {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        }
    }

    /// The quotient of two independent positive figures.
    pub(super) fn over(self, other: Self) -> Self {
        self.times(Self {
            value: 1.0 / other.value,
            low: 1.0 / other.high,
            high: 1.0 / other.low,
        })
    }

    /// The difference of two independent figures.
    pub(super) fn minus(self, other: Self) -> Self {
        let half = |m: Self| (m.high - m.low) / 2.0;
        let half = half(self).hypot(half(other));
        let value = self.value - other.value;
        Self {
            value,
            low: value - half,
            high: value + half,
        }
    }

    /// Whether the figure and both ends of its interval are numbers.
    pub(super) fn is_known(&self) -> bool {
        [self.value, self.low, self.high]
            .iter()
            .all(|v| v.is_finite())
    }
}

/// The one of these whose value is the largest.
pub(super) fn largest(all: impl IntoIterator<Item = Measured>) -> Option<Measured> {
    all.into_iter().max_by(|a, b| a.value.total_cmp(&b.value))
}

/// The one of these whose value is the smallest.
pub(super) fn smallest(all: impl IntoIterator<Item = Measured>) -> Option<Measured> {
    all.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_students() {
        let m = Measured::mean(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        // t(95 %, 4) = 2.776445 times √(2.5/5) = 0.707107: six digits of the table.
        assert!((m.value - 3.0).abs() < 1e-15 && (m.high - 3.0 - 1.963_243).abs() < 2e-6);
        let r = Measured::ratio(&[2.0, 2.0, 2.0], &[4.0, 4.0, 4.0]);
        assert_eq!((r.value, r.low, r.high), (0.5, 0.5, 0.5));
        let noisy = Measured::ratio(&[1.0, 3.0], &[4.0, 4.0]);
        // t(95 %, 1) = 12.7062 times a relative error of ½.
        assert!((noisy.high / noisy.value - (12.706_2_f64 * 0.5).exp()).abs() < 0.1);
    }

    #[test]
    fn products_and_differences_add_half_widths_in_squares() {
        let of = |value: f64, half: f64| Measured {
            value,
            low: value - half,
            high: value + half,
        };
        let d = of(5.0, 0.3).minus(of(2.0, 0.4));
        assert!((d.value - 3.0).abs() < 1e-15 && (d.high - 3.5).abs() < 1e-12);
        let wide = |value: f64, half: f64| Measured {
            value,
            low: value * (-half).exp(),
            high: value * half.exp(),
        };
        let p = wide(2.0, 0.3).times(wide(3.0, 0.4));
        assert!((p.high / 6.0 - 0.5_f64.exp()).abs() < 1e-12);
        let both = Measured::pooled(&[wide(2.0, 0.3), wide(8.0, 0.4)]).unwrap();
        assert!((both.high / 4.0 - 0.25_f64.exp()).abs() < 1e-12);
        assert!(Measured::pooled(&[]).is_none());
    }
}
