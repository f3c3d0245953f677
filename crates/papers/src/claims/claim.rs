//! A claim of a paper, and the verdict that a measured figure gives it.

use crate::measured::{Measured, number};
use std::fmt;

/// The papers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Paper {
    Billen,
    Salesin,
    Peters,
    Shirley,
}

impl Paper {
    pub(super) const ALL: [Self; 4] = [Self::Billen, Self::Salesin, Self::Peters, Self::Shirley];

    /// How it is cited.
    pub(super) const fn citation(self) -> &'static str {
        match self {
            Self::Billen => "Billen & Dutré 2016",
            Self::Salesin => "Salesin & Jarosz 2019",
            Self::Peters => "Peters 2021",
            Self::Shirley => "Shirley & Wang 1991",
        }
    }
}

/// What a claim expects of its figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Expected {
    /// This figure, give or take a tolerance; `none` is the figure where the effect that the claim
    /// is about is not there at all. Without it the claim is about the figure alone.
    Figure {
        value: f64,
        tolerance: f64,
        none: Option<f64>,
    },
    /// This or less.
    AtMost(f64),
    /// This or more.
    AtLeast(f64),
    /// What this machine and these scenes cannot tell; why is said beside.
    Elsewhere,
}

/// What a measurement makes of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// As the paper says, within the tolerance and the interval.
    Confirmed,
    /// More than the paper says.
    Stronger,
    /// Less than the paper says, or not to be told from nothing.
    Weaker,
    /// The opposite, or another figure.
    Refuted,
    /// Not to be measured here.
    NotMeasurable,
}

impl Verdict {
    pub(super) const ALL: [Self; 5] = [
        Self::Confirmed,
        Self::Stronger,
        Self::Weaker,
        Self::Refuted,
        Self::NotMeasurable,
    ];

    /// The verdict in words.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Stronger => "stronger",
            Self::Weaker => "weaker",
            Self::Refuted => "refuted",
            Self::NotMeasurable => "not measurable here",
        }
    }

    /// Whether a reader wants to know why.
    pub(super) const fn needs_reason(self) -> bool {
        matches!(self, Self::Weaker | Self::Refuted | Self::NotMeasurable)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Expected {
    /// The verdict of a figure, by its whole interval.
    ///
    /// A figure within the tolerance of the paper's confirms it. Beyond it, away from `none`, it is
    /// stronger; short of it weaker; at `none` or on its other side refuted, and where the interval
    /// holds `none` the effect is not told from nothing: weaker. A bound is confirmed or refuted by
    /// an interval on one side of it; one that holds it is weaker. A figure that is not known is
    /// weaker than any claim.
    pub(super) fn judge(self, measured: Option<Measured>) -> Verdict {
        if self == Self::Elsewhere {
            return Verdict::NotMeasurable;
        }
        let Some([low, high]) = measured.and_then(|m| m.known()) else {
            return Verdict::Weaker;
        };
        match self {
            Self::Elsewhere => Verdict::NotMeasurable,
            Self::AtMost(bound) => bounded(low, high, bound),
            Self::AtLeast(bound) => bounded(-high, -low, -bound),
            Self::Figure {
                value,
                tolerance,
                none: Some(none),
            } => {
                // Turned about so that more is stronger.
                let sign = (value - none).signum();
                let [low, high] = if sign > 0.0 {
                    [low, high]
                } else {
                    [-high, -low]
                };
                let (value, none) = (sign * value, sign * none);
                if high <= none {
                    Verdict::Refuted
                } else if low <= none || high < value - tolerance {
                    Verdict::Weaker
                } else if low > value + tolerance {
                    Verdict::Stronger
                } else {
                    Verdict::Confirmed
                }
            }
            Self::Figure {
                value, tolerance, ..
            } => {
                if low > value + tolerance || high < value - tolerance {
                    Verdict::Refuted
                } else if high - low <= 6.0 * tolerance {
                    Verdict::Confirmed
                } else {
                    // An interval that wide would hold nearly anything.
                    Verdict::Weaker
                }
            }
        }
    }

    /// What is expected, in figures.
    pub(super) fn text(self) -> String {
        match self {
            Self::Figure {
                value, tolerance, ..
            } if tolerance > 0.0 => format!("{} ± {}", number(value), number(tolerance)),
            Self::Figure { value, .. } => number(value),
            Self::AtMost(bound) => format!("≤ {}", number(bound)),
            Self::AtLeast(bound) => format!("≥ {}", number(bound)),
            Self::Elsewhere => "–".to_owned(),
        }
    }

    /// What follows from the figure, in a sentence.
    pub(super) fn sentence(self, measured: Option<Measured>) -> String {
        if self == Self::Elsewhere {
            return "Not measured.".to_owned();
        }
        let Some(found) = measured.filter(|m| m.known().is_some()) else {
            return "The figure has no interval, or is none: nothing follows from it.".to_owned();
        };
        let verdict = self.judge(measured);
        match (self, verdict) {
            (Self::Figure { value, .. }, Verdict::Confirmed) => {
                format!("{found}: as the paper's {}.", number(value))
            }
            (Self::Figure { value, .. }, Verdict::Stronger) => {
                format!("{found}, beyond the paper's {}.", number(value))
            }
            (
                Self::Figure {
                    value,
                    none: Some(none),
                    ..
                },
                Verdict::Weaker,
            ) => {
                let share = 100.0 * (found.value - none) / (value - none);
                format!(
                    "{found}: {share:.0} % of the way from {} (no effect) to the paper's {}.",
                    number(none),
                    number(value)
                )
            }
            (
                Self::Figure {
                    value,
                    none: Some(none),
                    ..
                },
                _,
            ) => format!(
                "{found}: no effect in the paper's sense, which is from {} to {}.",
                number(none),
                number(value)
            ),
            (Self::Figure { value, .. }, Verdict::Weaker) => {
                format!(
                    "{found}: too wide an interval to tell of {}.",
                    number(value)
                )
            }
            (Self::Figure { value, .. }, _) => {
                format!("{found}, not the paper's {}.", number(value))
            }
            (Self::AtMost(_) | Self::AtLeast(_), Verdict::Confirmed) => {
                format!("{found}, {}.", self.text())
            }
            (Self::AtMost(_) | Self::AtLeast(_), Verdict::Weaker) => {
                format!("{found} is on both sides of {}.", self.text())
            }
            _ => format!("{found}, not {}.", self.text()),
        }
    }
}

fn bounded(low: f64, high: f64, most: f64) -> Verdict {
    if high <= most {
        Verdict::Confirmed
    } else if low > most {
        Verdict::Refuted
    } else {
        Verdict::Weaker
    }
}

/// A claim of a paper.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    /// A name that stays: results, records and explanations go by it.
    pub(super) id: String,
    pub(super) paper: Paper,
    /// Figure, table or section.
    pub(super) place: &'static str,
    /// The claim, in our words.
    pub(super) says: String,
    pub(super) expected: Expected,
    /// How the expected figure was read.
    pub(super) read: &'static str,
    /// Why the tolerance is what it is.
    pub(super) why: &'static str,
    /// The figure that tells, by its name in [`Figures`](super::bench::Figures).
    pub(super) figure: String,
    /// The verdict of the last run that was looked at, of the quick form.
    pub(super) recorded: Verdict,
    /// Why it is weaker, refuted or not measurable here.
    pub(super) reason: Option<Reason>,
    /// Verdict and reason of the other form, where it comes to another verdict: of `--full`, until
    /// [`Claim::in_full`].
    pub(super) otherwise: Option<(Verdict, Option<Reason>)>,
    /// Whether the figure hangs on how long something took. Of such a one a busy machine may tell
    /// nothing, which contradicts no record.
    pub(super) is_timed: bool,
}

/// An explanation, and the figure that it is checked by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reason {
    pub(super) words: &'static str,
    /// A figure that is as the words say. `None` where they need no figure.
    pub(super) check: Option<(&'static str, Expected)>,
}

/// How a figure was read that the paper's text or table prints.
pub(super) const PRINTED: &str = "printed";
/// How an order was read: of which of two is better.
pub(super) const ORDERING: &str = "printed, as an ordering";

impl Claim {
    /// A claim that is confirmed by a figure of the same name; expected, read and tolerated as is
    /// said next.
    pub(super) fn new(
        paper: Paper,
        id: impl Into<String>,
        place: &'static str,
        says: impl Into<String>,
    ) -> Self {
        let id = id.into();
        Self {
            figure: id.clone(),
            id,
            paper,
            place,
            says: says.into(),
            expected: Expected::Elsewhere,
            read: PRINTED,
            why: "",
            recorded: Verdict::Confirmed,
            reason: None,
            otherwise: None,
            is_timed: false,
        }
    }

    /// Expects a figure; at `none` there is no effect.
    pub(super) fn figure(
        mut self,
        value: f64,
        none: f64,
        tolerance: f64,
        why: &'static str,
    ) -> Self {
        self.expected = Expected::Figure {
            value,
            tolerance,
            none: Some(none),
        };
        self.why = why;
        self
    }

    /// Expects a figure, and neither more nor less.
    pub(super) fn just(mut self, value: f64, tolerance: f64, why: &'static str) -> Self {
        self.expected = Expected::Figure {
            value,
            tolerance,
            none: None,
        };
        self.why = why;
        self
    }

    /// Expects at most this.
    pub(super) fn at_most(mut self, bound: f64, why: &'static str) -> Self {
        self.expected = Expected::AtMost(bound);
        (self.read, self.why) = (ORDERING, why);
        self
    }

    /// Expects at least this.
    pub(super) fn at_least(mut self, bound: f64, why: &'static str) -> Self {
        self.expected = Expected::AtLeast(bound);
        (self.read, self.why) = (ORDERING, why);
        self
    }

    /// By another figure than that of its own name.
    pub(super) fn by(mut self, figure: impl Into<String>) -> Self {
        self.figure = figure.into();
        self
    }

    /// The figure hangs on times.
    pub(super) const fn timed(mut self) -> Self {
        self.is_timed = true;
        self
    }

    /// Whether a verdict is another than that on record: of a figure that hangs on times, only if
    /// both tell something.
    pub(super) fn differs(&self, verdict: Verdict) -> bool {
        let tells = |v: Verdict| !self.is_timed || v != Verdict::Weaker;
        verdict != self.recorded && tells(verdict) && tells(self.recorded)
    }

    /// The verdict on record.
    pub(super) const fn recorded(mut self, verdict: Verdict) -> Self {
        self.recorded = verdict;
        self
    }

    /// The verdict on record of `--full`, which is another one than that of the quick form; why,
    /// and the figure that says so.
    pub(super) const fn but_in_full(
        mut self,
        verdict: Verdict,
        words: &'static str,
        check: Option<(&'static str, Expected)>,
    ) -> Self {
        self.otherwise = Some((verdict, Some(Reason { words, check })));
        self
    }

    /// As `--full` is held to it; the quick form's verdict is the other one then.
    pub(super) const fn in_full(mut self) -> Self {
        if let Some(full) = self.otherwise {
            self.otherwise = Some((self.recorded, self.reason));
            (self.recorded, self.reason) = full;
        }
        self
    }

    /// Why, where no figure is needed to tell.
    pub(super) const fn because(mut self, words: &'static str) -> Self {
        self.reason = Some(Reason { words, check: None });
        self
    }

    /// Why, and the figure that says so.
    pub(super) const fn because_of(
        mut self,
        words: &'static str,
        figure: &'static str,
        expected: Expected,
    ) -> Self {
        self.reason = Some(Reason {
            words,
            check: Some((figure, expected)),
        });
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn m(low: f64, value: f64, high: f64) -> Option<Measured> {
        let interval = Some([low, high]);
        Some(Measured { value, interval })
    }

    #[test]
    fn verdicts_go_by_the_whole_interval() {
        let order = Expected::Figure {
            value: -1.15,
            tolerance: 0.05,
            none: Some(-0.5),
        };
        for (measured, verdict) in [
            (m(-1.2, -1.17, -1.14), Verdict::Confirmed),
            (m(-1.3, -1.2, -1.19), Verdict::Confirmed),
            (m(-1.3, -1.25, -1.21), Verdict::Stronger),
            (m(-1.09, -1.0, -0.9), Verdict::Weaker),
            (m(-1.3, -0.9, -0.45), Verdict::Weaker),
            (m(-0.5, -0.45, -0.4), Verdict::Refuted),
            (m(f64::NAN, -1.15, f64::NAN), Verdict::Weaker),
            (None, Verdict::Weaker),
        ] {
            assert_eq!(order.judge(measured), verdict, "{measured:?}");
        }
        // The same to the other side.
        let gain = Expected::Figure {
            value: 2.5,
            tolerance: 0.2,
            none: Some(1.0),
        };
        assert_eq!(gain.judge(m(2.8, 3.0, 3.2)), Verdict::Stronger);
        assert_eq!(gain.judge(m(1.2, 1.5, 1.8)), Verdict::Weaker);
        assert_eq!(gain.judge(m(0.7, 0.8, 0.9)), Verdict::Refuted);
    }

    #[test]
    fn bounds_and_bare_figures() {
        for (expected, measured, verdict) in [
            (Expected::AtMost(1.0), m(0.8, 0.9, 1.0), Verdict::Confirmed),
            (Expected::AtMost(1.0), m(0.8, 0.9, 1.1), Verdict::Weaker),
            (Expected::AtMost(1.0), m(1.1, 1.2, 1.3), Verdict::Refuted),
            (Expected::AtLeast(1.0), m(1.0, 1.2, 1.3), Verdict::Confirmed),
            (Expected::AtLeast(1.0), m(0.1, 0.2, 0.3), Verdict::Refuted),
            (
                Expected::Elsewhere,
                m(0.0, 0.0, 0.0),
                Verdict::NotMeasurable,
            ),
        ] {
            assert_eq!(expected.judge(measured), verdict, "{expected:?}");
        }
        let half = Expected::Figure {
            value: -0.5,
            tolerance: 0.01,
            none: None,
        };
        assert_eq!(half.judge(m(-0.52, -0.505, -0.49)), Verdict::Confirmed);
        assert_eq!(half.judge(m(-0.55, -0.53, -0.511)), Verdict::Refuted);
        assert_eq!(half.judge(m(-0.495, -0.485, -0.475)), Verdict::Confirmed);
        assert_eq!(half.judge(m(-0.9, -0.5, -0.1)), Verdict::Weaker);
    }

    #[test]
    fn a_busy_machine_contradicts_nothing() {
        let claim = || Claim::new(Paper::Billen, "a", "b", "c.").at_most(1.0, "d");
        for (recorded, found, differs, timed_differs) in [
            (Verdict::Confirmed, Verdict::Confirmed, false, false),
            (Verdict::Confirmed, Verdict::Weaker, true, false),
            (Verdict::Weaker, Verdict::Refuted, true, false),
            (Verdict::Confirmed, Verdict::Refuted, true, true),
        ] {
            assert_eq!(claim().recorded(recorded).differs(found), differs);
            let timed = claim().timed().recorded(recorded);
            assert_eq!(timed.differs(found), timed_differs);
        }
    }

    #[test]
    fn sentences_follow_from_the_figures() {
        let order = Expected::Figure {
            value: -1.5,
            tolerance: 0.05,
            none: Some(-0.5),
        };
        let text = order.sentence(m(-1.02, -1.0, -0.98));
        assert_eq!(
            text,
            "−1 [−1.02, −0.98]: 50 % of the way from −0.5 (no effect) to the paper's −1.5."
        );
        assert_eq!(
            Expected::AtMost(1.0).sentence(m(0.25, 0.25, 0.25)),
            "0.25, ≤ 1."
        );
    }
}
