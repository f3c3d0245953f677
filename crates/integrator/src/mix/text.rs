//! The text form of mixes.

use super::{
    LineDirection, LineMeasure, LineTechnique, MOST_TECHNIQUES, Mix, MixHeuristic, Optimal, Part,
    Pieces, Smoothing, Technique,
};
use crate::{ParseEstimatorError, options};
use linelit_mis::Heuristic;
use std::fmt;
use std::str::FromStr;

/// Names of the techniques.
const TECHNIQUES: [&str; 11] = [
    "point-area",
    "point-solid-angle",
    "point-bsdf",
    "line-area",
    "line-solid-angle",
    "line-projected",
    "line-warped",
    "point-texture",
    "line-texture",
    "line-analytic",
    "hybrid",
];

const HEURISTICS: &str = "balance, power, maximum, average, smooth, smooth-fixed, optimal, clamped-optimal or unoccluded";

/// The most points that a piece of a line gets.
const MOST_POINTS: u8 = 64;

impl FromStr for Mix {
    type Err = ParseEstimatorError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut parts = Vec::new();
        let mut heuristic = None;
        for word in split_outside_brackets(text) {
            parts.push(parse_part(word.trim(), &mut heuristic)?);
        }
        let mix = Self::new(&parts).ok_or_else(|| {
            ParseEstimatorError::new(format!(
                "`{text}` needs between 1 and {MOST_TECHNIQUES} techniques, a spread counted as its directions"
            ))
        })?;
        Ok(heuristic.map_or(mix, |h| mix.with(h)))
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
fn parse_part(
    word: &str,
    heuristic: &mut Option<MixHeuristic>,
) -> Result<Part, ParseEstimatorError> {
    let (before, options, after) = match word.split_once('[') {
        None => (word, "", ""),
        Some((before, rest)) => rest
            .split_once(']')
            .map(|(options, after)| (before, options, after))
            .ok_or_else(|| ParseEstimatorError::new(format!("`{word}` lacks its closing `]`")))?,
    };
    let (name, share) = match before.split_once(':') {
        Some((name, share)) if after.is_empty() => (name, Some(share)),
        Some((name, _)) => {
            return Err(ParseEstimatorError::new(format!(
                "`{after}` after the options of `{name}`, whose share stands before them"
            )));
        }
        None => (before, after.strip_prefix(':')),
    };
    let share: u32 = match share {
        None if after.is_empty() => 1,
        None => {
            return Err(ParseEstimatorError::new(format!(
                "`{after}` after the options of `{name}`; expected `:SHARE`"
            )));
        }
        Some(text) => text.parse().ok().filter(|s| *s > 0).ok_or_else(|| {
            ParseEstimatorError::new(format!(
                "share `{text}` of `{name}`; expected a whole number above 0"
            ))
        })?,
    };
    let mut technique = technique_named(name.trim())?;
    for (key, value) in options::pairs(options) {
        match (key, &mut technique) {
            ("mis", _) => set_heuristic(heuristic, parse_heuristic(value)?)?,
            ("orientation", Technique::Line(line)) => line.direction = parse_direction(value)?,
            ("pieces", Technique::Line(line)) => line.pieces = parse_pieces(value)?,
            ("points", Technique::Line(line)) => line.points = parse_points(value)?,
            (_, Technique::Line(_)) => {
                return Err(no_option(name, key, "orientation, pieces, points or mis"));
            }
            _ => return Err(no_option(name, key, "mis")),
        }
    }
    Ok(Part { technique, share })
}

/// A mix has one heuristic, however often it is said.
fn set_heuristic(
    heuristic: &mut Option<MixHeuristic>,
    found: MixHeuristic,
) -> Result<(), ParseEstimatorError> {
    let other = heuristic.replace(found).filter(|before| *before != found);
    let name = |h| heuristic_name(h).unwrap_or("another");
    other.map_or(Ok(()), |before| {
        Err(ParseEstimatorError::new(format!(
            "mis `{}` after `{}`; a combination has one",
            name(found),
            name(before)
        )))
    })
}

fn no_option(name: &str, key: &str, expected: &str) -> ParseEstimatorError {
    ParseEstimatorError::new(format!(
        "`{name}` in a combination has no option `{key}`; expected {expected}"
    ))
}

fn technique_named(name: &str) -> Result<Technique, ParseEstimatorError> {
    let line = |measure| Technique::Line(LineTechnique::new(measure));
    Ok(match name {
        "point-area" => Technique::PointArea,
        "point-solid-angle" => Technique::PointSolidAngle,
        "point-bsdf" => Technique::PointBsdf,
        "point-texture" => Technique::PointTexture,
        "line-area" => line(LineMeasure::Area),
        "line-solid-angle" => line(LineMeasure::SolidAngle),
        "line-projected" => line(LineMeasure::Projected),
        "line-warped" => line(LineMeasure::Warped),
        "line-texture" => line(LineMeasure::Texture),
        "line-analytic" => line(LineMeasure::Analytic),
        "hybrid" => line(LineMeasure::Hybrid),
        _ => {
            return Err(ParseEstimatorError::new(format!(
                "`{name}` cannot be combined; expected one of {}",
                TECHNIQUES.join(", ")
            )));
        }
    })
}

fn parse_direction(value: &str) -> Result<LineDirection, ParseEstimatorError> {
    let most = MOST_TECHNIQUES;
    let direction = match value.split_once(':') {
        None if value == "parallel" => Some(LineDirection::Parallel),
        Some(("spread", v)) => {
            let count = v.parse().ok();
            count
                .filter(|c| (1..=most).contains(&usize::from(*c)))
                .map(LineDirection::Spread)
        }
        _ => options::fixed(value).map(LineDirection::Fixed),
    };
    direction.ok_or_else(|| {
        ParseEstimatorError::new(format!(
            "orientation `{value}`; expected parallel, fixed:FRACTION (of a half turn) or spread:COUNT (at most {most})"
        ))
    })
}

fn parse_pieces(value: &str) -> Result<Pieces, ParseEstimatorError> {
    match value {
        "one" => Ok(Pieces::One),
        "each" => Ok(Pieces::Each),
        _ => Err(ParseEstimatorError::new(format!(
            "pieces `{value}`; expected one or each"
        ))),
    }
}

fn parse_points(value: &str) -> Result<u8, ParseEstimatorError> {
    let count = value.parse().ok();
    count
        .filter(|c| (1..=MOST_POINTS).contains(c))
        .ok_or_else(|| {
            ParseEstimatorError::new(format!(
                "points `{value}`; expected a whole number from 1 to {MOST_POINTS}"
            ))
        })
}

fn parse_heuristic(value: &str) -> Result<MixHeuristic, ParseEstimatorError> {
    Ok(match value {
        "balance" => MixHeuristic::Classic(Heuristic::Balance),
        "power" => MixHeuristic::Classic(Heuristic::Power(2.0)),
        "maximum" => MixHeuristic::Classic(Heuristic::Maximum),
        "average" => MixHeuristic::Classic(Heuristic::Average),
        "smooth" => MixHeuristic::Smooth(Smoothing::Variable),
        "smooth-fixed" => MixHeuristic::Smooth(Smoothing::Fixed),
        "optimal" => MixHeuristic::Optimal(Optimal::Free),
        "clamped-optimal" => MixHeuristic::Optimal(Optimal::Clamped),
        "unoccluded" => MixHeuristic::Unoccluded,
        _ => {
            return Err(ParseEstimatorError::new(format!(
                "mis `{value}`; expected {HEURISTICS}"
            )));
        }
    })
}

impl fmt::Display for Mix {
    /// What is the default is left out; the heuristic stands with the last technique.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: Vec<&Part> = self.parts().collect();
        let mis = heuristic_name(self.heuristic).filter(|_| self.heuristic != default_heuristic());
        for (i, part) in parts.iter().enumerate() {
            if i > 0 {
                f.write_str("+")?;
            }
            write!(f, "{}", technique_name(&part.technique))?;
            if part.share != 1 {
                write!(f, ":{}", part.share)?;
            }
            let mut options = line_options(&part.technique);
            if i + 1 == parts.len() {
                options.extend(mis.map(|m| format!("mis={m}")));
            }
            if !options.is_empty() {
                write!(f, "[{}]", options.join(","))?;
            }
        }
        Ok(())
    }
}

const fn default_heuristic() -> MixHeuristic {
    MixHeuristic::Classic(Heuristic::Balance)
}

fn heuristic_name(heuristic: MixHeuristic) -> Option<&'static str> {
    Some(match heuristic {
        MixHeuristic::Classic(Heuristic::Balance) => "balance",
        MixHeuristic::Classic(Heuristic::Power(_)) => "power",
        MixHeuristic::Classic(Heuristic::Maximum) => "maximum",
        MixHeuristic::Classic(Heuristic::Average) => "average",
        MixHeuristic::Classic(Heuristic::Cutoff(_)) => return None,
        MixHeuristic::Smooth(Smoothing::Variable) => "smooth",
        MixHeuristic::Smooth(Smoothing::Fixed) => "smooth-fixed",
        MixHeuristic::Optimal(Optimal::Free) => "optimal",
        MixHeuristic::Optimal(Optimal::Clamped) => "clamped-optimal",
        MixHeuristic::Unoccluded => "unoccluded",
    })
}

const fn technique_name(technique: &Technique) -> &'static str {
    match technique {
        Technique::PointArea => TECHNIQUES[0],
        Technique::PointSolidAngle => TECHNIQUES[1],
        Technique::PointBsdf => TECHNIQUES[2],
        Technique::PointTexture => TECHNIQUES[7],
        Technique::Line(line) => match line.measure {
            LineMeasure::Area => TECHNIQUES[3],
            LineMeasure::SolidAngle => TECHNIQUES[4],
            LineMeasure::Projected => TECHNIQUES[5],
            LineMeasure::Warped => TECHNIQUES[6],
            LineMeasure::Texture => TECHNIQUES[8],
            LineMeasure::Analytic => TECHNIQUES[9],
            LineMeasure::Hybrid => TECHNIQUES[10],
        },
    }
}

fn line_options(technique: &Technique) -> Vec<String> {
    let Technique::Line(line) = technique else {
        return Vec::new();
    };
    let mut out = Vec::new();
    match line.direction {
        LineDirection::Parallel => {}
        LineDirection::Fixed(fraction) => out.push(format!("orientation=fixed:{fraction}")),
        LineDirection::Spread(count) => out.push(format!("orientation=spread:{count}")),
    }
    if line.pieces == Pieces::One {
        out.push("pieces=one".to_owned());
    }
    if line.points != 1 {
        out.push(format!("points={}", line.points));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_round_trip() {
        let texts = [
            "line-solid-angle",
            "line-solid-angle:3+point-bsdf",
            "line-solid-angle:3[orientation=fixed:0.5]+point-bsdf[mis=smooth]",
            "line-area[orientation=fixed:0]+line-area[orientation=fixed:0.5,mis=average]",
            "line-projected[orientation=spread:4,pieces=one]+point-solid-angle:2",
            "point-area+point-bsdf[mis=power]",
            "line-texture[orientation=fixed:0]+point-texture",
            "line-area+point-bsdf[mis=clamped-optimal]",
            "line-analytic+point-bsdf:3",
            "hybrid+point-bsdf",
            "line-area[pieces=one,points=4]+point-bsdf[mis=unoccluded]",
        ];
        for text in texts {
            assert_eq!(text.parse::<Mix>().unwrap().to_string(), text);
        }
        let spelt: Mix = " line-solid-angle : 1"
            .replace(" :", ":")
            .replace(": ", ":")
            .parse()
            .unwrap();
        assert_eq!(spelt.to_string(), "line-solid-angle");
        let after: Mix = "line-area[orientation=fixed:0.5]:3+point-bsdf:1"
            .parse()
            .unwrap();
        assert_eq!(
            after.to_string(),
            "line-area:3[orientation=fixed:0.5]+point-bsdf"
        );
    }

    #[test]
    fn errors_say_what_was_expected() {
        let error = |t: &str| t.parse::<Mix>().unwrap_err().to_string();
        assert!(error("exact+point-bsdf").contains("cannot be combined"));
        assert!(error("line-area:0+point-bsdf").contains("above 0"));
        assert!(error("line-area+point-bsdf[mis=best]").contains("expected balance"));
        assert!(error("line-area[").contains("closing"));
        assert!(error("line-area[pieces=two]").contains("one or each"));
        assert!(error("line-area[points=0]").contains("from 1 to"));
        assert!(error("line-area[orientation=uniform]").contains("spread:COUNT"));
        assert!(error("point-area[pieces=one]").contains("expected mis"));
        assert!(
            error("line-area[orientation=spread:6]+line-solid-angle[orientation=spread:6]")
                .contains("between 1 and 8")
        );
        assert!(error("line-area[mis=smooth]3").contains(":SHARE"));
        assert!(error("line-area:3[mis=smooth]x").contains("stands before"));
        assert!(error("line-area:3[mis=smooth]:4").contains("stands before"));
        assert!(error("line-area[orientation=fixed:1e308]").contains("fixed:FRACTION"));
        let two = error("line-area[mis=power]+point-area[mis=smooth]");
        assert!(two.contains("`smooth` after `power`"), "{two}");
        let same = "line-area[mis=power]+point-area[mis=power]";
        assert!(same.parse::<Mix>().is_ok());
    }
}
