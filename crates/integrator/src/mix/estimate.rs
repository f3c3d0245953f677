//! The estimate of a mix at one shading point and light.

use super::optimal::{self, Half};
use super::sight::Sight;
use super::strand::{Kind, Lines, Lit, Seen, Strand, allot, through};
use super::{
    LineDirection, LineMeasure, LineTechnique, MOST_TECHNIQUES, Mix, MixHeuristic, Part, Pieces,
    Smoothing, Technique,
};
use crate::hybrid::POINTS_FOR_A_LINE_IN_CROWDS;
use crate::pair::Pair;
use crate::points::meets;
use crate::{
    LineOptions, PlanCounters, PlannedLight, SegmentCounters, Settings, ShadingPoint, Workspace,
};
use linelit_bsdf::Reflection;
use linelit_geometry::{ConvexPolygon, DVec3, ParallelLines, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample, Orientation};
use linelit_mis::{Heuristic, smoothing};
use linelit_samplers::{Sampler, SamplerKind};
use linelit_visibility::{ShaftClass, ShaftQuery, VisibleLines};
use std::f64::consts::FRAC_PI_2;

/// The buffers of a mix.
#[derive(Debug, Default)]
pub(crate) struct MixBuffers<'t> {
    strands: Vec<Strand<'t>>,
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

/// A visible point of the light, drawn by one of the techniques.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub strand: usize,
    seen: Seen,
    /// L f_r cos θ.
    pub value: DVec3,
    /// Density per solid angle of its own technique.
    density: f64,
    /// Density per solid angle of each technique, as weights see it.
    pub densities: [f64; MOST_TECHNIQUES],
    /// What the densities of points are multiplied with in weights.
    smooth: f64,
}

/// One pair in work: what is read, and what is counted.
struct Work<'a, 's> {
    light: &'a PlannedLight,
    area: &'a AreaLight,
    point: &'a ShadingPoint,
    sight: Sight<'s>,
    visible: &'a mut VisibleLines,
    smoothing: Option<Smooth>,
    plan: &'a mut PlanCounters,
    segments: &'a mut SegmentCounters,
}

/// What is hidden of a line, as a share of it, to be smoothed with a fixed width. Ends of visible parts
/// are good to some 1e-12, and what rounding hides at the end of one line may be visible on the line
/// through the same point that another technique asks for: weights would no longer sum to one.
const LEAST_GAP: f64 = 1e-9;

/// What smoothing needs to know of the light.
struct Smooth {
    kind: Smoothing,
    width: f64,
    light: ConvexPolygon,
}

impl MixBuffers<'_> {
    /// The same memory without the strands, which may borrow from another light.
    fn emptied<'t>(self) -> MixBuffers<'t> {
        let (mut strands, mut samples) = (self.strands, self.samples);
        strands.clear();
        samples.clear();
        MixBuffers {
            // Of an empty vector nothing is made: this keeps its memory under another lifetime.
            strands: strands.into_iter().map_while(|_| None).collect(),
            drawn: self.drawn,
            segments: self.segments,
            samples,
            first_round: None,
            misses: Default::default(),
            owners: self.owners,
        }
    }
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

impl Pair<'_> {
    /// All techniques of the mix, weighted: Σ_s Σ_k w_s f/(N_s p_s) (Salesin & Jarosz 2019, eq. 20
    /// without its 1/S).
    pub(crate) fn mix(&self, area: &AreaLight, mix: &Mix, workspace: &mut Workspace) -> DVec3 {
        if let Some((line, samples)) = mix.closed(self.count())
            && self.light.closed_form(self.point).is_some()
        {
            return self.closed(area, (line, samples), workspace);
        }
        let Some(lit) = above_horizon(area, self.point) else {
            return DVec3::ZERO;
        };
        let mut lit = Lit {
            crowded: false,
            turn: area.polygon.plane_frame().turn_from(&lit.plane_frame()),
            light: lit,
            texture: self.light.texture.as_deref(),
        };
        let query = ShaftQuery {
            point: self.point.position,
            light: (&lit.light).into(),
            exclude: self.light.triangles.clone(),
        };
        let Workspace {
            scratch,
            visible,
            plan,
            segments,
            mix: buffers,
            ..
        } = workspace;
        let mut work = Work {
            light: self.light,
            area,
            point: self.point,
            sight: Sight::new(self, query, scratch),
            visible,
            smoothing: match mix.heuristic() {
                MixHeuristic::Smooth(kind) => Some(Smooth::new(kind, lit.light)),
                _ => None,
            },
            plan,
            segments,
        };
        match work.sight.class() {
            ShaftClass::Blocked => {
                work.plan.hidden += 1;
                return DVec3::ZERO;
            }
            ShaftClass::Empty => work.plan.unoccluded += 1,
            ShaftClass::Partial => {}
        }
        let hybrid = |p: &Part| matches!(p.technique, Technique::Line(l) if l.measure == LineMeasure::Hybrid);
        lit.crowded = work.sight.is_dense() && mix.parts().any(hybrid);
        let count = if lit.crowded {
            self.count().saturating_mul(POINTS_FOR_A_LINE_IN_CROWDS)
        } else {
            self.count()
        };
        let independent = Sampler::new(SamplerKind::Independent, self.settings.seed);
        let random = independent.points(self.pixel, self.dimension + 1, 2 + MOST);
        let u = |k| random.get_1d(k);
        let mut lent = std::mem::take(buffers).emptied();
        let (rounds, each) = match mix.heuristic() {
            MixHeuristic::Optimal(_) if count > 1 => (2, 0.5 * f64::from(count)),
            _ => (1, f64::from(count)),
        };
        Strand::all(mix, each, &lit, self.point, u, &mut lent.strands);
        for round in 0..rounds {
            let half = (round > 0).then_some(lent.samples.len());
            lent.first_round = half;
            allot(
                &mut lent.strands,
                if half.is_some() { u(1 + MOST) } else { u(0) },
            );
            self.draw(&mut work, round, &mut lent);
        }
        if mix.heuristic() == MixHeuristic::Unoccluded {
            work.densities_unoccluded(&mut lent);
        } else {
            work.densities(&mut lent);
        }
        work.smooth_across(&mut lent);
        let sum = work.sum(mix, &lent);
        *buffers = lent.emptied();
        sum
    }

    /// Where the material has a closed form.
    fn closed(
        &self,
        area: &AreaLight,
        (line, samples): (LineTechnique, u32),
        workspace: &mut Workspace,
    ) -> DVec3 {
        let settings = &Settings {
            samples,
            ..*self.settings
        };
        let pair = Pair {
            settings,
            each: 1,
            ..*self
        };
        if line.measure == LineMeasure::Hybrid {
            return pair.hybrid(area, workspace);
        }
        let options = LineOptions {
            orientation: match line.direction {
                LineDirection::Fixed(fraction) => Orientation::Fixed(fraction),
                LineDirection::Parallel | LineDirection::Spread(_) => Orientation::ParallelPerPoint,
            },
            ..LineOptions::default()
        };
        pair.lines(area, options, pair.along(), workspace)
    }

    /// Draws the samples of all techniques; those of two rounds are independent.
    fn draw(&self, work: &mut Work<'_, '_>, round: usize, buffers: &mut MixBuffers<'_>) {
        let seed = self.settings.seed ^ [0, OTHER_SEED][round];
        let sampler = Sampler::new(self.settings.sampler, seed);
        for index in 0..buffers.strands.len() {
            let stream = u32::try_from(index).map_or(0, |i| self.dimension + 2 + i);
            let count = buffers.strands[index].count;
            if count == 0 {
                continue;
            }
            let set = sampler.points(self.pixel, stream, count);
            let hits = if matches!(buffers.strands[index].kind, Kind::Line(..)) {
                work.draw_lines(index, buffers, |i| set.get_2d(i))
            } else {
                let (strand, before) = (&buffers.strands[index], buffers.samples.len());
                let draw = |i| work.draw_point(index, strand, set.get_2d(i));
                buffers.samples.extend((0..count).filter_map(draw));
                buffers.samples.len() - before
            };
            buffers.misses[round][index] = count as usize - hits;
        }
    }
}

/// What tells the seed of the second round from that of the first.
const OTHER_SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// [`MOST_TECHNIQUES`] as a count of random numbers.
#[allow(clippy::cast_possible_truncation, reason = "a small constant")]
const MOST: u32 = MOST_TECHNIQUES as u32;

/// The part of the light above both horizons of the shading point.
fn above_horizon(area: &AreaLight, point: &ShadingPoint) -> Option<ConvexPolygon> {
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
    let (low, high) = places.fold(
        (
            linelit_geometry::DVec2::INFINITY,
            linelit_geometry::DVec2::NEG_INFINITY,
        ),
        |(low, high), p| (low.min(p), high.max(p)),
    );
    (high - low).min_element()
}

impl Work<'_, '_> {
    /// A sample of technique `strand`, if it carries light.
    fn sample(&self, strand: usize, seen: Seen, density: f64) -> Option<Sample> {
        let value = self
            .light
            .unshadowed(self.area, self.point, seen.point, seen.direction);
        if value == DVec3::ZERO || !(density > 0.0 && density.is_finite()) {
            return None;
        }
        let mut densities = [0.0; MOST_TECHNIQUES];
        densities[strand] = density;
        Some(Sample {
            strand,
            seen,
            value,
            density,
            densities,
            smooth: match &self.smoothing {
                Some(smooth) => smooth.border(seen.point),
                None => 1.0,
            },
        })
    }

    fn seen(&self, point: DVec3) -> Seen {
        Seen::new(point, self.point, &self.area.polygon)
    }

    /// One sample of a point technique, if it carries light and is visible.
    fn draw_point(&mut self, index: usize, strand: &Strand<'_>, u: [f64; 2]) -> Option<Sample> {
        let on_light = match &strand.kind {
            Kind::Area(sampler) => sampler.sample(u).point,
            Kind::SolidAngle(sampler) => sampler.sample(u).point,
            Kind::Texture(sampler, beside) => {
                let on_plane = sampler.sample(u).point;
                match beside {
                    Some(light) => {
                        meets(light, self.point.position, on_plane - self.point.position)?
                    }
                    None => on_plane,
                }
            }
            Kind::Bsdf => {
                let (point, n) = (self.point, self.point.normal);
                let w = point.bsdf.sample(u, point.outgoing, n)?;
                meets(&self.area.polygon, point.position, w)?
            }
            Kind::Line(..) => return None,
        };
        let seen = self.seen(on_light);
        let density = strand.point_density(&seen, self.point);
        let sample = self.sample(index, seen, density)?;
        self.sight.point_visible(on_light).then_some(sample)
    }

    /// The samples of a line technique: all its lines in one query, then points on what is visible.
    /// Gives the number of lines that have any.
    fn draw_lines(
        &mut self,
        index: usize,
        buffers: &mut MixBuffers<'_>,
        u: impl Fn(u32) -> [f64; 2],
    ) -> usize {
        let mut hits = 0;
        let MixBuffers {
            strands,
            drawn,
            segments,
            samples,
            ..
        } = buffers;
        let Kind::Line(lines, pieces) = &strands[index].kind else {
            return hits;
        };
        let each = strands[index].each;
        drawn.clear();
        drawn.extend((0..strands[index].count).map(|i| lines.sample(u(i)[0])));
        segments.clear();
        segments.extend(drawn.iter().map(|line| line.segment));
        self.sight.visible(segments, self.visible);
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
                    let (seen, density) = lines.point(line, part, place, |p| self.seen(p));
                    if let Some(mut sample) = self.sample(index, seen, density) {
                        sample.smooth *= self.smooth_factor(&seen, &line.segment, parts);
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
    fn densities(&mut self, buffers: &mut MixBuffers<'_>) {
        let MixBuffers {
            strands,
            segments,
            samples,
            owners,
            ..
        } = buffers;
        if strands.len() == 1 {
            return;
        }
        for (index, strand) in strands.iter().enumerate() {
            let others = samples.iter_mut().filter(|s| s.strand != index);
            let Kind::Line(lines, pieces) = &strand.kind else {
                others.for_each(|s| s.densities[index] = strand.point_density(&s.seen, self.point));
                continue;
            };
            owners.clear();
            segments.clear();
            for (k, sample) in samples.iter().enumerate() {
                if sample.strand != index {
                    owners.push(k);
                    segments.push(lines.through(sample.seen.point));
                }
            }
            self.sight.visible(segments, self.visible);
            self.plan.density_lines += owners.len() as u64;
            for (i, &owner) in owners.iter().enumerate() {
                let parts = self.visible.line(i);
                let sample = &mut samples[owner];
                sample.smooth *= self.smooth_factor(&sample.seen, &segments[i], parts);
                sample.densities[index] = line_density(lines, *pieces, sample, &segments[i], parts);
            }
        }
    }

    /// The densities of all techniques at all samples, for lines as if nothing stood in between.
    fn densities_unoccluded(&self, buffers: &mut MixBuffers<'_>) {
        let MixBuffers {
            strands, samples, ..
        } = buffers;
        if strands.len() == 1 {
            return;
        }
        for (index, strand) in strands.iter().enumerate() {
            for sample in samples.iter_mut() {
                sample.densities[index] = match &strand.kind {
                    Kind::Line(lines, _) => lines.density(&sample.seen, &[Interval::UNIT]),
                    _ if sample.strand == index => continue,
                    _ => strand.point_density(&sample.seen, self.point),
                };
            }
        }
    }

    /// Where all lines have one direction, smooths along the other, too: one more line through each
    /// sample.
    fn smooth_across(&mut self, buffers: &mut MixBuffers<'_>) {
        let MixBuffers {
            strands,
            segments,
            samples,
            ..
        } = buffers;
        let lines = |s: &Strand<'_>| match &s.kind {
            Kind::Line(lines, _) => Some(lines.direction()),
            _ => None,
        };
        let mut directions = strands.iter().filter_map(lines);
        let (Some(smooth), Some(first), None) =
            (&self.smoothing, directions.next(), directions.next())
        else {
            return;
        };
        let along = smooth.light.plane_frame().axes;
        let angle = along.y.dot(first).atan2(along.x.dot(first)) + FRAC_PI_2;
        let across = ParallelLines::new(&smooth.light, angle);
        segments.clear();
        segments.extend(samples.iter().map(|s| through(&across, s.seen.point)));
        self.sight.visible(segments, self.visible);
        self.plan.density_lines += segments.len() as u64;
        for (i, sample) in samples.iter_mut().enumerate() {
            sample.smooth *= self.smooth_factor(&sample.seen, &segments[i], self.visible.line(i));
        }
    }

    /// The smoothing factor of points at the ends of visible parts, along one line direction: 1
    /// unless asked for.
    fn smooth_factor(&self, seen: &Seen, line: &Segment, parts: &[Interval]) -> f64 {
        let Some(Smooth { kind, width, .. }) = &self.smoothing else {
            return 1.0;
        };
        let (t, length) = (parameter(line, seen.point), line.length());
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

    /// The weighted sum.
    fn sum(&self, mix: &Mix, buffers: &MixBuffers<'_>) -> DVec3 {
        let count = buffers.strands.len();
        let mut expected = [0.0; MOST_TECHNIQUES];
        for (to, strand) in expected.iter_mut().zip(&buffers.strands) {
            *to = strand.expected;
        }
        let ns = &expected[..count];
        if let MixHeuristic::Optimal(kind) = mix.heuristic()
            && let Some(half) = buffers.first_round
        {
            let (first, second) = buffers.samples.split_at(half);
            let [a, b] = &buffers.misses;
            let half = |samples, misses| Half { samples, misses };
            return optimal::sum(kind, &expected, [half(first, a), half(second, b)]);
        }
        let mut sum = DVec3::ZERO;
        for sample in &buffers.samples {
            let (ps, i) = (&sample.densities[..count], sample.strand);
            let weight = match mix.heuristic() {
                MixHeuristic::Classic(heuristic) => heuristic.weight(ns, ps, i),
                MixHeuristic::Optimal(_) | MixHeuristic::Unoccluded => {
                    Heuristic::Balance.weight(ns, ps, i)
                }
                MixHeuristic::Smooth(_) => {
                    let mut factors = [1.0; MOST_TECHNIQUES];
                    for (factor, strand) in factors.iter_mut().zip(&buffers.strands) {
                        if !matches!(strand.kind, Kind::Line(..)) {
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
}

/// The density of a line technique at a sample of another.
fn line_density(
    lines: &Lines<'_>,
    pieces: Pieces,
    sample: &Sample,
    line: &Segment,
    parts: &[Interval],
) -> f64 {
    match pieces {
        Pieces::One => lines.density(&sample.seen, parts),
        Pieces::Each => piece_of(parameter(line, sample.seen.point), parts)
            .map_or(0.0, |k| lines.density(&sample.seen, &parts[k..=k])),
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
