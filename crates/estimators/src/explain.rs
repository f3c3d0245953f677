//! This module describes methods in words, for the reports of the program. Where an estimator
//! names a technique that the light or the reflection does not have, the words name the technique
//! that replaces it.

use crate::choose::Choice;
use crate::{
    Closed, Estimator, Integration, KnownIntegrand, KnownOver, LightKind, LineBy, Lines, Method,
    MethodFacts, ShaftAnswer, VisibilityBy,
};
use crate::{PointBy, PointDensity, Points, Rest, Technique};
use linelit_visibility::ShaftClass;
use std::fmt;

impl Estimator {
    /// Describes in words what the estimator does at shading points of this kind: with no occluder
    /// in between, past a typical number of triangles, and past too many triangles to collect.
    #[must_use]
    pub fn explain(&self, facts: &MethodFacts<'_>) -> String {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few hundred"
        )]
        // Choose a method for each of the three cases.
        let usual = facts.occlusion.candidates.round().max(1.0) as usize;
        let choice = Choice::new(self, *facts);
        let cases = [
            (ShaftClass::Empty, 0, false),
            (ShaftClass::Partial, usual, false),
            (ShaftClass::Partial, 0, true),
        ];
        let [whole, few, many] = cases.map(|(class, candidates, is_dense)| {
            // Triangles in a dense shaft may reach into a sphere or a cylinder, and the shaft does
            // not know.
            let is_told =
                !(is_dense && matches!(facts.light, LightKind::Sphere | LightKind::Cylinder));
            let between = ShaftAnswer {
                class,
                is_dense: is_dense && is_told,
                candidates,
                has_region: is_told && choice.ask() == VisibilityBy::Shaft,
            };
            let mut method = choice.method(&between);
            if !is_told {
                method.ask = VisibilityBy::Rays;
            }
            method.describe(facts)
        });
        // Mention each method once.
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

impl Estimator {
    /// The number of points that are sampled instead of the integral for which the estimator is
    /// named, given these facts and a few triangles in between. `None` if at least a part of the
    /// light is integrated, and for estimators that have points by name or choose them on purpose,
    /// as `hybrid` does.
    ///
    /// `exact` and `line-analytic` sample points on reflections without a closed form, and for
    /// lights that emit by a profile or an image. Their noise is then the noise of points.
    ///
    /// ```
    /// use linelit_estimators::{Estimator, MethodFacts, KnownKind, LightKind};
    /// let exact = Estimator::exact();
    /// let on = |known| exact.points_in_place(&MethodFacts::new(LightKind::Polygon, known, 16));
    /// let [(_, diffuse), .., (_, unknown)] = KnownKind::ALL;
    /// assert_eq!((on(diffuse), on(unknown)), (None, Some(16)));
    /// ```
    #[must_use]
    pub fn points_in_place(&self, facts: &MethodFacts<'_>) -> Option<u32> {
        let choice = Choice::new(self, *facts);
        let between = ShaftAnswer {
            class: ShaftClass::Partial,
            is_dense: false,
            candidates: 1,
            has_region: choice.ask() == VisibilityBy::Shaft,
        };
        self.in_place(&choice.method(&between))
    }

    /// The number of points of a method without a known part, if the estimator is named for an
    /// integral.
    pub(crate) fn in_place(&self, method: &Method<'_>) -> Option<u32> {
        let is_named = || self.integrals().any(|by| by != Integration::Cheapest);
        let is_empty = method.known == KnownOver::Nothing;
        let points = match method.rest {
            Rest::Nothing => 0,
            Rest::Points { samples, .. }
            | Rest::PointsByLobes { samples }
            | Rest::PointsOfLines { samples, .. }
            | Rest::Visible { samples } => samples,
            Rest::Weighted(weighted) => weighted.samples,
        };
        (is_empty && points > 0 && is_named()).then_some(points)
    }
}

impl Method<'_> {
    /// Describes the method in words, given these facts. Techniques that the light or the
    /// reflection does not have are named by what replaces them.
    #[must_use]
    pub fn describe(&self, facts: &MethodFacts<'_>) -> String {
        // Describe the integral of the known part.
        let known = match self.known {
            KnownOver::Nothing => String::new(),
            KnownOver::Lines { of, count, .. } => format!("{of} along {count} lines"),
            KnownOver::Region(of) => format!("{of} over the visible part of the light"),
            KnownOver::Ray => "one shadow ray, without noise".to_owned(),
        };
        let by = match self.ask {
            VisibilityBy::Rays => "a shadow ray each",
            VisibilityBy::Shaft => "one shaft for all",
        };
        let points = |samples, density| {
            let points = Estimator::points(facts.points_by(density));
            format!("{samples} points as `{points}`, {by}")
        };
        // Describe the samples for the rest.
        let rest = match self.rest {
            Rest::Nothing if known.is_empty() => return "no light".to_owned(),
            Rest::Nothing => return known,
            Rest::Points { by, samples } => points(samples, by),
            Rest::PointsByLobes { samples } => points(samples, PointDensity::Lobes.into()),
            Rest::PointsOfLines { samples, .. } => {
                format!("a point of each of {samples} lines as `line-area`, {by}")
            }
            Rest::Visible { samples } => format!("{samples} points of that part"),
            Rest::Weighted(weighted) => {
                let names = weighted.techniques();
                let names = names.map(|part| facts.technique(part.technique).name());
                let names = names.collect::<Vec<_>>().join("` and `");
                format!(
                    "{} samples weighted among `{names}`, {by}",
                    weighted.samples
                )
            }
        };
        if known.is_empty() {
            return rest;
        }
        format!("{known}, the rest by {rest}")
    }
}

impl MethodFacts<'_> {
    /// The density that is used for points where the light or the reflection does not have this
    /// one.
    fn points_by(&self, by: PointBy) -> PointBy {
        use LightKind::{Cylinder, Disk, Linear, Polygon, Sky, Sphere, Textured};
        use PointDensity::{
            Area, Lobes, ProjectedSolidAngle, Proxy, SolidAngle, Texture, VisibleArea,
        };
        let has_lobes = self.known.has_cosines && self.known.closed != Closed::Diffuse;
        let density = match (by, self.light) {
            (by, Linear) => return PointBy::Linear(by.on_segment()),
            (PointBy::Bsdf, _) => return by,
            (PointBy::Linear(_), _) => SolidAngle,
            (PointBy::Surface(density), _) => density,
        };
        PointBy::Surface(match (density, self.light) {
            (Lobes | ProjectedSolidAngle, Sky) => ProjectedSolidAngle,
            (_, Sky) => Texture,
            (VisibleArea, Polygon | Textured | Disk) | (Texture, Polygon) => Area,
            (Texture | Proxy, Sphere | Disk | Cylinder) | (Lobes, Cylinder) => SolidAngle,
            (Lobes, _) if !has_lobes => SolidAngle,
            (density, _) => density,
        })
    }

    /// The technique that is used where the light or the reflection does not have this one.
    fn technique(&self, technique: Technique) -> Technique {
        match (technique, self.light) {
            (Technique::Points(points), _) => Points::by(self.points_by(points.by)).into(),
            (Technique::Lines(_), LightKind::Sphere | LightKind::Disk) => {
                Points::by(PointDensity::SolidAngle.into()).into()
            }
            (Technique::Lines(_), LightKind::Sky) => {
                Points::by(PointDensity::Texture.into()).into()
            }
            (Technique::Lines(lines), light) => Lines::by(match (lines.measure(), light) {
                (LineBy::Texture, LightKind::Textured) => LineBy::Texture,
                (LineBy::Texture, _) => LineBy::Area,
                (LineBy::Warped, LightKind::Cylinder) => LineBy::SolidAngle,
                (by, _) => by,
            })
            .into(),
        }
    }
}

impl fmt::Display for LightKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = Self::ALL.iter().find(|(_, kind)| kind == self);
        f.write_str(found.map_or("", |(name, _)| name))
    }
}

impl fmt::Display for KnownIntegrand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reflection => "closed form",
            Self::Quadrature => "quadrature",
            Self::Cosines => "closed form of transformed cosines",
        })
    }
}
