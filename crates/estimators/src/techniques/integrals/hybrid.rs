//! `hybrid`: whichever of exact, lines, points and rays is cheapest, by a few rules about what is
//! between the shading point and the light (`docs/decisions/007-what-hybrid-asks.md`).

use super::{Between, Instead, Integral};
use crate::point_sum::cheapest;
use crate::strategy::{Strategy, through_shaft};
use crate::{Buffers, EmissionTexture, Estimator, Lines, OcclusionStats, PointBy, Points, Query};
use crate::{combination, point_sum};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::AreaLight;
use linelit_visibility::Shaft;

/// Points, or rays that are traced together, in place of a line.
const POINTS: u32 = 4;

/// Fewer lines than this are points that share the shaft.
const FEW_LINES: u32 = 4;

/// Points that complete the closed form of transformed cosines, at least.
const POINTS_WITH_COSINES: u32 = 16;

/// Lines that take as long as the closed form over what is visible, for each triangle in between
/// and for each edge that bounds what triangles hide, and by how many fewer in all, for the lines'
/// own beginning: measured.
const LINES_FOR_A_TRIANGLE: f64 = 1.3;
const LINES_FOR_AN_EDGE: f64 = 0.95;
const LINES_FOR_THE_FIRST: f64 = 1.2;

/// Triangles in between, for each line, up to which the closed form of transformed cosines with
/// points for what they leave out reaches an error before points and lines do.
const TRIANGLES_WITH_COSINES: f64 = 24.0;

/// Towards a light that is densely occluded there are rays below so many lines, and below the rays
/// that take as long as a line over the other number.
const LINES_IF_DENSE: f64 = 8.0;
const RAYS_FOR_LINES: f64 = 3.0;

/// In combinations, points that share a dense shaft in place of a line.
const POINTS_IF_DENSE: u32 = 2 * POINTS;

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
        if query.light.texture.is_some() {
            return by_texture(query, area, buffers);
        }
        let (lines, occlusion) = (query.samples, &query.light.occlusion);
        let closed = query.point.known().closed_form();
        let is_diffuse = closed.is_some_and(|form| form.is_diffuse());
        let by = if is_diffuse {
            cheapest(query, area)
        } else {
            PointBy::Ltc
        };
        let are_few = f64::from(lines) < lines_if_dense(occlusion);
        if occlusion.dense && are_few {
            return point_sum::by_rays(&query.about_times(POINTS), area, by, buffers);
        }
        let has_lines = closed.is_some();
        through_shaft(query, area, options, buffers, |shaft| {
            if shaft.is_dense() {
                match are_few {
                    true => (Strategy::Rays(by), POINTS),
                    false => (Strategy::Lines, 1),
                }
            } else if is_diffuse && lines_of_exact(occlusion, shaft) <= f64::from(lines) {
                (Strategy::Exact, 1)
            } else if !is_diffuse && takes_cosines(shaft, lines) {
                (Strategy::Exact, points_with_cosines(lines))
            } else if has_lines && lines >= FEW_LINES {
                (Strategy::Lines, 1)
            } else {
                (Strategy::Points(by), POINTS)
            }
        })
    }

    fn instead(self, between: &Between<'_, '_>) -> Instead {
        let (shaft, lines) = (between.shaft, between.samples);
        if shaft.is_dense() {
            Instead::Points(POINTS_IF_DENSE)
        } else if between.has_cosines && takes_cosines(shaft, lines) {
            Instead::Differences(points_with_cosines(lines))
        } else {
            Instead::Line
        }
    }
}

/// Towards a light that is densely occluded, lines have less noise than rays in the same time from
/// so many on.
fn lines_if_dense(occlusion: &OcclusionStats) -> f64 {
    LINES_IF_DENSE.max(occlusion.line_cost / RAYS_FOR_LINES)
}

/// Lines that take as long as the closed form over what is visible past the shaft's triangles.
fn lines_of_exact(occlusion: &OcclusionStats, shaft: &Shaft<'_>) -> f64 {
    let for_a_triangle = LINES_FOR_A_TRIANGLE + LINES_FOR_AN_EDGE * occlusion.edges;
    for_a_triangle * triangles(shaft) - LINES_FOR_THE_FIRST
}

/// Whether the closed form of transformed cosines past the shaft's triangles, with points for the
/// difference, reaches an error before others do.
fn takes_cosines(shaft: &Shaft<'_>, lines: u32) -> bool {
    triangles(shaft) <= TRIANGLES_WITH_COSINES * f64::from(lines)
}

#[allow(clippy::cast_precision_loss, reason = "a few hundred")]
fn triangles(shaft: &Shaft<'_>) -> f64 {
    shaft.candidates() as f64
}

/// How many points for each line complete the closed form of transformed cosines.
fn points_with_cosines(lines: u32) -> u32 {
    POINTS.max(POINTS_WITH_COSINES.div_ceil(lines.max(1)))
}

/// Points of a light that emits an image, half of them by the image; or a third, and a third by a
/// reflection that is [unlike](linelit_bsdf::Known::is_unlike_cosines) transformed cosines.
fn by_texture<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let known = query.point.known();
    let by = if known.constant().is_some() {
        PointBy::SolidAngle
    } else {
        PointBy::Ltc
    };
    let mut estimator = Estimator::points(by).with(Points::by(PointBy::Texture));
    if known.is_unlike_cosines() {
        estimator = estimator.with(Points::bsdf());
    }
    let query = Query {
        estimator: &estimator,
        ..*query
    };
    combination::combined(&query, area, buffers)
}
