//! This module chooses the method by which an estimator treats one light at one shading point.
//!
//! The choice is a pure function of facts: the estimator, the kind of the light, what is known of
//! the reflection, and what the shaft between point and light found. It has two stages.
//! [`Choice::ask`] says, before visibility is queried, whether a shaft is worth its time;
//! [`Choice::method`] then takes the shaft's answer and returns the method: the known part, the
//! samples for the rest, and how visibility is queried. `hybrid.rs` has the rules that weigh times
//! against each other.
//!
//! A technique *stands alone* if it is the only one of its estimator and has no weights
//! ([`Weights::Alone`]). A *combination* weights several techniques, or one that needs weights.

use crate::estimator::Integral;
use crate::hybrid;
use crate::{
    Closed, Estimator, ExactOptions, Integration, KnownIntegrand, KnownOver, LightKind,
    LinearOptions, Method, MethodFacts, PointBy, PointDensity, Rest, ShaftAnswer, Technique,
    VisibilityBy, Weighted, Weights,
};
use linelit_visibility::ShaftClass;

/// An estimator together with the facts about its query, and what follows from both before
/// visibility is queried.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice<'e, 'f> {
    estimator: &'e Estimator,
    pub facts: MethodFacts<'f>,
    /// The integral that takes all samples, so that no other technique draws any: that of a
    /// technique that stands alone, and that of the first integral of a combination where the
    /// reflection has a closed form.
    integral: Option<Integral<'e>>,
}

impl<'e, 'f> Choice<'e, 'f> {
    pub(crate) fn new(estimator: &'e Estimator, facts: MethodFacts<'f>) -> Self {
        let mut choice = Self {
            estimator,
            facts,
            integral: None,
        };
        let integral = estimator.closed(facts.samples);
        choice.integral = integral.filter(|integral| choice.leaves_nothing(integral.by));
        choice
    }

    /// Returns whether a shaft is built before the method is chosen, or each sample has a ray of
    /// its own. Shafts are left out where no method could use their answer, and where rays are
    /// known to be better.
    pub(crate) fn ask(&self) -> VisibilityBy {
        let facts = &self.facts;
        if matches!(facts.light, LightKind::Delta | LightKind::Sky) {
            return VisibilityBy::Rays;
        }
        let by_rays = match (self.estimator.alone(), facts.light) {
            (Some(Technique::Points(_)), light) => self.estimator.points_by_rays(light).is_some(),
            (_, LightKind::Linear) => !facts.has_line_integral(),
            (Some(technique), LightKind::Sphere | LightKind::Disk) => {
                let has_integral = technique.may_become_points() && facts.has_region_integral();
                !has_integral && !self.wants_bsdf()
            }
            (_, LightKind::Polygon | LightKind::Textured) => match &self.integral {
                Some(integral) if integral.by == Integration::Cheapest => {
                    facts.occlusion.dense && hybrid::are_rays_better(facts, integral.count)
                }
                // Points by an image take a ray each: what hides them says nothing of the image.
                _ if facts.light == LightKind::Textured && self.is_hybrid() => {
                    facts.ask == VisibilityBy::Rays || facts.known.closed == Closed::Diffuse
                }
                _ => self.is_weighted() && facts.ask == VisibilityBy::Rays,
            },
            _ => false,
        };
        if by_rays {
            VisibilityBy::Rays
        } else {
            VisibilityBy::Shaft
        }
    }

    /// Returns the method for the light, for any estimator, from what the shaft found between the
    /// point and the light.
    pub(crate) fn method(&self, between: &ShaftAnswer) -> Method<'e> {
        let (facts, alone) = (&self.facts, self.estimator.alone());
        // Take the lights that have one method, whatever hides them.
        match facts.light {
            LightKind::Delta => return Method::RAY,
            LightKind::Sky => return self.sky(),
            _ => {}
        }
        // Leave out a light that is wholly hidden, unless every sample is to be taken.
        let (samples, is_polygon) = (facts.samples, facts.light.is_polygon());
        let is_diffuse = facts.known.closed == Closed::Diffuse;
        let takes_all = |technique: &Technique| !technique.may_become_points();
        let ignores_class = !facts.skip && is_polygon && alone.is_some_and(takes_all);
        if between.class == ShaftClass::Blocked && !ignores_class {
            return Method::NONE;
        }
        if let Some(by) = self.estimator.points_by_rays(facts.light) {
            return Method::points(by, samples, VisibilityBy::Rays);
        }
        // Take a technique that stands alone as it is, and integrals and combinations by what is
        // known.
        match alone {
            _ if facts.light == LightKind::Linear => segment(facts),
            Some(Technique::Points(points)) if is_polygon => {
                match facts.has_whole(between) && is_diffuse {
                    true => Method::region(KnownIntegrand::Reflection),
                    false => Method::points(points.by, samples, VisibilityBy::Shaft),
                }
            }
            Some(Technique::Lines(lines)) if is_polygon && lines.integration.is_none() => {
                Method::points_of_lines(lines, samples)
            }
            Some(Technique::Lines(_))
                if facts.light.is_round() && self.ask() == VisibilityBy::Rays =>
            {
                Method::points(PointDensity::SolidAngle.into(), samples, VisibilityBy::Rays)
            }
            _ => {
                let known = |integral| integrated(integral, facts, between);
                let method = self.integral.as_ref().and_then(known);
                let mut method = method.unwrap_or_else(|| self.combined(between));
                if facts.light.is_round() && matches!(method.known, KnownOver::Region(_)) {
                    let by_angle = Some(PointDensity::SolidAngle);
                    let weighted = self.weighted(self.wants_bsdf(), by_angle, samples);
                    method.otherwise = Rest::Weighted(weighted);
                }
                method
            }
        }
    }

    /// Returns whether the choice may depend on the best density of points
    /// ([`MethodFacts::points`]), which takes time to find.
    pub(crate) fn asks_for_density(&self) -> bool {
        let known = &self.facts.known;
        let (is_diffuse, has_region) = (
            known.closed == Closed::Diffuse,
            self.facts.has_closed_region(),
        );
        if self.facts.light == LightKind::Textured {
            return is_diffuse && self.is_hybrid();
        }
        match self.integral.as_ref().map(|integral| integral.by) {
            Some(Integration::Cheapest) => is_diffuse || known.has_cosines,
            Some(Integration::Exact(_)) => !has_region && known.has_cosines,
            Some(Integration::Analytic) | None => false,
        }
    }

    /// Returns whether the estimator is `hybrid` alone.
    fn is_hybrid(&self) -> bool {
        let mut integrals = self.estimator.integrals();
        self.estimator.alone().is_some() && integrals.any(|by| by == Integration::Cheapest)
    }

    /// Returns whether the estimator weights techniques, which are then drawn on the part of a
    /// polygon above the horizons.
    pub(crate) fn is_weighted(&self) -> bool {
        let draws_on_all = match self.estimator.alone() {
            Some(Technique::Points(_)) => true,
            Some(Technique::Lines(lines)) => lines.integration.is_none(),
            None => false,
        };
        !draws_on_all && self.integral.is_none()
    }

    /// Returns whether one integral replaces all techniques of the estimator on this light and
    /// reflection.
    fn leaves_nothing(&self, by: Integration) -> bool {
        let facts = &self.facts;
        let alone = self.estimator.alone().is_some();
        let stands = match (facts.light, by) {
            (LightKind::Textured, by) => alone && by != Integration::Cheapest,
            (LightKind::Sphere | LightKind::Disk, Integration::Analytic) => false,
            (LightKind::Cylinder, _) => facts.has_line_integral(),
            _ => alone || facts.known.closed != Closed::Nowhere,
        };
        stands && !self.wants_bsdf()
    }

    /// Returns whether samples of the BSDF are added to an integral of LTCs, because the LTCs are
    /// unlike the reflection.
    fn wants_bsdf(&self) -> bool {
        use LightKind::{Disk, Polygon, Sphere};
        self.facts.known.are_unlike
            && matches!(self.facts.light, Polygon | Sphere | Disk)
            && self.estimator.alone().is_some_and(|technique| {
                technique.may_become_points() && !technique.must_stand_alone()
            })
    }

    /// The method for a sky, which has neither lines nor a visible region: it is sampled by points
    /// with a shadow ray each. Lines become points in proportion to the radiance. Integrals become
    /// points by radiance and cosine, which are weighted with directions from the BSDF unless the
    /// reflection is diffuse.
    fn sky(&self) -> Method<'e> {
        let (facts, estimator) = (&self.facts, self.estimator);
        let weighted = |with_bsdf| {
            let integrals = Some(PointDensity::ProjectedSolidAngle);
            let weighted = self.weighted(with_bsdf, integrals, facts.samples);
            Method::sampled(Rest::Weighted(weighted), VisibilityBy::Rays)
        };
        match estimator.alone() {
            Some(Technique::Points(points)) => {
                Method::points(points.by, facts.samples, VisibilityBy::Rays)
            }
            Some(technique) if technique.may_become_points() => {
                weighted(facts.known.closed != Closed::Diffuse)
            }
            Some(Technique::Lines(_)) => Method::points(
                PointDensity::Texture.into(),
                facts.samples,
                VisibilityBy::Rays,
            ),
            None => weighted(false),
        }
    }

    /// Returns the method that combines all techniques by weights.
    fn combined(&self, between: &ShaftAnswer) -> Method<'e> {
        let (facts, estimator) = (&self.facts, self.estimator);
        // Find what replaces the lines of the integrals; of several integrals, the one that
        // replaces most decides.
        let is_textured = facts.light == LightKind::Textured;
        if is_textured && self.is_hybrid() {
            return hybrid::textured(facts);
        }
        let each = (estimator.integrals()).map(|integration| instead(integration, facts, between));
        let instead = match facts.ask {
            VisibilityBy::Rays => LineReplacement::Line,
            VisibilityBy::Shaft => each.max().unwrap_or(LineReplacement::Line),
        };
        // Find the known part, the density of the points that replace lines, and how many of them
        // replace one line.
        let (is_round, mut known) = (facts.light.is_round(), KnownOver::Nothing);
        let (integrals, times) = match instead {
            LineReplacement::Differences(times) if between.has_region => {
                known = KnownOver::Region(KnownIntegrand::Cosines);
                // A round light takes as many samples as one technique alone.
                (Some(PointDensity::Lobes), if is_round { 1 } else { times })
            }
            LineReplacement::Line | LineReplacement::Differences(_) => {
                (is_round.then_some(PointDensity::SolidAngle), 1)
            }
            LineReplacement::Points(times) if is_textured => (Some(PointDensity::Area), times),
            LineReplacement::Points(times) => (Some(PointDensity::Lobes), times),
        };
        // Multiply the samples of all techniques alike, so that their shares stay as they are.
        let samples = facts.samples.saturating_mul(times);
        let weighted = Weighted {
            lobes_alone: is_round && known != KnownOver::Nothing,
            ..self.weighted(self.wants_bsdf(), integrals, samples)
        };
        Method::new(known, Rest::Weighted(weighted), facts.ask)
    }

    /// The techniques of the estimator with their weights. A technique that stands alone gets the
    /// balance heuristic, which weights it with the points that are added to it.
    fn weighted(
        &self,
        with_bsdf: bool,
        integrals: Option<PointDensity>,
        samples: u32,
    ) -> Weighted<'e> {
        let weights = match self.estimator.weights() {
            Weights::Alone => Weights::Balance,
            weights => weights,
        };
        Weighted {
            parts: self.estimator.parts(),
            with_bsdf,
            integrals,
            lobes_alone: false,
            weights,
            samples,
        }
    }
}

impl Estimator {
    /// Returns the method by which this estimator treats a light, given the facts about light and
    /// reflection and the answer of a shaft.
    ///
    /// The choice depends on geometry alone and never on random numbers, so that the estimate is
    /// unbiased for each choice.
    #[must_use]
    pub fn method<'e>(&'e self, facts: &MethodFacts<'_>, between: &ShaftAnswer) -> Method<'e> {
        Choice::new(self, *facts).method(between)
    }

    /// The density of the points of a technique that stands alone and sends a shadow ray to each
    /// point; `None` for any other estimator. It depends on the light alone.
    pub(crate) fn points_by_rays(&self, light: LightKind) -> Option<PointBy> {
        match (self.alone(), light) {
            (Some(Technique::Points(points)), LightKind::Linear) => {
                Some(PointBy::Linear(points.by.on_segment()))
            }
            (Some(Technique::Points(points)), _) => (!points.in_shaft).then_some(points.by),
            _ => None,
        }
    }
}

/// The method for a linear light, of which one line finds all that is visible.
fn segment<'e>(facts: &MethodFacts<'_>) -> Method<'e> {
    match facts.known.closed {
        Closed::AlongLines | Closed::OverPolygons { .. } | Closed::Diffuse => {
            Method::region(KnownIntegrand::Reflection)
        }
        Closed::Nowhere if facts.known.has_peaks => Method::region(KnownIntegrand::Quadrature),
        Closed::Nowhere => {
            let by = PointBy::Linear(LinearOptions::DEFAULT);
            Method::points(by, facts.samples, VisibilityBy::Rays)
        }
    }
}

/// The method of an integral that takes all samples; `None` for a round light that has no such
/// method.
fn integrated<'e>(
    integral: &Integral<'e>,
    facts: &MethodFacts<'_>,
    between: &ShaftAnswer,
) -> Option<Method<'e>> {
    let (is_round, count) = (facts.light.is_round(), integral.count);
    let is_polygon = facts.light.is_polygon();
    // Integrate over all of the light where it is seen as a whole.
    let skips = facts.skip || is_polygon && integral.by != Integration::Analytic;
    if skips && facts.has_whole(between) && between.has_region {
        return Some(Method::region(KnownIntegrand::Reflection));
    }
    // Otherwise integrate over the visible region or along lines, as the integral's name says.
    match integral.by {
        _ if facts.light == LightKind::Cylinder => along(integral, facts),
        Integration::Exact(options) if options.is_for(between) => {
            region(count, facts, between).or_else(|| along(integral, facts))
        }
        Integration::Cheapest if is_round => {
            let is_cheap = !between.is_dense && hybrid::takes_cosines(between, count);
            region(count, facts, between).filter(|_| is_cheap)
        }
        Integration::Cheapest => Some(hybrid::method(integral, facts, between)),
        Integration::Exact(_) | Integration::Analytic => along(integral, facts),
    }
}

/// The method that integrates along lines: on a polygon in closed form, or with a point of each
/// line where there is no closed form; on a cylinder along its axis, by quadrature where there is
/// no closed form. `None` for a round light, which has no lines.
pub(crate) fn along<'e>(integral: &Integral<'e>, facts: &MethodFacts<'_>) -> Option<Method<'e>> {
    let (lines, count) = (integral.lines, integral.count);
    let (of, ask) = match (facts.light, facts.known.closed) {
        (LightKind::Cylinder, Closed::Nowhere) => (KnownIntegrand::Quadrature, facts.ask),
        (LightKind::Cylinder, _) => (KnownIntegrand::Reflection, facts.ask),
        (LightKind::Textured, _) | (LightKind::Polygon, Closed::Nowhere) => {
            return Some(Method::points_of_lines(lines, count));
        }
        (LightKind::Polygon, _) => (KnownIntegrand::Reflection, VisibilityBy::Shaft),
        _ => return None,
    };
    Some(Method::new(
        KnownOver::Lines { lines, count, of },
        Rest::Nothing,
        ask,
    ))
}

/// The method that integrates over the visible region of a light, with this many points for the
/// rest; `None` where the region cannot be found, or nothing of the reflection is known.
pub(crate) fn region<'e>(
    samples: u32,
    facts: &MethodFacts<'_>,
    between: &ShaftAnswer,
) -> Option<Method<'e>> {
    if !between.has_region || !facts.has_region_integral() {
        return None;
    }
    if facts.has_closed_region() {
        return Some(Method::region(KnownIntegrand::Reflection));
    }
    let by = PointDensity::Lobes.into();
    let rest = match (between.class, facts.points) {
        _ if facts.light.is_round() => Rest::PointsByLobes { samples },
        (ShaftClass::Partial, PointDensity::Area) => Rest::Visible { samples },
        _ => Rest::Points { by, samples },
    };
    Some(Method::new(
        KnownOver::Region(KnownIntegrand::Cosines),
        rest,
        VisibilityBy::Shaft,
    ))
}

/// What replaces a line of an integral in a combination, on a reflection without a closed form.
/// Later variants replace more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum LineReplacement {
    /// The line stays, and a point of it is sampled.
    Line,
    /// This many points of the light replace it.
    Points(u32),
    /// The closed form of the LTCs that resemble the reflection replaces it; each technique takes
    /// this many times its samples for the difference.
    Differences(u32),
}

/// Returns what replaces a line of one integral.
fn instead(
    integration: Integration,
    facts: &MethodFacts<'_>,
    between: &ShaftAnswer,
) -> LineReplacement {
    let has_cosines = facts.known.has_cosines
        && !matches!(facts.light, LightKind::Textured | LightKind::Cylinder);
    match integration {
        Integration::Exact(options) if has_cosines && options.is_for(between) => {
            LineReplacement::Differences(1)
        }
        Integration::Analytic | Integration::Exact(_) => LineReplacement::Line,
        Integration::Cheapest if between.is_dense => {
            LineReplacement::Points(hybrid::POINTS_IF_DENSE)
        }
        Integration::Cheapest if has_cosines && hybrid::takes_cosines(between, facts.samples) => {
            let points = hybrid::points_with_cosines(facts.samples);
            LineReplacement::Differences(points.div_ceil(facts.samples.max(1)))
        }
        Integration::Cheapest => LineReplacement::Line,
    }
}

impl ExactOptions {
    /// Returns whether the closed form is to be used past the triangles of this shaft.
    fn is_for(self, between: &ShaftAnswer) -> bool {
        let within = !between.is_dense && between.candidates <= self.limit as usize;
        within || self.limit == Self::NO_LIMIT
    }
}

impl MethodFacts<'_> {
    /// Returns whether the light along a line can be integrated, in closed form or by quadrature.
    fn has_line_integral(&self) -> bool {
        self.known.closed != Closed::Nowhere || self.known.has_peaks
    }

    /// Returns whether the light over a visible region can be integrated: the reflection itself or
    /// LTCs that resemble it.
    fn has_region_integral(&self) -> bool {
        (self.has_closed_region() || self.known.has_cosines) && self.light != LightKind::Textured
    }

    /// Returns whether the shaft is empty and the reflected light of the whole light has a closed
    /// form.
    fn has_whole(&self, between: &ShaftAnswer) -> bool {
        between.class == ShaftClass::Empty && self.has_closed_region()
    }

    /// Returns whether the reflection itself has a closed form over visible regions of this kind of
    /// light.
    fn has_closed_region(&self) -> bool {
        match self.known.closed {
            Closed::Diffuse => self.light != LightKind::Textured,
            Closed::OverPolygons { .. } => self.light == LightKind::Polygon,
            Closed::AlongLines | Closed::Nowhere => false,
        }
    }
}
