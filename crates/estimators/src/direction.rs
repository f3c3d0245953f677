//! Which direction suits the lines of a light: the one across which what is visible changes least,
//! or most evenly.

use crate::closed_form::Pieces;
use crate::light::even_emission;
use crate::line_sum::Along;
use crate::occlusion::middle;
use crate::techniques::points::LightPoint;
use crate::{EmissionTexture, LineBy, LineDirection, Lines, Query, SampleBuffers, Stream};
use linelit_bsdf::Reflection;
use linelit_elementary::atan2;
use linelit_geometry::{ConvexPolygon, intervals::Interval};
use linelit_lights::{AreaLight, LineSample, LineSampler, LineTechnique as _, OffsetDensity};
use linelit_visibility::Shaft;
use std::f64::consts::PI;

/// Directions that are compared.
const DIRECTIONS: usize = 4;

/// Pilot lines of a direction.
const PILOTS: usize = 32;

/// Points of a visible part where nothing is known of the reflection.
const POINTS: usize = 4;
/// What each counts for.
const POINTS_SHARE: f64 = 0.25;

/// How unevenly the light along the visible part changes from line to line, in a few directions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Changes {
    /// The directions, in half turns from the light's first edge.
    directions: [f64; DIRECTIONS],
    /// Sums over shading points of the root of how far what lines send to the viewer is from the
    /// mean of the lines beside, which slopes
    /// ([`LineControl::Slopes`](crate::LineControl::Slopes)) leave as noise, in root mean square up
    /// to a factor: without the root, a few points of many would decide.
    deviations: [f64; DIRECTIONS],
}

impl Changes {
    /// Pilot lines for a shading point.
    #[allow(clippy::cast_precision_loss, reason = "few")]
    pub(crate) const LINES: f64 = (DIRECTIONS * PILOTS) as f64;

    /// Sends pilot lines of all directions through the shaft of a query.
    pub(crate) fn look<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        shaft: &mut Shaft<'_>,
        samples: &mut SampleBuffers,
    ) {
        let (along, light) = (Along::best(query), &area.polygon);
        let SampleBuffers { visible, draws, .. } = samples;
        self.directions = directions(light);
        for (fraction, deviation) in self.directions.iter().zip(&mut self.deviations) {
            let family = LineSampler::new(light, fraction * PI, OffsetDensity::Length);
            let lines: [LineSample; PILOTS] =
                std::array::from_fn(|i| family.sample(middle(i, PILOTS)));
            shaft.visible(&lines.map(|line| line.segment), visible);
            let value = |i: usize| {
                let (line, parts) = (&lines[i], visible.line(i));
                match line.pdf.is_positive() {
                    true => light_along(query, area, along, line, parts, &mut draws.pieces),
                    false => 0.0,
                }
            };
            let mut values = [0.0; PILOTS];
            (0..PILOTS)
                .map(value)
                .zip(&mut values)
                .for_each(|(v, out)| *out = v);
            let second = |v: &[f64]| (v[1] - 0.5 * (v[0] + v[2])).powi(2);
            let variance: f64 = values.windows(3).map(second).sum();
            *deviation += variance.sqrt().sqrt();
        }
    }

    /// The direction of the least deviation; `None` where there is none at all, or nothing was
    /// looked at.
    pub(crate) fn least(&self) -> Option<f64> {
        let all = self.deviations.iter().zip(self.directions);
        let least = all.min_by(|a, b| a.0.total_cmp(b.0))?;
        (*least.0 > 0.0).then_some(least.1)
    }
}

/// What the visible parts of a line send to the viewer, over the density of the line: in closed
/// form, or by a few points of each.
fn light_along<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    along: Along<'_>,
    line: &LineSample,
    parts: &[Interval],
    pieces: &mut Pieces,
) -> f64 {
    let (point, segment) = (query.point, &line.segment);
    let sum = match along {
        Along::Analytic(reflection) => {
            pieces.clear();
            pieces.add(point, segment, parts, 1.0);
            pieces.light(even_emission(area, point.position), point, &reflection)
        }
        Along::Point => {
            let points = parts.iter().flat_map(|part| {
                (0..POINTS).map(|k| (part.lo + part.length() * middle(k, POINTS), part.length()))
            });
            let light = points.map(|(t, share)| {
                let at = LightPoint::new(segment.at(t), point.position, &area.polygon);
                let cosine = at.cos_light.abs() / at.square;
                query.unshadowed(&at) * (cosine * share * segment.length() * POINTS_SHARE)
            });
            light.sum()
        }
    };
    sum.element_sum() / line.pdf.value()
}

/// Directions to compare, in half turns from the first edge of a light: of a triangle those of its
/// edges, of a quadrilateral those of two edges and the diagonals, of any other light that of the
/// first edge and those at even angles to it.
///
/// Lines along an edge of a parallelogram all have one length, and what stands between is often
/// parallel to one of both; no edge of occluders that are aligned with the light is parallel to its
/// diagonals.
fn directions(light: &ConvexPolygon) -> [f64; DIRECTIONS] {
    let v = light.vertices();
    let axes = light.plane_frame().axes;
    let along = |from: usize, to: usize| {
        let way = v[to] - v[from];
        (atan2(axes.y.dot(way), axes.x.dot(way)) / PI).rem_euclid(1.0)
    };
    match v.len() {
        3 => [0.0, along(1, 2), along(2, 0), 0.0],
        4 => [0.0, along(1, 2), along(0, 2), along(1, 3)],
        _ => [0.0, 0.5, 0.25, 0.75],
    }
}

impl Lines {
    /// The direction of a family of lines in half turns from the light's first edge: by a random
    /// number in [0, 1), unless it is said or known which suits the light.
    pub(crate) fn fraction<R, T: EmissionTexture>(&self, query: &Query<'_, R, T>, u: f64) -> f64 {
        match self.direction {
            LineDirection::Fixed(fraction) => fraction,
            // Lines by texture run along its axes, in turn.
            LineDirection::Adaptive if self.measure() != LineBy::Texture => {
                query.light.occlusion.direction.unwrap_or(u)
            }
            LineDirection::Adaptive
            | LineDirection::Parallel
            | LineDirection::Spread(_)
            | LineDirection::UniformPerLine => u,
        }
    }

    /// [`Lines::fraction`] of the only lines of a query.
    pub(crate) fn only_fraction<R, T: EmissionTexture>(&self, query: &Query<'_, R, T>) -> f64 {
        let u = query.numbers.independent(Stream::Orientation, 1).get_1d(0);
        self.fraction(query, u)
    }
}
