//! The choice of a method by facts, a pure function.

use crate::hybrid;
use crate::{
    Ask, Between, Closed, Estimator, ExactOptions, Facts, Integration, KnownOver, LightKind,
    LinearOptions, Lines, Method, Of, PointBy, Queries, Rest, Technique, Weighted, Weights,
};
use linelit_visibility::ShaftClass;

impl Estimator {
    /// Whether a shaft is worth to be asked before anything is chosen.
    #[must_use]
    pub fn ask(&self, facts: &Facts<'_>) -> Ask {
        let by_rays = match (self.alone(), facts.light) {
            (Some(Technique::Points(_)), light) => self.points_by_rays(light, 1).is_some(),
            (_, LightKind::Linear) => !facts.has_line_integral(),
            (Some(Technique::Lines(lines)), LightKind::Sphere | LightKind::Disk) => {
                let has_integral = lines.becomes_points() && facts.has_region_integral();
                !has_integral && !self.wants_bsdf(facts)
            }
            (_, LightKind::Polygon | LightKind::Textured) => match self.integral(facts) {
                Some((_, Integration::Cheapest, count)) => hybrid::takes_rays(facts, count),
                _ => self.is_weighted(facts) && facts.queries == Queries::SeparateRays,
            },
            _ => false,
        };
        if by_rays { Ask::Rays } else { Ask::Shaft }
    }

    /// The method for a light, whatever the estimator is made of.
    ///
    /// The choice depends on geometry alone, never on random numbers: whatever is chosen, the
    /// estimate stays unbiased.
    #[must_use]
    pub fn method<'e>(&'e self, facts: &Facts<'_>, between: &Between) -> Method<'e> {
        let (samples, is_polygon) = (facts.samples, facts.light.is_polygon());
        let takes_all = self
            .all()
            .iter()
            .all(|part| !part.technique.may_become_points());
        let ignores_class = !facts.skip && is_polygon && self.alone().is_some() && takes_all;
        if between.class == ShaftClass::Blocked && !ignores_class {
            return Method::NONE;
        }
        if let Some(method) = self.points_by_rays(facts.light, samples) {
            return method;
        }
        match self.alone() {
            _ if facts.light == LightKind::Linear => segment(facts),
            Some(Technique::Points(points)) if is_polygon => match facts.has_whole(between) {
                true => Method::region(Of::Reflection),
                false => Method::points(points.by, samples, Ask::Shaft),
            },
            Some(Technique::Lines(lines)) if is_polygon && lines.integration.is_none() => {
                Method::points_of_lines(lines, samples)
            }
            Some(Technique::Lines(_)) if self.ask(facts) == Ask::Rays && facts.light.is_round() => {
                Method::points(PointBy::SolidAngle, samples, Ask::Rays)
            }
            _ => {
                let integral = self.integral(facts);
                let method = integral.and_then(|(lines, integration, count)| match facts.light {
                    LightKind::Cylinder => Some(along_axis(lines, count, facts, between)),
                    _ => integrated(lines, integration, count, facts, between),
                });
                method.unwrap_or_else(|| self.combined(facts, between))
            }
        }
    }

    /// Whether the method may depend on the density of points that is best ([`Facts::points`]).
    pub(crate) fn asks_for_density(&self, facts: &Facts<'_>) -> bool {
        let is_diffuse = facts.known.closed == Closed::Diffuse;
        match self.integral(facts) {
            Some((_, Integration::Cheapest, _)) => is_diffuse || facts.known.has_cosines,
            Some((_, Integration::Exact(_), _)) => !is_diffuse && facts.known.has_cosines,
            Some((_, Integration::Analytic, _)) | None => false,
        }
    }

    /// The method of points that stand alone with a ray each, which depends on the light alone.
    pub(crate) fn points_by_rays<'e>(&self, light: LightKind, samples: u32) -> Option<Method<'e>> {
        match (self.alone(), light) {
            (Some(Technique::Points(points)), LightKind::Linear) => {
                let by = PointBy::Linear(points.by.on_segment());
                Some(Method::points(by, samples, Ask::Rays))
            }
            (Some(Technique::Points(points)), _) if !points.in_shaft => {
                Some(Method::points(points.by, samples, Ask::Rays))
            }
            _ => None,
        }
    }

    /// Whether it weights techniques on the part of a polygon above the horizons.
    pub(crate) fn is_weighted(&self, facts: &Facts<'_>) -> bool {
        let draws_on_all = match self.alone() {
            Some(Technique::Points(_)) => true,
            Some(Technique::Lines(lines)) => lines.integration.is_none(),
            None => false,
        };
        !draws_on_all && self.integral(facts).is_none()
    }

    /// The integral that leaves nothing for other techniques, with its number of samples: of a
    /// technique alone, and of the first of a combination where the reflection has a closed form.
    fn integral(&self, facts: &Facts<'_>) -> Option<(&Lines, Integration, u32)> {
        let integral = self.closed(facts.samples)?;
        let (alone, has_form) = (
            self.alone().is_some(),
            facts.known.closed != Closed::Nowhere,
        );
        let stands = match (facts.light, integral.1) {
            (LightKind::Textured, integration) => alone && integration != Integration::Cheapest,
            (LightKind::Sphere | LightKind::Disk, Integration::Analytic) => false,
            (LightKind::Cylinder, _) => facts.has_line_integral(),
            _ => alone || has_form,
        };
        (stands && !self.wants_bsdf(facts)).then_some(integral)
    }

    /// Whether samples of the BSDF stand beside integrals of transformed cosines that the
    /// reflection is unlike.
    fn wants_bsdf(&self, facts: &Facts<'_>) -> bool {
        let Some(technique) = self.alone() else {
            return false;
        };
        use LightKind::{Disk, Polygon, Sphere};
        facts.known.are_unlike
            && matches!(facts.light, Polygon | Sphere | Disk)
            && technique.may_become_points()
            && !technique.must_stand_alone()
    }

    /// All techniques, weighted.
    fn combined<'e>(&'e self, facts: &Facts<'_>, between: &Between) -> Method<'e> {
        let is_textured = facts.light == LightKind::Textured;
        let integrals = || {
            self.all()
                .iter()
                .filter_map(|part| part.technique.integrated())
        };
        let is_hybrid = |(_, integration)| integration == Integration::Cheapest;
        if is_textured && self.alone().is_some() && integrals().any(is_hybrid) {
            return hybrid::textured(facts);
        }
        let each = integrals().map(|(_, integration)| instead(integration, facts, between));
        let instead = match facts.asked() {
            Ask::Rays => Instead::Line,
            Ask::Shaft => each.max().unwrap_or(Instead::Line),
        };
        let (known, integrals, times) = match instead {
            Instead::Differences(times) if between.has_region => {
                // Round lights take no more than alone.
                let times = if facts.light.is_round() { 1 } else { times };
                (KnownOver::Region(Of::Cosines), Some(PointBy::Ltc), times)
            }
            Instead::Line | Instead::Differences(_) => {
                let without_lines = facts.light.is_round().then_some(PointBy::SolidAngle);
                (KnownOver::Nothing, without_lines, 1)
            }
            Instead::Points(times) if is_textured => {
                (KnownOver::Nothing, Some(PointBy::Area), times)
            }
            Instead::Points(times) => (KnownOver::Nothing, Some(PointBy::Ltc), times),
        };
        Method {
            known,
            rest: Rest::Weighted(Weighted {
                parts: self.all(),
                with_bsdf: self.wants_bsdf(facts),
                integrals,
                weights: match self.weights() {
                    Weights::Alone => Weights::Balance,
                    weights => weights,
                },
                samples: facts.samples.saturating_mul(times),
            }),
            ask: facts.asked(),
        }
    }

    /// The methods in words: where nothing is between the shading point and the light, past as many
    /// triangles as usually are, and past too many to keep.
    #[must_use]
    pub fn explain(&self, facts: &Facts<'_>) -> String {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few hundred"
        )]
        let usual = facts.occlusion.candidates.round().max(1.0) as usize;
        let cases = [
            (ShaftClass::Empty, 0, false),
            (ShaftClass::Partial, usual, false),
            (ShaftClass::Partial, 0, true),
        ];
        let [whole, few, many] = cases.map(|(class, candidates, is_dense)| {
            // Too many triangles may reach into a solid light, which a shaft does not tell.
            let is_told =
                !(is_dense && matches!(facts.light, LightKind::Sphere | LightKind::Cylinder));
            let between = Between {
                class,
                is_dense: is_dense && is_told,
                candidates,
                has_region: is_told && self.ask(facts) == Ask::Shaft,
            };
            let mut method = self.method(facts, &between);
            if !is_told {
                method.ask = Ask::Rays;
            }
            method.to_string()
        });
        match (whole == few, few == many) {
            (true, true) => whole,
            (false, true) => format!("{whole} where nothing is between, else {few}"),
            (true, false) => format!("{few}; past too many triangles to keep, {many}"),
            (false, false) => format!(
                "{whole} where nothing is between; past some triangles, {few}; past too many to \
                 keep, {many}"
            ),
        }
    }
}

/// The method for a linear light: one line answers for all of it.
fn segment<'e>(facts: &Facts<'_>) -> Method<'e> {
    match facts.known.closed {
        Closed::AlongLines | Closed::Diffuse => Method::region(Of::Reflection),
        Closed::Nowhere if facts.known.has_peaks => Method::region(Of::Quadrature),
        Closed::Nowhere => {
            let by = PointBy::Linear(LinearOptions::default());
            Method::points(by, facts.samples, Ask::Rays)
        }
    }
}

/// The method for a cylinder: lines along its axis, unless all of it is known.
fn along_axis<'e>(
    lines: &'e Lines,
    count: u32,
    facts: &Facts<'_>,
    between: &Between,
) -> Method<'e> {
    if facts.skip && between.has_region && facts.has_whole(between) {
        return Method::region(Of::Reflection);
    }
    let of = match facts.known.closed {
        Closed::Nowhere => Of::Quadrature,
        Closed::AlongLines | Closed::Diffuse => Of::Reflection,
    };
    Method {
        known: KnownOver::Lines { lines, count, of },
        rest: Rest::Nothing,
        ask: facts.asked(),
    }
}

/// The method of an integral over the visible part of a polygon, a sphere or a disk that stands
/// alone; `None` where a round light has none.
fn integrated<'e>(
    lines: &'e Lines,
    integration: Integration,
    count: u32,
    facts: &Facts<'_>,
    between: &Between,
) -> Option<Method<'e>> {
    let is_round = facts.light.is_round();
    let skips = facts.skip || !is_round && integration != Integration::Analytic;
    if skips && facts.has_whole(between) && between.has_region {
        return Some(Method::region(Of::Reflection));
    }
    Some(match integration {
        Integration::Exact(options) if options.is_for(between) => {
            region(count, facts, between).or_else(|| along(lines, count, facts))?
        }
        Integration::Cheapest if is_round => {
            let is_cheap = !between.is_dense && hybrid::takes_cosines(between, count);
            region(count, facts, between).filter(|_| is_cheap)?
        }
        Integration::Cheapest => hybrid::method(lines, count, facts, between),
        Integration::Exact(_) | Integration::Analytic => along(lines, count, facts)?,
    })
}

/// Lines on a polygon: integrated in closed form where there is one, else a point of each. `None`
/// for a round light, which has no lines.
pub(crate) fn along<'e>(lines: &'e Lines, count: u32, facts: &Facts<'_>) -> Option<Method<'e>> {
    let closed = facts.known.closed != Closed::Nowhere;
    Some(match facts.light {
        LightKind::Polygon if closed => Method {
            known: KnownOver::Lines {
                lines,
                count,
                of: Of::Reflection,
            },
            rest: Rest::Nothing,
            ask: Ask::Shaft,
        },
        LightKind::Polygon | LightKind::Textured => Method::points_of_lines(lines, count),
        LightKind::Linear | LightKind::Sphere | LightKind::Disk | LightKind::Cylinder => {
            return None;
        }
    })
}

/// The visible region of a light, with so many points for the rest; `None` where there is no
/// region, or nothing is known.
pub(crate) fn region<'e>(points: u32, facts: &Facts<'_>, between: &Between) -> Option<Method<'e>> {
    if !between.has_region || !facts.has_region_integral() {
        return None;
    }
    if facts.known.closed == Closed::Diffuse {
        return Some(Method::region(Of::Reflection));
    }
    let is_partial = between.class == ShaftClass::Partial && !facts.light.is_round();
    let by = PointBy::Ltc;
    Some(Method {
        known: KnownOver::Region(Of::Cosines),
        rest: match is_partial && facts.points == PointBy::Area {
            true => Rest::Visible { samples: points },
            false => Rest::Points {
                by,
                samples: points,
            },
        },
        ask: Ask::Shaft,
    })
}

/// The replacement of a line of an integral in a combination on a reflection without a closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Instead {
    /// None: it stays one, of which a point is drawn.
    Line,
    /// So many points of the light.
    Points(u32),
    /// The closed form of the transformed cosines that the reflection looks like, and so many
    /// points for the rest, of this technique and of all others.
    Differences(u32),
}

fn instead(integration: Integration, facts: &Facts<'_>, between: &Between) -> Instead {
    let has_cosines = facts.known.has_cosines
        && !matches!(facts.light, LightKind::Textured | LightKind::Cylinder);
    match integration {
        Integration::Exact(options) if has_cosines && options.is_for(between) => {
            Instead::Differences(1)
        }
        Integration::Analytic | Integration::Exact(_) => Instead::Line,
        Integration::Cheapest if between.is_dense => Instead::Points(hybrid::POINTS_IF_DENSE),
        Integration::Cheapest if has_cosines && hybrid::takes_cosines(between, facts.samples) => {
            let points = hybrid::points_with_cosines(facts.samples);
            Instead::Differences(points.div_ceil(facts.samples.max(1)))
        }
        Integration::Cheapest => Instead::Line,
    }
}

impl ExactOptions {
    /// Whether the closed form is taken past the triangles of a shaft.
    fn is_for(self, between: &Between) -> bool {
        let within = !between.is_dense && between.candidates <= self.limit as usize;
        within || self.limit == Self::NO_LIMIT
    }
}

impl Facts<'_> {
    /// Whether the light along a line of the light has an integral.
    fn has_line_integral(&self) -> bool {
        self.known.closed != Closed::Nowhere || self.known.has_peaks
    }

    /// Whether the light over a region has an integral, of the reflection or of cosines.
    fn has_region_integral(&self) -> bool {
        let is_known = self.known.closed == Closed::Diffuse || self.known.has_cosines;
        is_known && self.light != LightKind::Textured
    }

    /// Whether the shaft is empty and the light over all of the light has a closed form.
    fn has_whole(&self, between: &Between) -> bool {
        between.class == ShaftClass::Empty
            && self.known.closed == Closed::Diffuse
            && self.light != LightKind::Textured
    }

    /// The way in which combinations ask for visibility.
    pub(crate) fn asked(&self) -> Ask {
        match self.queries {
            Queries::OneShaft => Ask::Shaft,
            Queries::SeparateRays => Ask::Rays,
        }
    }
}
