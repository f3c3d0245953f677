//! Pilot lines are sent to a light before the first estimate, to find the direction in which lines
//! have the least noise past its occluders, and what they cost.

use crate::integrand::Integrand;
use crate::known::lines::LineMemory;
use crate::noises::{ExpectedNoise, PILOTS, unevenness};
use crate::view::LightView;
use crate::{EmissionTexture, Query};
use linelit_bsdf::Reflection;
use linelit_elementary::atan2;
use linelit_geometry::{ConvexPolygon, DVec3, intervals::Interval};
use linelit_lights::{
    LightPoint, LineSample, LineSampler, LineTechnique as _, OffsetDensity, Surface,
};
use linelit_visibility::{Counters, Shaft};
use std::f64::consts::PI;

/// The number of points of a visible part, where the reflection has no closed form.
const POINTS: usize = 4;
/// The weight of each of these points.
const POINTS_SHARE: f64 = 1.0 / POINTS as f64;

/// The number of tests against boxes and triangles that take as long as collecting one triangle
/// against which points are then tested: measured.
const TESTS_FOR_A_CANDIDATE: u64 = 5;

/// The number of tests against boxes and triangles that take as long as finding one visible piece
/// of a line and integrating along it: measured, to a factor of two.
const TESTS_FOR_A_PIECE: u64 = 30;

/// Pilot lines of all shading points so far: how much the light changes from line to line in a few
/// directions, and what the lines cost.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PilotLines {
    /// The directions, in half turns from the light's first edge.
    directions: [f64; DIRECTIONS],
    /// How much the light changes, on surfaces with a closed form and on all others.
    deviations: [Deviations; 2],
    /// The cost of lines through dense shafts, in tests against boxes and triangles.
    tests: [u64; DIRECTIONS],
    /// The predicted noise of lines and rays past dense shafts, on surfaces with a closed form.
    noises: [ExpectedNoise; DIRECTIONS],
}

/// How much the light along visible parts changes from line to line, in each direction.
///
/// Slopes ([`LineControl::Slopes`](crate::LineControl::Slopes)) leave as noise the difference
/// between a line's light and the mean of its two neighbours. The root mean square of that
/// difference is the deviation of a shading point, up to a factor. Its square root is added up over
/// the points; without the root, a few points of many would dominate.
#[derive(Clone, Copy, Debug, Default)]
struct Deviations {
    /// The sum of the deviations in each direction.
    sums: [f64; DIRECTIONS],
    /// The number of deviations that are not zero.
    count: u64,
}

impl PilotLines {
    /// The number of pilot lines of a shading point in each direction.
    pub(crate) const LINES: f64 = PILOTS as f64;

    /// Sends pilot lines in each direction through the shaft of a query, and adds what they find.
    pub(crate) fn look<R: Reflection, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        view: &LightView<'_>,
        shaft: &mut Shaft<'_>,
        memory: &mut LineMemory,
    ) {
        let Some(light) = view.polygon() else {
            return;
        };
        // Use the closed form of the reflection if it has one, else a few points of each part.
        let (visible, pieces) = (&mut memory.visible, &mut memory.pieces);
        let is_dense = shaft.is_dense();
        let form = query.point.known().closed_form();
        let form = form.filter(|_| query.light.texture.is_none());
        let integrand = Integrand {
            light: query.light,
            point: query.point,
            known: None,
        };
        let deviations = &mut self.deviations[usize::from(form.is_none())];
        self.directions = directions(light);
        for (k, fraction) in self.directions.iter().enumerate() {
            // Find the visible parts of evenly spaced lines in this direction.
            let family = LineSampler::new(light, fraction * PI, OffsetDensity::Length);
            let lines: [LineSample; PILOTS] =
                std::array::from_fn(|i| family.sample(middle(i, PILOTS)));
            let before = tests_of_lines(shaft.counters());
            shaft.visible(&lines.map(|line| line.segment), visible);
            if is_dense {
                self.tests[k] += tests_of_lines(shaft.counters()) - before;
            }
            // Find the light that each line sends to the viewer.
            let value = |i: usize| {
                let (line, parts) = (&lines[i], visible.line(i));
                if !line.pdf.is_positive() {
                    return 0.0;
                }
                let sum = match &form {
                    Some(form) => {
                        pieces.clear();
                        pieces.add(&view.at, &line.segment, parts, 1.0);
                        let (emitted, height) = view.emitted();
                        pieces.light(emitted, height, &view.at, form)
                    }
                    None => by_points(&integrand, light, line, parts),
                };
                sum.element_sum() / line.pdf.value()
            };
            // An iterator fills the array: `from_fn` would not inline the closure, but call it for
            // each line.
            let mut values = [0.0; PILOTS];
            let of_lines = (0..PILOTS).map(value);
            of_lines.zip(&mut values).for_each(|(v, out)| *out = v);
            // Add how much the light changes from line to line, and the noise that this predicts.
            let deviation = unevenness(&values, 1).sqrt().sqrt();
            deviations.sums[k] += deviation;
            deviations.count += u64::from(deviation > 0.0);
            if is_dense && form.is_some() {
                self.noises[k].add(&values, |i| visible.line(i));
            }
        }
    }

    /// The direction with the least deviation; `None` if no shading point was seen, or the light
    /// does not change from line to line.
    pub(crate) fn direction(&self) -> Option<f64> {
        let best = self.best();
        (self.deviations()[best] > 0.0).then_some(self.directions[best])
    }

    /// The cost of the lines in the best direction through dense shafts, in tests against boxes and
    /// triangles.
    pub(crate) fn tests(&self) -> u64 {
        self.tests[self.best()]
    }

    /// The number of lines from which on lines past dense shafts have less noise than rays in the
    /// same time, where a line takes as long as `rays` rays; `None` if that is not known.
    pub(crate) fn lines_ahead_of_rays(&self, rays: f64) -> Option<f64> {
        self.noises[self.best()].lines_ahead_of_rays(rays)
    }

    /// The deviations for the kind of reflection that most shading points have. On narrow lobes, a
    /// few points of a line say little about its light.
    fn deviations(&self) -> &[f64; DIRECTIONS] {
        let [closed, others] = &self.deviations;
        match closed.count >= others.count {
            true => &closed.sums,
            false => &others.sums,
        }
    }

    /// The index of the best direction.
    fn best(&self) -> usize {
        let all = self.deviations().iter().enumerate();
        let least = all.min_by(|a, b| a.1.total_cmp(b.1));
        least.map_or(0, |(number, _)| number)
    }
}

/// The light that the visible parts of a line send to the viewer, estimated by a few points of each
/// part.
fn by_points<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    polygon: &ConvexPolygon,
    line: &LineSample,
    parts: &[Interval],
) -> DVec3 {
    let points = parts.iter().flat_map(|part| {
        (0..POINTS).map(|k| (part.lo + part.length() * middle(k, POINTS), part.length()))
    });
    let light = points.map(|(t, share)| {
        let (x, surface) = (integrand.point.position, Surface::Polygon(polygon));
        let at = LightPoint::new(line.segment.at(t), x, &surface);
        let cosine = at.cos_light.abs() / at.square;
        integrand.value(&at) * (cosine * share * line.segment.length() * POINTS_SHARE)
    });
    light.sum()
}

/// The number of directions that are compared.
const DIRECTIONS: usize = 4;

/// The directions to compare for a light, in half turns from its first edge. For a triangle these
/// are the directions of its edges; for a quadrilateral, of two edges and the diagonals; for any
/// other light, of the first edge and at even angles to it.
///
/// Lines along an edge of a parallelogram all have the same length, and occluders are often
/// parallel to one of its edges. Occluders that are aligned with the light have no edge parallel to
/// its diagonals.
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

/// The middle of part `i` of [0, 1] in `count` equal parts.
#[allow(clippy::cast_precision_loss, reason = "few parts")]
pub(crate) fn middle(i: usize, count: usize) -> f64 {
    (2 * i + 1) as f64 / (2 * count) as f64
}

/// The cost of lines in dense shafts, in tests against boxes and triangles.
fn tests_of_lines(counters: &Counters) -> u64 {
    tests(counters)
        + TESTS_FOR_A_CANDIDATE * counters.candidates
        + TESTS_FOR_A_PIECE * counters.intervals
}

/// The number of boxes and triangles that were tested.
pub(crate) fn tests(counters: &Counters) -> u64 {
    counters.node_tests + counters.triangle_tests
}
