//! Techniques: the ways to draw points and lines of a light, and to integrate along lines.

use PointDensity::{Area, Lobes, ProjectedSolidAngle, Proxy, SolidAngle, Texture, VisibleArea};
use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;
pub use linelit_lights::{LineDensity as LineBy, PointDensity};

/// A technique: one way to estimate the light that a light sends to a shading point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    /// Points of the light, or directions that may meet it.
    Points(Points),
    /// Lines on the light, with their visible parts.
    Lines(Lines),
}

/// Points, and the way in which their visibility is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// The density of the points.
    pub by: PointBy,
    /// Whether points of a technique that stands alone share a shaft in place of shadow rays; in
    /// an empty shaft the closed form then replaces them. Points of a combination always share its
    /// shaft.
    pub in_shaft: bool,
}

/// The source of points. A density that a light does not have is replaced by another one, as
/// [`PointDensity`] says, and never by nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointBy {
    /// A density on the light's surface; on a linear light, the technique that is closest to it.
    Surface(PointDensity),
    /// Directions drawn from the BSDF; those that meet the light count. A linear light is
    /// never met: it gets points by its projected solid angle.
    Bsdf,
    /// Any technique of linear lights; other lights take [`PointDensity::SolidAngle`].
    Linear(LinearOptions),
}

/// The technique that draws points on linear lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearOptions {
    /// One technique.
    Technique(LinearTechnique),
    /// Two techniques with as many samples each: projected solid angle for the diffuse light, and
    /// linearly transformed cosines for the lobes. On a surface without a lobe, the first alone.
    Ltc(LinearHeuristic),
}

/// Weights of the diffuse and glossy samples of a linear light (Peters 2021, section 4.2).
///
/// The heuristics but the first know the unshadowed diffuse and glossy light cₖ, by channel, in
/// closed form. The share ν of them is the visibility that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearHeuristic {
    /// The densities alone, of which any technique may have that of projected solid angle's place.
    Balance(LinearTechnique),
    /// The densities times cₖ; perfect where nothing is hidden.
    WeightedBalance,
    /// The optimal heuristic for the visibility ν. Contributions of hidden samples count, and may
    /// be negative.
    Optimal(f64),
    /// ν times the weighted balance and 1 − ν times the balance.
    ClampedOptimal(f64),
}

/// Lines on area lights, and the use that is made of their visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// The measure in which lines, and points on them, are uniform; lines that are integrated in
    /// closed form are uniform in the area whatever this says.
    pub by: LineBy,
    /// The integral over the visible parts; `None` draws a point of them.
    pub integration: Option<Integration>,
    /// Direction of the lines.
    pub direction: LineDirection,
    /// Density of the offsets of parallel lines by [`LineBy::Area`].
    pub offset: OffsetDensity,
    /// The control variate of lines whose integrals are known.
    pub control: LineControl,
    /// The part of a line on which points are drawn in a combination.
    pub pieces: Pieces,
    /// The number of points there, evenly spread from a random first one; 1 with optimal weights.
    /// They cost less than the line where visibility does.
    pub points: u8,
}

/// The integral over the visible part that replaces points of it.
///
/// Where the reflection has no closed form, [`Integration::Exact`] and [`Integration::Cheapest`]
/// integrate transformed cosines that look like it and sample the rest; where nothing is known, or
/// the light has a texture, each takes points, of lines or of the light (`Method`).
///
/// In a combination the first of them stands alone with the share of all where there is a closed
/// form: it integrates over the BSDF, too, so that nothing is left for others to add. Where there
/// is none, each becomes `line-area` ([`LineBy::Area`]) or points, beside the integral of
/// transformed cosines where they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integration {
    /// The closed form along the visible parts of each line.
    Analytic,
    /// The closed form over the visible part of the light, past any number of triangles unless
    /// there is a limit; past those, and holes, as [`Integration::Analytic`].
    Exact(ExactOptions),
    /// Whichever of exact, lines, points and rays takes the least time to an equal error, chosen
    /// per shading point and light by what is in between.
    Cheapest,
}

/// The limits of [`Integration::Exact`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactOptions {
    /// The most triangles in between: past more, and wherever there are too many to count, lines
    /// take over; nowhere if it is [`ExactOptions::NO_LIMIT`].
    pub limit: u32,
}

impl ExactOptions {
    /// The closed form past any number of triangles.
    pub const NO_LIMIT: u32 = u32::MAX;

    /// Past any number of triangles.
    pub const DEFAULT: Self = Self {
        limit: Self::NO_LIMIT,
    };
}

/// The directions of the lines of one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineDirection {
    /// The direction in which the visible part of the light changes least from one line to the
    /// next, among those of its edges and diagonals, where it is known
    /// (`OcclusionStats::direction`); else, and for lines by texture, as
    /// [`LineDirection::Parallel`].
    Adaptive,
    /// The fixed direction at this fraction of a half turn from the light's first edge.
    Fixed(f64),
    /// One random direction for each shading point (what Billen & Dutré 2016 prefer).
    Parallel,
    /// A direction for each line, independent of the others', while offsets follow the pattern:
    /// this brings back the rate N^-1/2. Only for a technique that stands alone.
    UniformPerLine,
    /// A direction for each line, direction and offset by one pattern of two dimensions (Billen &
    /// Dutré 2016, §5.1.1). Only for a technique that stands alone.
    Stratified,
    /// Lines from one corner of the light to its border, from a random one for each shading point,
    /// as many over equal areas ([`AreaSampler::line`](linelit_lights::AreaSampler::line); Billen &
    /// Dutré 2016, §8): [`Lines::offset`] does not count. Only for a technique that stands alone.
    Origin,
    /// So many directions, evenly spread from a random first one, each a technique of its own: the
    /// continuum of directions by the balance heuristic over those drawn (stochastic MIS, West et
    /// al. 2020). As every direction covers the whole light, each draw of directions is unbiased by
    /// itself.
    Spread(u8),
}

/// The control variate of lines that are integrated in closed form, or by quadrature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineControl {
    /// The slope between the lines on either side of each is a control variate: light that changes
    /// linearly from line to line has noise in the first and last stratum only, and the variance
    /// falls as N⁻⁴ where the plain mean's falls as N⁻³ (Chopin & Gerber 2024). Unbiased.
    ///
    /// Lines of one direction or one origin have it, by patterns of
    /// [independent strata](linelit_samplers::SampleSet::has_independent_strata); where the pattern
    /// has none, and for lines of which a point is drawn, as [`LineControl::None`].
    Slopes,
    /// No control variate: the mean over lines, as published.
    None,
}

/// The part of a line on which points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// All visible pieces, in proportion to their measure, as published.
    One,
    /// Each visible piece, all at the same place within their piece: the estimate then stays
    /// smooth where a piece appears or ends, which one point that jumps between pieces is not.
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
    /// The default: samples by projected solid angle.
    pub const DEFAULT: Self = Self::Technique(LinearTechnique::ProjectedSolidAngle);
}

/// Peters' ν: half of the light is expected to be visible.
pub(crate) const NU: f64 = 0.5;

impl Points {
    /// Points of a density, with a shadow ray each.
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
    /// The density on a surface; `None` of directions that the BSDF draws.
    pub(crate) const fn on_surface(self) -> Option<PointDensity> {
        match self {
            Self::Surface(density) => Some(density),
            Self::Linear(_) => Some(SolidAngle),
            Self::Bsdf => None,
        }
    }

    /// The technique of linear lights that it stands for.
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
    /// Lines uniform in the area, a point of the visible part of each.
    pub const AREA: Self = Self::by(LineBy::Area);

    /// Lines of a measure with points of their visible parts, in the direction that suits the
    /// shading point best, offsets in proportion to length.
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

    /// Lines uniform in the area, integrated in closed form.
    #[must_use]
    pub const fn integrated(integration: Integration) -> Self {
        Self {
            integration: Some(integration),
            ..Self::AREA
        }
    }

    /// The measure that counts.
    pub(crate) const fn measure(&self) -> LineBy {
        match self.integration {
            None => self.by,
            Some(_) => LineBy::Area,
        }
    }

    /// The number of directions, each a technique of its own.
    pub(crate) const fn directions(&self) -> u8 {
        match self.direction {
            LineDirection::Spread(count) => count,
            _ => 1,
        }
    }

    /// Whether the density of offsets counts.
    pub(crate) fn has_offsets(&self) -> bool {
        self.measure() == LineBy::Area && self.direction != LineDirection::Origin
    }
}

/// The techniques with their names, as texts have them, and their default options.
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
    /// All techniques with their default options, in the order of their names' table.
    pub fn all() -> impl Iterator<Item = Self> {
        TECHNIQUES.into_iter().map(|(_, technique)| technique)
    }

    /// The name in texts, whatever the options.
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

    /// Whether it asks for the reflection's transformed cosines.
    pub(crate) fn asks_for_cosines(&self) -> bool {
        use PointBy::{Linear, Surface};
        match self {
            Self::Points(p) => matches!(p.by, Surface(Lobes) | Linear(LinearOptions::Ltc(_))),
            Self::Lines(_) => self.may_become_points(),
        }
    }

    /// Whether its lines may become points, or nothing, in a combination.
    pub(crate) fn may_become_points(&self) -> bool {
        self.integrated()
            .is_some_and(|(_, by)| by != Integration::Analytic)
    }

    /// Returns its lines and the integral over their visible parts, if it has one.
    pub(crate) fn integrated(&self) -> Option<(&Lines, Integration)> {
        match self {
            Self::Lines(lines) => Some((lines, lines.integration?)),
            Self::Points(_) => None,
        }
    }

    /// The number of techniques that it counts for.
    pub(crate) fn width(&self) -> usize {
        match self {
            Self::Lines(lines) => usize::from(lines.directions()),
            Self::Points(_) => 1,
        }
    }

    /// Whether its samples need no weights as an estimator's only technique: it then draws on the
    /// whole light, by its first stream. Any other is a combination of one.
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

    /// Whether it cannot be weighted: there is no density to weight by.
    pub(crate) const fn must_stand_alone(&self) -> bool {
        use LineDirection::{Origin, Stratified, UniformPerLine};
        matches!(self, Self::Lines(l) if matches!(l.direction, UniformPerLine | Stratified | Origin))
    }

    /// Whether the option `mis` is its own, so that weights of techniques cannot be said with it.
    pub(crate) const fn has_own_mis(&self) -> bool {
        matches!(self, Self::Points(points) if matches!(points.by, PointBy::Linear(_)))
    }

    /// Whether it has the option `visibility`: alone, its points may share a shaft.
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
