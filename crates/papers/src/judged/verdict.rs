//! The verdict on a paper's number or bound, from a measured number with its confidence interval.

use crate::measured::{Measured, number};
use serde::Deserialize;
use std::fmt;

/// The number or bound that a paper gives.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Bounds")]
pub(super) enum Expected {
    /// A number with a tolerance. `none` is the value that would mean no effect, on one side of the
    /// number: a measurement farther from it than the paper's is stronger. Without `none`, any
    /// other number refutes the claim.
    Figure {
        value: f64,
        tolerance: f64,
        none: Option<f64>,
    },
    /// Less than a bound.
    Below(f64),
    /// More than a bound.
    Above(f64),
}

/// The expected number or bound as `claims.toml` has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Bounds {
    value: Option<f64>,
    tolerance: Option<f64>,
    none: Option<f64>,
    below: Option<f64>,
    above: Option<f64>,
}

impl TryFrom<Bounds> for Expected {
    type Error = &'static str;

    fn try_from(b: Bounds) -> Result<Self, Self::Error> {
        match (b.value, b.tolerance, b.none, b.below, b.above) {
            (Some(value), Some(tolerance), none, None, None) if tolerance > 0.0 => {
                Ok(Self::Figure {
                    value,
                    tolerance,
                    none,
                })
            }
            (None, None, None, Some(bound), None) => Ok(Self::Below(bound)),
            (None, None, None, None, Some(bound)) => Ok(Self::Above(bound)),
            _ => Err("expect a value with a positive tolerance, or below, or above"),
        }
    }
}

/// The verdict on a claim, which follows from the measured number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Verdict {
    /// The whole interval is within the tolerance of the paper's number, or on the claimed side of
    /// a bound.
    Confirmed,
    /// The interval overlaps the tolerance, or contains the bound.
    Consistent,
    /// The measured effect is stronger than the paper's: the whole interval is beyond the paper's
    /// number and its tolerance.
    Stronger,
    /// The measured effect is weaker than the paper's: the whole interval is between no effect and
    /// the paper's number, or at least not beyond no effect.
    Weaker,
    /// There is no effect, or the opposite one; or the number, if it has no value of no effect, is
    /// another one.
    Refuted,
    /// The claim cannot be measured here.
    NotMeasurable,
}

impl Verdict {
    pub(super) const ALL: [Self; 6] = [
        Self::Confirmed,
        Self::Consistent,
        Self::Stronger,
        Self::Weaker,
        Self::Refuted,
        Self::NotMeasurable,
    ];

    /// Returns the verdict in words.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Consistent => "consistent",
            Self::Stronger => "stronger",
            Self::Weaker => "weaker",
            Self::Refuted => "refuted",
            Self::NotMeasurable => "not measurable here",
        }
    }

    /// Returns whether a claim with this verdict needs a reason.
    pub(super) const fn needs_reason(self) -> bool {
        matches!(self, Self::Weaker | Self::Refuted | Self::NotMeasurable)
    }

    /// Returns whether two verdicts exclude each other: they differ, and neither is `Consistent`.
    pub(super) fn contradicts(self, other: Self) -> bool {
        self != other && self != Self::Consistent && other != Self::Consistent
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Expected {
    /// Returns the verdict on a measured number. An unknown number is consistent with everything.
    pub(super) fn judge(self, measured: Measured) -> Verdict {
        let Some([low, high]) = measured.known() else {
            return Verdict::Consistent;
        };
        // A bound needs only the comparison; `Above` is `Below` with all signs changed.
        let (value, tolerance, none) = match self {
            Self::Below(bound) => return bounded(low, high, bound),
            Self::Above(bound) => return bounded(-high, -low, -bound),
            Self::Figure {
                value,
                tolerance,
                none,
            } => (value, tolerance, none),
        };
        // Compare the interval with the tolerance of the paper's number.
        let (least, most) = (value - tolerance, value + tolerance);
        if least <= low && high <= most {
            return Verdict::Confirmed;
        }
        if least <= high && low <= most {
            return Verdict::Consistent;
        }
        // The whole interval is on one side of the tolerance. It is stronger on the side away from
        // no effect; otherwise it is refuted if all of it is beyond no effect.
        let Some(none) = none else {
            return Verdict::Refuted;
        };
        let above = low > most;
        if above == (value > none) {
            Verdict::Stronger
        } else if (above && low >= none) || (!above && high <= none) {
            Verdict::Refuted
        } else {
            Verdict::Weaker
        }
    }

    /// Returns the expected number or bound as text.
    pub(super) fn text(self) -> String {
        match self {
            Self::Figure {
                value, tolerance, ..
            } => format!("{} ± {}", number(value), number(tolerance)),
            Self::Below(bound) => format!("< {}", number(bound)),
            Self::Above(bound) => format!("> {}", number(bound)),
        }
    }
}

/// Returns the verdict on an interval that should be below a bound.
fn bounded(low: f64, high: f64, bound: f64) -> Verdict {
    if high < bound {
        Verdict::Confirmed
    } else if low >= bound {
        Verdict::Refuted
    } else {
        Verdict::Consistent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn m(low: f64, high: f64) -> Measured {
        Measured {
            value: 0.5 * (low + high),
            interval: Some([low, high]),
        }
    }

    #[test]
    fn verdicts_go_by_the_whole_interval() {
        let order = Expected::Figure {
            value: -1.15,
            tolerance: 0.05,
            none: Some(-0.5),
        };
        for (measured, verdict) in [
            (m(-1.19, -1.11), Verdict::Confirmed),
            (m(-1.2, -1.0), Verdict::Consistent),
            (m(-1.3, -1.15), Verdict::Consistent),
            (m(-1.3, -0.3), Verdict::Consistent),
            (m(-1.3, -1.21), Verdict::Stronger),
            (m(-1.05, -0.9), Verdict::Weaker),
            (m(-1.05, -0.4), Verdict::Weaker),
            (m(-0.5, -0.4), Verdict::Refuted),
            (Measured::UNKNOWN, Verdict::Consistent),
        ] {
            assert_eq!(order.judge(measured), verdict, "{measured:?}");
        }
        let alone = Expected::Figure {
            value: 1.0,
            tolerance: 0.1,
            none: None,
        };
        assert_eq!(alone.judge(m(0.95, 1.05)), Verdict::Confirmed);
        assert_eq!(alone.judge(m(1.11, 1.2)), Verdict::Refuted);
    }

    #[test]
    fn a_bound_is_strict() {
        let below = Expected::Below(1.0);
        assert_eq!(below.judge(m(0.8, 0.99)), Verdict::Confirmed);
        assert_eq!(below.judge(m(0.8, 1.0)), Verdict::Consistent);
        // A ratio of one would mean no gain.
        assert_eq!(below.judge(m(1.0, 1.0)), Verdict::Refuted);
        assert_eq!(Expected::Above(1.0).judge(m(1.0, 1.0)), Verdict::Refuted);
        assert_eq!(Expected::Above(1.0).judge(m(1.01, 1.2)), Verdict::Confirmed);
    }

    #[test]
    fn verdicts_contradict_across_consistent() {
        assert!(Verdict::Confirmed.contradicts(Verdict::Weaker));
        assert!(Verdict::Weaker.contradicts(Verdict::Confirmed));
        assert!(!Verdict::Consistent.contradicts(Verdict::Refuted));
        assert!(!Verdict::Refuted.contradicts(Verdict::Refuted));
    }
}
