//! Points and lines in one estimator (Salesin & Jarosz 2019, sections 3 and 4).
//!
//! A line sample becomes a point sample once a point of its visible part is drawn: its density is
//! the joint one of eqs. 14 and 19, which knows the visibility. Any number of such techniques,
//! lines of different directions, points and BSDF samples, then combine by multiple importance
//! sampling.

mod cylinder;
mod domain;
mod optimal;
mod prepared;
mod round;
mod smooth;
mod visibility;

use crate::point_block::{BLOCK, LEAST};
use crate::techniques::integrals::{Between, Instead};
use crate::techniques::lines::DrawLines;
use crate::techniques::points::{DrawPoints, LightPoint, Polygon};
use crate::transformed::{self, Known};
use crate::{
    Buffers, EmissionTexture, Estimator, MOST_TECHNIQUES, Pieces, PointBy, Query, SampleBuffers,
    ShadingPoint, Stream, Weights,
};
pub(crate) use cylinder::on_cylinder;
use domain::Domain;
pub(crate) use domain::NoLines;
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{ConvexPolygon, DVec3, Segment, intervals::Interval};
use linelit_lights::{AreaLight, LineSample};
use linelit_mis::{Heuristic, smoothing};
use linelit_samplers::SampleSet;
use linelit_visibility::{Shaft, ShaftClass};
use optimal::Round;
use prepared::{PreparedTechnique, Source, allot};
pub(crate) use round::on_round;
use smooth::{Bordered, Smooth, parameter, piece_of};
use visibility::Visibility;

/// The memory of combinations.
#[derive(Debug)]
pub(crate) struct CombinationBuffers<P, L> {
    techniques: Vec<PreparedTechnique<P, L>>,
    drawn: Vec<LineSample>,
    segments: Vec<Segment>,
    samples: Vec<Sample>,
    /// How many of them are the first of two rounds.
    first_round: Option<usize>,
    /// In each round, how many samples each technique drew.
    counts: [[f64; MOST_TECHNIQUES]; 2],
    /// For the densities of one technique: whose sample each line goes through.
    owners: Vec<usize>,
}

impl<P, L> Default for CombinationBuffers<P, L> {
    fn default() -> Self {
        Self {
            techniques: Vec::new(),
            drawn: Vec::new(),
            segments: Vec::new(),
            samples: Vec::new(),
            first_round: None,
            counts: Default::default(),
            owners: Vec::new(),
        }
    }
}

impl<P, L> CombinationBuffers<P, L> {
    /// The same memory without the techniques, which may borrow from another light.
    fn emptied<Q, M>(self) -> CombinationBuffers<Q, M> {
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
            counts: Default::default(),
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
struct Combination<'a, 's, R, T, S> {
    query: &'a Query<'a, R, T>,
    light: &'a S,
    visibility: Visibility<'s>,
    smoothing: Option<Smooth<S>>,
    /// What becomes of the lines of integrals.
    instead: Instead,
    /// What is known in closed form, which samples do without: theirs is the rest.
    known: Option<Known>,
    /// But for their `combination`, which is in use.
    buffers: &'a mut SampleBuffers,
}

/// All techniques of the combination, weighted: Σ_s Σ_k w_s f/(N_s p_s) (Salesin & Jarosz 2019,
/// eq. 20 without its 1/S).
pub(crate) fn combined<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    area: &AreaLight,
    buffers: &mut Buffers,
) -> DVec3 {
    let estimator = query.estimator;
    // One technique alone, which leaves nothing for the others.
    if let Some((lines, integration, samples)) = estimator.closed(query.samples)
        && query.light.closed_form(query.point).is_some()
    {
        return integration.light(&query.with_samples(samples), area, &lines, buffers);
    }
    let Some(polygon) = above_horizon(area, query.point) else {
        return DVec3::ZERO;
    };
    let part = Polygon {
        turn: area.polygon.plane_frame().turn_from(&polygon.plane_frame()),
        polygon: &polygon,
        texture: query.light.texture,
        position: query.point.position,
        normal: query.point.normal,
        cosines: query.cosines_for(estimator.parts().map(|part| &part.technique)),
    };
    let asked = query.shaft(part.polygon);
    let Buffers { scratch, samples } = buffers;
    let mut visibility = Visibility::new(query.occluders, query.queries, asked, scratch);
    match visibility.class() {
        ShaftClass::Blocked => {
            samples.plan.hidden += 1;
            return DVec3::ZERO;
        }
        ShaftClass::Empty => samples.plan.unoccluded += 1,
        ShaftClass::Partial => {}
    }
    let mut cosines = part.cosines.filter(|_| query.light.texture.is_none());
    let (instead, known) = instead(
        query,
        &mut visibility,
        cosines.as_mut(),
        samples,
        |cosines, shaft, samples| {
            transformed::known(query, area, part.polygon, cosines, shaft, samples)
        },
    );
    let mut own = std::mem::take(&mut samples.combination).emptied();
    let mut combination = Combination {
        query,
        light: &area.polygon,
        visibility,
        smoothing: Smooth::new(estimator.weights(), part.polygon),
        instead,
        known,
        buffers: samples,
    };
    combination.gather(&part, &mut own);
    let sum = combination.sum(&own);
    samples.combination = own.emptied();
    sum
}

/// What becomes of the lines of integrals in a combination, and what is known in closed form, if
/// they ask for that.
fn instead<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    visibility: &mut Visibility<'_>,
    cosines: Option<&mut TransformedCosines>,
    samples: &mut SampleBuffers,
    known: impl FnOnce(&mut TransformedCosines, &mut Shaft<'_>, &mut SampleBuffers) -> Option<Known>,
) -> (Instead, Option<Known>) {
    let Some(shaft) = visibility.shaft_mut() else {
        return (Instead::Line, None);
    };
    let between = Between {
        shaft,
        samples: query.samples,
        has_cosines: cosines.is_some(),
    };
    let each = (query.estimator.integrations()).map(|integration| integration.instead(&between));
    let instead = each.max().unwrap_or(Instead::Line);
    let (Instead::Differences(_), Some(cosines)) = (instead, cosines) else {
        return (instead, None);
    };
    let partial = u64::from(shaft.class() == ShaftClass::Partial);
    match known(cosines, shaft, samples) {
        None => {
            samples.plan.exact_fallbacks += partial;
            (Instead::Line, None)
        }
        known => {
            samples.plan.exact_penumbrae += partial;
            (instead, known)
        }
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

impl<R: Reflection, T: EmissionTexture, S: Bordered> Combination<'_, '_, R, T, S> {
    /// Samples of all techniques with all their densities: in two rounds for the optimal
    /// heuristic, each of which gives the other its coefficients.
    fn gather<D: Domain<Surface = S>>(
        &mut self,
        part: &D,
        own: &mut CombinationBuffers<D::Points, D::Lines>,
    ) {
        let estimator = self.query.estimator;
        let (times, by) = match self.instead {
            Instead::Line => (1, None),
            Instead::Points(n) if self.query.light.texture.is_some() => (n, Some(PointBy::Area)),
            Instead::Points(n) | Instead::Differences(n) => (n, Some(PointBy::Ltc)),
        };
        let count = self.query.samples.saturating_mul(times);
        let mut numbers = self.query.numbers;
        let random = numbers.in_common(Stream::Orientation, 1 + MOST);
        let rounds = match estimator.weights() {
            Weights::Optimal(_) if count > 1 => 2,
            _ => 1,
        };
        let expected = f64::from(count) / [1.0, 2.0][rounds - 1];
        let turn = |k| random.get_1d(k);
        PreparedTechnique::all(self.query, expected, part, by, turn, &mut own.techniques);
        numbers.block = numbers.block.interleaved();
        let u = numbers.spread(random.get_1d(0));
        for round in 0..rounds {
            if round > 0 {
                own.first_round = Some(own.samples.len());
            }
            numbers.seed = self.query.numbers.seed ^ [0, OTHER_SEED][round];
            // Both rounds together have as many samples of each technique as one of both would.
            allot(&mut own.techniques, &numbers, [u, (u + 0.5).fract()][round]);
            if round > 0 {
                // What weights the other round does not go along with it from block to block.
                for technique in &mut own.techniques {
                    let block = &mut technique.numbers.block;
                    *block = block.interleaved();
                }
            }
            self.draw(round, own);
        }
        self.densities(own);
        self.smooth_across(own);
    }

    /// Draws the samples of all techniques; those of two rounds are independent.
    fn draw<P: DrawPoints<S>, L: DrawLines<S>>(
        &mut self,
        round: usize,
        buffers: &mut CombinationBuffers<P, L>,
    ) {
        for (index, stream) in (0..buffers.techniques.len()).zip(0..) {
            let PreparedTechnique { count, numbers, .. } = buffers.techniques[index];
            buffers.counts[round][index] = f64::from(count);
            if count == 0 {
                continue;
            }
            let set = numbers.points(Stream::Technique(stream), count);
            match &buffers.techniques[index].source {
                Source::Lines(..) => self.draw_lines(index, buffers, |i| set.get_2d(i)),
                Source::Points(source) => {
                    self.draw_points(index, source, &set, &mut buffers.samples);
                }
            }
        }
    }

    /// A sample of technique `technique`, if it carries light.
    fn sample(&self, technique: usize, at: LightPoint, density: f64) -> Option<Sample> {
        let mut value = self.query.unshadowed(&at);
        if let Some(known) = &self.known {
            let cosine = self.query.point.cosine(at.direction);
            if cosine <= 0.0 {
                return None;
            }
            value -= known.emitted * self.buffers.fit.at(at.direction, cosine);
        }
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
            smooth: self.smoothing.as_ref().map_or(1.0, |s| s.border(at.point)),
        })
    }

    /// The samples of a point technique that carry light and are visible.
    fn draw_points(
        &mut self,
        index: usize,
        source: &impl DrawPoints<S>,
        set: &SampleSet,
        samples: &mut Vec<Sample>,
    ) {
        let (count, point) = (set.count(), self.query.point);
        let mut targets = std::mem::take(&mut self.buffers.targets);
        let mut first = 0;
        while first < count {
            let numbers = first..count.min(first.saturating_add(BLOCK));
            first = numbers.end;
            let filled = numbers.len() >= LEAST;
            let block = &mut self.buffers.points;
            let in_columns = filled && block.draw_columns(source, set, &numbers).is_some();
            let block = &self.buffers.points;
            let drawn = samples.len();
            samples.extend(numbers.enumerate().filter_map(|(k, i)| {
                let on_light = if in_columns {
                    block.on_light(k)
                } else {
                    let u = if filled {
                        block.numbers(k)
                    } else {
                        set.get_2d(i)
                    };
                    source.draw(u, self.light, point)?.0.point
                };
                let at = LightPoint::new(on_light, point.position, self.light);
                self.sample(index, at, source.density(&at, point))
            }));
            targets.clear();
            targets.extend(samples[drawn..].iter().map(|s| self.light.target(&s.at)));
            let mut visible = self.visibility.points_visible(&mut targets);
            let mut kept = drawn;
            while visible != 0 {
                samples[kept] = samples[drawn + visible.trailing_zeros() as usize];
                kept += 1;
                visible &= visible - 1;
            }
            samples.truncate(kept);
        }
        self.buffers.targets = targets;
    }

    /// The samples of a line technique: all its lines in one query, then points on what is visible.
    fn draw_lines<P, L: DrawLines<S>>(
        &mut self,
        index: usize,
        buffers: &mut CombinationBuffers<P, L>,
        u: impl Fn(u32) -> [f64; 2],
    ) {
        let CombinationBuffers {
            techniques,
            drawn,
            segments,
            samples,
            ..
        } = buffers;
        let Source::Lines(lines, pieces) = &techniques[index].source else {
            return;
        };
        let points = techniques[index].points;
        drawn.clear();
        drawn.extend((0..techniques[index].count).map(|i| lines.sample(u(i)[0])));
        segments.clear();
        segments.extend(drawn.iter().map(|line| line.segment));
        self.visibility.visible(segments, &mut self.buffers.visible);
        for (i, line) in (0u32..).zip(drawn.iter()) {
            let parts = self.buffers.visible.line(i as usize);
            self.buffers.segments.lines += 1;
            self.buffers.segments.pieces += parts.len() as u64;
            self.buffers.plan.hidden_lines += u64::from(parts.is_empty());
            if !line.pdf.is_positive() {
                continue;
            }
            let v = u(i)[1];
            let mut draw = |part: &[Interval]| {
                for k in 0..points {
                    let v = (f64::from(k) + v) / f64::from(points);
                    let x = self.query.point.position;
                    let (at, density) = lines.point(line, part, v, x, self.light);
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
        }
    }

    /// The densities of all techniques at each other's samples: the lines through them are one
    /// more question to the same shaft.
    fn densities<P: DrawPoints<S>, L: DrawLines<S>>(
        &mut self,
        buffers: &mut CombinationBuffers<P, L>,
    ) {
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
            let (lines, pieces) = match &technique.source {
                Source::Lines(lines, pieces) => (lines, *pieces),
                Source::Points(source) => {
                    for sample in samples.iter_mut().filter(|s| s.technique != index) {
                        sample.densities[index] = source.density(&sample.at, self.query.point);
                    }
                    continue;
                }
            };
            owners.clear();
            segments.clear();
            for (k, sample) in samples.iter().enumerate() {
                if sample.technique != index {
                    owners.push(k);
                    segments.push(lines.through(sample.at.point));
                }
            }
            self.visibility.visible(segments, &mut self.buffers.visible);
            self.buffers.plan.density_lines += owners.len() as u64;
            for (i, &owner) in owners.iter().enumerate() {
                let parts = self.buffers.visible.line(i);
                let sample = &mut samples[owner];
                sample.smooth *= self.smooth_factor(&sample.at, &segments[i], parts);
                sample.densities[index] = line_density(lines, pieces, sample, &segments[i], parts);
            }
        }
    }
}

impl<R, T, S> Combination<'_, '_, R, T, S> {
    /// What is known and the weighted sum of the samples.
    fn sum<P, L>(&self, buffers: &CombinationBuffers<P, L>) -> DVec3 {
        let known = self.known.map(|known| known.emitted * known.integral);
        known.unwrap_or_default() + sum(self.query.estimator, buffers)
    }
}

/// The weighted sum.
fn sum<P, L>(estimator: &Estimator, buffers: &CombinationBuffers<P, L>) -> DVec3 {
    let count = buffers.techniques.len();
    let of = |i: usize| buffers.techniques.get(i).map_or(0.0, |t| t.expected);
    let expected: [f64; MOST_TECHNIQUES] = std::array::from_fn(of);
    let ns = &expected[..count];
    let mut sum = DVec3::ZERO;
    for sample in &buffers.samples {
        let (ps, i) = (&sample.densities[..count], sample.technique);
        let weight = match estimator.weights() {
            Weights::Alone | Weights::Balance | Weights::Optimal(_) => {
                Heuristic::Balance.weight(ns, ps, i)
            }
            Weights::Power => Heuristic::Power(2.0).weight(ns, ps, i),
            Weights::Maximum => Heuristic::Maximum.weight(ns, ps, i),
            Weights::Average => Heuristic::Average.weight(ns, ps, i),
            Weights::Smooth(_) => {
                let mut factors = [1.0; MOST_TECHNIQUES];
                for (factor, technique) in factors.iter_mut().zip(&buffers.techniques) {
                    if matches!(technique.source, Source::Points(_)) {
                        *factor = sample.smooth;
                    }
                }
                smoothing::smoothed_balance(ns, ps, &factors[..count], i)
            }
        };
        sum += sample.value * (weight / (ns[i] * sample.density));
    }
    if let Weights::Optimal(kind) = estimator.weights()
        && let Some(first) = buffers.first_round
    {
        let (first, second) = buffers.samples.split_at(first);
        let rounds = [(first, buffers.counts[0]), (second, buffers.counts[1])];
        let rounds = rounds.map(|(samples, counts)| Round { samples, counts });
        sum = 0.5 * sum + optimal::sum(kind, &expected, rounds);
    }
    sum
}

/// The density of a line technique at a sample of another.
fn line_density<S>(
    lines: &impl DrawLines<S>,
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
