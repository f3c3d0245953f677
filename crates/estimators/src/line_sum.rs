//! Line samples: the visibility of a whole segment at once.

use crate::closed_form::{Pieces, without_samples};
use crate::control::Offsets;
use crate::light::even_emission;
use crate::techniques::points::LightPoint;
use crate::{
    Buffers, EmissionTexture, LineControl, LineDirection, Lines, Query, SampleBuffers, Stream,
};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample, LineSampler, LineTechnique};
use linelit_visibility::Shaft;
use std::f64::consts::PI;

/// Which integral is taken along the visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Along<'p> {
    /// The closed form (Billen & Dutré 2016, section 5.3).
    Analytic(ClosedForm<'p>),
    /// A point, uniform in the visible length (Salesin & Jarosz 2019, eqs. 14–15).
    Point,
}

impl<'p> Along<'p> {
    /// The closed form where there is one; elsewhere a point.
    pub(crate) fn best<R: Reflection, T: EmissionTexture>(query: &Query<'p, R, T>) -> Self {
        let closed = query.light.closed_form(query.point);
        closed.map_or(Self::Point, Self::Analytic)
    }
}

/// The line samples of one query.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draws {
    /// The lines, those of positive density.
    samples: Vec<Draw>,
    offsets: Offsets,
    /// The same lines.
    pub lines: Vec<Segment>,
    /// What is visible of them.
    pub pieces: Pieces,
}

/// A line sample.
#[derive(Clone, Copy, Debug)]
struct Draw {
    line: LineSample,
    /// How much its integral counts, where that is known.
    share: f64,
    /// The random number that picks a point of it elsewhere.
    v: f64,
}

impl Draws {
    /// Draws all line samples of the query. Gives what draws points on any of them.
    pub(crate) fn draw<R, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        options: &Lines,
        along: Along<'_>,
    ) -> LineSampler {
        let family = |fraction: f64| LineSampler::new(&area.polygon, fraction * PI, options.offset);
        let each = options.direction == LineDirection::UniformPerLine;
        let independent = || (query.numbers).independent(Stream::Orientation, query.samples);
        let angles = each.then(independent);
        let lines = family(match &angles {
            Some(angles) => angles.get_1d(0),
            None => options.only_fraction(query),
        });
        let line = |i: u32, u: f64| match &angles {
            Some(angles) if i > 0 => family(angles.get_1d(i)).sample(u),
            _ => lines.sample(u),
        };
        match along {
            Along::Point => {
                self.clear();
                let numbers = query.numbers();
                for i in 0..query.samples {
                    let [u, v] = numbers.get_2d(i);
                    self.push(line(i, u), 1.0, v);
                }
            }
            Along::Analytic(_) => {
                let control = if each {
                    LineControl::None
                } else {
                    options.control
                };
                self.draw_integrated(query, control, line);
            }
        }
        lines
    }

    /// Draws lines whose integrals are known, which need no second number for a point.
    pub(crate) fn draw_integrated<R, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        control: LineControl,
        line: impl Fn(u32, f64) -> LineSample,
    ) {
        self.clear();
        let mut offsets = std::mem::take(&mut self.offsets);
        offsets.set(&query.numbers(), control);
        for (i, (u, share)) in (0..).zip(offsets.iter()) {
            self.push(line(i, u), share, 0.0);
        }
        self.offsets = offsets;
    }

    fn clear(&mut self) {
        self.lines.clear();
        self.samples.clear();
    }

    /// Keeps a line if it can be drawn.
    fn push(&mut self, line: LineSample, share: f64, v: f64) {
        if line.pdf.is_positive() {
            self.lines.push(line.segment);
            self.samples.push(Draw { line, share, v });
        }
    }

    /// The lines, each with what its integral is to be multiplied with, and room for their pieces.
    pub(crate) fn weighted(&mut self) -> (impl Iterator<Item = (&LineSample, f64)>, &mut Pieces) {
        self.pieces.clear();
        let samples = self.samples.iter();
        let weighted = samples.map(|draw| (&draw.line, draw.share / draw.line.pdf.value()));
        (weighted, &mut self.pieces)
    }
}

/// Sums over the lines that `family` and its like drew on a light what their visible parts send;
/// `visible` tells the parts of a line.
pub(crate) fn gather<'v, R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    along: Along<'_>,
    family: &LineSampler,
    draws: &mut Draws,
    visible: impl Fn(usize) -> &'v [Interval],
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    let point = query.point;
    draws.pieces.clear();
    for (i, Draw { line, share, v }) in draws.samples.iter().enumerate() {
        let parts = visible(i);
        if parts.is_empty() {
            continue;
        }
        match along {
            Along::Analytic(_) => {
                let weight = share / line.pdf.value();
                draws.pieces.add(point, &line.segment, parts, weight);
            }
            Along::Point => {
                let on_light = family.point(line, parts, *v).point;
                let at = LightPoint::new(on_light, point.position, &area.polygon);
                let visible: f64 = parts.iter().map(Interval::length).sum();
                let integral = at.cos_light.abs() / at.square * visible * line.segment.length();
                sum += query.unshadowed(&at) * integral * (1.0 / line.pdf.value());
            }
        }
    }
    if let Along::Analytic(reflection) = &along {
        let (emitted, height) = even_emission(area, point.position);
        sum = draws.pieces.light(emitted, height, point, reflection);
    }
    sum
}

/// The mean over lines, all of them in one query to a shaft.
pub(crate) fn in_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    along: Along<'_>,
    shaft: &mut Shaft<'_>,
    buffers: &mut SampleBuffers,
) -> DVec3 {
    let SampleBuffers { draws, visible, .. } = &mut *buffers;
    let family = draws.draw(query, area, options, along);
    shaft.visible(&draws.lines, visible);
    let sum = gather(query, area, along, &family, draws, |i| visible.line(i));
    buffers.count_lines();
    sum / f64::from(query.samples)
}

/// The mean over lines, with the shaft asked for.
pub(crate) fn lines<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    along: Along<'_>,
    buffers: &mut Buffers,
) -> DVec3 {
    let Buffers { scratch, samples } = buffers;
    let mut shaft = query.occluders.shaft(query.shaft(&area.polygon), scratch);
    if query.skip
        && let Some(value) = without_samples(query, area, shaft.class(), along, &mut samples.plan)
    {
        return value;
    }
    in_shaft(query, area, options, along, &mut shaft, samples)
}
