//! Line samples: the visibility of a whole segment at once.

use crate::closed_form::Pieces;
use crate::pair::Pair;
use crate::{LineOptions, PlanCounters, PlannedLight, SegmentCounters, ShadingPoint};
use linelit_bsdf::ClosedForm;
use linelit_geometry::{DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample, LineSampler, Orientation};
use linelit_samplers::{SampleSet, Sampler, SamplerKind};
use linelit_visibility::{Shaft, VisibleLines};
use std::f64::consts::PI;

/// Where the random numbers of one (shading point, light) pair come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Streams<'a> {
    /// Offsets, or offsets and places along the lines.
    pub samples: &'a SampleSet,
    /// Whether the set is two-dimensional.
    pub two_dimensional: bool,
    /// Independent numbers, for orientations.
    pub orientations: &'a Sampler,
    /// The pixel and the first dimension of the pair.
    pub key: ([u32; 2], u32),
    /// Number of samples.
    pub count: u32,
}

/// Which integral is taken along the visible parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Along {
    /// The closed form (Billen & Dutré 2016, section 5.3).
    Analytic(ClosedForm),
    /// One point, uniform in the visible length (Salesin & Jarosz 2019, eqs. 14–15).
    Point,
}

/// The line samples of one (shading point, light) pair.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draws {
    /// The lines.
    pub lines: Vec<Segment>,
    /// Reciprocal densities of their offsets.
    pub weights: Vec<f64>,
    /// Places along them, where the samples are two-dimensional.
    pub places: Vec<f64>,
    /// What is visible of them.
    pieces: Pieces,
}

impl Draws {
    fn clear(&mut self) {
        self.lines.clear();
        self.weights.clear();
        self.places.clear();
    }

    fn push(&mut self, sample: &LineSample, place: f64) {
        if sample.pdf.is_positive() {
            self.lines.push(sample.segment);
            self.weights.push(1.0 / sample.pdf.value());
            self.places.push(place);
        }
    }

    /// Draws all line samples of the pair.
    pub(crate) fn draw(&mut self, light: &AreaLight, options: LineOptions, streams: &Streams<'_>) {
        self.clear();
        let (pixel, dimension) = streams.key;
        let angles = streams
            .orientations
            .points(pixel, dimension + 1, streams.count);
        let common = match options.orientation {
            Orientation::Fixed(fraction) => Some(fraction * PI),
            Orientation::ParallelPerPoint => Some(angles.get_1d(0) * PI),
            Orientation::UniformPerLine => None,
        };
        let make = |angle: f64| LineSampler::new(&light.polygon, angle, options.offset);
        let shared = common.map(make);
        for i in 0..streams.count {
            let (u, place) = streams.get(i);
            let sample = match &shared {
                Some(sampler) => sampler.sample(u),
                None => make(angles.get_1d(i) * PI).sample(u),
            };
            self.push(&sample, place);
        }
    }
}

impl Streams<'_> {
    fn get(&self, i: u32) -> (f64, f64) {
        if self.two_dimensional {
            let [u, v] = self.samples.get_2d(i);
            (u, v)
        } else {
            (self.samples.get_1d(i), 0.0)
        }
    }
}

/// What was seen of the lines of a pair: the sum over them, and the counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Sum of value over density.
    pub sum: DVec3,
    /// Lines and their pieces.
    pub segments: SegmentCounters,
    /// Lines wholly hidden.
    pub hidden: u64,
}

/// Sums over the drawn lines of a light what their visible parts send; `visible` tells the parts of a line.
pub(crate) fn gather<'v>(
    (planned, light): (&PlannedLight, &AreaLight),
    point: &ShadingPoint,
    along: Along,
    draws: &mut Draws,
    visible: impl Fn(usize) -> &'v [Interval],
) -> Gathered {
    let mut out = Gathered::default();
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
                let value = one_point((planned, light), point, line, parts, places[i]);
                out.sum += value * weights[i];
            }
        }
    }
    if let Along::Analytic(reflection) = &along {
        out.sum = pieces.light(light, point, reflection);
    }
    out
}

/// What lines of a pair are kept in, and where they are counted.
pub(crate) struct LineBuffers<'a> {
    pub draws: &'a mut Draws,
    pub visible: &'a mut VisibleLines,
    pub plan: &'a mut PlanCounters,
    pub segments: &'a mut SegmentCounters,
}

impl Pair<'_> {
    /// The mean over lines, all of them in one query to a shaft.
    pub(crate) fn lines_in_shaft(
        &self,
        area: &AreaLight,
        (options, along): (LineOptions, Along),
        shaft: &mut Shaft<'_>,
        buffers: LineBuffers<'_>,
    ) -> DVec3 {
        let LineBuffers {
            draws,
            visible,
            plan,
            segments,
        } = buffers;
        let streams = Streams {
            samples: &self.samples(),
            two_dimensional: along == Along::Point,
            orientations: &Sampler::new(SamplerKind::Independent, self.settings.seed),
            key: (self.pixel, self.dimension),
            count: self.count(),
        };
        draws.draw(area, options, &streams);
        shaft.visible(&draws.lines, visible);
        let light = (self.light, area);
        let gathered = gather(light, self.point, along, draws, |i| visible.line(i));
        *segments += gathered.segments;
        plan.hidden_lines += gathered.hidden;
        gathered.sum / f64::from(self.count())
    }
}

/// L f_r cos θ cos θ'/r² × visible length, at the point of the visible part that `v` picks.
fn one_point(
    (planned, light): (&PlannedLight, &AreaLight),
    point: &ShadingPoint,
    line: &Segment,
    parts: &[Interval],
    v: f64,
) -> DVec3 {
    let total: f64 = parts.iter().map(Interval::length).sum();
    let on_light = line.at(place(parts, v * total));
    let to_light = on_light - point.position;
    let square = to_light.length_squared();
    let w = to_light / square.sqrt();
    let cos_light = light.polygon.normal().dot(w).abs();
    let value = planned.unshadowed(light, point, on_light, w);
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
