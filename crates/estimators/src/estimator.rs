//! This module has [`Estimator`], the one type of all estimators: techniques, their shares of the
//! samples, and the weights that combine them. `text.rs` reads and writes it as text.

use crate::{ExactOptions, Integration, LineBy, LineDirection, Lines, PointBy, Points, Technique};

/// The most techniques that one combination may have. Lines with `orientation=spread:K` count as K.
pub const MOST_TECHNIQUES: usize = 8;

/// An estimator of the direct light at a shading point: one to eight techniques that share the
/// samples, and the weights that combine them.
///
/// An estimator is built from parts, or parsed from text ([`std::str::FromStr`]). The text lists
/// techniques with `+` between them, with their shares after `:` and their options in brackets.
/// Shares and options that are left out have their default values.
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

/// A technique of an estimator and its share of the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The technique.
    pub technique: Technique,
    /// The share of the samples, in proportion to the shares of the other parts; above zero.
    pub share: u32,
}

/// The weights that combine the techniques of an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// One technique without weights. Its samples on the whole light count as value over density;
    /// lines have a point in each visible piece. Points by [texture](crate::PointDensity::Texture),
    /// lines by measures other than area, [`LineDirection::Spread`], [`Lines::points`] above one
    /// and [`Pieces::One`](crate::Pieces::One) cannot have it: a single technique of these kinds
    /// has [`Weights::Balance`].
    Alone,
    /// The balance heuristic, with weights in proportion to N p (Veach & Guibas 1995). A single
    /// technique may have it, too: it then draws on the part of the light above the horizons, as in
    /// any combination.
    Balance,
    /// The power heuristic, with weights in proportion to (N p)².
    Power,
    /// The maximum heuristic, which gives all weight to the technique with the largest N p.
    Maximum,
    /// Equal weights for all techniques that can sample the point, regardless of their numbers of
    /// samples and densities. This is the mean of the estimates by each technique alone (Salesin &
    /// Jarosz 2019, eq. 6).
    Average,
    /// The balance heuristic with densities of points that are smoothed at the borders of the light
    /// and of its visible parts, so that weights have no steps (Salesin & Jarosz 2019, eqs. 20–24).
    Smooth(Smoothing),
    /// The optimal heuristic (Kondapaneni et al. 2019). The coefficients for each half of the
    /// samples come from the other half, so that the estimate is unbiased. With one sample, and for
    /// a technique without a sample in a half, this is the balance heuristic.
    Optimal(Optimal),
}

impl Part {
    /// A technique with a share of one.
    pub(crate) fn one(technique: impl Into<Technique>) -> Self {
        Self {
            technique: technique.into(),
            share: 1,
        }
    }
}

impl Weights {
    /// The weights of parts for which no weights are given.
    pub(crate) fn implied(parts: &[Part]) -> Self {
        match parts {
            [only] if only.technique.can_stand_alone() => Self::Alone,
            _ => Self::Balance,
        }
    }
}

/// The range of optimal weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optimal {
    /// Weights may be negative, and above one.
    Free,
    /// Weights are between zero and one, so that no sample has a negative contribution.
    Clamped,
}

/// The width over which the densities of points are smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothing {
    /// Half the light's smaller dimension, everywhere.
    Fixed,
    /// Less than that where the occluder at the end of a visible part hides a short piece (eq. 24).
    Variable,
}

impl<T: Into<Technique>> From<T> for Estimator {
    /// The technique alone, or with the balance heuristic if it needs weights.
    fn from(technique: T) -> Self {
        let part = Part::one(technique);
        Self {
            parts: [part; MOST_TECHNIQUES],
            count: 1,
            weights: Weights::implied(&[part]),
        }
    }
}

impl Estimator {
    /// Combines techniques with their shares by weights.
    ///
    /// Returns `None` in these cases:
    /// - There is no part, there are more than [`MOST_TECHNIQUES`], or a share is zero.
    /// - [`Weights::Alone`] is given for several techniques, or for one that needs weights.
    /// - Lines have a direction that only a technique without weights can have ([`LineDirection`]),
    ///   and the weights are others.
    /// - The combination could not be written as text: all parts are [`PointBy::Linear`], and the
    ///   weights are not the default for that many parts.
    #[must_use]
    pub fn new(parts: &[Part], weights: Weights) -> Option<Self> {
        let width: usize = parts.iter().map(|p| p.technique.width()).sum();
        let alone = weights == Weights::Alone;
        let fits = |p: &Part| match alone {
            true => p.technique.can_stand_alone() && parts.len() == 1,
            false => !p.technique.must_stand_alone(),
        };
        let counted = (1..=MOST_TECHNIQUES).contains(&width) && parts.iter().all(|p| p.share > 0);
        let is_implied = weights == Weights::implied(parts);
        let has_text = is_implied || !parts.iter().all(|p| p.technique.has_own_mis());
        if !counted || !has_text || !parts.iter().all(fits) {
            return None;
        }
        let mut all = [*parts.first()?; MOST_TECHNIQUES];
        // A spread of zero directions does not count, so that there may be more parts than the
        // array holds.
        all.get_mut(..parts.len())?.copy_from_slice(parts);
        Some(Self {
            parts: all,
            count: parts.len(),
            weights,
        })
    }

    /// Points by a density, with a shadow ray for each.
    #[must_use]
    pub fn points(by: impl Into<PointBy>) -> Self {
        Points::by(by.into()).into()
    }

    /// Lines that are uniform in a measure, with points of their visible parts.
    #[must_use]
    pub fn lines(by: LineBy) -> Self {
        Lines::by(by).into()
    }

    /// Lines along whose visible parts the light is integrated in closed form.
    #[must_use]
    pub fn analytic() -> Self {
        Lines::integrated(Integration::Analytic).into()
    }

    /// The closed form over the visible part of the light. On a reflection without a closed form,
    /// LTCs that resemble it are integrated, and points sample the difference; if there are no such
    /// LTCs either, a point of each line is sampled.
    #[must_use]
    pub fn exact() -> Self {
        Lines::integrated(Integration::Exact(ExactOptions::DEFAULT)).into()
    }

    /// The estimator that chooses, at each shading point and for each light, the technique that
    /// takes the least time for an equal error, by the occluders in between.
    #[must_use]
    pub fn hybrid() -> Self {
        Lines::integrated(Integration::Cheapest).into()
    }

    /// Adds one more technique, with a share of one. The techniques are weighted by the balance
    /// heuristic, unless other weights were chosen before.
    ///
    /// # Panics
    /// If there are too many techniques, or one cannot be combined; see [`Estimator::new`].
    #[must_use]
    pub fn with(self, technique: impl Into<Technique>) -> Self {
        let weights = match self.weights {
            Weights::Alone => Weights::Balance,
            chosen => chosen,
        };
        let mut parts = self.parts().to_vec();
        parts.push(Part::one(technique));
        Self::new(&parts, weights).expect("techniques that can be combined, eight at most")
    }

    /// Fixes the direction of the lines of the last technique, as a fraction of a half turn from
    /// the light's first edge. If that technique has points, it is left unchanged.
    #[must_use]
    pub const fn fixed(mut self, fraction: f64) -> Self {
        if let Technique::Lines(lines) = &mut self.parts[self.count - 1].technique {
            lines.direction = LineDirection::Fixed(fraction);
        }
        self
    }

    /// Sets the share of the last technique; a share of zero counts as one.
    #[must_use]
    pub const fn share(mut self, share: u32) -> Self {
        self.parts[self.count - 1].share = if share == 0 { 1 } else { share };
        self
    }

    /// Sets the weights of the techniques.
    ///
    /// # Panics
    /// If the techniques cannot have these weights; see [`Estimator::new`].
    #[must_use]
    pub fn weighted(self, weights: Weights) -> Self {
        Self::new(self.parts(), weights).expect("weights that these techniques can have")
    }

    /// The techniques with their shares.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts[..self.count]
    }

    /// Returns the weights of the techniques.
    #[must_use]
    pub const fn weights(&self) -> Weights {
        self.weights
    }

    /// The only technique of an estimator without weights; `None` if there are weights.
    #[must_use]
    pub fn alone(&self) -> Option<&Technique> {
        (self.weights == Weights::Alone).then_some(&self.parts[0].technique)
    }

    /// The integrals of the techniques that have one ([`Lines::integration`]).
    pub(crate) fn integrals(&self) -> impl Iterator<Item = Integration> {
        let integrals = (self.parts().iter()).filter_map(|part| part.technique.integrated());
        integrals.map(|(_, by)| by)
    }

    /// The first of the [integrals](Self::integrals), together with the number of samples, of
    /// `count`, that all of them have.
    pub(crate) fn closed(&self, count: u32) -> Option<Integral<'_>> {
        let (lines, by) = (self.parts().iter()).find_map(|part| part.technique.integrated())?;
        if self.count == 1 {
            return Some(Integral { lines, by, count });
        }
        let share = |part: &Part| f64::from(part.share);
        let is_closed = |part: &&Part| part.technique.integrated().is_some();
        let theirs: f64 = self.parts().iter().filter(is_closed).map(share).sum();
        let all: f64 = self.parts().iter().map(share).sum();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and the number of samples"
        )]
        let count = (f64::from(count) * theirs / all).round().max(1.0) as u32;
        Some(Integral { lines, by, count })
    }
}

/// An integral over the visible parts of a light, which may replace techniques.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Integral<'e> {
    pub lines: &'e Lines,
    pub by: Integration,
    /// The number of samples, which are lines or points.
    pub count: u32,
}
