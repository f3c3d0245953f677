//! Methods as data: the integral in closed form, the samples for the rest, and the way in which
//! visibility is asked for.
//!
//! Every estimate is L = ∫ g V dω + ∫ (f − g) V dω, where f is the light that the reflection sends
//! to the viewer, V visibility and g the part of f that is known in closed form.

use crate::{EmissionTexture, LightSource, Lines, OcclusionStats, Part, PointBy, PointDensity};
use crate::{Points, Query, ShadingPoint, Weights};
use linelit_bsdf::{ClosedLobe, LtcLobe, LtcMixture, Reflection};
use linelit_geometry::{DVec3, Segment};
use linelit_lights::Light;
use linelit_visibility::ShaftClass;

/// The kinds of lights that methods tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LightKind {
    /// A polygon of one radiance.
    Polygon,
    /// A polygon that emits an image.
    Textured,
    /// A linear light.
    Linear,
    /// A sphere.
    Sphere,
    /// A disk.
    Disk,
    /// A cylinder.
    Cylinder,
    /// A point, a spot, or parallel light: one direction leads to it.
    Delta,
    /// An environment, or a sun.
    Sky,
}

impl LightKind {
    /// All values, with their names.
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

    /// Whether it is a sphere or a disk, which have no lines.
    pub(crate) const fn is_round(self) -> bool {
        matches!(self, Self::Sphere | Self::Disk)
    }

    /// Whether it is a polygon.
    pub(crate) const fn is_polygon(self) -> bool {
        matches!(self, Self::Polygon | Self::Textured)
    }

    /// The kind of a light.
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

/// The closed forms that a reflection has ([`Reflection::known`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Closed {
    /// No closed form.
    Nowhere,
    /// Closed forms along lines: it has Gaussians.
    AlongLines,
    /// Closed forms along lines and, at a cost, over polygons: it has lobes of Phong.
    OverPolygons {
        /// The lines on a polygon, with the same lobes, that take as long as an edge of what is
        /// visible of it.
        lines_for_an_edge: u32,
    },
    /// Closed forms along lines and over lights, as cheap as visibility: it is diffuse.
    Diffuse,
}

/// The exponent up to which a lobe of Phong's is so wide that its integral along an edge takes as
/// long as along two lines ([`linelit_shading::phong_polygon`]); of narrower lobes, as along one.
const WIDE_LOBE: f64 = 113.0;

impl Closed {
    /// The closed forms of a diffuse part and lobes.
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

    /// The lines that take as long as the integral over an edge of a visible region.
    pub(crate) const fn lines_for_an_edge(self) -> u32 {
        match self {
            Self::OverPolygons { lines_for_an_edge } => lines_for_an_edge,
            Self::Nowhere | Self::AlongLines | Self::Diffuse => 1,
        }
    }
}

/// The knowledge of a reflection, as one viewer sees it, that the choice of a method depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct KnownKind {
    /// The reflection's closed forms.
    pub closed: Closed,
    /// Whether it is known as transformed cosines ([`Reflection::transformed_cosines`]).
    pub has_cosines: bool,
    /// Whether samples by these cosines alone would be rare and large
    /// ([`linelit_bsdf::Known::is_unlike_cosines`]).
    pub are_unlike: bool,
    /// Whether all their lobes are so wide that a point of a line sees most of what is reflected.
    pub are_wide: bool,
    /// Whether it has no closed form, and its peaks along lines are known
    /// ([`Reflection::peaks`]), so that it can be integrated along lines by quadrature.
    pub has_peaks: bool,
}

impl KnownKind {
    /// Kinds of reflections that techniques treat differently, with their names.
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

    /// Nothing is known, as of light that a profile turns with direction.
    pub const NOTHING: Self = Self {
        closed: Closed::Nowhere,
        has_cosines: false,
        are_unlike: false,
        are_wide: false,
        has_peaks: false,
    };

    /// The knowledge that the reflection at a shading point gives.
    pub fn of<R: Reflection>(point: &ShadingPoint<R>) -> Self {
        let (wo, n) = (point.outgoing, point.normal);
        let cosines = point.bsdf.transformed_cosines(wo, n);
        let line = Segment::new(n, n + DVec3::X);
        Self::along(point, cosines.as_ref(), Some(line))
    }

    /// The knowledge where these transformed cosines are asked for, and peaks along a line relative
    /// to the point.
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
        // Where there is a closed form, nobody integrates between peaks.
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

/// The least solid angle of a wide lobe, as a share of the cosine's.
const WIDE: f64 = 0.15;

/// Whether all lobes of transformed cosines are wide.
fn are_wide(cosines: &LtcMixture) -> bool {
    let is_wide = |lobe: &LtcLobe| {
        let largest = [lobe.map.x_axis, lobe.map.y_axis, lobe.map.z_axis].map(DVec3::length);
        let volume = largest.into_iter().fold(0.0, f64::max).powi(3);
        lobe.map.determinant().abs() >= WIDE * volume
    };
    cosines.lobes().iter().all(is_wide)
}

/// Facts about a light and a reflection that are known before visibility is asked for.
#[derive(Clone, Copy, Debug)]
pub struct MethodFacts<'a> {
    /// The kind of the light.
    pub light: LightKind,
    /// The knowledge of the reflection.
    pub known: KnownKind,
    /// Statistics of the light's occlusion.
    pub occlusion: &'a OcclusionStats,
    /// The number of samples.
    pub samples: u32,
    /// Whether empty and blocked shafts take no samples ([`Query::skip`](crate::Query::skip)).
    pub skip: bool,
    /// The way in which combinations ask for visibility.
    pub ask: VisibilityBy,
    /// The density of points of a polygon that reaches an error first: by area, of a light whose
    /// solid angle differs little from place to place, else by solid angle.
    pub points: PointDensity,
}

impl<'a> MethodFacts<'a> {
    /// Facts of a query that skips what it can and shares one shaft, towards a light before which
    /// few triangles stand, and which is seen alike from place to place.
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

    /// The facts of a query, by which `estimate` chooses its method.
    #[must_use]
    pub fn of<R: Reflection, T: EmissionTexture>(query: &Query<'a, R, T>) -> Self {
        Self {
            points: query.light.cheapest_points(query.point.position),
            ..Self::before(query, query.cosines().as_ref())
        }
    }

    /// The facts of a query before the best density of points is asked for.
    pub(crate) fn before<R: Reflection, T>(
        query: &Query<'a, R, T>,
        cosines: Option<&LtcMixture>,
    ) -> Self {
        let line = match query.light.light {
            Light::Linear(light) => Some(light.segment),
            Light::Cylinder(light) => Some(light.cylinder.axis),
            Light::Area(_) | Light::Sphere(_) | Light::Disk(_) => None,
            Light::Point(_) | Light::Distant(_) | Light::Sky(_) => None,
        };
        let line = line.map(|line| line.relative_to(query.point.position));
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

/// The answer of a shaft between a shading point and a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftAnswer {
    /// The class of the shaft; partial where none was asked.
    pub class: ShaftClass,
    /// Whether too many triangles are in between to keep.
    pub is_dense: bool,
    /// The triangles that are kept.
    pub candidates: usize,
    /// Whether the visible region of the light can be found: the light is seen as a whole, or what
    /// bounds the region is [known](linelit_visibility::Shaft::has_front); of a cylinder, whether
    /// all of it is visible and above the horizons.
    pub has_region: bool,
}

/// A method: the light that is known, the samples for the rest, and the way to ask for visibility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Method<'e> {
    /// The integral of the known part.
    pub known: KnownOver<'e>,
    /// The samples for the rest.
    pub rest: Rest<'e>,
    /// The way in which visibility is asked for: always by a shaft for a region.
    pub ask: VisibilityBy,
    /// The samples of all of the light that take the place of both where the visible region of a
    /// round light is so narrow, or a lobe makes it so narrow, that sums over its boundary would
    /// lose half of their digits. No other method needs any.
    pub otherwise: Rest<'e>,
}

/// The domain over which the known part of the light is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KnownOver<'e> {
    /// No domain: nothing is known.
    Nothing,
    /// The visible parts of lines.
    Lines {
        /// The lines.
        lines: &'e Lines,
        /// The number of lines.
        count: u32,
        /// The integrand.
        of: KnownIntegrand,
    },
    /// The visible region of the light; all of the light if the shaft is empty.
    Region(KnownIntegrand),
    /// The one direction to a light without size.
    Ray,
}

/// The known integrand g.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnownIntegrand {
    /// The reflection itself, in closed form.
    Reflection,
    /// The reflection itself, by adaptive quadrature between its peaks.
    Quadrature,
    /// The transformed cosines that look like the reflection.
    Cosines,
}

/// The samples for the part of the light that is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest<'e> {
    /// No samples: all is known.
    Nothing,
    /// Points of the whole light by one density.
    Points {
        /// The density.
        by: PointBy,
        /// The number of points.
        samples: u32,
    },
    /// Points of a round light by the lobes of the transformed cosines whose integral is known,
    /// [without the cosine itself](linelit_shading::ltc::LtcMixture::lobes_alone): the
    /// difference that this leaves mostly cancels.
    PointsByLobes {
        /// The number of points.
        samples: u32,
    },
    /// A point of the visible parts of each line.
    PointsOfLines {
        /// The lines.
        lines: &'e Lines,
        /// The number of points.
        samples: u32,
    },
    /// Points of the visible region by the transformed cosines, whose visibility is known; where
    /// all that is visible has an area that is rounded to zero, points of the whole light.
    Visible {
        /// The number of points.
        samples: u32,
    },
    /// Several techniques on the part of the light above the horizons, weighted.
    Weighted(Weighted<'e>),
}

/// Weighted techniques that share samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted<'e> {
    /// The techniques.
    pub parts: &'e [Part],
    /// Whether directions of the BSDF stand beside them, with a share of one.
    pub with_bsdf: bool,
    /// The points that replace lines of integrals ([`Lines::integration`]); `None` keeps lines, of
    /// which points are drawn.
    pub integrals: Option<PointDensity>,
    /// Whether points by transformed cosines leave out the cosine itself, as
    /// [`Rest::PointsByLobes`].
    pub lobes_alone: bool,
    /// The weights.
    pub weights: Weights,
    /// The samples of all together.
    pub samples: u32,
}

/// The way in which visibility is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VisibilityBy {
    /// A traversal for each point and each line, as published.
    Rays,
    /// One shaft for all (`docs/decisions/008-one-shaft-for-combinations.md`).
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

    /// Samples alone.
    pub(crate) const fn sampled(rest: Rest<'e>, ask: VisibilityBy) -> Self {
        Self::new(KnownOver::Nothing, rest, ask)
    }

    /// The method of a light that is wholly hidden.
    pub(crate) const NONE: Self = Self::sampled(Rest::Nothing, VisibilityBy::Shaft);

    /// One shadow ray to a light without size, whatever the estimator.
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

    /// Whether the estimate has no noise.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        matches!(self.known, KnownOver::Region(_) | KnownOver::Ray) && self.rest == Rest::Nothing
    }
}

impl Weighted<'_> {
    /// The techniques with their shares, with points in place of lines of integrals where they are
    /// replaced.
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
