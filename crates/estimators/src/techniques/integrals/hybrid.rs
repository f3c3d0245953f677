//! `hybrid`: whichever of exact, lines, points and rays is cheapest by what stands in between.
//! Where the numbers come from: `docs/decisions/007-what-hybrid-asks.md`.

use super::exact::ExactOptions;
use super::{Between, Instead, Integral};
use crate::point_sum::cheapest;
use crate::strategy::{Strategy, through_shaft};
use crate::techniques::points::LightPoint;
use crate::{Buffers, EmissionTexture, Estimator, Lines, OcclusionStats, PointBy, Points, Query};
use crate::{combination, point_sum, transformed};
use linelit_bsdf::{ClosedLobe, Reflection, TransformedCosine};
use linelit_geometry::{DVec3, Frame};
use linelit_lights::AreaLight;
use linelit_visibility::{Shaft, ShaftClass};

/// Below this many lines a shaft query costs more than it saves: shadow rays.
const FEW_LINES: u32 = 4;

/// Rays, traced together, that take about as long as a line where `FEW_LINES` decides, and for a
/// dense shaft.
const RAYS_FOR_A_LINE: u32 = 4;

/// Points share a shaft in place of `FEW_LINES` where it costs less than this many times as much as
/// rays.
const SHAFT_FOR_FEW: f64 = 0.9;

/// Below this many triangles in a shaft on average, points share it in place of `FEW_LINES` lines.
const CANDIDATES_FOR_FEW_LINES: f64 = 72.0;

/// Points that take about as long as a line there.
const POINTS_FOR_A_LINE: u32 = 4;

/// Points that take about as long as the closed form of transformed cosines, which they complete.
const POINTS_WITH_FITS: u32 = 16;

/// Where what the light sends to the viewer differs by no more than this from corner to corner and
/// middle, points of its area soon know it, and all else costs more than they do.
const SMOOTH: f64 = 4.0;

/// A light whose image in the space of a lobe's cosine has a corner further than this from another,
/// on the unit sphere, is wide for the lobe.
const WIDE_FOR_COSINES: f64 = 1.0;

/// Towards a light that is densely occluded, and for a dense shaft, lines are few below the square
/// of the rays that take as long as one, each divided by this, where nothing better is known: as
/// their number grows, the error of lines falls faster than that of points, so that dearer ones are
/// ahead all the later. Measured.
const RAYS_FOR_FEW_LINES: f64 = 2.4;

/// The least rays in place of a line towards densely occluded lights; in combinations, points that
/// share a shaft.
const POINTS_FOR_A_LINE_IF_DENSE: u32 = 8;

/// How long the tests of lines take, in those of rays, which are traced together but end at what
/// they meet first: measured.
const TIME_OF_TESTS: f64 = 0.5;

/// Never more rays in place of a line: the dearest lines that were measured take some 160, and
/// what tests foretell may be far off where rays soon meet something.
const MOST_RAYS_FOR_A_LINE: f64 = 256.0;

/// Lines that take as long as the closed form, for each candidate and for each edge that bounds
/// what candidates hide, and by how many fewer in all, for the lines' own beginning: measured.
const LINES_FOR_A_CANDIDATE: f64 = 1.3;
const LINES_FOR_AN_EDGE: f64 = 0.95;
const LINES_FOR_THE_FIRST: f64 = 1.2;

/// The same past a dense shaft, by its silhouettes: for each edge, and in all. Measured, but for a
/// factor of two either way.
const LINES_FOR_A_DENSE_EDGE: f64 = 0.8;
const LINES_PAST_DENSE: f64 = 25.0;

/// How many times sooner the closed form of transformed cosines pays past a dense shaft: what they
/// leave out has little noise where points are drawn on what is visible alone, and a ray by them
/// takes as long as three or four. Measured.
const SOONER_WITH_FITS: f64 = 6.0;

/// Where the closed form takes over from fewer than this many times as many lines on as lines do
/// from rays, rays go on until then: lines, only just ahead of them, would not be for long.
const LINES_BEFORE_DENSE: f64 = 4.0;

/// By how much of its time in an empty shaft a line takes longer for each candidate.
const LINE_BY_CANDIDATES: f64 = 0.011;

/// Lines that take as long as the light's own edges for each lobe of the surface.
const LINES_FOR_A_LOBE: f64 = 20.0;

/// What `LINES_FOR_AN_EDGE` grows by for each lobe, before a light that is narrow for it, and
/// before a wide one.
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

    /// Rays where looking for everything in between does not pay; else what the shaft suggests.
    fn light<R: Reflection, T: EmissionTexture>(
        self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        options: &Lines,
        buffers: &mut Buffers,
    ) -> DVec3 {
        let query = &query.with_tolerance(ExactOptions::default().tolerance);
        let (lines, occlusion) = (query.samples, &query.light.occlusion);
        if lines >= FEW_LINES && query.light.texture.is_some() {
            return by_texture(query, area, buffers);
        }
        let closed = query.point.bsdf.closed_form();
        // Without a closed form, but as transformed cosines (or nothing is known of it).
        let is_fitted = query.light.texture.is_none() && closed.is_none();
        let sooner = if is_fitted { SOONER_WITH_FITS } else { 1.0 };
        let dense_from = lines_past_dense(occlusion, lines_for_lobes(query, area)) / sooner;
        let past_dense = dense_from <= f64::from(lines);
        let few = few_lines(occlusion, closed.is_some(), dense_from);
        let are_few = f64::from(lines) < few.max(f64::from(FEW_LINES + 1));
        if occlusion.dense && are_few && !past_dense {
            let query = &query.about_times(rays_for_a_line(occlusion, lines));
            if is_fitted {
                return transformed::by_rays(query, area, buffers);
            }
            return point_sum::by_rays(query, area, cheapest(query, area), buffers);
        }
        if is_fitted && occlusion.candidates < CANDIDATES_OF_FITS * f64::from(lines) {
            let times = points_with_fits(lines);
            return through_shaft(query, area, options, buffers, |shaft| {
                if shaft.is_dense() {
                    in_dense_shaft((past_dense, times), are_few, PointBy::Ltc, shaft)
                } else if shaft.class() == ShaftClass::Empty && is_smooth(query, area) {
                    (Strategy::Points(PointBy::Area), times)
                } else {
                    (Strategy::Exact, times)
                }
            });
        }
        if lines < FEW_LINES {
            return by_few_points(query, area, options, buffers);
        }
        if lines == FEW_LINES && occlusion.candidates < CANDIDATES_FOR_FEW_LINES {
            let is_diffuse = closed.is_some_and(|form| form.is_diffuse());
            if !is_diffuse && occlusion.shaft_cost > 1.0 {
                let query = &query.times(POINTS_FOR_A_LINE);
                return point_sum::by_rays(query, area, PointBy::Area, buffers);
            }
            let points = (Strategy::Points(PointBy::Area), POINTS_FOR_A_LINE);
            return through_shaft(query, area, options, buffers, |shaft| {
                exact_or(points, query, area, shaft)
            });
        }
        through_shaft(query, area, options, buffers, |shaft| {
            if shaft.is_dense() {
                in_dense_shaft((past_dense, 1), are_few, PointBy::SolidAngle, shaft)
            } else {
                exact_or((Strategy::Lines, 1), query, area, shaft)
            }
        })
    }

    #[allow(clippy::cast_precision_loss, reason = "a few hundred")]
    fn instead(self, between: &Between<'_, '_>) -> Instead {
        let Between {
            shaft, occlusion, ..
        } = between;
        let lines = f64::from(between.samples);
        let is_affordable = match shaft.is_dense() {
            true => shaft.has_silhouettes() && lines_past_dense(occlusion, WITHOUT_LOBES) <= lines,
            false => (shaft.candidates() as f64) < CANDIDATES_OF_FITS * lines,
        };
        if is_affordable && between.has_cosines {
            Instead::Differences(points_with_fits(between.samples))
        } else if shaft.is_dense() {
            Instead::Points(POINTS_FOR_A_LINE_IF_DENSE)
        } else {
            Instead::Line
        }
    }
}

/// Towards a light that is densely occluded, and for a dense shaft, lines are few below this, if
/// the closed form past silhouettes takes over from so many on.
fn few_lines(occlusion: &OcclusionStats, has_closed_form: bool, dense_from: f64) -> f64 {
    let by_cost = (occlusion.line_cost / RAYS_FOR_FEW_LINES).powi(2);
    let ahead = occlusion.lines_ahead.filter(|_| has_closed_form);
    let few = ahead.unwrap_or(by_cost);
    if dense_from < LINES_BEFORE_DENSE * few {
        few.max(dense_from)
    } else {
        few
    }
}

/// Rays in place of a line towards a light that is densely occluded: some where lines are few, and
/// the more of them, the nearer lines are to being ahead of rays, until both take as long.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped"
)]
fn rays_for_a_line(occlusion: &OcclusionStats, lines: u32) -> u32 {
    if lines < FEW_LINES {
        return RAYS_FOR_A_LINE;
    }
    let as_long = (occlusion.line_cost * TIME_OF_TESTS).min(MOST_RAYS_FOR_A_LINE);
    let ahead = occlusion.lines_ahead.unwrap_or(f64::INFINITY);
    let so_far = (f64::from(lines) / ahead).min(1.0);
    POINTS_FOR_A_LINE_IF_DENSE.max((as_long * so_far) as u32)
}

/// How many points for each line complete the closed form of transformed cosines.
fn points_with_fits(lines: u32) -> u32 {
    POINTS_FOR_A_LINE.max(POINTS_WITH_FITS.div_ceil(lines.max(1)))
}

/// Points where lines would be fewer than `FEW_LINES`: in a shaft, if that costs less than rays do
/// and where it is empty closed forms cost little.
fn by_few_points<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    buffers: &mut Buffers,
) -> DVec3 {
    let shaft_cost = query.light.occlusion.shaft_cost;
    let closed = query.point.bsdf.closed_form();
    let by = if query.light.texture.is_none() && closed.is_none() {
        PointBy::Ltc
    } else if shaft_cost > 1.0 {
        // So much is in between that fewer and better points pay.
        cheapest(query, area)
    } else {
        PointBy::Area
    };
    if shaft_cost < SHAFT_FOR_FEW && closed.is_some_and(|form| form.is_diffuse()) {
        let points = (Strategy::Points(by), POINTS_FOR_A_LINE);
        return through_shaft(query, area, options, buffers, |_| points);
    }
    point_sum::by_rays(&query.times(RAYS_FOR_A_LINE), area, by, buffers)
}

/// Points of a light that emits an image, half of them by the image; or a third, and a third by a
/// reflection that is [unlike](Reflection::is_unlike_cosines) transformed cosines.
fn by_texture<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let point = query.point;
    let closed = point.bsdf.closed_form();
    let by = if closed.is_some_and(|form| form.is_diffuse()) {
        PointBy::SolidAngle
    } else {
        PointBy::Ltc
    };
    let mut estimator = Estimator::points(by).with(Points::by(PointBy::Texture));
    if point.bsdf.is_unlike_cosines(point.outgoing, point.normal) {
        estimator = estimator.with(Points::bsdf());
    }
    let query = Query {
        estimator: &estimator,
        ..*query
    };
    combination::combined(&query, area, buffers)
}

/// What to do about a light that is partly hidden behind more than a shaft keeps: if the closed
/// form pays past silhouettes, that with so many times as many points.
fn in_dense_shaft(
    (past_dense, times): (bool, u32),
    are_few: bool,
    by: PointBy,
    shaft: &Shaft<'_>,
) -> (Strategy, u32) {
    if past_dense && shaft.has_silhouettes() {
        (Strategy::Exact, times)
    } else if are_few {
        (Strategy::Rays(by), RAYS_FOR_A_LINE)
    } else {
        (Strategy::Lines, 1)
    }
}

/// The closed form where it takes no longer than the query's lines, else something else.
fn exact_or<R: Reflection, T>(
    other: (Strategy, u32),
    query: &Query<'_, R, T>,
    area: &AreaLight,
    shaft: &Shaft<'_>,
) -> (Strategy, u32) {
    let lines = lines_of_exact(query, area, shaft) * query.light.occlusion.exact_cost;
    if !shaft.is_dense() && lines <= f64::from(query.samples) {
        (Strategy::Exact, 1)
    } else {
        other
    }
}

/// Lines that take as long as the closed form over what is visible past the shaft's candidates.
pub(crate) fn lines_of_exact<R: Reflection, T>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    shaft: &Shaft<'_>,
) -> f64 {
    #[allow(clippy::cast_precision_loss, reason = "a few hundred")]
    let candidates = shaft.candidates() as f64;
    let [for_lobes, for_an_edge] = lines_for_lobes(query, area);
    let for_a_candidate = LINES_FOR_A_CANDIDATE + for_an_edge * query.light.occlusion.edges;
    (for_a_candidate * candidates + for_lobes - LINES_FOR_THE_FIRST)
        / (1.0 + LINE_BY_CANDIDATES * candidates)
}

/// Lines that take as long as the closed form past a dense shaft, on average.
fn lines_past_dense(occlusion: &OcclusionStats, [for_lobes, for_an_edge]: [f64; 2]) -> f64 {
    let for_an_edge = LINES_FOR_A_DENSE_EDGE * for_an_edge / LINES_FOR_AN_EDGE;
    let lines = LINES_PAST_DENSE + for_an_edge * occlusion.dense_edges;
    (lines + for_lobes) * occlusion.exact_cost
}

/// Whether what the light sends to the viewer is smooth over it: by its corners and middle, and no
/// lobe is so narrow that it could lie between them.
fn is_smooth<R: Reflection, T: EmissionTexture>(query: &Query<'_, R, T>, area: &AreaLight) -> bool {
    let (polygon, point) = (&area.polygon, query.point);
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    let corners = polygon.vertices().iter().copied();
    let mut places = std::iter::once(polygon.centroid()).chain(corners);
    let is_even = places.all(|at| {
        let at = LightPoint::new(at, point.position, polygon);
        let value = query.unshadowed(&at).element_sum() * at.cos_light.abs() / at.square;
        (least, most) = (least.min(value), most.max(value));
        most <= SMOOTH * least
    });
    let is_narrow = |lobe: &TransformedCosine, frame: &Frame| {
        let inverse = lobe.map.inverse();
        let image = |v: &DVec3| (inverse * frame.to_local(*v - point.position)).normalize_or_zero();
        let [first, rest @ ..] = polygon.vertices() else {
            return true;
        };
        let first = image(first);
        rest.iter()
            .any(|v| first.distance(image(v)) > WIDE_FOR_COSINES)
    };
    is_even && {
        let cosines = point.bsdf.transformed_cosines(point.outgoing, point.normal);
        cosines.is_some_and(|c| !c.lobes().iter().any(|lobe| is_narrow(lobe, &c.frame)))
    }
}

/// What `lines_for_lobes` says where there are none.
const WITHOUT_LOBES: [f64; 2] = [0.0, LINES_FOR_AN_EDGE];

/// Lines that take as long as the lobes over the light's own edges in the closed form, and as an
/// edge.
fn lines_for_lobes<R: Reflection, T>(query: &Query<'_, R, T>, area: &AreaLight) -> [f64; 2] {
    let point = query.point;
    let Some(reflection) = point.bsdf.closed_form() else {
        return WITHOUT_LOBES;
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
    lobes.fold(WITHOUT_LOBES, |[own, edge], lobe| {
        [own + LINES_FOR_A_LOBE, edge + for_a_lobe(lobe)]
    })
}
