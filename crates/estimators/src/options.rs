//! This module reads and writes the options of techniques in the texts of estimators: `key=value,…`
//! in brackets.

use crate::technique::NU;
use crate::{
    ExactOptions, Integration, LineControl, LineDirection, LinearHeuristic, LinearOptions, Lines,
    MOST_TECHNIQUES, Pieces, PointBy, Points, Technique,
};
use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;
use std::f64::consts::PI;
use std::fmt;

/// The reason why a text is not an estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseEstimatorError {
    message: String,
    unknown: Option<(String, Vec<&'static str>)>,
}

impl ParseEstimatorError {
    /// The unknown word, and the names that are allowed at its position: names of techniques, of
    /// options, or of an option's values. `None` if the error has another reason.
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

/// Returns an error with a message.
pub(crate) fn error<T>(message: impl Into<String>) -> Result<T> {
    Err(ParseEstimatorError {
        message: message.into(),
        unknown: None,
    })
}

/// Returns an error about a word that is not one of the allowed names.
fn unknown<T>(message: String, word: &str, names: Vec<&'static str>) -> Result<T> {
    let unknown = Some((word.to_owned(), names));
    Err(ParseEstimatorError { message, unknown })
}

/// Looks up a name in a table. If it is not there, returns an error about the word; its message is
/// made from the names in the table.
pub(crate) fn find<V: Copy>(
    table: &[(&'static str, V)],
    word: &str,
    message: impl FnOnce(&[&'static str]) -> String,
) -> Result<V> {
    if let Some((_, value)) = table.iter().find(|(name, _)| *name == word) {
        return Ok(*value);
    }
    let names: Vec<_> = table.iter().map(|(name, _)| *name).collect();
    unknown(message(&names), word, names)
}

/// Joins names to a list that ends with `or`.
fn either(names: &[&str]) -> String {
    match names {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        only => only.concat(),
    }
}

/// The options in the brackets of one technique. Each is removed when it is read.
pub(crate) struct Options<'a> {
    technique: &'a str,
    unread: Vec<(&'a str, &'a str)>,
    /// The keys that were looked up so far.
    keys: Vec<&'static str>,
}

impl<'a> Options<'a> {
    /// Splits a text `key=value,…` into options.
    pub(crate) fn new(technique: &'a str, text: &'a str) -> Self {
        let options = text.split(',').map(str::trim).filter(|o| !o.is_empty());
        Self {
            technique,
            unread: options
                .map(|o| o.split_once('=').unwrap_or((o, "")))
                .collect(),
            keys: Vec::new(),
        }
    }

    /// Removes an option and returns its value; if the option occurs more than once, its last
    /// value.
    pub(crate) fn take(&mut self, key: &'static str) -> Option<&'a str> {
        if !self.keys.contains(&key) {
            self.keys.push(key);
        }
        let value = self.unread.iter().rfind(|(k, _)| *k == key)?.1;
        self.unread.retain(|(k, _)| *k != key);
        Some(value)
    }

    /// Sets an option to the value that `read` parses, if the option occurs in the text, and
    /// returns whether it does. If `read` returns `None`, there is an error that says what was
    /// expected.
    fn read<V>(
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

    /// Sets an option that has a few named values, if it occurs in the text, and returns whether it
    /// does.
    fn choose<V: Copy, const N: usize>(
        &mut self,
        key: &'static str,
        choices: [(&'static str, V); N],
        option: &mut V,
    ) -> Result<bool> {
        let Some(value) = self.take(key) else {
            return Ok(false);
        };
        *option = find(&choices, value, |names| {
            format!("{key} `{value}`; expected {}", either(names))
        })?;
        Ok(true)
    }

    /// Checks that all options have been read.
    pub(crate) fn done(self) -> Result<()> {
        let Some((key, _)) = self.unread.first() else {
            return Ok(());
        };
        let (technique, expected) = (self.technique, either(&self.keys));
        let message = format!("`{technique}` has no option `{key}`; expected {expected}");
        unknown(message, key, self.keys)
    }
}

impl Points {
    /// Returns the points with the options of the text.
    pub(crate) fn read(mut self, options: &mut Options<'_>) -> Result<Self> {
        if let PointBy::Linear(linear) = self.by {
            self.by = PointBy::Linear(linear.read(options)?);
        }
        if Technique::Points(self).has_visibility() {
            let ways = [("rays", false), ("shaft", true)];
            options.choose("visibility", ways, &mut self.in_shaft)?;
        }
        Ok(self)
    }

    /// Writes the options that differ from their defaults, as `key=value`.
    pub(crate) fn write(self, out: &mut Vec<String>) {
        if let PointBy::Linear(linear) = self.by {
            linear.write(out);
        }
        if self.in_shaft {
            out.push("visibility=shaft".to_owned());
        }
    }
}

impl LinearOptions {
    fn read(self, options: &mut Options<'_>) -> Result<Self> {
        let (technique, mis) = (options.take("technique"), options.take("mis"));
        let with = options.take("with").map(named).transpose()?;
        let mut nu = None;
        let share = |text: &str| text.parse().ok().filter(|nu| (0.0..=1.0).contains(nu));
        options.read("nu", "0 to 1", |text| share(text).map(Some), &mut nu)?;
        match technique {
            Some("ltc") => heuristic(mis, nu, with).map(Self::Ltc),
            _ if mis.is_some() || nu.is_some() || with.is_some() => {
                error("`mis`, `nu` and `with` are of the two techniques of `technique=ltc`")
            }
            None => Ok(self),
            Some(name) => named(name).map(Self::Technique),
        }
    }

    fn write(self, out: &mut Vec<String>) {
        let first = LinearTechnique::ProjectedSolidAngle;
        let share = |nu: f64| ((nu - NU).abs() > 0.0).then(|| format!("nu={nu}"));
        let (mis, option) = match self {
            Self::Technique(technique) if technique == first => return,
            Self::Technique(technique) => {
                return out.push(format!("technique={}", technique.name()));
            }
            Self::Ltc(LinearHeuristic::Balance(with)) => {
                let with = (with != first).then(|| format!("with={}", with.name()));
                (Some("mis=balance"), with)
            }
            Self::Ltc(LinearHeuristic::WeightedBalance) => (Some("mis=weighted-balance"), None),
            Self::Ltc(LinearHeuristic::Optimal(nu)) => (Some("mis=optimal"), share(nu)),
            Self::Ltc(LinearHeuristic::ClampedOptimal(nu)) => (None, share(nu)),
        };
        let said = ["technique=ltc"].into_iter().chain(mis);
        out.extend(said.map(str::to_owned).chain(option));
    }
}

/// The technique for linear lights of a name.
fn named(name: &str) -> Result<LinearTechnique> {
    if let Some(found) = LinearTechnique::ALL.into_iter().find(|t| t.name() == name) {
        return Ok(found);
    }
    let mut names = LinearTechnique::ALL.map(LinearTechnique::name).to_vec();
    names.push("ltc");
    let message = format!("technique `{name}`; expected {}", either(&names));
    unknown(message, name, names)
}

/// The heuristics of `technique=ltc`, with their default options.
const HEURISTICS: [(&str, LinearHeuristic); 4] = [
    (
        "balance",
        LinearHeuristic::Balance(LinearTechnique::ProjectedSolidAngle),
    ),
    ("weighted-balance", LinearHeuristic::WeightedBalance),
    ("optimal", LinearHeuristic::Optimal(NU)),
    ("clamped-optimal", LinearHeuristic::ClampedOptimal(NU)),
];

/// The heuristic of `technique=ltc` that the options `mis`, `nu` and `with` choose.
fn heuristic(
    mis: Option<&str>,
    nu: Option<f64>,
    with: Option<LinearTechnique>,
) -> Result<LinearHeuristic> {
    use LinearHeuristic::{Balance, ClampedOptimal, Optimal, WeightedBalance};
    let name = mis.unwrap_or("clamped-optimal");
    if with.is_some() && (name != "balance" || nu.is_some()) {
        return error("`with` needs `mis=balance`");
    }
    let heuristic = find(&HEURISTICS, name, |names| {
        format!("mis `{name}`; expected {}", either(names))
    })?;
    Ok(match (heuristic, nu) {
        (Balance(_) | WeightedBalance, Some(_)) => {
            return error(format!("`mis={name}` has no parameter nu"));
        }
        (Balance(first), None) => Balance(with.unwrap_or(first)),
        (Optimal(_), Some(nu)) => Optimal(nu),
        (ClampedOptimal(_), Some(nu)) => ClampedOptimal(nu),
        (default, None) => default,
    })
}

/// The largest number of points on a piece of a line.
const MOST_POINTS: u8 = 64;

/// The values of `orientation`, for error messages.
const DIRECTIONS: &str = "adaptive, parallel, uniform, stratified, origin, fixed:FRACTION (of a half turn) or spread:COUNT (at most 8)";

/// The values of `orientation` that are plain names.
const NAMED_DIRECTIONS: [(&str, LineDirection); 5] = [
    ("adaptive", LineDirection::Adaptive),
    ("parallel", LineDirection::Parallel),
    ("uniform", LineDirection::UniformPerLine),
    ("stratified", LineDirection::Stratified),
    ("origin", LineDirection::Origin),
];

impl Lines {
    /// Returns the lines with the options of the text, and whether one of these options is only
    /// possible for weighted techniques.
    pub(crate) fn read(mut self, options: &mut Options<'_>) -> Result<(Self, bool)> {
        if let Some(Integration::Exact(exact)) = &mut self.integration {
            exact.read(options)?;
        }
        options.read("orientation", DIRECTIONS, direction, &mut self.direction)?;
        if self.has_offsets() {
            let offsets = [
                ("uniform", OffsetDensity::Uniform),
                ("length", OffsetDensity::Length),
            ];
            options.choose("offset", offsets, &mut self.offset)?;
        }
        if self.integration.is_some() {
            let controls = [("slopes", LineControl::Slopes), ("none", LineControl::None)];
            options.choose("control", controls, &mut self.control)?;
        }
        let ways = [("one", Pieces::One), ("each", Pieces::Each)];
        let pieces = options.choose("pieces", ways, &mut self.pieces)?;
        let count = |text: &str| text.parse().ok().filter(|k| (1..=MOST_POINTS).contains(k));
        let expected = "a whole number from 1 to 64";
        let points = options.read("points", expected, count, &mut self.points)?;
        let spread = matches!(self.direction, LineDirection::Spread(_));
        Ok((self, pieces || points || spread))
    }

    /// Writes the options that differ from their defaults, as `key=value`.
    pub(crate) fn write(self, out: &mut Vec<String>) {
        if let Some(Integration::Exact(exact)) = self.integration {
            exact.write(out);
        }
        match self.direction {
            LineDirection::Adaptive => {}
            LineDirection::Fixed(fraction) => out.push(format!("orientation=fixed:{fraction}")),
            LineDirection::Spread(count) => out.push(format!("orientation=spread:{count}")),
            named => {
                let found = NAMED_DIRECTIONS.iter().find(|(_, d)| *d == named);
                out.extend(found.map(|(name, _)| format!("orientation={name}")));
            }
        }
        if self.offset == OffsetDensity::Uniform && self.has_offsets() {
            out.push("offset=uniform".to_owned());
        }
        if self.control == LineControl::None && self.integration.is_some() {
            out.push("control=none".to_owned());
        }
        if self.pieces == Pieces::One {
            out.push("pieces=one".to_owned());
        }
        if self.points != 1 {
            out.push(format!("points={}", self.points));
        }
    }
}

impl ExactOptions {
    fn read(&mut self, options: &mut Options<'_>) -> Result<()> {
        let number = |text: &str| text.parse().ok();
        options.read("limit", "a number of triangles", number, &mut self.limit)?;
        Ok(())
    }

    fn write(self, out: &mut Vec<String>) {
        if self.limit != Self::DEFAULT.limit {
            out.push(format!("limit={}", self.limit));
        }
    }
}

/// Parses a value of `orientation`.
fn direction(value: &str) -> Option<LineDirection> {
    if let Some((_, named)) = NAMED_DIRECTIONS.iter().find(|(name, _)| *name == value) {
        return Some(*named);
    }
    match value.split_once(':') {
        Some(("spread", count)) => {
            let count = count.parse().ok()?;
            let fits = (1..=MOST_TECHNIQUES).contains(&usize::from(count));
            fits.then_some(LineDirection::Spread(count))
        }
        _ => fixed(value).map(LineDirection::Fixed),
    }
}

/// The fraction of a half turn in `fixed:FRACTION`, which is 0 without `:FRACTION`. `None` for
/// other texts, and for fractions so large that the angle would overflow.
fn fixed(value: &str) -> Option<f64> {
    let fraction: f64 = match value.strip_prefix("fixed")? {
        "" => 0.0,
        rest => rest.strip_prefix(':')?.parse().ok()?,
    };
    (fraction * PI).is_finite().then_some(fraction)
}
