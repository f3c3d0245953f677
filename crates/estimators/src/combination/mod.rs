//! Points and lines in one estimator (Salesin & Jarosz 2019, sections 3 and 4).
//!
//! A line sample becomes a point sample once a point of its visible part is drawn: its density is
//! the joint one of eqs. 14 and 19, which knows the visibility. Any number of such techniques,
//! lines of different directions, points and BSDF samples, then combine by multiple importance
//! sampling.

mod optimal;
mod prepared;
mod visibility;

use crate::line_sum::{self, Along};
use crate::point_sum::meets;
use crate::strategy::{self, POINTS_FOR_A_LINE_IF_DENSE};
use crate::{
    Buffers, EmissionTexture, Estimator, Integration, LightSource, Lines, MOST_TECHNIQUES, Pieces,
    PlanCounters, Query, SegmentCounters, ShadingPoint, Smoothing, Stream, Weights,
};
use linelit_bsdf::Reflection;
use linelit_geometry::{ConvexPolygon, DVec2, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample};
use linelit_mis::{Heuristic, smoothing};
use linelit_visibility::{ShaftClass, ShaftQuery, VisibleLines};
use optimal::Half;
use prepared::{LightPart, LightPoint, LineFamily, PreparedTechnique, Source, allot, through};
use std::f64::consts::FRAC_PI_2;
use visibility::Visibility;

/// The memory of combinations.
#[derive(Debug, Default)]
pub(crate) struct CombinationBuffers<'t> {
    techniques: Vec<PreparedTechnique<'t>>,
    drawn: Vec<LineSample>,
    segments: Vec<Segment>,
    samples: Vec<Sample>,
    /// How many of them are the first of two rounds.
    first_round: Option<usize>,
    /// In each round, draws of each technique that gave no sample.
    misses: [[usize; MOST_TECHNIQUES]; 2],
    /// For the densities of one technique: whose sample each line goes through.
    owners: Vec<usize>,
}

impl CombinationBuffers<'_> {
    /// The same memory without the techniques, which may borrow from another light.
    fn emptied<'t>(self) -> CombinationBuffers<'t> {
        let (mut techniques, mut samples) = (self.techniques, self.samples);
        techniques.clear();
        samples.clear();
        CombinationBuffers {
            // `collect` reuses the emptied vector's allocation; only the lifetime changes.
            techniques: techniques.into_iter().map_while(|_| None).collect(),
            drawn: self.drawn,
            segments: self.segments,
            samples,
            first_round: None,
            misses: Default::default(),
            owners: self.owners,
        }
    }
}

/// A visible point of the light, drawn by one of the techniques.
#[derive(Clone, Copy, Debug)]
struct Sample {
    technique: usize,
    at: LightPoint,
    /// L f_r cos θ.
    value: DVec3,
    /// Density per solid angle of its own technique.
    density: f64,
    /// Density per solid angle of each technique, as weights see it.
    densities: [f64; MOST_TECHNIQUES],
    /// What the densities of points are multiplied with in weights.
    smooth: f64,
}

/// What is read while samples of a combination are drawn and weighted, and what is counted.
struct Combination<'a, 's, R, T> {
    light: &'a LightSource<'a, T>,
    area: &'a AreaLight,
    point: &'a ShadingPoint<R>,
    visibility: Visibility<'s>,
    visible: &'a mut VisibleLines,
    smoothing: Option<Smooth>,
    plan: &'a mut PlanCounters,
    segments: &'a mut SegmentCounters,
}

/// What is hidden of a line, as a share of it, to be smoothed with a fixed width. Ends of visible
/// parts are good to some 1e-12, and what rounding hides at the end of one line may be visible on
/// the line through the same point that another technique asks for: weights would no longer sum to
/// one.
const LEAST_GAP: f64 = 1e-9;

/// What smoothing needs to know of the light.
struct Smooth {
    kind: Smoothing,
    width: f64,
    light: ConvexPolygon,
}

impl Smooth {
    fn new(kind: Smoothing, light: ConvexPolygon) -> Self {
        Self {
            kind,
            width: 0.5 * smaller_side(&light),
            light,
        }
    }

    /// The factor for the borders of the light: eq. 23 with all edges in place of u and v.
    fn border(&self, point: DVec3) -> f64 {
        let vertices = self.light.vertices();
        let next = vertices.iter().cycle().skip(1);
        let factor = |(a, b): (&DVec3, &DVec3)| {
            let inwards = self.light.normal().cross((*b - *a).normalize_or_zero());
            smoothing::edge(inwards.dot(point - *a), self.width)
        };
        vertices.iter().zip(next).map(factor).product()
    }
}

/// All techniques of the combination, weighted: Σ_s Σ_k w_s f/(N_s p_s) (Salesin & Jarosz 2019,
/// eq. 20 without its 1/S).
pub(crate) fn combined<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let estimator = query.estimator;
    if let Some((lines, samples)) = estimator.closed(query.samples)
        && query.light.closed_form(query.point).is_some()
    {
        return in_closed_form(&query.with_samples(samples), area, lines, buffers);
    }
    let Some(polygon) = above_horizon(area, query.point) else {
        return DVec3::ZERO;
    };
    let mut part = LightPart {
        dense: false,
        turn: area.polygon.plane_frame().turn_from(&polygon.plane_frame()),
        polygon,
        texture: query.light.texture,
    };
    let asked = ShaftQuery {
        point: query.point.position,
        light: (&part.polygon).into(),
        exclude: query.light.triangles.clone(),
    };
    let Buffers {
        scratch,
        visible,
        plan,
        segments,
        combination: buffers,
        ..
    } = buffers;
    let mut work = Combination {
        light: query.light,
        area,
        point: query.point,
        visibility: Visibility::new(query.occluders, query.queries, asked, scratch),
        visible,
        smoothing: match estimator.weights() {
            Weights::Smooth(kind) => Some(Smooth::new(kind, part.polygon)),
            Weights::Alone
            | Weights::Balance
            | Weights::Power
            | Weights::Maximum
            | Weights::Average
            | Weights::Optimal(_)
            | Weights::Unoccluded => None,
        },
        plan,
        segments,
    };
    match work.visibility.class() {
        ShaftClass::Blocked => {
            work.plan.hidden += 1;
            return DVec3::ZERO;
        }
        ShaftClass::Empty => work.plan.unoccluded += 1,
        ShaftClass::Partial => {}
    }
    part.dense = work.visibility.is_dense() && estimator.has_cheapest();
    let count = if part.dense {
        query.samples.saturating_mul(POINTS_FOR_A_LINE_IF_DENSE)
    } else {
        query.samples
    };
    let random = query.numbers.independent(Stream::Orientation, 2 + MOST);
    let u = |k| random.get_1d(k);
    let mut own = std::mem::take(buffers).emptied();
    let (rounds, each) = match estimator.weights() {
        Weights::Optimal(_) if count > 1 => (2, 0.5 * f64::from(count)),
        _ => (1, f64::from(count)),
    };
    PreparedTechnique::all(estimator, each, &part, query.point, u, &mut own.techniques);
    for round in 0..rounds {
        let half = (round > 0).then_some(own.samples.len());
        own.first_round = half;
        allot(
            &mut own.techniques,
            if half.is_some() { u(1 + MOST) } else { u(0) },
        );
        draw(query, &mut work, round, &mut own);
    }
    if estimator.weights() == Weights::Unoccluded {
        work.densities_unoccluded(&mut own);
    } else {
        work.densities(&mut own);
    }
    work.smooth_across(&mut own);
    let sum = sum(estimator, &own);
    *buffers = own.emptied();
    sum
}

/// Where the material has a closed form: one technique alone, which leaves nothing for the others.
fn in_closed_form<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    lines: Lines,
    buffers: &mut Buffers,
) -> DVec3 {
    match lines.integration {
        Integration::Cheapest => strategy::hybrid(query, area, buffers),
        Integration::Exact(options) => strategy::exact(query, area, options, buffers),
        Integration::Analytic | Integration::Points => {
            line_sum::lines(query, area, &lines, Along::best(query), buffers)
        }
    }
}

/// Draws the samples of all techniques; those of two rounds are independent.
fn draw<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    work: &mut Combination<'_, '_, R, T>,
    round: usize,
    buffers: &mut CombinationBuffers<'_>,
) {
    let mut numbers = query.numbers;
    numbers.seed ^= [0, OTHER_SEED][round];
    for index in 0..buffers.techniques.len() {
        let count = buffers.techniques[index].count;
        if count == 0 {
            continue;
        }
        let stream = Stream::Technique(u32::try_from(index).unwrap_or(0));
        let set = numbers.points(stream, count);
        let hits = if matches!(buffers.techniques[index].source, Source::Line(..)) {
            work.draw_lines(index, buffers, |i| set.get_2d(i))
        } else {
            let (technique, before) = (&buffers.techniques[index], buffers.samples.len());
            let draw = |i| work.draw_point(index, technique, set.get_2d(i));
            buffers.samples.extend((0..count).filter_map(draw));
            buffers.samples.len() - before
        };
        buffers.misses[round][index] = count as usize - hits;
    }
}

/// What tells the seed of the second round from that of the first.
const OTHER_SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// [`MOST_TECHNIQUES`] as a count of random numbers.
#[allow(clippy::cast_possible_truncation, reason = "a small constant")]
const MOST: u32 = MOST_TECHNIQUES as u32;

/// The part of the light above both horizons of the shading point.
fn above_horizon<R>(area: &AreaLight, point: &ShadingPoint<R>) -> Option<ConvexPolygon> {
    let above = area.polygon.clip(point.position, point.normal)?;
    if point.normal == point.geometric_normal {
        Some(above)
    } else {
        above.clip(point.position, point.geometric_normal)
    }
}

/// The smaller extent of a polygon along and across its first edge.
fn smaller_side(polygon: &ConvexPolygon) -> f64 {
    let frame = polygon.plane_frame();
    let places = polygon.vertices().iter().map(|v| frame.to_plane(*v));
    let (low, high) = places.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    });
    (high - low).min_element()
}

impl<R: Reflection, T: EmissionTexture> Combination<'_, '_, R, T> {
    /// A sample of technique `technique`, if it carries light.
    fn sample(&self, technique: usize, at: LightPoint, density: f64) -> Option<Sample> {
        let emitted = self.light.emitted(self.area, at.point, at.direction);
        let value = self.point.reflected(emitted, at.direction);
        if value == DVec3::ZERO || !(density > 0.0 && density.is_finite()) {
            return None;
        }
        let mut densities = [0.0; MOST_TECHNIQUES];
        densities[technique] = density;
        Some(Sample {
            technique,
            at,
            value,
            density,
            densities,
            smooth: match &self.smoothing {
                Some(smooth) => smooth.border(at.point),
                None => 1.0,
            },
        })
    }

    fn light_point(&self, point: DVec3) -> LightPoint {
        LightPoint::new(point, self.point.position, &self.area.polygon)
    }

    /// One sample of a point technique, if it carries light and is visible.
    fn draw_point(
        &mut self,
        index: usize,
        technique: &PreparedTechnique<'_>,
        u: [f64; 2],
    ) -> Option<Sample> {
        let on_light = match &technique.source {
            Source::Area(sampler) => sampler.sample(u).point,
            Source::SolidAngle(sampler) => sampler.sample(u).point,
            Source::Projected(lines) => {
                let line = lines.sample(u[0]);
                lines.point(&line, &[Interval::UNIT], u[1]).point
            }
            Source::Texture(sampler, beside) => {
                let on_plane = sampler.sample(u).point;
                match beside {
                    Some(light) => {
                        meets(light, self.point.position, on_plane - self.point.position)?
                    }
                    None => on_plane,
                }
            }
            Source::Bsdf => {
                let (point, n) = (self.point, self.point.normal);
                let w = point.bsdf.sample(u, point.outgoing, n)?;
                meets(&self.area.polygon, point.position, w)?
            }
            Source::Line(..) => return None,
        };
        let at = self.light_point(on_light);
        let density = technique.point_density(&at, self.point);
        let sample = self.sample(index, at, density)?;
        self.visibility.point_visible(on_light).then_some(sample)
    }

    /// The samples of a line technique: all its lines in one query, then points on what is visible.
    /// Gives the number of lines that have any.
    fn draw_lines(
        &mut self,
        index: usize,
        buffers: &mut CombinationBuffers<'_>,
        u: impl Fn(u32) -> [f64; 2],
    ) -> usize {
        let mut hits = 0;
        let CombinationBuffers {
            techniques,
            drawn,
            segments,
            samples,
            ..
        } = buffers;
        let Source::Line(lines, pieces) = &techniques[index].source else {
            return hits;
        };
        let each = techniques[index].each;
        drawn.clear();
        drawn.extend((0..techniques[index].count).map(|i| lines.sample(u(i)[0])));
        segments.clear();
        segments.extend(drawn.iter().map(|line| line.segment));
        self.visibility.visible(segments, self.visible);
        for (i, line) in (0u32..).zip(drawn.iter()) {
            let parts = self.visible.line(i as usize);
            self.segments.lines += 1;
            self.segments.pieces += parts.len() as u64;
            self.plan.hidden_lines += u64::from(parts.is_empty());
            if !line.pdf.is_positive() {
                continue;
            }
            let (place, before) = (u(i)[1], samples.len());
            let mut draw = |part: &[Interval]| {
                for k in 0..each {
                    let place = (f64::from(k) + place) / f64::from(each);
                    let (at, density) = lines.point(line, part, place, |p| self.light_point(p));
                    if let Some(mut sample) = self.sample(index, at, density) {
                        sample.smooth *= self.smooth_factor(&at, &line.segment, parts);
                        samples.push(sample);
                    }
                }
            };
            match pieces {
                Pieces::Each => parts.chunks(1).for_each(&mut draw),
                Pieces::One if parts.is_empty() => {}
                Pieces::One => draw(parts),
            }
            hits += usize::from(samples.len() > before);
        }
        hits
    }

    /// The densities of all techniques at each other's samples: the lines through them are one
    /// more question to the same shaft.
    fn densities(&mut self, buffers: &mut CombinationBuffers<'_>) {
        let CombinationBuffers {
            techniques,
            segments,
            samples,
            owners,
            ..
        } = buffers;
        if techniques.len() == 1 {
            return;
        }
        for (index, technique) in techniques.iter().enumerate() {
            let others = samples.iter_mut().filter(|s| s.technique != index);
            let Source::Line(lines, pieces) = &technique.source else {
                others
                    .for_each(|s| s.densities[index] = technique.point_density(&s.at, self.point));
                continue;
            };
            owners.clear();
            segments.clear();
            for (k, sample) in samples.iter().enumerate() {
                if sample.technique != index {
                    owners.push(k);
                    segments.push(lines.through(sample.at.point));
                }
            }
            self.visibility.visible(segments, self.visible);
            self.plan.density_lines += owners.len() as u64;
            for (i, &owner) in owners.iter().enumerate() {
                let parts = self.visible.line(i);
                let sample = &mut samples[owner];
                sample.smooth *= self.smooth_factor(&sample.at, &segments[i], parts);
                sample.densities[index] = line_density(lines, *pieces, sample, &segments[i], parts);
            }
        }
    }

    /// The densities of all techniques at all samples, for lines as if nothing stood in between.
    fn densities_unoccluded(&self, buffers: &mut CombinationBuffers<'_>) {
        let CombinationBuffers {
            techniques,
            samples,
            ..
        } = buffers;
        if techniques.len() == 1 {
            return;
        }
        for (index, technique) in techniques.iter().enumerate() {
            for sample in samples.iter_mut() {
                sample.densities[index] = match &technique.source {
                    Source::Line(lines, _) => lines.density(&sample.at, &[Interval::UNIT]),
                    _ if sample.technique == index => continue,
                    _ => technique.point_density(&sample.at, self.point),
                };
            }
        }
    }

    /// Where all lines have one direction, smooths along the other, too: one more line through each
    /// sample.
    fn smooth_across(&mut self, buffers: &mut CombinationBuffers<'_>) {
        let CombinationBuffers {
            techniques,
            segments,
            samples,
            ..
        } = buffers;
        let lines = |s: &PreparedTechnique<'_>| match &s.source {
            Source::Line(lines, _) => Some(lines.direction()),
            _ => None,
        };
        let mut directions = techniques.iter().filter_map(lines);
        let (Some(smooth), Some(first), None) =
            (&self.smoothing, directions.next(), directions.next())
        else {
            return;
        };
        let along = smooth.light.plane_frame().axes;
        let angle = along.y.dot(first).atan2(along.x.dot(first)) + FRAC_PI_2;
        let across = ParallelLines::new(&smooth.light, angle);
        segments.clear();
        segments.extend(samples.iter().map(|s| through(&across, s.at.point)));
        self.visibility.visible(segments, self.visible);
        self.plan.density_lines += segments.len() as u64;
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.smooth *= self.smooth_factor(&sample.at, &segments[i], self.visible.line(i));
        }
    }

    /// The smoothing factor of points at the ends of visible parts, along one line direction: 1
    /// unless asked for.
    fn smooth_factor(&self, at: &LightPoint, line: &Segment, parts: &[Interval]) -> f64 {
        let Some(Smooth { kind, width, .. }) = &self.smoothing else {
            return 1.0;
        };
        let (t, length) = (parameter(line, at.point), line.length());
        let Some(k) = piece_of(t, parts) else {
            return 1.0;
        };
        let part = parts[k];
        let before = k.checked_sub(1).map_or(0.0, |j| parts[j].hi);
        let after = parts.get(k + 1).map_or(1.0, |p| p.lo);
        let gap = |hidden: f64| match kind {
            Smoothing::Fixed if hidden > LEAST_GAP => f64::INFINITY,
            _ => hidden * length,
        };
        let (lo, hi) = (part.lo * length, part.hi * length);
        let gaps = (gap(part.lo - before), gap(after - part.hi));
        smoothing::visible_interval(t * length, lo, hi, gaps.0, gaps.1, *width)
    }
}

/// The weighted sum.
fn sum(estimator: &Estimator, buffers: &CombinationBuffers<'_>) -> DVec3 {
    let count = buffers.techniques.len();
    let mut expected = [0.0; MOST_TECHNIQUES];
    for (to, technique) in expected.iter_mut().zip(&buffers.techniques) {
        *to = technique.expected;
    }
    let ns = &expected[..count];
    if let Weights::Optimal(kind) = estimator.weights()
        && let Some(half) = buffers.first_round
    {
        let (first, second) = buffers.samples.split_at(half);
        let [a, b] = &buffers.misses;
        let half = |samples, misses| Half { samples, misses };
        return optimal::sum(kind, &expected, [half(first, a), half(second, b)]);
    }
    let mut sum = DVec3::ZERO;
    for sample in &buffers.samples {
        let (ps, i) = (&sample.densities[..count], sample.technique);
        let weight = match estimator.weights() {
            Weights::Alone | Weights::Balance | Weights::Optimal(_) | Weights::Unoccluded => {
                Heuristic::Balance.weight(ns, ps, i)
            }
            Weights::Power => Heuristic::Power(2.0).weight(ns, ps, i),
            Weights::Maximum => Heuristic::Maximum.weight(ns, ps, i),
            Weights::Average => Heuristic::Average.weight(ns, ps, i),
            Weights::Smooth(_) => {
                let mut factors = [1.0; MOST_TECHNIQUES];
                for (factor, technique) in factors.iter_mut().zip(&buffers.techniques) {
                    if !matches!(technique.source, Source::Line(..)) {
                        *factor = sample.smooth;
                    }
                }
                smoothing::smoothed_balance(ns, ps, &factors[..count], i)
            }
        };
        sum += sample.value * (weight / (ns[i] * sample.density));
    }
    sum
}

/// The density of a line technique at a sample of another.
fn line_density(
    lines: &LineFamily<'_>,
    pieces: Pieces,
    sample: &Sample,
    line: &Segment,
    parts: &[Interval],
) -> f64 {
    match pieces {
        Pieces::One => lines.density(&sample.at, parts),
        Pieces::Each => piece_of(parameter(line, sample.at.point), parts)
            .map_or(0.0, |k| lines.density(&sample.at, &parts[k..=k])),
    }
}

/// The parameter in [0, 1] of a point on a line.
fn parameter(line: &Segment, point: DVec3) -> f64 {
    let along = line.vector();
    let square = along.length_squared();
    if square > 0.0 {
        ((point - line.p0).dot(along) / square).clamp(0.0, 1.0)
    } else {
        0.5
    }
}

/// The visible part that holds a parameter, whose rounding may have put it beyond an end.
fn piece_of(t: f64, parts: &[Interval]) -> Option<usize> {
    let slack = 16.0 * f64::EPSILON;
    parts
        .iter()
        .position(|part| t >= part.lo - slack && t <= part.hi + slack)
}
