//! Points and lines in one estimator (Salesin & Jarosz 2019, sections 3 and 4).
//!
//! A line sample becomes a point sample once a point of its visible part is drawn: its density is
//! the joint one of eqs. 14 and 19, which knows the visibility. Any number of such techniques,
//! lines of different directions, points and BSDF samples, then combine by multiple importance
//! sampling.

mod estimate;
mod optimal;
mod sight;
mod strand;
mod text;

pub(crate) use estimate::MixBuffers;

use linelit_mis::Heuristic;

/// Techniques in one mix, after a spread of directions is counted out.
pub const MOST_TECHNIQUES: usize = 8;

/// Techniques that share the samples of a shading point, combined by multiple importance sampling.
///
/// The text form lists them with `+`, their shares of the samples after `:`, options in brackets:
/// `line-solid-angle:3+point-bsdf:1[mis=smooth]`. Techniques are `point-area`, `point-solid-angle`,
/// `point-texture`, `point-bsdf`, `line-area`, `line-analytic`, `hybrid`, `line-solid-angle`, `line-warped` (nearly
/// solid angle, at half the cost), `line-projected` and `line-texture`; the option `mis`, which may
/// stand with any of them, names the heuristic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    parts: [Option<Part>; MOST_TECHNIQUES],
    heuristic: MixHeuristic,
}

/// A technique and its share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The technique.
    pub technique: Technique,
    /// Its share of the samples, in proportion to the other parts'.
    pub share: u32,
}

/// How one part of a mix draws points of an area light.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Technique {
    /// Uniform on the area.
    PointArea,
    /// Uniform in the solid angle.
    PointSolidAngle,
    /// In proportion to the light's texture; uniform on the area of a light without one.
    PointTexture,
    /// Directions drawn from the BSDF.
    PointBsdf,
    /// Points of the visible part of lines.
    Line(LineTechnique),
}

/// Points of the visible part of lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineTechnique {
    /// The measure in which lines, and points on them, are uniform.
    pub measure: LineMeasure,
    /// Direction of the lines.
    pub direction: LineDirection,
    /// Where points are drawn.
    pub pieces: Pieces,
    /// How many there, evenly spread from a random first one; 1 with optimal weights. They cost
    /// less than the line where visibility does.
    pub points: u8,
}

/// The measure in which lines, and points on them, are uniform where nothing occludes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineMeasure {
    /// Area: offsets in proportion to length, points uniform in length (Salesin & Jarosz 2019, eq. 14).
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
    /// Area; but where the material has a closed form, this part's samples alone, as lines with the
    /// light along what is visible of them in closed form: that integrates over the BSDF, too, so
    /// that nothing is left for others to add.
    Analytic,
    /// The same, but what is cheapest in place of lines, as
    /// [`Estimator::Hybrid`](crate::Estimator::Hybrid) has it; where the material has no closed form
    /// and a shaft is too dense to keep, points uniform on the area, eight for each sample of all
    /// parts.
    Hybrid,
}

/// The directions of the lines of one technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LineDirection {
    /// This fraction of a half turn from the light's first edge.
    Fixed(f64),
    /// One random direction for each shading point.
    Parallel,
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

/// How the techniques of a mix are weighted.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MixHeuristic {
    /// One of the classic heuristics (Veach & Guibas 1995).
    Classic(Heuristic),
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

impl Mix {
    /// A mix of parts, with the balance heuristic; `None` for no part, too many, or no share.
    #[must_use]
    pub fn new(parts: &[Part]) -> Option<Self> {
        let strands: usize = parts.iter().map(|p| p.technique.strands()).sum();
        if parts.is_empty() || strands > MOST_TECHNIQUES || parts.iter().any(|p| p.share == 0) {
            return None;
        }
        let mut out = [None; MOST_TECHNIQUES];
        for (to, from) in out.iter_mut().zip(parts) {
            *to = Some(*from);
        }
        Some(Self {
            parts: out,
            heuristic: MixHeuristic::Classic(Heuristic::Balance),
        })
    }

    /// The same parts with another heuristic.
    #[must_use]
    pub const fn with(mut self, heuristic: MixHeuristic) -> Self {
        self.heuristic = heuristic;
        self
    }

    /// The parts.
    pub fn parts(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().flatten()
    }

    /// The heuristic.
    #[must_use]
    pub const fn heuristic(&self) -> MixHeuristic {
        self.heuristic
    }

    /// The part that takes the closed form where the material has one, and its samples of `count`.
    pub(crate) fn closed(&self, count: u32) -> Option<(LineTechnique, u32)> {
        let shares = |p: &Part| f64::from(p.share);
        let closed = |p: &&Part| matches!(p.technique, Technique::Line(l) if l.measure.is_closed());
        let all: f64 = self.parts().map(shares).sum();
        let theirs: f64 = self.parts().filter(closed).map(shares).sum();
        let Some(Part {
            technique: Technique::Line(line),
            ..
        }) = self.parts().find(closed)
        else {
            return None;
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and the number of samples"
        )]
        let samples = (f64::from(count) * theirs / all).round().max(1.0) as u32;
        Some((*line, samples))
    }

    /// Whether any part is a line technique.
    #[must_use]
    pub fn uses_lines(&self) -> bool {
        self.parts()
            .any(|p| matches!(p.technique, Technique::Line(_)))
    }
}

impl LineMeasure {
    /// Whether it takes the closed form where the material has one.
    const fn is_closed(self) -> bool {
        matches!(self, Self::Analytic | Self::Hybrid)
    }
}

impl LineDirection {
    pub(crate) const fn is_fixed(self) -> bool {
        matches!(self, Self::Fixed(_))
    }
}

impl Technique {
    /// The number of techniques it counts for.
    fn strands(&self) -> usize {
        match self {
            Self::Line(LineTechnique {
                direction: LineDirection::Spread(count),
                ..
            }) => usize::from(*count),
            _ => 1,
        }
    }
}

impl LineTechnique {
    /// Lines of the measure, one random direction for each shading point, a point in each piece.
    #[must_use]
    pub const fn new(measure: LineMeasure) -> Self {
        Self {
            measure,
            direction: LineDirection::Parallel,
            pieces: Pieces::Each,
            points: 1,
        }
    }
}
