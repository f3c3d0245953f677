//! Line samples: the visibility of a whole segment at once.

use crate::closed_form::{Pieces, without_samples};
use crate::control::{Offsets, stratum};
use crate::direction::only_number;
use crate::light::even_emission;
use crate::techniques::points::LightPoint;
use crate::{
    Buffers, EmissionTexture, LineControl, LineDirection, Lines, Query, SampleBuffers, Stream,
};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, AreaSampler, LineSample, LineSampler, LineTechnique, Pdf};
use linelit_lights::{PointTechnique, Width};
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
    /// Widths of their strips along them.
    width: Width,
    /// The same lines.
    pub lines: Vec<Segment>,
    /// What is visible of them.
    pub pieces: Pieces,
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
    /// Draws all line samples of the query.
    pub(crate) fn draw<R, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        options: &Lines,
        along: Along<'_>,
    ) {
        let parallel = |fraction| LineSampler::new(&area.polygon, fraction * PI, options.offset);
        let (numbers, samples) = (&query.numbers, query.samples);
        self.width = Width::Even;
        match options.direction {
            LineDirection::Origin => {
                self.width = Width::Growing;
                let corner = stratum(only_number(query), area.polygon.vertices().len());
                let polygon = area.polygon.starting_at(corner);
                let fan = AreaSampler::by_fan(&polygon);
                self.draw_each(query, along, options.control, |_, u| from_corner(&fan, u));
            }
            LineDirection::Stratified => {
                let places = numbers.points(Stream::Orientation, samples);
                let set = query.numbers();
                self.clear();
                for i in 0..samples {
                    let [fraction, u] = set.get_2d(i);
                    self.push(parallel(fraction).sample(u), 1.0, places.get_1d(i));
                }
            }
            LineDirection::UniformPerLine => {
                let fractions = numbers.independent(Stream::Orientation, samples);
                let line = |i, u| parallel(fractions.get_1d(i)).sample(u);
                self.draw_each(query, along, LineControl::None, line);
            }
            LineDirection::Adaptive
            | LineDirection::Fixed(_)
            | LineDirection::Parallel
            | LineDirection::Spread(_) => {
                let lines = parallel(options.only_fraction(query));
                self.draw_each(query, along, options.control, |_, u| lines.sample(u));
            }
        }
    }

    /// Draws lines by one random number each, and by a second one for a point where one is wanted.
    fn draw_each<R, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        along: Along<'_>,
        control: LineControl,
        line: impl Fn(u32, f64) -> LineSample,
    ) {
        match along {
            Along::Point => {
                self.clear();
                let numbers = query.numbers();
                for i in 0..query.samples {
                    let [u, v] = numbers.get_2d(i);
                    self.push(line(i, u), 1.0, v);
                }
            }
            Along::Analytic(_) => self.draw_integrated(query, control, line),
        }
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

/// Sums over the lines that were drawn on a light what their visible parts send; `visible` tells
/// the parts of a line.
pub(crate) fn gather<'v, R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    along: Along<'_>,
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
                let first = draws.pieces.len();
                draws.pieces.add(point, &line.segment, parts, weight);
                if draws.width == Width::Growing {
                    draws.pieces.taper(first, point, &line.segment);
                }
            }
            Along::Point => {
                let (t, visible) = draws.width.place(parts, *v);
                let at = LightPoint::new(line.segment.at(t), point.position, &area.polygon);
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
    draws.draw(query, area, options, along);
    shaft.visible(&draws.lines, visible);
    let sum = gather(query, area, along, draws, |i| visible.line(i));
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
