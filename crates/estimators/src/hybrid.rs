//! This module has the rules by which `hybrid` chooses a method for each shading point and light.
//!
//! The rules compare times for an equal error. All times are measured in lines: a constant below
//! says how many lines take as long as something else. For a polygon, the order is: rays past too
//! many triangles to collect; the closed form over the visible region, if it takes no longer than
//! lines would, or not much longer; lines, if there are enough of them; and otherwise points that
//! share the shaft. `docs/decisions/007-what-hybrid-asks.md` has the measurements.

use crate::choose::{along, region};
use crate::estimator::Integral;
use crate::{
    Closed, Method, MethodFacts, Part, PointBy, PointDensity, Points, Rest, ShaftAnswer, Technique,
    VisibilityBy, Weighted, Weights,
};

/// The number of points, or of rays that are traced together, that replace a line. Fewer lines than
/// this are replaced by points that share the shaft.
const POINTS: u32 = 4;

/// The least number of points that are sampled in addition to the closed form of LTCs.
const POINTS_WITH_COSINES: u32 = 16;

/// The number of lines that take as long as the visible region, for each triangle in between, in
/// addition to the time for each edge that bounds what the triangle hides.
const LINES_FOR_A_TRIANGLE: f64 = 1.3;

/// How many times longer a method without noise may take than others, on average over a light's
/// shading points.
const PATIENCE: f64 = 1.5;

/// The time that a shading point takes apart from its method, as a number of lines, on diffuse
/// surfaces and on surfaces with lobes. These two and the next two numbers are measured.
const BEFORE: f64 = 4.0;
const BEFORE_LOBES: f64 = 1.0;

/// The number of lines on a diffuse surface that take as long as an edge of a visible region.
const LINES_FOR_AN_EDGE: f64 = 1.8;

/// The number of lines with lobes that take as long as setting up points that are drawn by lobes,
/// and the number that take as long as the [`POINTS`] which replace a line.
const POINTS_BY_LOBES: f64 = 7.0;
const LINES_FOR_POINTS: f64 = 1.6;

/// The number of triangles in between, for each point that samples the rest, up to which the closed
/// form of LTCs with narrow lobes reaches a given error before points do.
const TRIANGLES_WITH_COSINES: f64 = 6.0;

/// Towards a densely occluded light, rays have less noise than lines in the same time if there are
/// fewer lines than one of three bounds: this number; the number of rays that take as long as a
/// line, divided by the second number; and the bound that pilot lines found
/// ([`OcclusionStats::lines_ahead`](crate::OcclusionStats)). Pilot lines do not know the cost of
/// holes in triangles.
const LINES_IF_DENSE: f64 = 8.0;
const RAYS_FOR_LINES: f64 = 3.0;

/// The number of rays that replace a line towards a densely occluded light, and the number of
/// points that replace a line of a combination in a dense shaft.
pub(crate) const POINTS_IF_DENSE: u32 = 2 * POINTS;

/// Returns the method for a polygon of one radiance that is partly hidden.
pub(crate) fn method<'e>(
    integral: &Integral<'e>,
    facts: &MethodFacts<'_>,
    between: &ShaftAnswer,
) -> Method<'e> {
    let (lines, count) = (integral.lines, integral.count);
    let closed = facts.known.closed;
    let by = match closed {
        Closed::Diffuse => facts.points.into(),
        Closed::OverPolygons { .. } | Closed::AlongLines | Closed::Nowhere => {
            PointDensity::Lobes.into()
        }
    };
    let points = count.saturating_mul(POINTS);
    // Past too many occluders to collect, take rays, or lines if there are many.
    let is_dense = facts.occlusion.dense || between.is_dense;
    if is_dense && are_rays_better(facts, count) {
        // Rays are cheap, and their error falls faster than their time grows.
        let rays = if closed == Closed::Nowhere {
            POINTS
        } else {
            POINTS_IF_DENSE
        };
        let rays = nearest_power_of_two(count.saturating_mul(rays));
        return Method::points(by, rays, VisibilityBy::Rays);
    }
    // Take the visible region if it is found in the time of the lines or points.
    let is_smooth = closed == Closed::Diffuse || closed == Closed::Nowhere && facts.known.are_wide;
    let with_region = points_with_cosines(count);
    let is_region_cheap = match is_smooth || matches!(closed, Closed::OverPolygons { .. }) {
        true => {
            let edges = facts.occlusion.edges * f64::from(closed.lines_for_an_edge());
            let is_cheap_here =
                (LINES_FOR_A_TRIANGLE + edges) * triangles(between) <= f64::from(count);
            is_cheap_here || is_exact_cheap(facts, count)
        }
        false => takes_cosines(between, count),
    };
    if is_region_cheap
        && !between.is_dense
        && let Some(mut region) = region(with_region, facts, between)
    {
        if is_smooth && region.rest != Rest::Nothing {
            let samples = count;
            region.rest = Rest::PointsOfLines { lines, samples };
        }
        return region;
    }
    // Take lines where they can be integrated, or a point of each has most of the light; else
    // points.
    let takes_lines = match closed {
        Closed::Diffuse | Closed::AlongLines if between.is_dense => true,
        _ => takes_lines(facts, count),
    };
    let along = along(integral, facts).filter(|_| takes_lines);
    along.unwrap_or_else(|| Method::points(by, points, VisibilityBy::Shaft))
}

/// Returns whether lines are taken where the visible region is not, past triangles that are kept:
/// the light along them is known, or a point of each line represents most of it.
fn takes_lines(facts: &MethodFacts<'_>, count: u32) -> bool {
    match facts.known.closed {
        Closed::Nowhere => facts.known.are_wide,
        // Few lines miss the peak of a narrow lobe; points that are drawn by it do not.
        Closed::OverPolygons { .. } => facts.known.are_wide && count >= POINTS,
        Closed::Diffuse | Closed::AlongLines => count >= POINTS,
    }
}

/// Returns whether the closed form over the visible regions of a light takes at most [`PATIENCE`]
/// times as long as lines or points would. The closed form has no noise. The time that a shading
/// point takes with any method is included.
///
/// The decision is made once for all shading points of a light. Most of them see all of the light
/// or none of it, and cost the same with either method. So the few points where the closed form
/// takes long are cheap on average, and a picture without noise is worth more than one with noise
/// at a few points.
fn is_exact_cheap(facts: &MethodFacts<'_>, count: u32) -> bool {
    let (lines, occlusion) = (f64::from(count), facts.occlusion);
    let (before, edge, instead) = match facts.known.closed {
        Closed::Diffuse => (BEFORE, LINES_FOR_AN_EDGE, lines),
        // Lines along which lobes are integrated take longer, and so do points by lobes.
        Closed::OverPolygons { lines_for_an_edge } => {
            let instead = match takes_lines(facts, count) {
                true => lines,
                false => POINTS_BY_LOBES + LINES_FOR_POINTS * lines,
            };
            (BEFORE_LOBES, f64::from(lines_for_an_edge), instead)
        }
        Closed::AlongLines | Closed::Nowhere => return false,
    };
    let exact = before + edge * occlusion.edges * occlusion.candidates;
    !occlusion.dense && exact <= PATIENCE * (before + occlusion.partial * instead)
}

/// Returns whether rays towards a densely occluded light have less noise than lines in the same
/// time.
pub(crate) fn are_rays_better(facts: &MethodFacts<'_>, count: u32) -> bool {
    let by_cost = LINES_IF_DENSE.max(facts.occlusion.line_cost / RAYS_FOR_LINES);
    let lines = facts.occlusion.lines_ahead.unwrap_or(0.0).max(by_cost);
    facts.known.closed == Closed::Nowhere || f64::from(count) < lines
}

/// Returns whether the closed form of LTCs, with points for the rest, reaches a given error before
/// the other methods.
pub(crate) fn takes_cosines(between: &ShaftAnswer, lines: u32) -> bool {
    let points = f64::from(points_with_cosines(lines));
    triangles(between) <= TRIANGLES_WITH_COSINES * points
}

/// The number of triangles in between.
#[allow(clippy::cast_precision_loss, reason = "a few hundred")]
fn triangles(between: &ShaftAnswer) -> f64 {
    between.candidates as f64
}

/// The number of points that sample the rest after the closed form of LTCs.
pub(crate) fn points_with_cosines(lines: u32) -> u32 {
    POINTS_WITH_COSINES.max(lines.saturating_mul(POINTS))
}

/// The method for a light that emits an image. On a diffuse surface to which all of the light has
/// about the same distance and direction, all points are drawn in proportion to the image.
/// Otherwise the image draws half of the points; the other half is drawn by solid angle on a
/// diffuse surface, and by LTCs on any other. On a reflection that is
/// [unlike](linelit_bsdf::Known::is_unlike_cosines) its LTCs, image, LTCs and BSDF draw a third
/// each.
pub(crate) fn textured<'e>(facts: &MethodFacts<'_>) -> Method<'e> {
    const fn part(by: PointDensity) -> Part {
        Part {
            technique: Technique::Points(Points::by(PointBy::Surface(by))),
            share: 1,
        }
    }
    const DIFFUSE: [Part; 2] = [part(PointDensity::SolidAngle), part(PointDensity::Texture)];
    const GLOSSY: [Part; 2] = [part(PointDensity::Lobes), part(PointDensity::Texture)];
    let is_diffuse = facts.known.closed == Closed::Diffuse;
    if is_diffuse && facts.points == PointDensity::Area {
        return Method::points(PointDensity::Texture.into(), facts.samples, facts.ask);
    }
    let weighted = Weighted {
        parts: if is_diffuse { &DIFFUSE } else { &GLOSSY },
        with_bsdf: facts.known.are_unlike,
        integrals: None,
        lobes_alone: false,
        weights: Weights::Balance,
        samples: facts.samples,
    };
    Method::sampled(Rest::Weighted(weighted), facts.ask)
}

/// The power of two that is nearest by logarithm; 2³¹ at most, and 1 at least.
const fn nearest_power_of_two(n: u32) -> u32 {
    let below = 1_u32 << (n | 1).ilog2();
    let [square, limit] = [n as u64 * n as u64, 2 * below as u64 * below as u64];
    if square > limit && below < 1 << 31 {
        2 * below
    } else {
        below
    }
}

#[cfg(test)]
mod tests {
    use super::{is_exact_cheap, nearest_power_of_two};
    use crate::{Closed, KnownKind, LightKind, MethodFacts, OcclusionStats};

    /// Six triangles before one point of ten cost next to nothing on average. Before all points
    /// they cost more than a line, but less than sixteen lines or than points by lobes. Past dense
    /// shafts the cost is not known.
    #[test]
    fn closed_forms_are_cheap_where_few_points_need_them() {
        let seldom = OcclusionStats {
            candidates: 0.6,
            partial: 0.1,
            edges: 1.5,
            ..OcclusionStats::FEW
        };
        let always = OcclusionStats {
            candidates: 6.0,
            partial: 1.0,
            ..seldom
        };
        let dense = OcclusionStats {
            dense: true,
            ..seldom
        };
        let is_cheap = |closed, occlusion: &OcclusionStats, samples| {
            let known = KnownKind {
                closed,
                ..KnownKind::NOTHING
            };
            let facts = MethodFacts {
                occlusion,
                ..MethodFacts::new(LightKind::Polygon, known, samples)
            };
            is_exact_cheap(&facts, samples)
        };
        let phong = Closed::OverPolygons {
            lines_for_an_edge: 1,
        };
        let cases = [
            (Closed::Diffuse, seldom, [true, true]),
            (Closed::Diffuse, always, [false, true]),
            (Closed::Diffuse, dense, [false, false]),
            (phong, seldom, [true, true]),
            (phong, always, [true, true]),
            (Closed::Nowhere, seldom, [false, false]),
        ];
        for (closed, occlusion, expected) in cases {
            let cheap = [1, 16].map(|samples| is_cheap(closed, &occlusion, samples));
            assert_eq!(cheap, expected, "{closed:?} {occlusion:?}");
        }
    }

    #[test]
    fn nearest_powers_of_two() {
        let nearest = |n: u32| {
            f64::from(n.max(1))
                .log2()
                .round()
                .exp2()
                .min(f64::from(1 << 30) * 2.0)
        };
        for n in (0..3000).chain([1 << 30, 1_518_500_249, 1_518_500_250, 1 << 31, u32::MAX]) {
            let got = f64::from(nearest_power_of_two(n));
            assert!((got - nearest(n)).abs() < 0.5, "{n}: {got}");
        }
    }
}
