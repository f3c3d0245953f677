//! The one type of estimators: techniques, their shares of the samples, and how they are weighted.

use crate::{ExactOptions, Integration, LineBy, LineDirection, Lines, PointBy, Points, Technique};

/// Most techniques in one combination; `orientation=spread:K` counts as K.
pub const MOST_TECHNIQUES: usize = 8;

/// An estimator of direct light at a shading point: one to eight techniques that share the samples,
/// and the weights that combine them.
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
    /// The share of the samples, in proportion to the other parts'; above zero.
    pub share: u32,
}

/// The weights that combine an estimator's techniques.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// One technique without weights: its samples on the whole light count as value over density,
    /// a point in each visible piece of a line. Not for points by
    /// [texture](crate::PointDensity::Texture), lines by measures other than area,
    /// [`LineDirection::Spread`], [`Lines::points`] above one and
    /// [`Pieces::One`](crate::Pieces::One), which are [`Weights::Balance`] by themselves.
    Alone,
    /// The balance heuristic, in proportion to N p (Veach & Guibas 1995). Of a single technique: it
    /// draws on the part of the light above the horizon, as in any combination.
    Balance,
    /// The power heuristic, in proportion to (N p)².
    Power,
    /// All weight to the technique with the largest N p.
    Maximum,
    /// Equal weights for all techniques that reach the point, whatever their samples and densities:
    /// the mean of the estimates by each alone (Salesin & Jarosz 2019, eq. 6).
    Average,
    /// The balance heuristic with the densities of points smoothed at the borders of the light and
    /// of its visible parts, so that weights have no steps (Salesin & Jarosz 2019, eqs. 20–24).
    Smooth(Smoothing),
    /// The optimal heuristic (Kondapaneni et al. 2019), with coefficients for one half of the
    /// samples from the other, so that the mean stays right; for one sample, and for a technique
    /// that has no sample in a half, the balance heuristic.
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
    /// The weights of parts of which nothing else is said.
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
    /// Weights are between zero and one: no sample contributes less than nothing.
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

impl<T: Into<Technique>> From<T> for Estimator {
    /// The technique alone; with the balance heuristic if it cannot do without.
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
    /// Techniques with their shares, weighted. `None` for no part, more than [`MOST_TECHNIQUES`], a
    /// share of zero, [`Weights::Alone`] for several techniques or one that it is not
    /// for, directions of lines that only a technique alone can have ([`LineDirection`]) with any
    /// other weights, and weights that have no text: of [`PointBy::Linear`] alone, or of several of
    /// them but balanced.
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
    pub fn points(by: impl Into<PointBy>) -> Self {
        Points::by(by.into()).into()
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

    /// The closed form over the visible part of the light; on a reflection of which no closed form
    /// and no transformed cosines are known, a point of each line.
    #[must_use]
    pub fn exact() -> Self {
        Lines::integrated(Integration::Exact(ExactOptions::DEFAULT)).into()
    }

    /// Creates the estimator that chooses the cheapest technique by the occluders in between.
    #[must_use]
    pub fn hybrid() -> Self {
        Lines::integrated(Integration::Cheapest).into()
    }

    /// Adds one more technique, of share one; weighted by the balance heuristic unless weights are
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
        let mut parts = self.parts().to_vec();
        parts.push(Part::one(technique));
        Self::new(&parts, weights).expect("techniques that can be combined, eight at most")
    }

    /// Fixes the direction of the last technique's lines: a fraction of a half turn from the
    /// light's first edge. Points are unchanged.
    #[must_use]
    pub const fn fixed(mut self, fraction: f64) -> Self {
        if let Technique::Lines(lines) = &mut self.parts[self.count - 1].technique {
            lines.direction = LineDirection::Fixed(fraction);
        }
        self
    }

    /// Sets the share of the last technique; at least one.
    #[must_use]
    pub const fn share(mut self, share: u32) -> Self {
        self.parts[self.count - 1].share = if share == 0 { 1 } else { share };
        self
    }

    /// Sets the weights.
    ///
    /// # Panics
    /// If the techniques cannot be weighted so: see [`Estimator::new`].
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

    /// The technique that stands alone, unweighted.
    #[must_use]
    pub fn alone(&self) -> Option<&Technique> {
        (self.weights == Weights::Alone).then_some(&self.parts[0].technique)
    }

    /// The integrals of the techniques that take one where it has a closed form.
    pub(crate) fn integrals(&self) -> impl Iterator<Item = Integration> {
        let integrals = (self.parts().iter()).filter_map(|part| part.technique.integrated());
        integrals.map(|(_, by)| by)
    }

    /// The first of the [integrals](Self::integrals), with the samples of all of them, of `count`.
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

/// An integral over the visible parts of a light, in place of techniques.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Integral<'e> {
    pub lines: &'e Lines,
    pub by: Integration,
    /// The number of samples.
    pub count: u32,
}
