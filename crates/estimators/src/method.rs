//! A [`Method`] is the plan for one light and one shading point, as data. It says which part of the
//! light is integrated, which samples take the rest, and how visibility is queried. This module
//! also has the facts that the choice of a method depends on.
//!
//! Every estimate is L = ∫ g V dω + ∫ (f − g) V dω, where f is the light that the reflection sends
//! to the viewer if nothing hides it, V is the visibility, and g is the known part of f, whose
//! integral has a closed form.

use crate::{EmissionTexture, LightSource, Lines, OcclusionStats, Part, PointBy, PointDensity};
use crate::{Points, Query, ShadingPoint, Weights};
use linelit_bsdf::{ClosedLobe, LtcLobe, LtcMixture, Reflection};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::Light;
use linelit_visibility::ShaftClass;

/// The kinds of lights that the choice of a method distinguishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightKind {
    /// A polygon that has the same radiance everywhere.
    Polygon,
    /// A polygon that emits an image.
    Textured,
    /// A linear light: a cylinder so thin that it is treated as its axis.
    Linear,
    /// A sphere.
    Sphere,
    /// A disk.
    Disk,
    /// A cylinder.
    Cylinder,
    /// A delta light: a point, a spot, or parallel light, to which one direction leads.
    Delta,
    /// A sky: an environment, or a sun.
    Sky,
}

impl LightKind {
    /// All kinds, with their names.
    pub const ALL: [(&'static str, Self); 8] = [
        ("polygon", Self::Polygon),
        ("textured polygon", Self::Textured),
        ("line", Self::Linear),
        ("sphere", Self::Sphere),
        ("disk", Self::Disk),
        ("cylinder", Self::Cylinder),
        ("light without size", Self::Delta),
        ("sky", Self::Sky),
    ];

    /// Returns whether it is a sphere or a disk, on which no lines are drawn.
    pub(crate) const fn is_round(self) -> bool {
        matches!(self, Self::Sphere | Self::Disk)
    }

    /// Returns whether it is a polygon, with or without an image.
    pub(crate) const fn is_polygon(self) -> bool {
        matches!(self, Self::Polygon | Self::Textured)
    }

    /// Returns the kind of a light.
    #[must_use]
    pub const fn of<T>(light: &LightSource<'_, T>) -> Self {
        match light.light {
            Light::Area(_) if light.texture.is_some() => Self::Textured,
            Light::Area(_) => Self::Polygon,
            Light::Linear(_) => Self::Linear,
            Light::Sphere(_) => Self::Sphere,
            Light::Disk(_) => Self::Disk,
            Light::Cylinder(_) => Self::Cylinder,
            Light::Point(_) | Light::Distant(_) => Self::Delta,
            Light::Sky(_) => Self::Sky,
        }
    }
}

/// The closed forms that the integral of a reflection times the cosine has ([`Reflection::known`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Closed {
    /// There is no closed form.
    Nowhere,
    /// There are closed forms along lines, since the reflection has Gaussian lobes.
    AlongLines,
    /// There are closed forms along lines and, at a cost, over polygons, since the reflection has
    /// Phong lobes.
    OverPolygons {
        /// The number of lines on a polygon, with the same lobes, whose integrals take as long as
        /// the integral over one edge of its visible region.
        lines_for_an_edge: u32,
    },
    /// There are closed forms along lines and over lights, which cost no more than visibility,
    /// since the reflection is diffuse.
    Diffuse,
}

/// The exponent below which a Phong lobe is so wide that its integral along an edge takes as long
/// as along two lines ([`linelit_shading::phong_polygon`]). The integral of a narrower lobe takes
/// as long as one line.
const WIDE_LOBE: f64 = 113.0;

impl Closed {
    /// The closed forms of a reflection with a diffuse part and these lobes.
    fn of(mut lobes: impl Iterator<Item = ClosedLobe>) -> Self {
        lobes
            .try_fold(Self::Diffuse, |closed, lobe| match lobe {
                ClosedLobe::Power { exponent, .. } => Ok(Self::OverPolygons {
                    lines_for_an_edge: closed
                        .lines_for_an_edge()
                        .max(1 + u32::from(exponent < WIDE_LOBE)),
                }),
                ClosedLobe::Gaussian { .. } => Err(Self::AlongLines),
            })
            .unwrap_or_else(|closed| closed)
    }

    /// The number of lines that take as long as the integral over one edge of a visible region.
    pub(crate) const fn lines_for_an_edge(self) -> u32 {
        match self {
            Self::OverPolygons { lines_for_an_edge } => lines_for_an_edge,
            Self::Nowhere | Self::AlongLines | Self::Diffuse => 1,
        }
    }
}

/// What is known of a reflection, as one viewer sees it. The choice of a method depends on this.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct KnownKind {
    /// The reflection's closed forms.
    pub closed: Closed,
    /// Whether there are LTCs that resemble it ([`Reflection::transformed_cosines`]).
    pub has_cosines: bool,
    /// Whether samples in proportion to the LTCs alone would have rare and large values
    /// ([`linelit_bsdf::Known::is_unlike_cosines`]).
    pub are_unlike: bool,
    /// Whether all LTCs are so wide that one point of a line represents most of the light that the
    /// line reflects.
    pub are_wide: bool,
    /// Whether the reflection has no closed form, but its peaks along lines are known
    /// ([`Reflection::peaks`]), so that it can be integrated along lines by quadrature.
    pub has_peaks: bool,
}

impl KnownKind {
    /// Examples of reflections that techniques treat differently, with their names.
    pub const ALL: [(&'static str, Self); 6] = {
        const fn kind(closed: Closed, is_known: bool, are_wide: bool) -> KnownKind {
            KnownKind {
                closed,
                has_cosines: is_known,
                are_unlike: false,
                are_wide,
                has_peaks: is_known && matches!(closed, Closed::Nowhere),
            }
        }
        let narrow = kind(Closed::Nowhere, true, false);
        let phong = Closed::OverPolygons {
            lines_for_an_edge: 1,
        };
        [
            ("diffuse", kind(Closed::Diffuse, true, true)),
            ("lobes of Phong", kind(phong, true, false)),
            ("Gaussians", kind(Closed::AlongLines, true, false)),
            ("narrow transformed cosines", narrow),
            (
                "wide transformed cosines",
                kind(Closed::Nowhere, true, true),
            ),
            ("nothing known", kind(Closed::Nowhere, false, false)),
        ]
    };

    /// The value for a reflection that has neither closed forms nor LTCs, and for light with a
    /// profile, which changes with direction.
    pub const NOTHING: Self = Self {
        closed: Closed::Nowhere,
        has_cosines: false,
        are_unlike: false,
        are_wide: false,
        has_peaks: false,
    };

    /// Returns what is known of the reflection at a shading point.
    pub fn of<R: Reflection>(point: &ShadingPoint<R>) -> Self {
        let (wo, n) = (point.outgoing, point.normal);
        let cosines = point.bsdf.transformed_cosines(wo, n);
        let line = Segment::new(n, n + DVec3::X);
        Self::along(point, cosines.as_ref(), Some(line))
    }

    /// Returns what is known of the reflection, given its LTCs, if the estimator uses them, and a
    /// line relative to the point along which peaks may be needed.
    fn along<R: Reflection>(
        point: &ShadingPoint<R>,
        cosines: Option<&LtcMixture>,
        line: Option<Segment>,
    ) -> Self {
        let known = point.known();
        let peaks = |line| point.bsdf.peaks(&line, point.outgoing, point.normal);
        let closed = match known.closed_form() {
            None => Closed::Nowhere,
            Some(form) => Closed::of(form.lobes(point.outgoing, point.normal)),
        };
        // Peaks are needed only where there is no closed form.
        let line = line.filter(|_| closed == Closed::Nowhere);
        Self {
            closed,
            has_cosines: cosines.is_some(),
            are_unlike: known.is_unlike_cosines(),
            are_wide: cosines.is_some_and(are_wide),
            has_peaks: line.and_then(peaks).is_some(),
        }
    }
}

/// The least solid angle of a wide lobe, as a fraction of the solid angle of the untransformed
/// cosine.
const WIDE: f64 = 0.15;

/// Returns whether all lobes of LTCs are wide.
fn are_wide(cosines: &LtcMixture) -> bool {
    let is_wide = |lobe: &LtcLobe| {
        let largest = [lobe.map.x_axis, lobe.map.y_axis, lobe.map.z_axis].map(DVec3::length);
        let volume = largest.into_iter().fold(0.0, f64::max).powi(3);
        lobe.map.determinant().abs() >= WIDE * volume
    };
    cosines.lobes().iter().all(is_wide)
}

/// The facts about a light and a reflection that are known before visibility is queried.
#[derive(Clone, Copy, Debug)]
pub struct MethodFacts<'a> {
    /// The kind of the light.
    pub light: LightKind,
    /// What is known of the reflection.
    pub known: KnownKind,
    /// Statistics of the light's occlusion.
    pub occlusion: &'a OcclusionStats,
    /// The number of samples.
    pub samples: u32,
    /// Whether nothing is sampled where the shaft is empty or blocked, if possible
    /// ([`Query::skip`](crate::Query::skip)).
    pub skip: bool,
    /// The way in which combinations query visibility.
    pub ask: VisibilityBy,
    /// The density of points on a polygon that reaches a given error in the least time: by area for
    /// a light whose parts have about the same solid angle for equal areas, otherwise by solid
    /// angle.
    pub points: PointDensity,
}

impl<'a> MethodFacts<'a> {
    /// Facts with defaults: the query skips samples where it can and shares one shaft, and the
    /// light has few occluders and equal areas of about the same solid angle.
    #[must_use]
    pub const fn new(light: LightKind, known: KnownKind, samples: u32) -> Self {
        Self {
            light,
            known,
            occlusion: &OcclusionStats::FEW,
            samples,
            skip: true,
            ask: VisibilityBy::Shaft,
            points: PointDensity::Area,
        }
    }

    /// Returns the facts of a query, by which `estimate` chooses its method.
    #[must_use]
    pub fn of<R: Reflection, T: EmissionTexture>(query: &Query<'a, R, T>) -> Self {
        Self {
            points: query.light.cheapest_points(query.point.position),
            ..Self::before(query, query.cosines().as_ref())
        }
    }

    /// Returns the facts of a query without the best density of points, which takes time to find.
    pub(crate) fn before<R: Reflection, T>(
        query: &Query<'a, R, T>,
        cosines: Option<&LtcMixture>,
    ) -> Self {
        // Find the line along which the reflection may have peaks that matter.
        let line = match query.light.light {
            Light::Linear(light) => Some(light.segment),
            Light::Cylinder(light) => Some(light.cylinder.axis),
            Light::Area(_) | Light::Sphere(_) | Light::Disk(_) => None,
            Light::Point(_) | Light::Distant(_) | Light::Sky(_) => None,
        };
        let line = line.map(|line| line.relative_to(query.point.position));
        // Find what is known of the reflection, which is of no use if the emission has a profile.
        let known = match query.light.profile {
            None => KnownKind::along(query.point, cosines, line),
            Some(_) => KnownKind::NOTHING,
        };
        Self {
            light: LightKind::of(query.light),
            known,
            occlusion: &query.light.occlusion,
            samples: query.samples,
            skip: query.skip,
            ask: query.ask,
            points: PointDensity::SolidAngle,
        }
    }
}

/// What a shaft found between a shading point and a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftAnswer {
    /// The class of the shaft; partial if no shaft was built.
    pub class: ShaftClass,
    /// Whether the shaft is dense: it has too many triangles to collect.
    pub is_dense: bool,
    /// The number of triangles that were collected.
    pub candidates: usize,
    /// Whether the visible region of the light can be found: the light is seen as a whole, or the
    /// occluders that bound the region are [known](linelit_visibility::Shaft::has_front). For a
    /// cylinder: whether all of it is visible and above the horizons.
    pub has_region: bool,
}

/// A method: the known part of the light, the samples for the rest, and how visibility is queried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method<'e> {
    /// The integral of the known part, and the domain that it is over.
    pub known: KnownOver<'e>,
    /// The samples for the rest.
    pub rest: Rest<'e>,
    /// The way in which visibility is queried; for a visible region this is always a shaft.
    pub ask: VisibilityBy,
    /// The samples of the whole light that replace the known part and the rest if the visible
    /// region of a round light is so narrow, or a lobe maps it to one so narrow, that sums over its
    /// boundary would lose half of their digits. Methods for other lights do not need them.
    pub otherwise: Rest<'e>,
}

/// The domain over which the known part of the light is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KnownOver<'e> {
    /// Nothing is known: all light is sampled.
    Nothing,
    /// The visible parts of lines on the light.
    Lines {
        /// The technique that draws the lines.
        lines: &'e Lines,
        /// The number of lines.
        count: u32,
        /// The integrand.
        of: KnownIntegrand,
    },
    /// The visible region of the light, which is the whole light if the shaft is empty.
    Region(KnownIntegrand),
    /// The one direction to a delta light.
    Ray,
}

/// The known part g, which is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnownIntegrand {
    /// The reflection itself, in closed form.
    Reflection,
    /// The reflection itself, by adaptive quadrature between its peaks.
    Quadrature,
    /// The LTCs that resemble the reflection, in closed form.
    Cosines,
}

/// The samples for the rest, which is the part of the light that is not integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest<'e> {
    /// There are no samples: all light is integrated.
    Nothing,
    /// Points of the whole light by one density.
    Points {
        /// The density.
        by: PointBy,
        /// The number of points.
        samples: u32,
    },
    /// Points of a round light in proportion to the lobes of the LTCs, [without the cosine
    /// itself](linelit_shading::ltc::LtcMixture::lobes_alone). The integral of the LTCs is
    /// known, and what remains of the cosine is mostly zero.
    PointsByLobes {
        /// The number of points.
        samples: u32,
    },
    /// One point of the visible parts of each line.
    PointsOfLines {
        /// The technique that draws the lines.
        lines: &'e Lines,
        /// The number of lines, each with one point.
        samples: u32,
    },
    /// Points of the visible region in proportion to the LTCs, without further visibility queries.
    /// Points of the whole light replace them if the area of the visible region is rounded to zero.
    Visible {
        /// The number of points.
        samples: u32,
    },
    /// Several techniques on the part of the light above the horizons, combined by weights.
    Weighted(Weighted<'e>),
}

/// Weighted techniques that share the samples of one estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted<'e> {
    /// The techniques with their shares.
    pub parts: &'e [Part],
    /// Whether directions from the BSDF are one more technique, with a share of one.
    pub with_bsdf: bool,
    /// The density of the points that replace lines with integrals ([`Lines::integration`]); `None`
    /// keeps the lines, and draws points of them.
    pub integrals: Option<PointDensity>,
    /// Whether points in proportion to LTCs leave out the cosine itself, as in
    /// [`Rest::PointsByLobes`].
    pub lobes_alone: bool,
    /// The weights that combine the techniques.
    pub weights: Weights,
    /// The number of samples of all techniques together.
    pub samples: u32,
}

/// The way in which visibility is queried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VisibilityBy {
    /// Each point and each line traverses the hierarchy by itself, as published.
    Rays,
    /// One shaft answers all queries (`docs/decisions/008-one-shaft-for-combinations.md`).
    Shaft,
}

impl<'e> Method<'e> {
    pub(crate) const fn new(known: KnownOver<'e>, rest: Rest<'e>, ask: VisibilityBy) -> Self {
        Self {
            known,
            rest,
            ask,
            otherwise: Rest::Nothing,
        }
    }

    /// A method without a known part.
    pub(crate) const fn sampled(rest: Rest<'e>, ask: VisibilityBy) -> Self {
        Self::new(KnownOver::Nothing, rest, ask)
    }

    /// The method for a light that is wholly hidden: it causes no light.
    pub(crate) const NONE: Self = Self::sampled(Rest::Nothing, VisibilityBy::Shaft);

    /// One shadow ray to a delta light, for any estimator.
    pub(crate) const RAY: Self = Self::new(KnownOver::Ray, Rest::Nothing, VisibilityBy::Rays);

    pub(crate) const fn region(of: KnownIntegrand) -> Self {
        Self::new(KnownOver::Region(of), Rest::Nothing, VisibilityBy::Shaft)
    }

    pub(crate) const fn points(by: PointBy, samples: u32, ask: VisibilityBy) -> Self {
        Self::sampled(Rest::Points { by, samples }, ask)
    }

    pub(crate) const fn points_of_lines(lines: &'e Lines, samples: u32) -> Self {
        Self::sampled(Rest::PointsOfLines { lines, samples }, VisibilityBy::Shaft)
    }

    /// Returns whether the estimate has no noise.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        matches!(self.known, KnownOver::Region(_) | KnownOver::Ray) && self.rest == Rest::Nothing
    }
}

impl Weighted<'_> {
    /// The techniques with their shares, after lines with integrals have been replaced by points
    /// where this is to be done.
    pub(crate) fn techniques(&self) -> impl Iterator<Item = Part> {
        let beside = self.with_bsdf.then(|| Part::one(Points::bsdf()));
        let replaced = |part: &Part| match self.integrals {
            Some(by) if part.technique.may_become_points() => Part {
                technique: Points::by(by.into()).into(),
                ..*part
            },
            _ => *part,
        };
        self.parts.iter().map(replaced).chain(beside)
    }
}
