//! The text of estimators: one grammar, one parser, one printer, one table of names.
//!
//! `TECHNIQUE+TECHNIQUE+…`, each `NAME[:SHARE][OPTIONS]` or `NAME[OPTIONS]:SHARE`, with options as
//! `key=value,…` in brackets. The option `mis` may stand with any technique and is one for all;
//! that of `point-linear` is its own.

use crate::{Estimator, MOST_TECHNIQUES, Optimal, Part, Smoothing, Technique, Weights};
use std::fmt;
use std::str::FromStr;

/// The weights and their names.
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

/// Why a text names no estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseEstimatorError {
    message: String,
    unknown: Option<(String, Vec<&'static str>)>,
}

impl ParseEstimatorError {
    /// The word that is no name, and the names that there are for what stands there: of a
    /// technique, an option, or an option's value. `None` where something else is wrong.
    ///
    /// ```
    /// use linelit_estimators::Estimator;
    ///
    /// let error = "line-area[offst=uniform]".parse::<Estimator>().unwrap_err();
    /// let (word, names) = error.unknown().unwrap();
    /// assert_eq!((word, names.contains(&"offset")), ("offst", true));
    /// ```
    #[must_use]
    pub fn unknown(&self) -> Option<(&str, &[&'static str])> {
        let (word, names) = self.unknown.as_ref()?;
        Some((word, names))
    }
}

impl fmt::Display for ParseEstimatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ParseEstimatorError {}

pub(crate) type Result<T> = std::result::Result<T, ParseEstimatorError>;

pub(crate) fn error<T>(message: impl Into<String>) -> Result<T> {
    Err(ParseEstimatorError {
        message: message.into(),
        unknown: None,
    })
}

/// As [`error`], about a word that is none of some names.
pub(crate) fn unknown<T>(message: String, word: &str, names: Vec<&'static str>) -> Result<T> {
    let unknown = Some((word.to_owned(), names));
    Err(ParseEstimatorError { message, unknown })
}

/// What stands with any technique and counts for all.
#[derive(Default)]
struct Shared {
    weights: Option<Weights>,
    /// Whether an option was said that only weighted techniques have.
    weighted: bool,
}

impl FromStr for Estimator {
    type Err = ParseEstimatorError;

    fn from_str(text: &str) -> Result<Self> {
        let mut shared = Shared::default();
        let mut parts = Vec::new();
        for word in split_outside_brackets(text) {
            parts.push(part(word.trim(), &mut shared)?);
        }
        let stands_alone = |p: &Part| !shared.weighted && p.technique.can_stand_alone();
        let weights = match (shared.weights, &parts[..]) {
            (Some(weights), _) => weights,
            (None, [only]) if stands_alone(only) => Weights::Alone,
            (None, _) => Weights::Balance,
        };
        if let Some(estimator) = Self::new(&parts, weights) {
            return Ok(estimator);
        }
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

/// The parts between `+` signs that stand in no brackets.
fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    text.split(move |c| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == '+' && depth == 0
    })
}

/// `NAME[:SHARE][OPTIONS]`, or with the share after the options.
fn part(word: &str, shared: &mut Shared) -> Result<Part> {
    let (before, options, after) = match word.split_once('[') {
        None => (word, "", ""),
        Some((before, rest)) => match rest.split_once(']') {
            Some((options, after)) => (before, options, after),
            None => return error(format!("`{word}` lacks its closing `]`")),
        },
    };
    let (name, share) = match before.split_once(':') {
        Some((name, share)) if after.is_empty() => (name, Some(share)),
        Some((name, _)) => {
            return error(format!(
                "`{after}` after the options of `{name}`, whose share stands before them"
            ));
        }
        None => (before, after.strip_prefix(':')),
    };
    let share = match share {
        None if after.is_empty() => 1,
        None => {
            return error(format!(
                "`{after}` after the options of `{name}`; expected `:SHARE`"
            ));
        }
        Some(text) => match text.parse() {
            Ok(share @ 1..) => share,
            _ => {
                return error(format!(
                    "share `{text}` of `{name}`; expected a whole number above 0"
                ));
            }
        },
    };
    let name = name.trim();
    let Some(technique) = Technique::all().find(|t| t.name() == name) else {
        let names: Vec<&str> = Technique::all().map(|t| t.name()).collect();
        let expected = names.join(", ");
        let message = format!("unknown estimator `{name}`; expected one of {expected}");
        return unknown(message, name, names);
    };
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

/// A technique's own options.
pub(crate) trait OwnOptions: Sized {
    /// With the options that a text says.
    fn read(self, options: &mut Options<'_>) -> Result<Self>;

    /// Those that are not the default, as `key=value`.
    fn write(self, out: &mut Vec<String>);
}

/// The options in the brackets of one technique, until they are read.
pub(crate) struct Options<'a> {
    technique: &'a str,
    unread: Vec<(&'a str, &'a str)>,
    /// The keys that there are.
    keys: Vec<&'static str>,
}

impl<'a> Options<'a> {
    /// Of `key=value,…`.
    fn new(technique: &'a str, text: &'a str) -> Self {
        let options = text.split(',').map(str::trim).filter(|o| !o.is_empty());
        Self {
            technique,
            unread: options
                .map(|o| o.split_once('=').unwrap_or((o, "")))
                .collect(),
            keys: Vec::new(),
        }
    }

    /// The value of an option, the last if it is said again.
    pub(crate) fn take(&mut self, key: &'static str) -> Option<&'a str> {
        if !self.keys.contains(&key) {
            self.keys.push(key);
        }
        let value = self.unread.iter().rfind(|(k, _)| *k == key)?.1;
        self.unread.retain(|(k, _)| *k != key);
        Some(value)
    }

    /// Sets an option to what `read` makes of its value, if it is said, and tells whether it is;
    /// where `read` makes nothing of it, an error says what was expected.
    pub(crate) fn read<V>(
        &mut self,
        key: &'static str,
        expected: &str,
        read: impl Fn(&str) -> Option<V>,
        option: &mut V,
    ) -> Result<bool> {
        let Some(value) = self.take(key) else {
            return Ok(false);
        };
        let Some(read) = read(value) else {
            return error(format!("{key} `{value}`; expected {expected}"));
        };
        *option = read;
        Ok(true)
    }

    /// [`read`](Self::read) for an option that is one of a few.
    pub(crate) fn choose<V: Copy, const N: usize>(
        &mut self,
        key: &'static str,
        choices: [(&'static str, V); N],
        option: &mut V,
    ) -> Result<bool> {
        let Some(value) = self.take(key) else {
            return Ok(false);
        };
        let Some((_, chosen)) = choices.iter().find(|(name, _)| *name == value) else {
            let names = choices.map(|(name, _)| name);
            let message = format!("{key} `{value}`; expected {}", names.join(" or "));
            return unknown(message, value, names.to_vec());
        };
        *option = *chosen;
        Ok(true)
    }

    /// That all have been read.
    fn done(self) -> Result<()> {
        let Some((key, _)) = self.unread.first() else {
            return Ok(());
        };
        let expected = match &self.keys[..] {
            [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
            only => only.concat(),
        };
        let message = format!(
            "`{}` has no option `{key}`; expected {expected}",
            self.technique
        );
        unknown(message, key, self.keys)
    }
}

impl Shared {
    /// An estimator has one way to weigh, however often it is said.
    fn weigh(&mut self, value: &str) -> Result<()> {
        let Some((_, found)) = WEIGHTS.iter().find(|(name, _)| *name == value) else {
            let names = WEIGHTS.map(|(name, _)| name);
            let message = format!("mis `{value}`; expected one of {}", names.join(", "));
            return unknown(message, value, names.to_vec());
        };
        match self.weights.replace(*found) {
            Some(before) if before != *found => error(format!(
                "mis `{value}` after `{}`; a combination has one",
                weights_name(before).unwrap_or_default()
            )),
            Some(_) | None => Ok(()),
        }
    }
}

/// The name of weights, if they have one: nothing is said of a technique that stands alone.
fn weights_name(weights: Weights) -> Option<&'static str> {
    let found = WEIGHTS.iter().find(|(_, w)| *w == weights);
    found.map(|(name, _)| *name)
}

impl fmt::Display for Estimator {
    /// What is the default is left out; `mis` stands with the last technique that can say it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words: Vec<(&Part, Vec<String>)> = self.parts().map(with_options).collect();
        let implied = match &words[..] {
            [(only, _)] if only.technique.can_stand_alone() => Weights::Alone,
            _ => Weights::Balance,
        };
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

/// A part, and the options of its technique that are not the default.
fn with_options(part: &Part) -> (&Part, Vec<String>) {
    let mut out = Vec::new();
    match part.technique {
        Technique::Points(points) => points.write(&mut out),
        Technique::Lines(lines) => lines.write(&mut out),
    }
    (part, out)
}
