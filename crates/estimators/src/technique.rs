//! Techniques are the ways to draw points or lines on a light, and to integrate along the lines.
//! This module has their options as types; an `Estimator` consists of one or
//! more of them.

use PointDensity::{Area, Lobes, ProjectedSolidAngle, Proxy, SolidAngle, Texture, VisibleArea};
use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;
pub use linelit_lights::{LineDensity as LineBy, PointDensity};

/// A technique: one way to estimate the light that a shading point receives from a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    /// Points of the light, or directions that may hit it.
    Points(Points),
    /// Lines on the light, with their visible parts.
    Lines(Lines),
}

/// Point samples, and how their visibility is queried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// The density of the points.
    pub by: PointBy,
    /// Whether the points of a technique that stands alone share a shaft instead of having a shadow
    /// ray each. Where that shaft is empty and there is a closed form, the closed form replaces
    /// them. Points of a combination always share its shaft.
    pub in_shaft: bool,
}

/// The density that point samples are drawn from. Where a light does not have a density, another
/// one replaces it, as [`PointDensity`] says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointBy {
    /// A density on the light's surface; on a linear light, the technique that is most similar.
    Surface(PointDensity),
    /// Directions drawn from the BSDF, of which those that hit the light contribute. No direction
    /// hits a linear light, so that it gets points by its projected solid angle.
    Bsdf,
    /// Any technique for linear lights; other lights have [`PointDensity::SolidAngle`] instead.
    Linear(LinearOptions),
}

/// The technique that draws points on linear lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearOptions {
    /// One technique.
    Technique(LinearTechnique),
    /// Two techniques with equal numbers of samples: projected solid angle for the diffuse light,
    /// and LTCs for the lobes. On a surface without a lobe, the first one alone.
    Ltc(LinearHeuristic),
}

/// The weights that combine the diffuse and the glossy samples of a linear light (Peters 2021,
/// section 4.2).
///
/// All heuristics but the first use the unshadowed diffuse and glossy light cₖ by channel, which
/// has a closed form. The fraction ν is the visibility that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearHeuristic {
    /// The balance heuristic, which uses densities only. The diffuse samples may be drawn by any
    /// technique, not only by projected solid angle.
    Balance(LinearTechnique),
    /// The balance heuristic with densities times cₖ. It has no noise where nothing is hidden.
    WeightedBalance,
    /// The optimal heuristic for the visibility ν. Hidden samples contribute, too, and
    /// contributions may be negative.
    Optimal(f64),
    /// ν times the weighted balance heuristic plus 1 − ν times the balance heuristic.
    ClampedOptimal(f64),
}

/// Line samples on area lights, and how their visible parts are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// The measure in which lines, and the points on them, are uniform. Lines that are integrated
    /// in closed form are always uniform in the area.
    pub by: LineBy,
    /// The integral over the visible parts; if `None`, points of the visible parts are sampled.
    pub integration: Option<Integration>,
    /// The direction of the lines.
    pub direction: LineDirection,
    /// The density of the offsets of parallel lines by [`LineBy::Area`].
    pub offset: OffsetDensity,
    /// The control variate for lines that are integrated.
    pub control: LineControl,
    /// The parts of a line on which points are sampled in a combination.
    pub pieces: Pieces,
    /// The number of points on each such part, evenly spaced from a random first one; optimal
    /// weights use 1. A point costs less than a line wherever finding the visible parts of the line
    /// takes most of the time.
    pub points: u8,
}

/// The integral over the visible part of a light, which replaces samples of it.
///
/// Where the reflection has no closed form, [`Integration::Exact`] and [`Integration::Cheapest`]
/// integrate LTCs that resemble it, and sample the rest. Where there are no LTCs either, or the
/// light has a texture, they sample points, of lines or of the light (`Method` has
/// the details).
///
/// In a combination, the first integral takes the samples of all of them, where the reflection has
/// a closed form. It includes the light that the other techniques would sample, so that these are
/// left out. Where there is no closed form, each integral is replaced by `line-area`
/// ([`LineBy::Area`]) or by points, in addition to the integral of LTCs where there are some.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integration {
    /// The closed form along the visible parts of each line (`line-analytic`).
    Analytic,
    /// The closed form over the visible part of the light (`exact`). It is used past any number of
    /// triangles, unless there is a limit. Past more triangles than the limit, and past holes,
    /// [`Integration::Analytic`] is used.
    Exact(ExactOptions),
    /// The exact integral, lines, points or rays, whichever takes the least time for an equal error
    /// (`hybrid`). This is chosen for each shading point and light by the occluders between them.
    Cheapest,
}

/// The limits of [`Integration::Exact`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactOptions {
    /// The largest number of triangles in between for which the closed form over the visible part
    /// is used. Lines are used past more triangles, and past too many to count. There is no limit
    /// if this is [`ExactOptions::NO_LIMIT`].
    pub limit: u32,
}

impl ExactOptions {
    /// The limit that allows any number of triangles.
    pub const NO_LIMIT: u32 = u32::MAX;

    /// The default: any number of triangles.
    pub const DEFAULT: Self = Self {
        limit: Self::NO_LIMIT,
    };
}

/// The directions of the lines of one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineDirection {
    /// The direction in which the visible part of the light changes least from one line to the
    /// next, among the directions of the light's edges and diagonals, if it is known
    /// (`OcclusionStats::direction`). If not, and for lines by texture, this is
    /// [`LineDirection::Parallel`].
    Adaptive,
    /// A fixed direction, as a fraction of a half turn from the light's first edge.
    Fixed(f64),
    /// One random direction for each shading point, which Billen & Dutré 2016 prefer.
    Parallel,
    /// A random direction for each line, independent of the other lines, while the offsets follow
    /// the pattern. The error then falls with N^-1/2 only. A technique with this direction has to
    /// stand alone.
    UniformPerLine,
    /// A direction for each line, where direction and offset are the two dimensions of one pattern
    /// (Billen & Dutré 2016, §5.1.1). A technique with this direction has to stand alone.
    Stratified,
    /// Lines from one corner of the light to its border. The corner is random for each shading
    /// point, and equal areas get equally many lines
    /// ([`AreaSampler::line`](linelit_lights::AreaSampler::line); Billen & Dutré 2016, §8).
    /// [`Lines::offset`] has no effect. A technique with this direction has to stand alone.
    Origin,
    /// This many directions, evenly spaced from a random first one, each of which counts as a
    /// technique. The balance heuristic over them approximates a continuum of directions
    /// (stochastic MIS, West et al. 2020). As the lines of every direction cover the whole light,
    /// the estimate is unbiased for each draw of directions.
    Spread(u8),
}

/// The control variate of lines that are integrated in closed form, or by quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineControl {
    /// For each line, the slope between the two lines next to it is a control variate. If the light
    /// changes linearly from line to line, only the first and last stratum have noise. The variance
    /// falls as N⁻⁴, where the variance of the mean falls as N⁻³ (Chopin & Gerber 2024). The
    /// estimate stays unbiased.
    ///
    /// This applies to lines of one direction or from one corner, with patterns that have
    /// [independent strata](linelit_samplers::SampleSet::has_independent_strata). With other
    /// patterns, and for lines of which points are sampled, it is [`LineControl::None`].
    Slopes,
    /// There is no control variate: the estimate is the mean over lines, as published.
    None,
}

/// The parts of a line on which points are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// All visible pieces together, in proportion to their measure, as published.
    One,
    /// Each visible piece by itself, with a point at the same relative position of each. The
    /// estimate then stays smooth where a piece appears or ends, unlike the estimate by one point,
    /// which jumps between pieces.
    Each,
}

impl From<Points> for Technique {
    fn from(points: Points) -> Self {
        Self::Points(points)
    }
}

impl From<Lines> for Technique {
    fn from(lines: Lines) -> Self {
        Self::Lines(lines)
    }
}

impl From<PointDensity> for PointBy {
    fn from(density: PointDensity) -> Self {
        Self::Surface(density)
    }
}

impl LinearOptions {
    /// The default: points by projected solid angle.
    pub const DEFAULT: Self = Self::Technique(LinearTechnique::ProjectedSolidAngle);
}

/// The default of ν by Peters: half of the light is expected to be visible.
pub(crate) const NU: f64 = 0.5;

impl Points {
    /// Points by a density, with a shadow ray each.
    #[must_use]
    pub const fn by(by: PointBy) -> Self {
        Self {
            by,
            in_shaft: false,
        }
    }

    /// Directions drawn from the BSDF.
    #[must_use]
    pub const fn bsdf() -> Self {
        Self::by(PointBy::Bsdf)
    }
}

impl PointBy {
    /// The density on a surface; `None` if directions are drawn from the BSDF.
    pub(crate) const fn on_surface(self) -> Option<PointDensity> {
        match self {
            Self::Surface(density) => Some(density),
            Self::Linear(_) => Some(SolidAngle),
            Self::Bsdf => None,
        }
    }

    /// The technique for linear lights that replaces this density.
    pub(crate) const fn on_segment(self) -> LinearOptions {
        LinearOptions::Technique(match self {
            Self::Surface(Area | VisibleArea | Texture) => LinearTechnique::Area,
            Self::Surface(Proxy | SolidAngle) => LinearTechnique::ClippedSolidAngle,
            Self::Surface(ProjectedSolidAngle) | Self::Bsdf => LinearTechnique::ProjectedSolidAngle,
            Self::Surface(Lobes) => return LinearOptions::Ltc(LinearHeuristic::ClampedOptimal(NU)),
            Self::Linear(options) => return options,
        })
    }
}

impl Lines {
    /// Lines that are uniform in the area, with a point of the visible part of each.
    pub const AREA: Self = Self::by(LineBy::Area);

    /// Lines that are uniform in a measure, with points of their visible parts. They have the
    /// direction that is best for the light, and offsets in proportion to length.
    #[must_use]
    pub const fn by(by: LineBy) -> Self {
        Self {
            by,
            integration: None,
            direction: LineDirection::Adaptive,
            offset: OffsetDensity::Length,
            control: LineControl::Slopes,
            pieces: Pieces::Each,
            points: 1,
        }
    }

    /// Lines that are uniform in the area, with an integral over the visible parts.
    #[must_use]
    pub const fn integrated(integration: Integration) -> Self {
        Self {
            integration: Some(integration),
            ..Self::AREA
        }
    }

    /// The measure in which lines are in fact uniform.
    pub(crate) const fn measure(&self) -> LineBy {
        match self.integration {
            None => self.by,
            Some(_) => LineBy::Area,
        }
    }

    /// The number of directions, each of which counts as a technique.
    pub(crate) const fn directions(&self) -> u8 {
        match self.direction {
            LineDirection::Spread(count) => count,
            _ => 1,
        }
    }

    /// Returns whether the density of offsets has an effect.
    pub(crate) fn has_offsets(&self) -> bool {
        self.measure() == LineBy::Area && self.direction != LineDirection::Origin
    }
}

/// The techniques with their default options, and the names that they have in texts.
pub(crate) const TECHNIQUES: [(&str, Technique); 17] = {
    const fn points(by: PointDensity) -> Technique {
        Technique::Points(Points::by(PointBy::Surface(by)))
    }
    const fn lines(by: LineBy) -> Technique {
        Technique::Lines(Lines::by(by))
    }
    const fn integrated(integration: Integration) -> Technique {
        Technique::Lines(Lines::integrated(integration))
    }
    const LINEAR: PointBy = PointBy::Linear(LinearOptions::DEFAULT);
    const EXACT: Integration = Integration::Exact(ExactOptions::DEFAULT);
    [
        ("point-area", points(Area)),
        ("point-visible-area", points(VisibleArea)),
        ("point-proxy", points(Proxy)),
        ("point-solid-angle", points(SolidAngle)),
        ("point-projected-solid-angle", points(ProjectedSolidAngle)),
        ("point-ltc", points(Lobes)),
        ("point-texture", points(Texture)),
        ("point-bsdf", Technique::Points(Points::bsdf())),
        ("point-linear", Technique::Points(Points::by(LINEAR))),
        ("line-area", lines(LineBy::Area)),
        ("line-solid-angle", lines(LineBy::SolidAngle)),
        ("line-warped", lines(LineBy::Warped)),
        ("line-projected", lines(LineBy::Projected)),
        ("line-texture", lines(LineBy::Texture)),
        ("line-analytic", integrated(Integration::Analytic)),
        ("exact", integrated(EXACT)),
        ("hybrid", integrated(Integration::Cheapest)),
    ]
};

impl Technique {
    /// All techniques with their default options, in the order of the table of names.
    pub fn all() -> impl Iterator<Item = Self> {
        TECHNIQUES.into_iter().map(|(_, technique)| technique)
    }

    /// The name that the technique has in texts, with any options.
    #[must_use]
    pub fn name(&self) -> &'static str {
        use std::mem::discriminant;
        let is_kind = |other: &Self| match (self, other) {
            (Self::Points(a), Self::Points(b)) => match (a.by, b.by) {
                (PointBy::Linear(_), PointBy::Linear(_)) => true,
                (a, b) => a == b,
            },
            (Self::Lines(a), Self::Lines(b)) => {
                let integration = |lines: &Lines| lines.integration.as_ref().map(discriminant);
                integration(a) == integration(b) && a.measure() == b.measure()
            }
            _ => false,
        };
        let found = TECHNIQUES.iter().find(|(_, other)| is_kind(other));
        found.map_or("", |(name, _)| name)
    }

    /// Returns whether the technique uses the LTCs of the reflection.
    pub(crate) fn asks_for_cosines(&self) -> bool {
        use PointBy::{Linear, Surface};
        match self {
            Self::Points(p) => matches!(p.by, Surface(Lobes) | Linear(LinearOptions::Ltc(_))),
            Self::Lines(_) => self.may_become_points(),
        }
    }

    /// Returns whether its lines may be replaced, in a combination, by points or by an integral
    /// over the visible region.
    pub(crate) fn may_become_points(&self) -> bool {
        self.integrated()
            .is_some_and(|(_, by)| by != Integration::Analytic)
    }

    /// Its lines and the integral over their visible parts; `None` if it has no integral.
    pub(crate) fn integrated(&self) -> Option<(&Lines, Integration)> {
        match self {
            Self::Lines(lines) => Some((lines, lines.integration?)),
            Self::Points(_) => None,
        }
    }

    /// The number of techniques as which it counts.
    pub(crate) fn width(&self) -> usize {
        match self {
            Self::Lines(lines) => usize::from(lines.directions()),
            Self::Points(_) => 1,
        }
    }

    /// Returns whether it needs no weights if it is the only technique of an estimator. It then
    /// draws samples on the whole light, from the first stream. Any other technique is treated as a
    /// combination of one.
    pub(crate) fn can_stand_alone(&self) -> bool {
        match self {
            Self::Points(points) => points.by != PointBy::Surface(Texture),
            Self::Lines(lines) => {
                lines.measure() == LineBy::Area
                    && lines.pieces == Pieces::Each
                    && lines.points == 1
                    && !matches!(lines.direction, LineDirection::Spread(_))
            }
        }
    }

    /// Returns whether it cannot be weighted, because its density is not known at a given point.
    pub(crate) const fn must_stand_alone(&self) -> bool {
        use LineDirection::{Origin, Stratified, UniformPerLine};
        matches!(self, Self::Lines(l) if matches!(l.direction, UniformPerLine | Stratified | Origin))
    }

    /// Returns whether the option `mis` is an option of the technique itself, so that it cannot
    /// choose the weights that combine techniques.
    pub(crate) const fn has_own_mis(&self) -> bool {
        matches!(self, Self::Points(points) if matches!(points.by, PointBy::Linear(_)))
    }

    /// Returns whether it has the option `visibility`: its points may share a shaft if it stands
    /// alone.
    pub(crate) const fn has_visibility(&self) -> bool {
        matches!(
            self,
            Self::Points(Points {
                by: PointBy::Surface(Area | Proxy | SolidAngle | Lobes),
                ..
            })
        )
    }
}
