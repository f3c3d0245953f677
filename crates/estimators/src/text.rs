//! This module reads and writes estimators as text: it has the one parser, the one printer, and the
//! names of weights.
//!
//! The grammar is `TECHNIQUE+TECHNIQUE+…`, where each technique is `NAME[:SHARE][OPTIONS]` or
//! `NAME[OPTIONS]:SHARE`, and the options are `key=value,…` in brackets. The option `mis` chooses
//! the weights of the whole estimator and may be written with any technique; only for
//! `point-linear` it is an option of the technique itself.

use crate::options::{Options, ParseEstimatorError, Result, error, find};
use crate::technique::TECHNIQUES;
use crate::{Estimator, MOST_TECHNIQUES, Optimal, Part, Smoothing, Technique, Weights};
use std::fmt;
use std::str::FromStr;

/// The weights, and the names that they have in texts.
const WEIGHTS: [(&str, Weights); 8] = [
    ("balance", Weights::Balance),
    ("power", Weights::Power),
    ("maximum", Weights::Maximum),
    ("average", Weights::Average),
    ("smooth", Weights::Smooth(Smoothing::Variable)),
    ("smooth-fixed", Weights::Smooth(Smoothing::Fixed)),
    ("optimal", Weights::Optimal(Optimal::Free)),
    ("clamped-optimal", Weights::Optimal(Optimal::Clamped)),
];

/// Options that may be written with any technique and hold for the whole estimator.
#[derive(Default)]
struct Shared {
    weights: Option<Weights>,
    /// Whether there was an option that only weighted techniques have.
    weighted: bool,
}

impl FromStr for Estimator {
    type Err = ParseEstimatorError;

    fn from_str(text: &str) -> Result<Self> {
        // Parse the parts; options that hold for all are collected on the way.
        let mut shared = Shared::default();
        let mut parts = Vec::new();
        for word in split_outside_brackets(text) {
            parts.push(part(word.trim(), &mut shared)?);
        }
        // Find the weights, which may be given, needed by an option, or implied by the parts.
        let weights = match shared.weights {
            Some(weights) => weights,
            None if shared.weighted => Weights::Balance,
            None => Weights::implied(&parts),
        };
        if let Some(estimator) = Self::new(&parts, weights) {
            return Ok(estimator);
        }
        // Explain why the parts cannot be combined.
        if parts.iter().any(|p| p.technique.must_stand_alone()) {
            return error(
                "orientation `uniform`, `stratified` or `origin` is for line-area, line-analytic, exact or hybrid alone, without mis, pieces or points; expected parallel, fixed:FRACTION or spread:COUNT",
            );
        }
        error(format!(
            "`{text}` needs between 1 and {MOST_TECHNIQUES} techniques, a spread counted as its directions"
        ))
    }
}

/// Splits a text at the `+` signs that are not in brackets.
fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    text.split(move |c| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == '+' && depth == 0
    })
}

/// Parses one technique: `NAME[:SHARE][OPTIONS]`, or with the share after the options.
fn part(word: &str, shared: &mut Shared) -> Result<Part> {
    // Split the word into name, share and options.
    let (before, options, after) = match word.split_once('[') {
        None => (word, "", ""),
        Some((before, rest)) => match rest.split_once(']') {
            Some((options, after)) => (before, options, after),
            None => return error(format!("`{word}` lacks its closing `]`")),
        },
    };
    let (name, share) = match (before.split_once(':'), after.strip_prefix(':')) {
        (Some((name, share)), _) if after.is_empty() => (name, share),
        (Some((name, _)), _) => {
            return error(format!(
                "`{after}` after the options of `{name}`, whose share must come before the options"
            ));
        }
        (None, Some(share)) => (before, share),
        (None, None) if after.is_empty() => (before, "1"),
        (None, None) => {
            return error(format!(
                "`{after}` after the options of `{before}`; expected `:SHARE`"
            ));
        }
    };
    let Ok(share @ 1..) = share.parse() else {
        return error(format!(
            "share `{share}` of `{name}`; expected a whole number above 0"
        ));
    };
    let name = name.trim();
    // Look up the technique, and read its options.
    let technique = find(&TECHNIQUES, name, |names| {
        format!(
            "unknown estimator `{name}`; expected one of {}",
            names.join(", ")
        )
    })?;
    let mut options = Options::new(name, options);
    let technique: Technique = match technique {
        Technique::Points(points) => points.read(&mut options)?.into(),
        Technique::Lines(lines) => {
            let (lines, weighted) = lines.read(&mut options)?;
            shared.weighted |= weighted;
            lines.into()
        }
    };
    if let Some(weights) = options.take("mis").filter(|_| !technique.has_own_mis()) {
        shared.weigh(weights)?;
    }
    options.done()?;
    Ok(Part { technique, share })
}

impl Shared {
    /// Sets the weights of the estimator. It may be said several times, but always with the same
    /// value.
    fn weigh(&mut self, value: &str) -> Result<()> {
        let found = find(&WEIGHTS, value, |names| {
            format!("mis `{value}`; expected one of {}", names.join(", "))
        })?;
        match self.weights.replace(found) {
            Some(before) if before != found => error(format!(
                "mis `{value}` after `{}`; a combination has one",
                weights_name(before).unwrap_or_default()
            )),
            Some(_) | None => Ok(()),
        }
    }
}

/// The name of weights in texts; `None` for a technique without weights.
fn weights_name(weights: Weights) -> Option<&'static str> {
    let found = WEIGHTS.iter().find(|(_, w)| *w == weights);
    found.map(|(name, _)| *name)
}

impl fmt::Display for Estimator {
    /// Writes the estimator without what has its default value. The option `mis` is written with
    /// the last technique that can have it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words: Vec<(&Part, Vec<String>)> = self.parts().iter().map(with_options).collect();
        let implied = Weights::implied(self.parts());
        let says_weights = |(p, _): &&mut (&Part, _)| !p.technique.has_own_mis();
        if let Some(name) = weights_name(self.weights()).filter(|_| self.weights() != implied)
            && let Some((_, last)) = words.iter_mut().rev().find(says_weights)
        {
            last.push(format!("mis={name}"));
        }
        for (i, (part, options)) in words.iter().enumerate() {
            f.write_str(if i > 0 { "+" } else { "" })?;
            f.write_str(part.technique.name())?;
            if part.share != 1 {
                write!(f, ":{}", part.share)?;
            }
            if !options.is_empty() {
                write!(f, "[{}]", options.join(","))?;
            }
        }
        Ok(())
    }
}

/// Returns a part together with the options of its technique that differ from their defaults.
fn with_options(part: &Part) -> (&Part, Vec<String>) {
    let mut out = Vec::new();
    match part.technique {
        Technique::Points(points) => points.write(&mut out),
        Technique::Lines(lines) => lines.write(&mut out),
    }
    (part, out)
}
