//! Logarithmic axes, their ticks and labels, and the notation of numbers in plots and tables.

use linelit_elementary::{ln, log10};

/// The kind of numbers along an axis, which determines how its labels are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Plain numbers, written as powers of ten.
    Number,
    /// Counts, written in full.
    Count,
    /// Seconds, written with the usual prefixes.
    Seconds,
}

/// A logarithmic axis: the values from `low` to `high` (both positive) lie at the pixels from
/// `from` to `to`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogAxis {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl LogAxis {
    /// Returns the axis that contains all positive values, with a margin of a factor `pad` at both
    /// ends.
    pub(crate) fn spanning(values: impl Iterator<Item = f64>, pad: f64) -> Self {
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|v| *v > 0.0 && v.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (0.1, 10.0);
        }
        Self {
            low: low / pad,
            high: high * pad,
            from: 0.0,
            to: 1.0,
        }
    }

    /// Returns the same axis, drawn from the pixel `from` to the pixel `to`.
    pub(crate) fn over(self, from: f64, to: f64) -> Self {
        Self { from, to, ..self }
    }

    /// Returns the position of a value in pixels; values beyond the axis lie at its ends.
    pub(crate) fn pixel(&self, value: f64) -> f64 {
        let value = value.clamp(self.low, self.high);
        let t = ln(value / self.low) / ln(self.high / self.low);
        self.from + t * (self.to - self.from)
    }

    /// Returns whether a value is on the axis.
    pub(crate) fn holds(&self, value: f64) -> bool {
        // A tick at the end itself is on the axis, however the padding was rounded.
        value >= self.low * (1.0 - 1e-9) && value <= self.high * (1.0 + 1e-9)
    }

    /// Returns the number of decades that the axis spans.
    fn decades(&self) -> f64 {
        log10(self.high / self.low)
    }

    /// Returns the ticks, about nine at most: every decade, or every few decades, or 1, 2, 5 within
    /// few decades.
    pub(crate) fn ticks(&self) -> Vec<f64> {
        #[allow(clippy::cast_possible_truncation, reason = "exponents of f64 fit i32")]
        let exponent = |v: f64| log10(v).floor() as i32;
        let (first, last) = (exponent(self.low), exponent(self.high) + 1);
        #[allow(clippy::cast_possible_truncation, reason = "at most 617 decades")]
        let step = ((self.decades() / 9.0).ceil() as i32).max(1);
        let mantissas: &[f64] = if self.decades() <= 1.6 {
            &[1.0, 2.0, 5.0]
        } else {
            &[1.0]
        };
        let decades = (first..=last).filter(|k| k.rem_euclid(step) == 0);
        let ticks = decades.flat_map(|k| mantissas.iter().map(move |m| m * 10_f64.powi(k)));
        ticks.filter(|&tick| self.holds(tick)).collect()
    }

    /// Returns the ticks without those whose labels would touch: every one, or every second, or
    /// every third….
    pub(crate) fn thinned(&self, ticks: &[f64]) -> Vec<f64> {
        let inside: Vec<f64> = ticks.iter().copied().filter(|t| self.holds(*t)).collect();
        let kept = |step: usize| inside.iter().copied().step_by(step).collect::<Vec<f64>>();
        let apart = |pair: &[f64]| self.pixel(pair[1]) - self.pixel(pair[0]) >= 38.0;
        let mut some = (1..=inside.len()).map(kept);
        let found = some.find(|ticks| ticks.windows(2).all(apart));
        found.unwrap_or(inside)
    }

    /// Returns the pixels of the ends of an error bar, the lower of which is clamped to the axis;
    /// `None` if there is no error.
    pub(crate) fn bar(&self, [value, error]: [f64; 2]) -> Option<[f64; 2]> {
        let ends = [(value - error).max(self.low), value + error];
        (error > 0.0).then(|| ends.map(|end| self.pixel(end)))
    }
}

/// Returns the label of the tick at `value`.
pub(crate) fn label(value: f64, unit: Unit) -> String {
    match unit {
        Unit::Count => format!("{value}"),
        Unit::Seconds => seconds(value),
        Unit::Number => {
            let power = exponential(value, 0);
            power.strip_prefix("1·").unwrap_or(&power).to_owned()
        }
    }
}

/// Formats seconds so that they are read at a glance: `200 µs`, `5 s`.
pub(crate) fn seconds(value: f64) -> String {
    for (unit, size) in [("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)] {
        if value >= size * 0.999_999 {
            return format!("{} {unit}", short(value / size));
        }
    }
    format!("{} ns", short(value * 1e9))
}

/// Formats a number by three significant digits without trailing zeros; larger numbers are rounded
/// to whole ones.
pub(crate) fn short(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude >= 100.0 || magnitude <= 0.0 {
        return format!("{value:.0}");
    }
    #[allow(clippy::cast_possible_truncation, reason = "exponents of f64 fit i32")]
    let exponent = log10(magnitude).floor() as i32;
    let decimals = usize::try_from(2 - exponent).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Formats a number with a true minus sign, or a dash if it is not finite.
pub(crate) fn signed(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:.digits$}").replace('-', "−")
    } else {
        "–".to_owned()
    }
}

/// Formats a number by three digits and a power of ten, `1.25·10⁻⁷`, or as a dash if it is not
/// finite.
#[must_use]
pub fn scientific(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    if value.abs() <= 0.0 {
        return "0".to_owned();
    }
    exponential(value, 2)
}

/// Formats a number as a mantissa with this many decimals and a power of ten in superscript digits.
fn exponential(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$e}").replace('-', "−");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let digit = |d: u32| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(d as usize);
    let superscript = |c: char| c.to_digit(10).and_then(digit).unwrap_or('⁻');
    let exponent: String = exponent.chars().map(superscript).collect();
    format!("{mantissa}·10{exponent}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_few_and_inside() {
        for (low, high) in [
            (1e-3, 3.0),
            (0.9, 1.2),
            (1e-12, 1e9),
            (4.0, 4.0),
            (2e-4, 1e-3),
            (1e-300, 1e300),
        ] {
            let axis = LogAxis::spanning([low, high].into_iter(), 1.3);
            let ticks = axis.ticks();
            assert!((1..=10).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            assert!(ticks.iter().all(|&t| axis.holds(t)));
            assert!(ticks.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn places_run_from_end_to_end() {
        let axis = LogAxis::spanning([1.0, 100.0].into_iter(), 1.0).over(50.0, 250.0);
        assert!((axis.pixel(10.0) - 150.0).abs() < 1e-9);
        assert!((axis.pixel(1e9) - 250.0).abs() < 1e-9);
        let empty = LogAxis::spanning(std::iter::empty(), 1.5);
        assert!(empty.low < empty.high);
    }

    #[test]
    fn labels() {
        assert_eq!(label(64.0, Unit::Count), "64");
        assert_eq!(label(2e-4, Unit::Seconds), "200 µs");
        assert_eq!(label(50.0, Unit::Seconds), "50 s");
        assert_eq!(label(1e-3, Unit::Number), "10⁻³");
        assert_eq!(label(0.2, Unit::Number), "2·10⁻¹");
    }

    #[test]
    fn numbers_for_people() {
        assert_eq!(scientific(1.25e-7), "1.25·10⁻⁷");
        assert_eq!(scientific(-32.0), "−3.20·10¹");
        assert_eq!(
            (scientific(0.0), scientific(f64::NAN)),
            ("0".into(), "–".into())
        );
    }
}
