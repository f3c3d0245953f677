//! Line samples are drawn on a light here, before their visible parts are queried.

use crate::streams::Samples;
use crate::{LineBy, LineControl, LineDirection, Lines, OcclusionStats, RandomNumbers, Stream};
use linelit_geometry::{ConvexPolygon, Segment};
use linelit_lights::{AreaSampler, LineSample, LineSampler, LineTechnique, Pdf};
use linelit_lights::{PointTechnique, Width};
use linelit_samplers::{Slopes, stratum};
use std::f64::consts::PI;

/// The line samples of one estimate.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draws {
    pub samples: Vec<Draw>,
    slopes: Slopes,
    /// How the width of a line's strip varies along the line.
    pub width: Width,
    /// The same lines as segments.
    pub segments: Vec<Segment>,
}

/// A line sample with positive density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    pub line: LineSample,
    /// The factor by which its integral counts, where integrals are known: 1, or what the control
    /// variate makes of it.
    pub share: f64,
    /// The random number that chooses a point of the line, where a point is sampled.
    pub v: f64,
}

/// What is done with the visible parts of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// The light is integrated along them in closed form.
    Integrals,
    /// A point of them is sampled.
    Points,
}

/// The line from a corner of a polygon to its border. The density is the density across the line at
/// its end on the border.
fn from_corner(fan: &AreaSampler<'_>, u: f64) -> LineSample {
    let segment = fan.line(u);
    let per_area = fan.pdf(segment.p1).value();
    LineSample {
        segment,
        offset: u,
        pdf: Pdf::new(0.5 * segment.length() * per_area),
    }
}

impl Draws {
    /// Draws lines on a polygon, with a density that is uniform in the area.
    pub(crate) fn draw(
        &mut self,
        polygon: &ConvexPolygon,
        options: &Lines,
        occlusion: &OcclusionStats,
        from: Samples<'_>,
        then: Use,
    ) {
        let parallel = |fraction| LineSampler::new(polygon, fraction * PI, options.offset);
        let Samples { numbers, count } = from;
        self.width = Width::Even;
        match options.direction {
            // Lines from a corner are wedges, whose width grows from zero at the corner.
            LineDirection::Origin => {
                self.width = Width::Growing;
                let corner = stratum(only_number(numbers), polygon.vertices().len());
                let polygon = polygon.starting_at(corner);
                let fan = AreaSampler::by_fan(&polygon);
                self.draw_each(from, then, options.control, |_, u| from_corner(&fan, u));
            }
            LineDirection::Stratified => {
                // Direction and offset are the two dimensions of one pattern.
                let places = numbers.points(Stream::Orientation, count);
                let set = from.set();
                self.clear();
                for i in 0..count {
                    let [fraction, u] = set.get_2d(i);
                    self.push(parallel(fraction).sample(u), 1.0, places.get_1d(i));
                }
            }
            LineDirection::UniformPerLine => {
                // Each line has a direction of its own, so that slopes between lines have no
                // meaning.
                let fractions = numbers.independent(Stream::Orientation, count);
                let line = |i, u| parallel(fractions.get_1d(i)).sample(u);
                self.draw_each(from, then, LineControl::None, line);
            }
            LineDirection::Adaptive
            | LineDirection::Fixed(_)
            | LineDirection::Parallel
            | LineDirection::Spread(_) => {
                // All lines are parallel.
                let lines = parallel(options.fraction(occlusion, only_number(numbers)));
                self.draw_each(from, then, options.control, |_, u| lines.sample(u));
            }
        }
    }

    /// Draws each line by one random number, and by a second one for its point if points are
    /// sampled.
    pub(crate) fn draw_each(
        &mut self,
        from: Samples<'_>,
        then: Use,
        control: LineControl,
        line: impl Fn(u32, f64) -> LineSample,
    ) {
        self.clear();
        let set = from.set();
        if then == Use::Points {
            for i in 0..from.count {
                let [u, v] = set.get_2d(i);
                self.push(line(i, u), 1.0, v);
            }
            return;
        }
        let mut slopes = std::mem::take(&mut self.slopes);
        slopes.set(&set, control == LineControl::Slopes);
        for (i, (u, share)) in (0..).zip(slopes.iter()) {
            self.push(line(i, u), share, 0.0);
        }
        self.slopes = slopes;
    }

    /// Removes the lines of the estimate before this one.
    fn clear(&mut self) {
        self.segments.clear();
        self.samples.clear();
    }

    /// Adds a line if its density is positive.
    fn push(&mut self, line: LineSample, share: f64, v: f64) {
        if line.pdf.is_positive() {
            self.segments.push(line.segment);
            self.samples.push(Draw { line, share, v });
        }
    }
}

impl Lines {
    /// The direction of parallel lines, in half turns from the light's first edge: the given one,
    /// or the best one if it is known, or else by the random number `u` in [0, 1).
    pub(crate) fn fraction(&self, occlusion: &OcclusionStats, u: f64) -> f64 {
        match self.direction {
            LineDirection::Fixed(fraction) => fraction,
            // The direction of lines by texture chooses between the two axes of the texture.
            LineDirection::Adaptive if self.measure() != LineBy::Texture => {
                occlusion.direction.unwrap_or(u)
            }
            LineDirection::Adaptive
            | LineDirection::Parallel
            | LineDirection::Spread(_)
            | LineDirection::UniformPerLine
            | LineDirection::Stratified
            | LineDirection::Origin => u,
        }
    }
}

/// The random number for the direction of all lines of an estimate.
fn only_number(numbers: &RandomNumbers) -> f64 {
    numbers.in_common(Stream::Orientation, 1).get_1d(0)
}
