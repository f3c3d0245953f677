//! Line samples: lines on a light, drawn before their visible parts are asked for.

use crate::streams::Samples;
use crate::{LineBy, LineControl, LineDirection, Lines, OcclusionStats, RandomNumbers, Stream};
use linelit_geometry::{ConvexPolygon, Segment};
use linelit_lights::{AreaSampler, LineSample, LineSampler, LineTechnique, Pdf};
use linelit_lights::{PointTechnique, Width};
use linelit_samplers::{Slopes, stratum};
use std::f64::consts::PI;

/// Line samples of one estimate.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draws {
    pub samples: Vec<Draw>,
    slopes: Slopes,
    /// Widths of their strips along them.
    pub width: Width,
    /// The lines as segments.
    pub segments: Vec<Segment>,
}

/// A line sample of positive density.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    pub line: LineSample,
    /// The share with which its integral counts, where that is known.
    pub share: f64,
    /// The random number that picks a point of it elsewhere.
    pub v: f64,
}

/// The use that is made of lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// Integrals along the lines are known in closed form.
    Integrals,
    /// A point of each is drawn.
    Points,
}

/// A line from a corner of a polygon; the density is that across its end on the border.
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
    /// Draws lines on a polygon by area.
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
            LineDirection::Origin => {
                self.width = Width::Growing;
                let corner = stratum(only_number(numbers), polygon.vertices().len());
                let polygon = polygon.starting_at(corner);
                let fan = AreaSampler::by_fan(&polygon);
                self.draw_each(from, then, options.control, |_, u| from_corner(&fan, u));
            }
            LineDirection::Stratified => {
                let places = numbers.points(Stream::Orientation, count);
                let set = from.set();
                self.clear();
                for i in 0..count {
                    let [fraction, u] = set.get_2d(i);
                    self.push(parallel(fraction).sample(u), 1.0, places.get_1d(i));
                }
            }
            LineDirection::UniformPerLine => {
                let fractions = numbers.independent(Stream::Orientation, count);
                let line = |i, u| parallel(fractions.get_1d(i)).sample(u);
                self.draw_each(from, then, LineControl::None, line);
            }
            LineDirection::Adaptive
            | LineDirection::Fixed(_)
            | LineDirection::Parallel
            | LineDirection::Spread(_) => {
                let lines = parallel(options.fraction(occlusion, only_number(numbers)));
                self.draw_each(from, then, options.control, |_, u| lines.sample(u));
            }
        }
    }

    /// Draws lines by one random number each, and by a second one for a point where one is wanted.
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

    fn clear(&mut self) {
        self.segments.clear();
        self.samples.clear();
    }

    /// Keeps a line if it can be drawn.
    fn push(&mut self, line: LineSample, share: f64, v: f64) {
        if line.pdf.is_positive() {
            self.segments.push(line.segment);
            self.samples.push(Draw { line, share, v });
        }
    }
}

impl Lines {
    /// The direction of a family of lines in half turns from the light's first edge: by a random
    /// number in [0, 1), unless it is said or known which suits the light.
    pub(crate) fn fraction(&self, occlusion: &OcclusionStats, u: f64) -> f64 {
        match self.direction {
            LineDirection::Fixed(fraction) => fraction,
            // Lines by texture run along its axes, in turn.
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

/// The random number that directs the only lines of an estimate.
fn only_number(numbers: &RandomNumbers) -> f64 {
    numbers.in_common(Stream::Orientation, 1).get_1d(0)
}
