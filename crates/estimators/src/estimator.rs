//! The one type of estimators: techniques, their shares of the samples, and how they are weighted.

use linelit_lights::OffsetDensity;
use linelit_lights::linear::LinearTechnique;

/// Most techniques in one combination; `orientation=spread:K` counts as K.
pub const MOST_TECHNIQUES: usize = 8;

/// How direct light is estimated at a shading point: one to eight techniques that share the
/// samples, and how they are weighted.
///
/// Built from parts, or from text ([`std::str::FromStr`]), which lists techniques with `+`, their
/// shares after `:` and options in brackets; what is not said takes its default.
///
/// ```
/// use linelit_estimators::{Estimator, LineBy, Points};
/// let built = Estimator::lines(LineBy::SolidAngle).fixed(0.0).share(3).with(Points::bsdf());
/// assert_eq!(built.to_string(), "line-solid-angle:3[orientation=fixed:0]+point-bsdf");
/// assert_eq!(built.to_string().parse(), Ok(built));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    parts: [Part; MOST_TECHNIQUES],
    count: usize,
    weights: Weights,
}

/// A technique and its share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The technique.
    pub technique: Technique,
    /// Its share of the samples, in proportion to the other parts'; above zero.
    pub share: u32,
}

/// One way to estimate the light of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    /// Points of the light, or directions that may meet it.
    Points(Points),
    /// Lines on the light, with their visible parts.
    Lines(Lines),
}

/// Points, and how their visibility is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// How they are drawn.
    pub by: PointBy,
    /// Whether points of a technique that stands alone share a shaft in place of shadow rays; where
    /// the shaft is empty, the closed form. Points of a combination share its shaft anyway.
    pub in_shaft: bool,
}

/// The density of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointBy {
    /// Uniform on the light's area.
    Area,
    /// Uniform on the part of the area that faces the shading point: of a sphere the visible cap,
    /// of other lights all of it.
    VisibleArea,
    /// Uniform in the light's solid angle.
    SolidAngle,
    /// Uniform in the light's projected solid angle: no noise on diffuse surfaces that see all of
    /// the light. Disks as [`PointBy::Area`].
    ProjectedSolidAngle,
    /// In proportion to the light's texture; uniform on the area of a light without one.
    Texture,
    /// Directions drawn from the BSDF; those that meet the light count. A linear light is never
    /// met: it gets points by its projected solid angle.
    Bsdf,
    /// On linear lights by any technique; on other lights as [`PointBy::SolidAngle`].
    Linear(LinearOptions),
}

/// Lines on area lights, and what is done with their visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// The measure in which lines, and points on them, are uniform; where they are integrated in
    /// closed form, area whatever this says.
    pub by: LineBy,
    /// How light is integrated over what is visible.
    pub integration: Integration,
    /// Direction of the lines.
    pub direction: LineDirection,
    /// Density of the offsets of lines by [`LineBy::Area`].
    pub offset: OffsetDensity,
    /// Where points are drawn in a combination.
    pub pieces: Pieces,
    /// How many there, evenly spread from a random first one; 1 with optimal weights. They cost
    /// less than the line where visibility does.
    pub points: u8,
}

/// The measure in which lines, and points on them, are uniform where nothing occludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineBy {
    /// Area: points uniform in length (Salesin & Jarosz 2019, eq. 14).
    Area,
    /// Solid angle (eqs. 16–19), for any polygon and direction.
    SolidAngle,
    /// Nearly solid angle: offsets from a density that needs no iteration
    /// ([`linelit_lights::AngularLines::by_warped_solid_angle`]).
    Warped,
    /// Projected solid angle of the part above the horizon.
    Projected,
    /// The light's texture: offsets by what is on the line, points by the texture along what is
    /// visible of it ([`linelit_lights::TexturedLines`]); area where there is no texture, or where
    /// the light is no parallelogram that is wholly above the horizon.
    Texture,
}

/// How light is integrated over what lines find visible.
///
/// All but [`Integration::Points`] need a reflection with a closed form; where there is none, or
/// the light has a texture, they take points. In a combination they stand alone where there is one,
/// with their share of the samples: they integrate over the BSDF, too, so that nothing is left for
/// others to add.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integration {
    /// By points of the visible parts.
    Points,
    /// The closed form along the visible parts of each line.
    Analytic,
    /// The closed form over what is visible of the light, where few enough triangles are in
    /// between; elsewhere as [`Integration::Analytic`].
    Exact(ExactOptions),
    /// Whichever of exact, lines, points and rays takes the least time to an equal error, chosen
    /// per shading point and light by what is in between. In a combination, where there is no
    /// closed form and a shaft is too dense to keep: points uniform on the area, eight for each
    /// sample of all parts.
    Cheapest,
}

/// How exact [`Integration::Exact`] is, and where it gives up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactOptions {
    /// The accuracy asked for, relative to the light unshadowed: 1e-3 to 1e-10.
    pub tolerance: f64,
    /// Past more triangles in between than this, lines take over.
    pub limit: u32,
}

/// The directions of the lines of one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineDirection {
    /// This fraction of a half turn from the light's first edge.
    Fixed(f64),
    /// One random direction for each shading point.
    Parallel,
    /// A direction for each line, which brings back the rate N^-1/2. Only for a technique that
    /// stands alone.
    UniformPerLine,
    /// So many directions, evenly spread from a random first one, each a technique of its own: the
    /// continuum of directions by the balance heuristic over those drawn (stochastic MIS, West et
    /// al. 2020). As every direction covers the whole light, each draw of directions is unbiased by
    /// itself.
    Spread(u8),
}

/// Where on a line points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pieces {
    /// On all visible pieces, in proportion to their measure, as published.
    One,
    /// In each visible piece, all at the same place within their piece: the estimate then stays
    /// smooth where a piece appears or ends, which one point that jumps between pieces is not.
    Each,
}

/// How the techniques of an estimator are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Not at all: one technique on the whole light, a point on each line.
    Alone,
    /// The balance heuristic, in proportion to N p (Veach & Guibas 1995). Of a single technique: it
    /// draws on the part of the light above the horizon, as in any combination.
    Balance,
    /// The power heuristic, in proportion to (N p)².
    Power,
    /// All to the largest N p.
    Maximum,
    /// In proportion to N, whatever the densities.
    Average,
    /// The balance heuristic with the densities of points smoothed at the borders of the light and
    /// of its visible parts, so that weights have no steps (Salesin & Jarosz 2019, eqs. 20–24).
    Smooth(Smoothing),
    /// The optimal heuristic (Kondapaneni et al. 2019), with coefficients for one half of the
    /// samples from the other, so that the mean stays right; for one sample, the balance heuristic.
    Optimal(Optimal),
    /// The balance heuristic by what the densities of lines would be if nothing stood in between:
    /// no technique then asks what is visible around another's samples.
    ///
    /// Weights that sum to one at each point of the light leave the mean as it is, whatever they
    /// are; what a sample is divided by is its own density, which the visibility that its own line
    /// has found tells.
    Unoccluded,
}

/// What optimal weights may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optimal {
    /// Negative, and above one.
    Free,
    /// Between zero and one: no sample contributes less than nothing.
    Clamped,
}

/// The width over which densities of points are smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothing {
    /// Half the light's smaller dimension, everywhere.
    Fixed,
    /// Less where the occluder behind an end hides less (eq. 24).
    Variable,
}

/// How points on linear lights are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearOptions {
    /// One technique.
    Technique(LinearTechnique),
    /// As many samples by projected solid angle, for what is diffuse, as by a linearly transformed
    /// cosine, for the lobe. On a surface without a lobe, the first alone.
    Ltc(LinearHeuristic),
}

/// How diffuse and glossy samples of a linear light are weighted (Peters 2021, section 4.2).
///
/// The heuristics but the first know the unshadowed diffuse and glossy light cₖ, by channel, in
/// closed form. The share ν of them is the visibility that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearHeuristic {
    /// By the densities.
    Balance,
    /// By cₖ times the densities; perfect where nothing is hidden.
    WeightedBalance,
    /// The optimal heuristic for the visibility ν. Contributions of hidden samples count, and may
    /// be negative.
    Optimal(f64),
    /// ν times the weighted balance and 1 − ν times the balance.
    ClampedOptimal(f64),
}

impl Default for LinearOptions {
    fn default() -> Self {
        Self::Technique(LinearTechnique::ProjectedSolidAngle)
    }
}

impl ExactOptions {
    /// Accurate to 1e-6, past 224 triangles.
    pub const DEFAULT: Self = Self {
        tolerance: 1e-6,
        limit: 224,
    };
}

impl Default for ExactOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

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

impl Lines {
    /// Lines uniform in the area, a point of what is visible of each.
    pub const AREA: Self = Self::by(LineBy::Area);

    /// Lines of a measure with points of their visible parts, one random direction for each shading
    /// point (what Billen & Dutré prefer), offsets in proportion to length.
    #[must_use]
    pub const fn by(by: LineBy) -> Self {
        Self {
            by,
            integration: Integration::Points,
            direction: LineDirection::Parallel,
            offset: OffsetDensity::Length,
            pieces: Pieces::Each,
            points: 1,
        }
    }

    /// The measure that counts.
    pub(crate) fn measure(&self) -> LineBy {
        match self.integration {
            Integration::Points => self.by,
            Integration::Analytic | Integration::Exact(_) | Integration::Cheapest => LineBy::Area,
        }
    }

    /// Lines uniform in the area, integrated in closed form.
    #[must_use]
    pub const fn integrated(integration: Integration) -> Self {
        Self {
            integration,
            ..Self::AREA
        }
    }
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

impl Technique {
    /// How many techniques it counts for.
    pub(crate) const fn width(&self) -> usize {
        match self {
            Self::Lines(Lines {
                direction: LineDirection::Spread(count),
                ..
            }) => *count as usize,
            Self::Lines(_) | Self::Points(_) => 1,
        }
    }

    /// Whether it can do without weights: it draws on the whole light, by its first stream.
    pub(crate) fn can_stand_alone(&self) -> bool {
        match self {
            Self::Points(points) => points.by != PointBy::Texture,
            Self::Lines(lines) => {
                lines.measure() == LineBy::Area
                    && lines.pieces == Pieces::Each
                    && lines.points == 1
                    && !matches!(lines.direction, LineDirection::Spread(_))
            }
        }
    }

    fn needs_to_stand_alone(&self) -> bool {
        matches!(self, Self::Lines(l) if l.direction == LineDirection::UniformPerLine)
    }
}

impl<T: Into<Technique>> From<T> for Estimator {
    /// The technique alone; with the balance heuristic if it cannot do without.
    fn from(technique: T) -> Self {
        let technique = technique.into();
        Self {
            parts: [Part {
                technique,
                share: 1,
            }; MOST_TECHNIQUES],
            count: 1,
            weights: if technique.can_stand_alone() {
                Weights::Alone
            } else {
                Weights::Balance
            },
        }
    }
}

impl Estimator {
    /// Techniques with their shares, weighted. `None` for no part, more than [`MOST_TECHNIQUES`], a
    /// share of zero, [`Weights::Alone`] for anything but one technique that can do without
    /// weights, [`LineDirection::UniformPerLine`] with any other weights, and weights that have no
    /// text: of [`PointBy::Linear`] alone, or of several of them but balanced.
    #[must_use]
    pub fn new(parts: &[Part], weights: Weights) -> Option<Self> {
        let width: usize = parts.iter().map(|p| p.technique.width()).sum();
        let alone = weights == Weights::Alone;
        let fits = |p: &Part| match alone {
            true => p.technique.can_stand_alone(),
            false => !p.technique.needs_to_stand_alone(),
        };
        let counted = (1..=MOST_TECHNIQUES).contains(&width) && parts.iter().all(|p| p.share > 0);
        // The option `mis` of `point-linear` is its own: nothing could say these weights.
        let linear = |p: &Part| matches!(p.technique, Technique::Points(p) if matches!(p.by, PointBy::Linear(_)));
        let said = match parts.len() {
            1 => alone,
            _ => weights == Weights::Balance,
        } || !parts.iter().all(linear);
        if !counted || !said || !parts.iter().all(fits) || (alone && parts.len() > 1) {
            return None;
        }
        let mut all = [*parts.first()?; MOST_TECHNIQUES];
        // A spread of no directions counts for nothing, so that there may be more parts.
        all.get_mut(..parts.len())?.copy_from_slice(parts);
        Some(Self {
            parts: all,
            count: parts.len(),
            weights,
        })
    }

    /// Points of a density, a shadow ray for each.
    #[must_use]
    pub fn points(by: PointBy) -> Self {
        Points::by(by).into()
    }

    /// Lines of a measure, with points of their visible parts.
    #[must_use]
    pub fn lines(by: LineBy) -> Self {
        Lines::by(by).into()
    }

    /// Lines with the light along their visible parts in closed form.
    #[must_use]
    pub fn analytic() -> Self {
        Lines::integrated(Integration::Analytic).into()
    }

    /// The closed form over what is visible of the light.
    #[must_use]
    pub fn exact() -> Self {
        Lines::integrated(Integration::Exact(ExactOptions::DEFAULT)).into()
    }

    /// Whichever is cheapest by what stands between.
    #[must_use]
    pub fn hybrid() -> Self {
        Lines::integrated(Integration::Cheapest).into()
    }

    /// With one more technique, of share one; weighted by the balance heuristic unless weights are
    /// chosen already.
    ///
    /// # Panics
    /// If there are too many, or a technique cannot be combined: see [`Estimator::new`].
    #[must_use]
    pub fn with(self, technique: impl Into<Technique>) -> Self {
        let weights = match self.weights {
            Weights::Alone => Weights::Balance,
            chosen => chosen,
        };
        let technique = technique.into();
        let mut parts: Vec<Part> = self.parts().copied().collect();
        parts.push(Part {
            technique,
            share: 1,
        });
        Self::new(&parts, weights).expect("techniques that can be combined, eight at most")
    }

    /// With the lines of the last technique in a fixed direction: a fraction of a half turn from
    /// the light's first edge. Points have none.
    #[must_use]
    pub const fn fixed(mut self, fraction: f64) -> Self {
        if let Technique::Lines(lines) = &mut self.parts[self.count - 1].technique {
            lines.direction = LineDirection::Fixed(fraction);
        }
        self
    }

    /// With another share for the last technique; at least one.
    #[must_use]
    pub const fn share(mut self, share: u32) -> Self {
        self.parts[self.count - 1].share = if share == 0 { 1 } else { share };
        self
    }

    /// With other weights.
    ///
    /// # Panics
    /// If the techniques cannot be weighted so: see [`Estimator::new`].
    #[must_use]
    pub fn weighted(self, weights: Weights) -> Self {
        let parts: Vec<Part> = self.parts().copied().collect();
        Self::new(&parts, weights).expect("weights that these techniques can have")
    }

    /// The techniques with their shares.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.parts[..self.count].iter()
    }

    /// How they are weighted.
    #[must_use]
    pub const fn weights(&self) -> Weights {
        self.weights
    }

    /// The technique that stands alone, unweighted.
    #[must_use]
    pub fn alone(&self) -> Option<&Technique> {
        (self.weights == Weights::Alone).then_some(&self.parts[0].technique)
    }

    /// Whether the estimator asks line queries.
    #[must_use]
    pub fn uses_lines(&self) -> bool {
        self.parts()
            .any(|p| matches!(p.technique, Technique::Lines(_)))
    }

    /// Whether a part is [`Integration::Cheapest`].
    pub(crate) fn has_cheapest(&self) -> bool {
        self.parts().any(
            |p| matches!(p.technique, Technique::Lines(l) if l.integration == Integration::Cheapest),
        )
    }

    /// The first part that takes a closed form where there is one, and the samples of all such
    /// parts of `count`.
    pub(crate) fn closed(&self, count: u32) -> Option<(Lines, u32)> {
        let closed = |p: &Part| match p.technique {
            Technique::Lines(l) if l.integration != Integration::Points => Some(l),
            Technique::Lines(_) | Technique::Points(_) => None,
        };
        let lines = self.parts().find_map(closed)?;
        let shares = |p: &Part| f64::from(p.share);
        let all: f64 = self.parts().map(shares).sum();
        let theirs: f64 = self
            .parts()
            .filter(|p| closed(p).is_some())
            .map(shares)
            .sum();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and the number of samples"
        )]
        let samples = (f64::from(count) * theirs / all).round().max(1.0) as u32;
        Some((lines, samples))
    }
}
