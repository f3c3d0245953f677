//! The estimators and their names on the command line.

use crate::LinearOptions;
use crate::mix::Mix;
use crate::{ExactOptions, ShaftPoints, options};
use linelit_lights::{OffsetDensity, Orientation};
use std::fmt;
use std::str::FromStr;

/// How direct light is estimated at a shading point.
///
/// The text form is the command line's: a name and options in brackets, such as
/// `line-area[orientation=fixed:0.25,offset=uniform]`. What is not said takes its default:
/// `orientation=parallel`, `offset=length`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[allow(
    clippy::large_enum_variant,
    reason = "a run has one; as a value it can be copied into each pixel's settings"
)]
pub enum Estimator {
    /// Points uniform on the light's area, one shadow ray each.
    PointArea,
    /// Points uniform on the part of the area that faces the shading point: of a sphere the visible
    /// cap, of other lights all of it.
    PointVisibleArea,
    /// Points uniform in the light's solid angle, one shadow ray each.
    PointSolidAngle,
    /// Points uniform in the light's projected solid angle (polygons and lines; spheres and disks
    /// as [`Estimator::PointSolidAngle`]): no noise on diffuse surfaces that see all of the light.
    PointProjectedSolidAngle,
    /// Directions drawn from the BSDF; those that meet the light count, one shadow ray each. A
    /// linear light is never met: it gets points by its projected solid angle.
    PointBsdf,
    /// Points on linear lights by any technique; on other lights as
    /// [`Estimator::PointSolidAngle`].
    PointLinear(LinearOptions),
    /// Line samples by area; on each, one point of its visible part, uniform in length.
    LineArea(LineOptions),
    /// Line samples by area; the light along their visible parts in closed form.
    LineAnalytic(LineOptions),
    /// Points of the light that share one shaft query in place of shadow rays; where the shaft is
    /// empty, the closed form.
    ShaftPoints(ShaftPoints),
    /// The closed form over what is visible of the light, where few enough triangles are in
    /// between; elsewhere, [`Estimator::LineAnalytic`].
    Exact(ExactOptions),
    /// Whichever of exact, lines, points and rays takes the least time to an equal error, chosen
    /// per shading point and light by what is in between.
    Hybrid,
    /// Points of visible parts of lines, points and BSDF samples, combined.
    Mix(Mix),
}

/// How the lines of a light are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineOptions {
    /// Direction of the lines.
    pub orientation: Orientation,
    /// Density of their offsets.
    pub offset: OffsetDensity,
}

impl Default for LineOptions {
    /// What Billen & Dutré prefer: parallel per shading point, offsets proportional to length.
    fn default() -> Self {
        Self {
            orientation: Orientation::ParallelPerPoint,
            offset: OffsetDensity::Length,
        }
    }
}

/// Names without options, as the command line lists them.
pub const ESTIMATOR_NAMES: [&str; 15] = [
    "point-area",
    "point-visible-area",
    "point-solid-angle",
    "point-projected-solid-angle",
    "point-texture",
    "point-bsdf",
    "point-linear",
    "line-area",
    "line-solid-angle",
    "line-warped",
    "line-projected",
    "line-texture",
    "line-analytic",
    "exact",
    "hybrid",
];

/// Why a text names no estimator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseEstimatorError {
    message: String,
}

impl ParseEstimatorError {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
        }
    }
}

impl fmt::Display for ParseEstimatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ParseEstimatorError {}

impl Estimator {
    /// Whether the estimator asks line queries.
    #[must_use]
    pub fn uses_lines(&self) -> bool {
        match self {
            Self::LineArea(_) | Self::LineAnalytic(_) | Self::Exact(_) | Self::Hybrid => true,
            Self::Mix(mix) => mix.uses_lines(),
            Self::PointArea
            | Self::PointVisibleArea
            | Self::PointSolidAngle
            | Self::PointProjectedSolidAngle
            | Self::PointBsdf
            | Self::ShaftPoints(_)
            | Self::PointLinear(_) => false,
        }
    }
}

impl FromStr for Estimator {
    type Err = ParseEstimatorError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        if is_mix(text) {
            return text.parse().map(Self::Mix);
        }
        let (name, options) = match text.split_once('[') {
            None => (text, ""),
            Some((name, rest)) => match rest.strip_suffix(']') {
                Some(options) => (name, options),
                None => {
                    return Err(ParseEstimatorError::new(format!(
                        "`{text}` lacks its closing `]`"
                    )));
                }
            },
        };
        let lines = |make: fn(LineOptions) -> Self| parse_line_options(name, options).map(make);
        let plain = |estimator: Self| match options {
            "" => Ok(estimator),
            _ => Err(ParseEstimatorError::new(format!(
                "`{name}` takes no options, found `{options}`"
            ))),
        };
        match name {
            "point-area" => options::points(name, options, Self::PointArea, ShaftPoints::Area),
            "point-visible-area" => plain(Self::PointVisibleArea),
            "point-solid-angle" => {
                let rays = Self::PointSolidAngle;
                options::points(name, options, rays, ShaftPoints::SolidAngle)
            }
            "point-projected-solid-angle" => plain(Self::PointProjectedSolidAngle),
            "point-bsdf" => plain(Self::PointBsdf),
            "point-linear" => LinearOptions::parse(options).map(Self::PointLinear),
            "line-area" => lines(Self::LineArea),
            "line-analytic" => lines(Self::LineAnalytic),
            "exact" => ExactOptions::parse(options).map(Self::Exact),
            "hybrid" => plain(Self::Hybrid),
            _ => Err(ParseEstimatorError::new(format!(
                "unknown estimator `{name}`; expected one of {}",
                ESTIMATOR_NAMES.join(", ")
            ))),
        }
    }
}

/// Whether a text is a mix's: it combines techniques, names one that only mixes have, or has their
/// options.
fn is_mix(text: &str) -> bool {
    let name = text.split(['[', ':', '+']).next().unwrap_or_default();
    let only_in_mixes = [
        "line-solid-angle",
        "line-warped",
        "line-projected",
        "line-texture",
        "point-texture",
    ];
    let marks = ["mis=", "pieces=", "points=", "spread:"];
    // A linear light's two techniques are weighted, too, but they are one estimator.
    let marked = name != "point-linear" && marks.iter().any(|mark| text.contains(mark));
    text.contains('+') || only_in_mixes.contains(&name.trim()) || marked
}

/// The text of a mix, told from that of an estimator of the same name by its heuristic.
fn marked(text: String) -> String {
    match text.strip_suffix(']') {
        _ if is_mix(&text) => text,
        Some(open) => format!("{open},mis=balance]"),
        None => format!("{text}[mis=balance]"),
    }
}

fn parse_line_options(name: &str, options: &str) -> Result<LineOptions, ParseEstimatorError> {
    let mut out = LineOptions::default();
    for (key, value) in options::pairs(options) {
        match key {
            "orientation" => out.orientation = parse_orientation(value)?,
            "offset" => out.offset = parse_offset(value)?,
            _ => {
                return Err(ParseEstimatorError::new(format!(
                    "`{name}` has no option `{key}`; expected orientation or offset"
                )));
            }
        }
    }
    Ok(out)
}

fn parse_orientation(value: &str) -> Result<Orientation, ParseEstimatorError> {
    match value {
        "parallel" => Ok(Orientation::ParallelPerPoint),
        "uniform" => Ok(Orientation::UniformPerLine),
        _ => options::fixed(value)
            .map(Orientation::Fixed)
            .ok_or_else(|| {
                ParseEstimatorError::new(format!(
                    "orientation `{value}`; expected parallel, uniform or fixed:FRACTION (of a half turn)"
                ))
            }),
    }
}

fn parse_offset(value: &str) -> Result<OffsetDensity, ParseEstimatorError> {
    match value {
        "uniform" => Ok(OffsetDensity::Uniform),
        "length" => Ok(OffsetDensity::Length),
        _ => Err(ParseEstimatorError::new(format!(
            "offset `{value}`; expected uniform or length"
        ))),
    }
}

impl fmt::Display for Estimator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PointArea => f.write_str("point-area"),
            Self::PointVisibleArea => f.write_str("point-visible-area"),
            Self::PointSolidAngle => f.write_str("point-solid-angle"),
            Self::PointProjectedSolidAngle => f.write_str("point-projected-solid-angle"),
            Self::PointBsdf => f.write_str("point-bsdf"),
            Self::PointLinear(options) => write!(f, "point-linear{options}"),
            Self::LineArea(options) => write!(f, "line-area{options}"),
            Self::LineAnalytic(options) => write!(f, "line-analytic{options}"),
            Self::ShaftPoints(ShaftPoints::Area) => f.write_str("point-area[visibility=shaft]"),
            Self::ShaftPoints(ShaftPoints::SolidAngle) => {
                f.write_str("point-solid-angle[visibility=shaft]")
            }
            Self::Exact(options) => write!(f, "exact{options}"),
            Self::Hybrid => f.write_str("hybrid"),
            Self::Mix(mix) => f.write_str(&marked(mix.to_string())),
        }
    }
}

impl fmt::Display for LineOptions {
    /// Options that are the default are left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let default = Self::default();
        let mut parts = Vec::new();
        if self.orientation != default.orientation {
            parts.push(match self.orientation {
                Orientation::Fixed(fraction) => format!("orientation=fixed:{fraction}"),
                Orientation::UniformPerLine => "orientation=uniform".to_owned(),
                Orientation::ParallelPerPoint => "orientation=parallel".to_owned(),
            });
        }
        if self.offset != default.offset {
            parts.push("offset=uniform".to_owned());
        }
        if parts.is_empty() {
            Ok(())
        } else {
            write!(f, "[{}]", parts.join(","))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        let texts = [
            "point-area",
            "point-visible-area",
            "point-solid-angle",
            "point-projected-solid-angle",
            "point-bsdf",
            "point-linear",
            "line-area",
            "line-analytic",
            "line-area[orientation=fixed:0.25]",
            "line-area[orientation=uniform,offset=uniform]",
            "line-analytic[offset=uniform]",
            "exact",
            "hybrid",
            "exact[tolerance=1e-4]",
            "exact[tolerance=1e-10,limit=16]",
            "point-area[visibility=shaft]",
            "point-solid-angle[visibility=shaft]",
            "line-solid-angle",
            "line-solid-angle:3+point-bsdf[mis=smooth]",
            "line-solid-angle[orientation=fixed:0.5]+point-bsdf:3",
            "line-area[pieces=one]",
            "line-area[mis=balance]",
            "line-area[orientation=fixed:0.5,mis=balance]",
            "line-area[points=3]",
            "point-area[mis=balance]",
        ];
        for text in texts {
            let estimator: Estimator = text.parse().unwrap();
            assert_eq!(estimator.to_string(), text);
        }
        let spelt: Estimator = "line-area[ offset=length , orientation=parallel ]"
            .parse()
            .unwrap();
        assert_eq!(spelt.to_string(), "line-area");
    }

    #[test]
    fn errors_say_what_was_expected() {
        let error = |t: &str| t.parse::<Estimator>().unwrap_err().to_string();
        assert!(error("line").contains("expected one of point-area"));
        assert!(error("line-area[").contains("closing"));
        assert!(error("line-area[width=2]").contains("no option `width`"));
        for wrong in ["nan", "1e308", "", "1x"] {
            let text = format!("line-area[orientation=fixed:{wrong}]");
            assert!(error(&text).contains("fixed:FRACTION"), "{text}");
        }
        assert!(error("line-area[offset=angle]").contains("expected uniform or length"));
        assert!(error("exact[n=2]").contains("no option `n`"));
        assert!(error("exact[tolerance=2]").contains("1e-10 to 1e-3"));
        assert!(error("point-bsdf[visibility=shaft]").contains("takes no options"));
        assert!(error("point-area[visibility=x]").contains("rays or shaft"));
        assert!(error("point-area+exact").contains("cannot be combined"));
    }
}
