//! Pilot lines, which tell beforehand how a light is best looked at past what stands before it.

use crate::closed_form::Pieces;
use crate::direction::{DIRECTIONS, directions};
use crate::light::even_emission;
use crate::line_sum::Along;
use crate::occlusion::{middle, tests_of_lines};
use crate::techniques::points::LightPoint;
use crate::{EmissionTexture, Query, SampleBuffers};
use linelit_bsdf::Reflection;
use linelit_geometry::intervals::Interval;
use linelit_lights::{AreaLight, LineSample, LineSampler, LineTechnique as _, OffsetDensity};
use linelit_visibility::Shaft;
use std::f64::consts::PI;

/// Lines of a shading point in each direction, in the middles of as many strata.
const PILOTS: usize = 32;
/// Points of a visible part where nothing is known of the reflection.
const POINTS: usize = 4;
/// What each counts for.
const POINTS_SHARE: f64 = 1.0 / POINTS as f64;

/// How evenly the light along the visible part changes from line to line, in a few directions, and
/// how long that takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PilotLines {
    /// The directions, in half turns from the light's first edge.
    directions: [f64; DIRECTIONS],
    /// Of surfaces with a closed form, and of others.
    deviations: [Deviations; 2],
    /// What lines past dense shafts take, in tests of boxes and triangles.
    tests: [u64; DIRECTIONS],
}

/// Sums over shading points of the root of how far what lines send to the viewer is from the mean
/// of the lines beside, which slopes ([`LineControl::Slopes`](crate::LineControl::Slopes)) leave as
/// noise, in root mean square up to a factor: without the root, a few points of many would decide.
#[derive(Clone, Copy, Debug, Default)]
struct Deviations {
    /// In each direction.
    sums: [f64; DIRECTIONS],
    /// How many are not zero.
    count: u64,
}

impl PilotLines {
    /// Of a shading point in each direction.
    pub(crate) const LINES: f64 = PILOTS as f64;

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
        let is_dense = shaft.is_dense();
        let has_closed_form = matches!(along, Along::Analytic(_));
        let deviations = &mut self.deviations[usize::from(!has_closed_form)];
        self.directions = directions(light);
        for (k, fraction) in self.directions.iter().enumerate() {
            let family = LineSampler::new(light, fraction * PI, OffsetDensity::Length);
            let lines: [LineSample; PILOTS] =
                std::array::from_fn(|i| family.sample(middle(i, PILOTS)));
            let before = tests_of_lines(shaft.counters());
            shaft.visible(&lines.map(|line| line.segment), visible);
            if is_dense {
                self.tests[k] += tests_of_lines(shaft.counters()) - before;
            }
            let value = |i: usize| {
                let (line, parts) = (&lines[i], visible.line(i));
                match line.pdf.is_positive() {
                    true => light_along(query, area, along, line, parts, &mut draws.pieces),
                    false => 0.0,
                }
            };
            // Not by `from_fn`, which would be called for each.
            let mut values = [0.0; PILOTS];
            let of_lines = (0..PILOTS).map(value);
            of_lines.zip(&mut values).for_each(|(v, out)| *out = v);
            let deviation = unevenness(&values).sqrt().sqrt();
            deviations.sums[k] += deviation;
            deviations.count += u64::from(deviation > 0.0);
        }
    }

    /// The direction of the least deviation; `None` where there is none at all, or nothing was
    /// looked at.
    pub(crate) fn direction(&self) -> Option<f64> {
        let best = self.best();
        (self.deviations()[best] > 0.0).then_some(self.directions[best])
    }

    /// What its lines past dense shafts take, in tests of boxes and triangles.
    pub(crate) fn tests(&self) -> u64 {
        self.tests[self.best()]
    }

    /// Those of most shading points: of a narrow lobe, a few points of a line tell little.
    fn deviations(&self) -> &[f64; DIRECTIONS] {
        let [closed, others] = &self.deviations;
        match closed.count >= others.count {
            true => &closed.sums,
            false => &others.sums,
        }
    }

    /// The number of the best direction.
    fn best(&self) -> usize {
        let all = self.deviations().iter().enumerate();
        let least = all.min_by(|a, b| a.1.total_cmp(b.1));
        least.map_or(0, |(number, _)| number)
    }
}

/// The sum of the squares of how far values are from the mean of the two beside them.
fn unevenness(values: &[f64; PILOTS]) -> f64 {
    let second = |v: &[f64]| (v[1] - 0.5 * (v[0] + v[2])).powi(2);
    values.windows(3).map(second).sum()
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
            let (emitted, height) = even_emission(area, point.position);
            pieces.light(emitted, height, point, &reflection)
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
