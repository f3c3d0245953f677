//! Line samples: the visibility of a whole segment at once.

use crate::closed_form::Pieces;
use crate::{
    Buffers, EmissionTexture, LineDirection, Lines, PlanCounters, Query, SegmentCounters,
    ShadingPoint, Stream,
};
use linelit_bsdf::{ClosedForm, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample, LineSampler};
use linelit_visibility::{Shaft, VisibleLines};
use std::f64::consts::PI;

/// Which integral is taken along the visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Along {
    /// The closed form (Billen & Dutré 2016, section 5.3).
    Analytic(ClosedForm),
    /// One point, uniform in the visible length (Salesin & Jarosz 2019, eqs. 14–15).
    Point,
}

impl Along {
    /// The closed form where there is one; elsewhere a point.
    pub(crate) fn best<R: Reflection, T: EmissionTexture>(query: &Query<'_, R, T>) -> Self {
        let closed = query.light.closed_form(query.point);
        closed.map_or(Self::Point, Self::Analytic)
    }
}

/// The line samples of one query.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draws {
    /// The lines, those of positive density.
    pub lines: Vec<Segment>,
    /// Reciprocal densities of their offsets.
    pub weights: Vec<f64>,
    /// Random numbers that pick places along them, where the samples are two-dimensional.
    pub places: Vec<f64>,
    /// What is visible of them.
    pieces: Pieces,
}

impl Draws {
    fn push(&mut self, sample: &LineSample, place: f64) {
        if sample.pdf.is_positive() {
            self.lines.push(sample.segment);
            self.weights.push(1.0 / sample.pdf.value());
            self.places.push(place);
        }
    }

    /// Draws all line samples of the query.
    pub(crate) fn draw<R, T: EmissionTexture>(
        &mut self,
        query: &Query<'_, R, T>,
        area: &AreaLight,
        options: &Lines,
        along: Along,
    ) {
        self.lines.clear();
        self.weights.clear();
        self.places.clear();
        let numbers = query.numbers();
        let angles = query
            .numbers
            .independent(Stream::Orientation, query.samples);
        let common = match options.direction {
            LineDirection::Fixed(fraction) => Some(fraction * PI),
            LineDirection::Parallel | LineDirection::Spread(_) => Some(angles.get_1d(0) * PI),
            LineDirection::UniformPerLine => None,
        };
        let make = |angle: f64| LineSampler::new(&area.polygon, angle, options.offset);
        let shared = common.map(make);
        for i in 0..query.samples {
            let (u, place) = match along {
                Along::Point => numbers.get_2d(i).into(),
                Along::Analytic(_) => (numbers.get_1d(i), 0.0),
            };
            let sample = match &shared {
                Some(sampler) => sampler.sample(u),
                None => make(angles.get_1d(i) * PI).sample(u),
            };
            self.push(&sample, place);
        }
    }
}

/// What is visible of the lines of a query: the sum over them, and the counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Sum of value over density.
    pub sum: DVec3,
    /// Lines and their pieces.
    pub segments: SegmentCounters,
    /// Lines wholly hidden.
    pub hidden: u64,
}

/// Sums over the drawn lines of a light what their visible parts send; `visible` tells the parts of
/// a line.
pub(crate) fn gather<'v, R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    along: Along,
    draws: &mut Draws,
    visible: impl Fn(usize) -> &'v [Interval],
) -> Gathered {
    let mut out = Gathered::default();
    let point = query.point;
    let Draws {
        lines,
        weights,
        places,
        pieces,
    } = draws;
    pieces.clear();
    for (i, line) in lines.iter().enumerate() {
        let parts = visible(i);
        out.segments.lines += 1;
        out.segments.pieces += parts.len() as u64;
        if parts.is_empty() {
            out.hidden += 1;
            continue;
        }
        match along {
            Along::Analytic(_) => pieces.add(point, line, parts, weights[i]),
            Along::Point => {
                let emitted = |on_light, w| query.light.emitted(area, on_light, w);
                out.sum += one_point(area, emitted, point, line, parts, places[i]) * weights[i];
            }
        }
    }
    if let Along::Analytic(reflection) = &along {
        out.sum = pieces.light(area, point, reflection);
    }
    out
}

/// Where lines are kept and counted.
pub(crate) struct LineBuffers<'a> {
    pub draws: &'a mut Draws,
    pub visible: &'a mut VisibleLines,
    pub plan: &'a mut PlanCounters,
    pub segments: &'a mut SegmentCounters,
}

/// The mean over lines, all of them in one query to a shaft.
pub(crate) fn in_shaft<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    along: Along,
    shaft: &mut Shaft<'_>,
    buffers: LineBuffers<'_>,
) -> DVec3 {
    let LineBuffers {
        draws,
        visible,
        plan,
        segments,
    } = buffers;
    draws.draw(query, area, options, along);
    shaft.visible(&draws.lines, visible);
    let gathered = gather(query, area, along, draws, |i| visible.line(i));
    *segments += gathered.segments;
    plan.hidden_lines += gathered.hidden;
    gathered.sum / f64::from(query.samples)
}

/// The mean over lines, with the shaft asked for.
pub(crate) fn lines<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    options: &Lines,
    along: Along,
    buffers: &mut Buffers,
) -> DVec3 {
    let Buffers {
        scratch,
        visible,
        draws,
        plan,
        segments,
        ..
    } = buffers;
    let mut shaft = query.occluders.shaft(query.shaft(area), scratch);
    if query.skip
        && let Some(value) =
            crate::closed_form::without_samples(query, area, shaft.class(), along, plan)
    {
        return value;
    }
    let buffers = LineBuffers {
        draws,
        visible,
        plan,
        segments,
    };
    in_shaft(query, area, options, along, &mut shaft, buffers)
}

/// L f_r cos θ cos θ'/r² × visible length, at the point of the visible parts that `v` picks.
fn one_point<R: Reflection>(
    area: &AreaLight,
    emitted: impl Fn(DVec3, DVec3) -> DVec3,
    point: &ShadingPoint<R>,
    line: &Segment,
    parts: &[Interval],
    v: f64,
) -> DVec3 {
    let total: f64 = parts.iter().map(Interval::length).sum();
    let on_light = line.at(place(parts, v * total));
    let to_light = on_light - point.position;
    let square = to_light.length_squared();
    let w = to_light / square.sqrt();
    let cos_light = area.polygon.normal().dot(w).abs();
    let value = point.reflected(emitted(on_light, w), w);
    value * (cos_light / square * total * line.length())
}

/// The parameter that has `length` of the visible parts before it.
fn place(parts: &[Interval], mut length: f64) -> f64 {
    for part in parts {
        if length <= part.length() {
            return part.lo + length;
        }
        length -= part.length();
    }
    parts.last().map_or(0.0, |p| p.hi)
}
