//! Measured numbers with confidence intervals, and their arithmetic. Claims of papers are judged by
//! these intervals.
//!
//! Intervals of positive numbers are symmetric in the logarithm. Half widths of independent numbers
//! add like standard errors: hypot(a, b).

use linelit_elementary::{exp, hypot, ln, pow};
use linelit_study::report::scientific;
use linelit_study::stats::metrics::MeanError;
use linelit_study::stats::slopes::{LEAST_TRIALS, SlopePoint, fit_trials};
use linelit_study::stats::student;
use serde::Serialize;
use std::fmt;

/// The confidence of all intervals.
const CONFIDENCE: f64 = 0.95;
/// The number of passes that a timing is assumed to have when its interval is computed, as the
/// number of passes is not recorded. With this many, Student's t differs from a normal number by
/// 0.1 %.
const MANY_PASSES: usize = 1000;

/// A measured number with its 95 % confidence interval. The interval is missing if there were too
/// few trials ([`LEAST_TRIALS`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Measured {
    /// The number.
    pub value: f64,
    /// The lower and upper end of the confidence interval; `None` if there were too few trials.
    pub interval: Option<[f64; 2]>,
}

impl Measured {
    /// A number that could not be measured.
    pub(crate) const UNKNOWN: Self = Self {
        value: f64::NAN,
        interval: None,
    };

    /// Returns a number without noise: a count, or the value of a formula.
    pub(crate) const fn exact(value: f64) -> Self {
        Self {
            value,
            interval: Some([value; 2]),
        }
    }

    /// Returns the number `value` with the interval `value` ± `half`; without an interval if `half`
    /// is not finite.
    fn around(value: f64, half: f64) -> Self {
        Self {
            value,
            interval: half.is_finite().then_some([value - half, value + half]),
        }
    }

    /// Returns the mean of independent values.
    pub(crate) fn mean(values: &[f64]) -> Self {
        let MeanError { mean, stderr } = MeanError::of(values);
        Self::around(mean, quantile(values.len()) * stderr)
    }

    /// Returns a positive mean of this many values with its standard error. The interval is
    /// symmetric in the logarithm of the mean, whose standard error is `stderr`/`mean` to first
    /// order.
    fn positive(mean: f64, stderr: f64, values: usize) -> Self {
        Self::around(ln(mean), quantile(values) * stderr / mean).map(exp)
    }

    /// Returns the mean of independent positive values.
    pub(crate) fn positive_mean(values: &[f64]) -> Self {
        let MeanError { mean, stderr } = MeanError::of(values);
        Self::positive(mean, stderr, values.len())
    }

    /// Returns the order of the standard deviation over the number of samples, or an unknown number
    /// if none can be fitted.
    pub(crate) fn order_of(points: &[SlopePoint]) -> Self {
        let Some(found) = fit_trials(points, CONFIDENCE) else {
            return Self::UNKNOWN;
        };
        let ends = [found.ci_low, found.ci_high];
        Self {
            value: found.order,
            interval: ends.iter().all(|end| end.is_finite()).then_some(ends),
        }
    }

    /// Returns the ratio of the means of two independent sets of positive values.
    pub(crate) fn ratio(top: &[f64], bottom: &[f64]) -> Self {
        let [a, b] = [top, bottom].map(|values| {
            let MeanError { mean, stderr } = MeanError::of(values);
            Self::positive(mean, stderr, values.len())
        });
        a.over(b)
    }

    /// Returns a time with its deviation over passes. The deviation is used as the standard error
    /// without dividing it by a number of passes, since what disturbs one pass disturbs the next.
    pub(crate) fn time(seconds: f64, deviation: f64) -> Self {
        Self::positive(seconds, deviation, MANY_PASSES)
    }

    /// Returns the geometric mean of positive values, such as ratios of times taken in turns.
    pub(crate) fn geometric_mean(values: &[f64]) -> Self {
        let logarithms: Vec<f64> = values.iter().map(|v| ln(*v)).collect();
        Self::mean(&logarithms).map(exp)
    }

    /// Returns the geometric mean of independent positive numbers, or `None` if there are none.
    pub(crate) fn pooled(all: &[Self]) -> Option<Self> {
        let product = all.iter().copied().reduce(Self::times)?;
        Some(product.map(|v| pow(v, 1.0 / all.len() as f64)))
    }

    /// Applies an increasing function to the number and to both ends of its interval.
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            value: f(self.value),
            interval: self.interval.map(|ends| ends.map(f)),
        }
    }

    /// Returns the difference of two independent numbers. Half widths add like standard errors.
    pub(crate) fn minus(self, other: Self) -> Self {
        let half = |m: Self| {
            m.interval
                .map_or(f64::NAN, |[low, high]| 0.5 * (high - low))
        };
        Self::around(self.value - other.value, hypot(half(self), half(other)))
    }

    /// Returns the quotient of two independent positive numbers, by the difference of their
    /// logarithms.
    pub(crate) fn over(self, other: Self) -> Self {
        self.map(ln).minus(other.map(ln)).map(exp)
    }

    /// Returns the product of two independent positive numbers.
    pub(crate) fn times(self, other: Self) -> Self {
        self.over(Self {
            value: 1.0 / other.value,
            interval: other.interval.map(|[low, high]| [1.0 / high, 1.0 / low]),
        })
    }

    /// Returns the interval if there is one, and the number and both ends of the interval are
    /// finite; otherwise `None`.
    pub(crate) fn known(&self) -> Option<[f64; 2]> {
        let known = |ends: &[f64; 2]| [self.value, ends[0], ends[1]].iter().all(|v| v.is_finite());
        self.interval.filter(known)
    }
}

/// Writes the number, and its interval in brackets.
impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", number(self.value))?;
        match self.interval {
            Some([low, high]) if low < high => write!(f, " [{}, {}]", number(low), number(high)),
            Some(_) => Ok(()),
            None => write!(f, " [–]"),
        }
    }
}

/// Formats a number with about four significant digits and at most three decimals, or by a power of
/// ten if it is very small or large.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if !size.is_finite() || (size > 0.0 && !(1e-3..1e5).contains(&size)) {
        return scientific(value);
    }
    let digits = match size {
        s if s >= 1000.0 => 0,
        s if s >= 100.0 => 1,
        s if s >= 10.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.digits$}").replace('-', "−");
    if digits > 0 && text.contains('.') {
        let text = text.trim_end_matches('0').trim_end_matches('.');
        return text.to_owned();
    }
    text
}

/// Returns the quantile of Student's t distribution for an interval from this many values; NaN if
/// there are too few.
fn quantile(values: usize) -> f64 {
    if values < LEAST_TRIALS {
        return f64::NAN;
    }
    let freedom = u32::try_from(values - 1).unwrap_or(u32::MAX);
    student::quantile(CONFIDENCE, freedom)
}

/// Returns the number with the largest value; `None` if there are no numbers.
pub(crate) fn largest(all: impl IntoIterator<Item = Measured>) -> Option<Measured> {
    all.into_iter().max_by(|a, b| a.value.total_cmp(&b.value))
}

/// Returns the number with the smallest value; `None` if there are no numbers.
pub(crate) fn smallest(all: impl IntoIterator<Item = Measured>) -> Option<Measured> {
    all.into_iter().min_by(|a, b| a.value.total_cmp(&b.value))
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
        assert_eq!(Measured::mean(&[1.0, 2.0, 3.0, 4.0]).interval, None);
        assert_eq!(Measured::exact(2.0).to_string(), "2");
        assert_eq!(Measured::mean(&[1.0; 2]).to_string(), "1 [–]");
    }

    #[test]
    fn products_and_differences_add_half_widths_in_squares() {
        let around = |value: f64, half: f64| Measured::around(value, half);
        let [low, high] = around(5.0, 0.3).minus(around(2.0, 0.4)).known().unwrap();
        assert!((low - 2.5).abs() < 1e-14 && (high - 3.5).abs() < 1e-14);
        let wide = |value: f64, half: f64| Measured::around(ln(value), half).map(exp);
        let [_, high] = wide(2.0, 0.3).times(wide(3.0, 0.4)).known().unwrap();
        assert!((high / 6.0 - exp(0.5)).abs() < 1e-14);
        let [_, high] = wide(6.0, 0.3).over(wide(3.0, 0.4)).known().unwrap();
        assert!((high / 2.0 - exp(0.5)).abs() < 1e-14);
        let both = Measured::pooled(&[wide(2.0, 0.3), wide(8.0, 0.4)]).unwrap();
        assert!((both.value - 4.0).abs() < 1e-14);
        assert!((both.known().unwrap()[1] / 4.0 - exp(0.25)).abs() < 1e-14);
        assert_eq!(Measured::pooled(&[]), None);
        // A number without an interval gives results without intervals.
        assert_eq!(around(5.0, 0.3).minus(Measured::mean(&[2.0])).known(), None);
        assert_eq!(Measured::ratio(&[0.0; 8], &[1.0; 8]).known(), None);
    }

    #[test]
    fn numbers_for_readers() {
        assert_eq!(number(12_345.6), "12346");
        assert_eq!(number(1.58e-5), "1.58·10⁻⁵");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(-0.25), "−0.25");
        assert_eq!(number(f64::NAN), "–");
    }

    /// Simulates 2,000 ratios of means of eight uniform numbers in [1, 2]: 95 % are in their
    /// intervals, ± 3.3 standard deviations of a binomial (α = 0.001), and 0.7 % for the first
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
        // It uses t(7), where Welch's test has 14 degrees of freedom: the intervals are a little
        // wide.
        let share = f64::from(covered) / 2000.0;
        let spread = 3.3 * (0.05 * 0.95 / 2000.0_f64).sqrt();
        assert!(
            share > 0.95 - spread - 0.007 && share < 0.98 + spread,
            "{share}"
        );
    }
}
