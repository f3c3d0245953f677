//! `hybrid`: whichever of exact, lines, points and rays is cheapest by what stands in between.
//! Where the numbers come from: `docs/decisions/007-what-hybrid-asks.md`.

use super::Integral;
use crate::strategy::{Strategy, rays, through_shaft};
use crate::{Buffers, EmissionTexture, Lines, PointBy, Query, point_sum};
use linelit_bsdf::{ClosedLobe, Reflection};
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;

/// Below this many lines a shaft query costs more than it saves: shadow rays, or points that share
/// the shaft.
const FEW_LINES: u32 = 4;

/// Rays that take about as long as a line where `FEW_LINES` decides.
const RAYS_FOR_A_LINE: u32 = 2;

/// What a shaft may hold on average, for each line after the first, to be asked for in place of
/// rays.
const CANDIDATES_FOR_A_LINE: f64 = 24.0;

/// Points that share a shaft in place of a line where `FEW_LINES` decides.
const POINTS_FOR_A_LINE: u32 = 4;

/// `FEW_LINES` towards a light that is densely occluded, and for a dense shaft.
const FEW_LINES_IF_DENSE: u32 = 17;

/// Points that share a shaft in place of a line towards densely occluded lights.
const POINTS_FOR_A_LINE_IF_DENSE: u32 = 8;

/// Where the solid angle of a piece of the light differs by no more than this from corner to
/// corner, points uniform on the area are as good as points uniform in the solid angle, and cost
/// two thirds.
const FLAT: f64 = 16.0;

/// Lines that take as long as the closed form, for each candidate and for each edge that bounds
/// what candidates hide: measured.
const LINES_FOR_A_CANDIDATE: f64 = 0.6;
const LINES_FOR_AN_EDGE: f64 = 1.4;

/// What `LINES_FOR_AN_EDGE` grows by where the surface has a lobe, before a light that is narrow
/// for the lobe, and before a wide one.
const LINES_FOR_A_NARROW_LOBE: f64 = 2.0;
const LINES_FOR_A_WIDE_LOBE: f64 = 80.0;

/// A light is wide for a lobe from this many times its width, 1/√(k + 1), on.
const WIDE_FOR_LOBES: f64 = 3.0;

/// What a shaft may hold on average, for each line, where the closed form of transformed cosines
/// with points for what they leave out reaches an error before lines and rays do.
const CANDIDATES_OF_FITS: f64 = 24.0;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cheapest;

impl Integral for Cheapest {
    const NAME: &'static str = "hybrid";
    const POINTS_IF_DENSE: Option<u32> = Some(POINTS_FOR_A_LINE_IF_DENSE);

    /// Rays where looking for everything in between does not pay; else what the shaft suggests.
    fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        options: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3 {
        let (lines, occlusion) = (query.samples, &query.light.occlusion);
        if occlusion.dense && lines < FEW_LINES {
            return rays(query, area, buffers);
        }
        if occlusion.dense && lines < FEW_LINES_IF_DENSE {
            let points = Strategy::Points(cheap_points(query, area));
            let query = query.times(POINTS_FOR_A_LINE_IF_DENSE);
            return through_shaft(&query, area, options, buffers, |_| points);
        }
        if !occlusion.dense
            && occlusion.candidates < CANDIDATES_OF_FITS * f64::from(lines)
            && looks_like_cosines(query)
        {
            return through_shaft(query, area, options, buffers, |shaft| {
                if shaft.is_dense() {
                    Strategy::Rays
                } else {
                    Strategy::Exact
                }
            });
        }
        let affordable = CANDIDATES_FOR_A_LINE * f64::from(lines - 1);
        if lines < FEW_LINES && occlusion.candidates < affordable {
            let query = query.times(POINTS_FOR_A_LINE);
            return through_shaft(&query, area, options, buffers, |_| {
                Strategy::Points(PointBy::Area)
            });
        }
        if lines < FEW_LINES {
            return point_sum::by_rays(&query.times(RAYS_FOR_A_LINE), area, PointBy::Area, buffers);
        }
        let for_an_edge = lines_for_an_edge(query, area);
        through_shaft(query, area, options, buffers, |shaft| {
            choose_strategy(shaft, occlusion.edges, for_an_edge, lines)
        })
    }
}

/// Whether the reflection has no closed form of its own, and is known by its transformed cosines.
fn looks_like_cosines<R: Reflection, T: EmissionTexture>(query: &Query<'_, R, T>) -> bool {
    let (bsdf, wo, n) = (&query.point.bsdf, query.point.outgoing, query.point.normal);
    query.light.texture.is_none()
        && bsdf.closed_form().is_none()
        && bsdf.transformed_cosines(wo, n).is_some()
}

/// What to do about a partly hidden light, by what the shaft and the number of lines say.
fn choose_strategy(shaft: &Shaft<'_>, edges: f64, for_an_edge: f64, lines: u32) -> Strategy {
    if shaft.is_dense() {
        return if lines < FEW_LINES_IF_DENSE {
            Strategy::Rays
        } else {
            Strategy::Lines
        };
    }
    let for_a_candidate = LINES_FOR_A_CANDIDATE + for_an_edge * edges;
    #[allow(clippy::cast_precision_loss, reason = "a few hundred")]
    let lines_of_exact = for_a_candidate * shaft.candidates() as f64;
    if lines_of_exact <= f64::from(lines) {
        Strategy::Exact
    } else {
        Strategy::Lines
    }
}

/// Lines that take as long as an edge in the closed form.
fn lines_for_an_edge<R: Reflection, T>(query: &Query<'_, R, T>, area: &AreaLight) -> f64 {
    let point = query.point;
    let Some(reflection) = point.bsdf.closed_form() else {
        return LINES_FOR_AN_EDGE;
    };
    let (vertices, x) = (area.polygon.vertices(), point.position);
    let first = (vertices[0] - x).normalize_or_zero();
    let chord = |v: &DVec3| first.distance((*v - x).normalize_or_zero());
    let for_a_lobe = |lobe: ClosedLobe| {
        let ClosedLobe::Power { exponent, .. } = lobe else {
            return LINES_FOR_A_NARROW_LOBE;
        };
        let size = vertices.iter().map(chord).fold(0.0, f64::max);
        if size * (exponent + 1.0).sqrt() < WIDE_FOR_LOBES {
            LINES_FOR_A_NARROW_LOBE
        } else {
            LINES_FOR_A_WIDE_LOBE
        }
    };
    let lobes = reflection.lobes(point.outgoing, point.normal);
    LINES_FOR_AN_EDGE + lobes.map(for_a_lobe).sum::<f64>()
}

/// The density of points that reaches an error first.
fn cheap_points<R, T>(query: &Query<'_, R, T>, area: &AreaLight) -> PointBy {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for corner in area.polygon.vertices() {
        let to_corner = *corner - query.point.position;
        let square = to_corner.length_squared();
        let density = area.polygon.normal().dot(to_corner).abs() / (square * square.sqrt());
        (least, most) = (least.min(density), most.max(density));
    }
    if most <= FLAT * least {
        PointBy::Area
    } else {
        PointBy::SolidAngle
    }
}
