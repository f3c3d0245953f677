//! The text of estimators: one grammar, one parser, one printer, one table of names.
//!
//! `TECHNIQUE+TECHNIQUE+…`, each `NAME[:SHARE][OPTIONS]` or `NAME[OPTIONS]:SHARE`, with options as
//! `key=value,…` in brackets. The option `mis` may stand with any technique and is one for all;
//! that of `point-linear` is its own.

use crate::{
    Estimator, ExactOptions, Integration, LineBy, LineDirection, LinearHeuristic, LinearOptions,
    Lines, MOST_TECHNIQUES, Optimal, Part, Pieces, PointBy, Points, Smoothing, Technique, Weights,
};
use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// The techniques with their default options: what a name stands for.
const TECHNIQUES: [Technique; 15] = {
    const fn points(by: PointBy) -> Technique {
        Technique::Points(Points::by(by))
    }
    const fn lines(by: LineBy) -> Technique {
        Technique::Lines(Lines::by(by))
    }
    const fn integrated(integration: Integration) -> Technique {
        Technique::Lines(Lines::integrated(integration))
    }
    [
        points(PointBy::Area),
        points(PointBy::VisibleArea),
        points(PointBy::SolidAngle),
        points(PointBy::ProjectedSolidAngle),
        points(PointBy::Texture),
        points(PointBy::Bsdf),
        points(PointBy::Linear(LinearOptions::Technique(
            LinearTechnique::ProjectedSolidAngle,
        ))),
        lines(LineBy::Area),
        lines(LineBy::SolidAngle),
        lines(LineBy::Warped),
        lines(LineBy::Projected),
        lines(LineBy::Texture),
        integrated(Integration::Analytic),
        integrated(Integration::Exact(ExactOptions::DEFAULT)),
        integrated(Integration::Cheapest),
    ]
};

/// Names of techniques without options, as the command line lists them.
pub const ESTIMATOR_NAMES: [&str; TECHNIQUES.len()] = {
    let mut names = [""; TECHNIQUES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = TECHNIQUES[i].name();
        i += 1;
    }
    names
};

impl Technique {
    /// The name, whatever the options.
    const fn name(&self) -> &'static str {
        match self {
            Self::Points(points) => match points.by {
                PointBy::Area => "point-area",
                PointBy::VisibleArea => "point-visible-area",
                PointBy::SolidAngle => "point-solid-angle",
                PointBy::ProjectedSolidAngle => "point-projected-solid-angle",
                PointBy::Texture => "point-texture",
                PointBy::Bsdf => "point-bsdf",
                PointBy::Linear(_) => "point-linear",
            },
            Self::Lines(lines) => match lines.integration {
                Integration::Points => match lines.by {
                    LineBy::Area => "line-area",
                    LineBy::SolidAngle => "line-solid-angle",
                    LineBy::Warped => "line-warped",
                    LineBy::Projected => "line-projected",
                    LineBy::Texture => "line-texture",
                },
                Integration::Analytic => "line-analytic",
                Integration::Exact(_) => "exact",
                Integration::Cheapest => "hybrid",
            },
        }
    }
}

/// The weights and their names.
const WEIGHTS: [(&str, Weights); 9] = [
    ("balance", Weights::Balance),
    ("power", Weights::Power),
    ("maximum", Weights::Maximum),
    ("average", Weights::Average),
    ("smooth", Weights::Smooth(Smoothing::Variable)),
    ("smooth-fixed", Weights::Smooth(Smoothing::Fixed)),
    ("optimal", Weights::Optimal(Optimal::Free)),
    ("clamped-optimal", Weights::Optimal(Optimal::Clamped)),
    ("unoccluded", Weights::Unoccluded),
];

/// The most points that a piece of a line gets.
const MOST_POINTS: u8 = 64;

/// Peters' ν.
const NU: f64 = 0.5;

/// Why a text names no estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseEstimatorError {
    message: String,
}

impl fmt::Display for ParseEstimatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ParseEstimatorError {}

type Result<T> = std::result::Result<T, ParseEstimatorError>;

fn error<T>(message: impl Into<String>) -> Result<T> {
    Err(ParseEstimatorError {
        message: message.into(),
    })
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
        let each = |p: &Part| matches!(p.technique, Technique::Lines(l) if l.direction == LineDirection::UniformPerLine);
        if parts.iter().any(each) {
            return error(
                "orientation `uniform` has no density to combine by; expected parallel, fixed:FRACTION or spread:COUNT",
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
    let Some(technique) = TECHNIQUES.into_iter().find(|t| t.name() == name) else {
        return error(format!(
            "unknown estimator `{name}`; expected one of {}",
            ESTIMATOR_NAMES.join(", ")
        ));
    };
    let technique = match technique {
        Technique::Points(points) => {
            Technique::Points(point_options(points, name, options, shared)?)
        }
        Technique::Lines(lines) => Technique::Lines(line_options(lines, name, options, shared)?),
    };
    Ok(Part { technique, share })
}

/// Keys and values of `key=value,…`.
fn pairs(options: &str) -> impl Iterator<Item = (&str, &str)> {
    let options = options.split(',').map(str::trim);
    options
        .filter(|o| !o.is_empty())
        .map(|o| o.split_once('=').unwrap_or((o, "")))
}

fn point_options(
    mut points: Points,
    name: &str,
    options: &str,
    shared: &mut Shared,
) -> Result<Points> {
    if let PointBy::Linear(_) = points.by {
        points.by = PointBy::Linear(linear_options(options)?);
        return Ok(points);
    }
    let has_shaft = matches!(points.by, PointBy::Area | PointBy::SolidAngle);
    for (key, value) in pairs(options) {
        match (key, value) {
            ("mis", _) => shared.weigh(value)?,
            ("visibility", "rays") if has_shaft => points.in_shaft = false,
            ("visibility", "shaft") if has_shaft => points.in_shaft = true,
            ("visibility", _) if has_shaft => {
                return error(format!("visibility `{value}`; expected rays or shaft"));
            }
            _ if has_shaft => return no_option(name, key, "visibility or mis"),
            _ => return no_option(name, key, "mis"),
        }
    }
    Ok(points)
}

fn line_options(mut lines: Lines, name: &str, options: &str, shared: &mut Shared) -> Result<Lines> {
    let by_area = lines.measure() == LineBy::Area;
    for (key, value) in pairs(options) {
        match (key, &mut lines.integration) {
            ("mis", _) => shared.weigh(value)?,
            ("tolerance", Integration::Exact(exact)) => {
                exact.tolerance = match value.parse() {
                    Ok(t) if (1e-10..=1e-3).contains(&t) => t,
                    _ => return error(format!("tolerance `{value}`; expected 1e-10 to 1e-3")),
                };
            }
            ("limit", Integration::Exact(exact)) => {
                exact.limit = match value.parse() {
                    Ok(limit) => limit,
                    Err(_) => {
                        return error(format!("limit `{value}`; expected a number of triangles"));
                    }
                };
            }
            ("orientation", _) => {
                lines.direction = direction(value)?;
                shared.weighted |= matches!(lines.direction, LineDirection::Spread(_));
            }
            ("offset", _) if by_area => {
                lines.offset = match value {
                    "uniform" => OffsetDensity::Uniform,
                    "length" => OffsetDensity::Length,
                    _ => return error(format!("offset `{value}`; expected uniform or length")),
                };
            }
            ("pieces", _) => {
                shared.weighted = true;
                lines.pieces = match value {
                    "one" => Pieces::One,
                    "each" => Pieces::Each,
                    _ => return error(format!("pieces `{value}`; expected one or each")),
                };
            }
            ("points", _) => {
                shared.weighted = true;
                lines.points = match value.parse() {
                    Ok(points @ 1..=MOST_POINTS) => points,
                    _ => {
                        return error(format!(
                            "points `{value}`; expected a whole number from 1 to {MOST_POINTS}"
                        ));
                    }
                };
            }
            (_, Integration::Exact(_)) => {
                let own = "tolerance, limit, orientation, offset, pieces, points or mis";
                return no_option(name, key, own);
            }
            _ if by_area => {
                return no_option(name, key, "orientation, offset, pieces, points or mis");
            }
            _ => return no_option(name, key, "orientation, pieces, points or mis"),
        }
    }
    Ok(lines)
}

fn no_option<T>(name: &str, key: &str, expected: &str) -> Result<T> {
    error(format!(
        "`{name}` has no option `{key}`; expected {expected}"
    ))
}

impl Shared {
    /// An estimator has one way to weigh, however often it is said.
    fn weigh(&mut self, value: &str) -> Result<()> {
        let Some((_, found)) = WEIGHTS.iter().find(|(name, _)| *name == value) else {
            let names = WEIGHTS.map(|(name, _)| name).join(", ");
            return error(format!("mis `{value}`; expected one of {names}"));
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

fn direction(value: &str) -> Result<LineDirection> {
    let most = MOST_TECHNIQUES;
    let found = match value.split_once(':') {
        None if value == "parallel" => Some(LineDirection::Parallel),
        None if value == "uniform" => Some(LineDirection::UniformPerLine),
        Some(("spread", count)) => match count.parse() {
            Ok(count) if (1..=most).contains(&usize::from(count)) => {
                Some(LineDirection::Spread(count))
            }
            _ => None,
        },
        _ => fixed(value).map(LineDirection::Fixed),
    };
    match found {
        Some(direction) => Ok(direction),
        None => error(format!(
            "orientation `{value}`; expected parallel, uniform, fixed:FRACTION (of a half turn) or spread:COUNT (at most {most})"
        )),
    }
}

/// The fraction of a half turn in `fixed:FRACTION`, 0 if it is not said; `None` for anything else,
/// and for fractions so large that there is no number for the angle.
fn fixed(value: &str) -> Option<f64> {
    let fraction: f64 = match value.strip_prefix("fixed")? {
        "" => 0.0,
        rest => rest.strip_prefix(':')?.parse().ok()?,
    };
    (fraction * PI).is_finite().then_some(fraction)
}

/// What stands in the brackets of `point-linear[…]`.
fn linear_options(options: &str) -> Result<LinearOptions> {
    let (mut technique, mut mis, mut nu) = (None, None, None);
    for (key, value) in pairs(options) {
        match key {
            "technique" => technique = Some(value),
            "mis" => mis = Some(value),
            "nu" => {
                nu = match value.parse() {
                    Ok(nu) if (0.0..=1.0).contains(&nu) => Some(nu),
                    _ => return error(format!("nu `{value}`; expected 0 to 1")),
                };
            }
            _ => return no_option("point-linear", key, "technique, mis or nu"),
        }
    }
    if technique == Some("ltc") {
        return linear_heuristic(mis, nu).map(LinearOptions::Ltc);
    }
    if mis.is_some() || nu.is_some() {
        return error("`mis` and `nu` weigh the two techniques of `technique=ltc`");
    }
    let Some(name) = technique else {
        return Ok(LinearOptions::default());
    };
    match LinearTechnique::ALL.into_iter().find(|t| t.name() == name) {
        Some(found) => Ok(LinearOptions::Technique(found)),
        None => {
            let names = LinearTechnique::ALL.map(LinearTechnique::name).join(", ");
            error(format!("technique `{name}`; expected {names} or ltc"))
        }
    }
}

fn linear_heuristic(mis: Option<&str>, nu: Option<f64>) -> Result<LinearHeuristic> {
    Ok(match mis {
        None | Some("clamped-optimal") => LinearHeuristic::ClampedOptimal(nu.unwrap_or(NU)),
        Some("optimal") => LinearHeuristic::Optimal(nu.unwrap_or(NU)),
        Some("balance") if nu.is_none() => LinearHeuristic::Balance,
        Some("weighted-balance") if nu.is_none() => LinearHeuristic::WeightedBalance,
        Some(name @ ("balance" | "weighted-balance")) => {
            return error(format!("`mis={name}` knows no nu"));
        }
        Some(name) => {
            return error(format!(
                "mis `{name}`; expected balance, weighted-balance, optimal or clamped-optimal"
            ));
        }
    })
}

impl fmt::Display for Estimator {
    /// What is the default is left out; `mis` stands with the last technique that can say it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut words: Vec<(&Part, Vec<String>)> =
            self.parts().map(|p| (p, options(&p.technique))).collect();
        let implied = match &words[..] {
            [(only, _)] if only.technique.can_stand_alone() => Weights::Alone,
            _ => Weights::Balance,
        };
        let linear = |p: &Part| matches!(p.technique, Technique::Points(p) if matches!(p.by, PointBy::Linear(_)));
        if let Some(name) = weights_name(self.weights()).filter(|_| self.weights() != implied)
            && let Some((_, last)) = words.iter_mut().rev().find(|(p, _)| !linear(p))
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

/// The options of a technique that are not the default.
fn options(technique: &Technique) -> Vec<String> {
    let mut out = Vec::new();
    let lines = match technique {
        Technique::Points(points) => {
            if let PointBy::Linear(linear) = points.by {
                linear_texts(linear, &mut out);
            } else if points.in_shaft {
                out.push("visibility=shaft".to_owned());
            }
            return out;
        }
        Technique::Lines(lines) => lines,
    };
    if let Integration::Exact(exact) = lines.integration {
        let default = ExactOptions::DEFAULT;
        if exact.tolerance.to_bits() != default.tolerance.to_bits() {
            out.push(format!("tolerance={:e}", exact.tolerance));
        }
        if exact.limit != default.limit {
            out.push(format!("limit={}", exact.limit));
        }
    }
    match lines.direction {
        LineDirection::Parallel => {}
        LineDirection::Fixed(fraction) => out.push(format!("orientation=fixed:{fraction}")),
        LineDirection::UniformPerLine => out.push("orientation=uniform".to_owned()),
        LineDirection::Spread(count) => out.push(format!("orientation=spread:{count}")),
    }
    if lines.offset == OffsetDensity::Uniform && lines.measure() == LineBy::Area {
        out.push("offset=uniform".to_owned());
    }
    if lines.pieces == Pieces::One {
        out.push("pieces=one".to_owned());
    }
    if lines.points != 1 {
        out.push(format!("points={}", lines.points));
    }
    out
}

fn linear_texts(options: LinearOptions, out: &mut Vec<String>) {
    let (mis, nu) = match options {
        LinearOptions::Technique(LinearTechnique::ProjectedSolidAngle) => return,
        LinearOptions::Technique(technique) => {
            return out.push(format!("technique={}", technique.name()));
        }
        LinearOptions::Ltc(LinearHeuristic::Balance) => (Some("balance"), None),
        LinearOptions::Ltc(LinearHeuristic::WeightedBalance) => (Some("weighted-balance"), None),
        LinearOptions::Ltc(LinearHeuristic::Optimal(nu)) => (Some("optimal"), Some(nu)),
        LinearOptions::Ltc(LinearHeuristic::ClampedOptimal(nu)) => (None, Some(nu)),
    };
    out.push("technique=ltc".to_owned());
    out.extend(mis.map(|mis| format!("mis={mis}")));
    let nu = nu.filter(|nu| (nu - NU).abs() > 0.0);
    out.extend(nu.map(|nu| format!("nu={nu}")));
}
