//! Points and lines are combined in one estimator here (Salesin & Jarosz 2019, sections 3 and 4).
//!
//! A line sample becomes a point sample once a point of its visible part is drawn. The density of
//! that point is the joint density of eqs. 14 and 19, which depends on visibility. Any number of
//! such techniques can then be combined by multiple importance sampling: lines of different
//! directions, points, and BSDF samples. The steps are:
//!
//! 1. Give each technique a whole number of samples, and draw them. Only visible samples that carry
//!    light are stored.
//! 2. At each sample, find the densities of all other techniques. For lines, this takes one more
//!    visibility query, for the line through the sample.
//! 3. Add up the samples by their weights.
//!
//! The optimal heuristic does the first step in two rounds, each of which gives the other its
//! coefficients.

use super::optimal::{self, Round};
use super::prepared::{Domain, Family, Prepared, Sample, allot};
use super::smooth::{Smooth, parameter, piece_of};
use crate::draw::Source;
use crate::draw::block::{BLOCK, LEAST, PointBlock};
use crate::integrand::Integrand;
use crate::view::LightView;
use crate::visible::Visible;
use crate::{
    EmissionTexture, MOST_TECHNIQUES, Pieces, RandomNumbers, Stream, Weighted, Weights,
    WorkCounters,
};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{DVec3, Segment, intervals::Interval, stop};
use linelit_lights::{LightPoint, LineFamily, LineSample, Surface, Viewer};
use linelit_mis::{Heuristic, smoothing};
use linelit_samplers::SampleSet;
use linelit_visibility::VisibleLines;

/// The memory of combinations, which is reused.
#[derive(Debug, Default)]
pub(crate) struct WeightedMemory {
    drawn: Vec<LineSample>,
    segments: Vec<Segment>,
    visible: VisibleLines,
    samples: Vec<Sample>,
    targets: Vec<DVec3>,
    /// The number of samples in the first round, if there are two rounds.
    first_round: Option<usize>,
    /// The number of samples that each technique drew, in each round.
    counts: [[f64; MOST_TECHNIQUES]; 2],
    /// The samples through which lines go, while the densities of one technique are queried.
    owners: Vec<usize>,
}

/// A combination of techniques while its samples are drawn.
struct Combination<'a, 'v, R, T> {
    integrand: &'a Integrand<'a, R, T>,
    surface: Surface<'a>,
    weights: Weights,
    smooth: Option<Smooth<'a>>,
    techniques: Vec<Prepared<'a>>,
    visible: &'a mut Visible<'v>,
    memory: &'a mut WeightedMemory,
    block: &'a mut PointBlock,
    counts: &'a mut WorkCounters,
}

/// The weighted sum of all techniques on the part of the light above the horizons, Σ_s Σ_k w_s
/// f/(N_s p_s) (Salesin & Jarosz 2019, eq. 20 without its 1/S).
pub(crate) fn sum<R: Reflection, T: EmissionTexture>(
    integrand: &Integrand<'_, R, T>,
    view: &LightView<'_>,
    weighted: &Weighted<'_>,
    cosines: Option<&LtcMixture>,
    numbers: &RandomNumbers,
    visible: &mut Visible<'_>,
    memory: (&mut WeightedMemory, &mut PointBlock, &mut WorkCounters),
) -> DVec3 {
    let (memory, block, counts) = memory;
    let Some(surface) = view.surface() else {
        return DVec3::ZERO;
    };
    // Set up the part of the light that all techniques draw on.
    let lobes = cosines.filter(|_| weighted.lobes_alone);
    let lobes = lobes.map(|cosines| cosines.lobes_alone());
    let domain = Domain {
        surface: view
            .above
            .map_or(surface, |above| Surface::Polygon(&above.polygon)),
        turn: view.above.map_or(0.0, |above| above.turn),
        light: integrand.light,
        viewer: Viewer {
            cosines: lobes.as_ref().or(cosines),
            ..view.at.viewer()
        },
    };
    // Draw the samples of all techniques, and add them up by their weights.
    memory.samples.clear();
    memory.first_round = None;
    let mut combination = Combination {
        integrand,
        surface,
        weights: weighted.weights,
        smooth: Smooth::new(weighted.weights, view, domain.surface),
        techniques: Vec::new(),
        visible,
        memory,
        block,
        counts,
    };
    combination.gather(weighted, &domain, numbers);
    combination.sum()
}

/// The difference between the seeds of the two rounds.
const OTHER_SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// [`MOST_TECHNIQUES`] as a number of random numbers.
#[allow(clippy::cast_possible_truncation, reason = "a small constant")]
const MOST: u32 = MOST_TECHNIQUES as u32;

impl<'a, R: Reflection, T: EmissionTexture> Combination<'a, '_, R, T> {
    /// Draws samples of all techniques and finds all their densities. For the optimal heuristic
    /// there are two rounds, each of which gives the other its coefficients.
    fn gather(&mut self, weighted: &Weighted<'_>, domain: &Domain<'a, T>, numbers: &RandomNumbers) {
        // Set up the techniques.
        let (count, seed) = (weighted.samples, numbers.seed);
        let random = numbers.in_common(Stream::Orientation, 1 + MOST);
        let rounds = match self.weights {
            Weights::Optimal(_) if count > 1 => 2,
            _ => 1,
        };
        let expected = f64::from(count) / [1.0, 2.0][rounds - 1];
        let turn = |k| random.get_1d(k);
        self.techniques = Prepared::all(weighted, expected, domain, numbers, turn);
        // Draw their samples, in one round or two.
        let mut numbers = *numbers;
        numbers.block = numbers.block.interleaved();
        let u = numbers.spread(random.get_1d(0));
        for round in 0..rounds {
            if round > 0 {
                self.memory.first_round = Some(self.memory.samples.len());
            }
            numbers.seed = seed ^ [0, OTHER_SEED][round];
            // Both rounds together have as many samples of each technique as one round of their
            // size would have.
            allot(
                &mut self.techniques,
                &numbers,
                [u, (u + 0.5).fract()][round],
            );
            if round > 0 {
                // Samples of one round determine weights of the other, so that they must not vary
                // together from block to block.
                for technique in &mut self.techniques {
                    let block = &mut technique.numbers.block;
                    *block = block.interleaved();
                }
            }
            self.draw(round);
        }
        self.densities();
        self.smooth_across();
    }

    /// Draws the samples of all techniques in one round. The samples of two rounds are independent.
    fn draw(&mut self, round: usize) {
        let techniques = std::mem::take(&mut self.techniques);
        for ((index, technique), stream) in techniques.iter().enumerate().zip(0..) {
            let count = technique.count;
            self.memory.counts[round][index] = f64::from(count);
            if count == 0 {
                continue;
            }
            let set = technique.numbers.points(Stream::Technique(stream), count);
            match &technique.source {
                Family::Lines(lines, pieces) => {
                    self.draw_lines((index, technique.points), (lines, *pieces), &set);
                }
                Family::Points(source) => self.draw_points(index, Source(source.as_deref()), &set),
            }
        }
        self.techniques = techniques;
    }

    /// Returns a sample of a technique; `None` if it carries no light.
    fn sample(&self, technique: usize, at: LightPoint, density: f64) -> Option<Sample> {
        let value = self.integrand.value(&at);
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
            smooth: self.smooth.as_ref().map_or(1.0, |s| s.border(at.point)),
        })
    }

    /// The smoothing factor for the line through a point, or 1 without smoothing.
    fn smooth_factor(&self, at: &LightPoint, line: &Segment, parts: &[Interval]) -> f64 {
        self.smooth.map_or(1.0, |s| s.factor(at, line, parts))
    }

    /// Draws the samples of a point technique, and stores those that carry light and are visible.
    fn draw_points(&mut self, index: usize, source: Source<'_, '_>, set: &SampleSet) {
        let (count, x) = (set.count(), self.integrand.point.position);
        let mut targets = std::mem::take(&mut self.memory.targets);
        let mut samples = std::mem::take(&mut self.memory.samples);
        let mut first = 0;
        while first < count {
            let numbers = first..count.min(first.saturating_add(BLOCK));
            stop::check();
            first = numbers.end;
            // Draw a block of points, and see them from the shading point.
            let filled = numbers.len() >= LEAST;
            let in_columns = filled && self.block.draw_columns(source, set, &numbers).is_some();
            let drawn = samples.len();
            samples.extend(numbers.enumerate().filter_map(|(k, i)| {
                let on_light = if in_columns {
                    self.block.on_light(k)
                } else {
                    let u = match filled {
                        true => self.block.numbers(k),
                        false => set.get_2d(i),
                    };
                    source.draw(u, &self.surface, self.integrand)?.0.point
                };
                let at = LightPoint::new(on_light, x, &self.surface);
                self.sample(index, at, source.density(&at, self.integrand))
            }));
            // Remove the points that are hidden.
            let target = self.visible.target();
            targets.clear();
            targets.extend(samples[drawn..].iter().map(|s| target.of(&s.at)));
            let mut visible = self.visible.points(&targets);
            let mut kept = drawn;
            while visible != 0 {
                samples[kept] = samples[drawn + visible.trailing_zeros() as usize];
                kept += 1;
                visible &= visible - 1;
            }
            samples.truncate(kept);
        }
        (self.memory.targets, self.memory.samples) = (targets, samples);
    }

    /// Draws the samples of a line technique: all its lines in one visibility query, then points on
    /// their visible parts.
    fn draw_lines(
        &mut self,
        technique: (usize, u8),
        family: (&LineFamily<'_>, Pieces),
        set: &SampleSet,
    ) {
        let ((index, points), (lines, pieces)) = (technique, family);
        // Draw the lines, and find their visible parts.
        let memory = &mut *self.memory;
        memory.drawn.clear();
        let drawn = (0..set.count()).map(|i| lines.sample(set.get_2d(i)[0]));
        memory.drawn.extend(drawn);
        memory.segments.clear();
        let segments = memory.drawn.iter().map(|line| line.segment);
        memory.segments.extend(segments);
        self.visible.lines(&memory.segments, &mut memory.visible);
        self.counts
            .count_lines(&memory.visible, memory.segments.len());
        // Draw points on all visible pieces together, or on each.
        let mut samples = std::mem::take(&mut self.memory.samples);
        let x = self.integrand.point.position;
        for (i, line) in (0u32..).zip(&self.memory.drawn) {
            let parts = self.memory.visible.line(i as usize);
            if !line.pdf.is_positive() {
                continue;
            }
            let v = set.get_2d(i)[1];
            let mut draw = |part: &[Interval]| {
                for k in 0..points {
                    let v = (f64::from(k) + v) / f64::from(points);
                    let (at, density) = lines.point(line, part, v, x, &self.surface);
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
        self.memory.samples = samples;
    }

    /// Finds the densities of all techniques at the samples of the others. For lines this takes one
    /// more query to the same shaft, for the lines through these samples.
    fn densities(&mut self) {
        if self.techniques.len() == 1 {
            return;
        }
        let mut samples = std::mem::take(&mut self.memory.samples);
        for (index, technique) in self.techniques.iter().enumerate() {
            // Evaluate the densities of points directly.
            let (lines, pieces) = match &technique.source {
                Family::Lines(lines, pieces) => (lines, *pieces),
                Family::Points(source) => {
                    let source = Source(source.as_deref());
                    for sample in samples.iter_mut().filter(|s| s.technique != index) {
                        sample.densities[index] = source.density(&sample.at, self.integrand);
                    }
                    continue;
                }
            };
            // Find the visible parts of the lines through the samples of the other techniques.
            let memory = &mut *self.memory;
            memory.owners.clear();
            memory.segments.clear();
            for (k, sample) in samples.iter().enumerate() {
                if sample.technique != index {
                    memory.owners.push(k);
                    memory.segments.push(lines.through(sample.at.point));
                }
            }
            self.visible.lines(&memory.segments, &mut memory.visible);
            self.counts.plan.density_lines += memory.owners.len() as u64;
            // Evaluate the densities of lines, given these parts.
            for (i, &owner) in self.memory.owners.iter().enumerate() {
                let parts = self.memory.visible.line(i);
                let (sample, line) = (&mut samples[owner], &self.memory.segments[i]);
                sample.smooth *= self.smooth_factor(&sample.at, line, parts);
                let at = &sample.at;
                sample.densities[index] = match pieces {
                    Pieces::One => lines.density(at, parts),
                    Pieces::Each => piece_of(parameter(line, at.point), parts)
                        .map_or(0.0, |k| lines.density(at, &parts[k..=k])),
                };
            }
        }
        self.memory.samples = samples;
    }

    /// Smooths the densities across the lines, too, if all lines have one direction. This takes one
    /// more line through each sample.
    fn smooth_across(&mut self) {
        let lines = |technique: &Prepared<'_>| match &technique.source {
            Family::Lines(lines, _) => Some(lines.direction()),
            Family::Points(_) => None,
        };
        let mut directions = self.techniques.iter().filter_map(lines);
        let (Some(smooth), Some(first), None) = (self.smooth, directions.next(), directions.next())
        else {
            return;
        };
        let memory = &mut *self.memory;
        let points = memory.samples.iter().map(|s| s.at.point);
        smooth.across(first, points, &mut memory.segments);
        self.visible.lines(&memory.segments, &mut memory.visible);
        self.counts.plan.density_lines += memory.segments.len() as u64;
        for (i, sample) in memory.samples.iter_mut().enumerate() {
            let (line, parts) = (&memory.segments[i], memory.visible.line(i));
            sample.smooth *= smooth.factor(&sample.at, line, parts);
        }
    }

    /// The sum of all samples by their weights.
    fn sum(&self) -> DVec3 {
        let (count, memory) = (self.techniques.len(), &self.memory);
        let of = |i: usize| self.techniques.get(i).map_or(0.0, |t| t.expected);
        let expected: [f64; MOST_TECHNIQUES] = std::array::from_fn(of);
        let ns = &expected[..count];
        // Weight each sample by the heuristic.
        let mut sum = DVec3::ZERO;
        for sample in &memory.samples {
            let (ps, i) = (&sample.densities[..count], sample.technique);
            let weight = match self.weights {
                Weights::Alone | Weights::Balance | Weights::Optimal(_) => {
                    Heuristic::Balance.weight(ns, ps, i)
                }
                Weights::Power => Heuristic::Power(2.0).weight(ns, ps, i),
                Weights::Maximum => Heuristic::Maximum.weight(ns, ps, i),
                Weights::Average => Heuristic::Average.weight(ns, ps, i),
                Weights::Smooth(_) => {
                    let mut factors = [1.0; MOST_TECHNIQUES];
                    for (factor, technique) in factors.iter_mut().zip(&self.techniques) {
                        if matches!(technique.source, Family::Points(_)) {
                            *factor = sample.smooth;
                        }
                    }
                    smoothing::smoothed_balance(ns, ps, &factors[..count], i)
                }
            };
            sum += sample.value * (weight / (ns[i] * sample.density));
        }
        // For optimal weights, add the difference between them and the balance heuristic.
        if let Weights::Optimal(kind) = self.weights
            && let Some(first) = memory.first_round
        {
            let (first, second) = memory.samples.split_at(first);
            let rounds = [(first, memory.counts[0]), (second, memory.counts[1])];
            let rounds = rounds.map(|(samples, counts)| Round { samples, counts });
            sum = 0.5 * sum + optimal::sum(kind, &expected, rounds);
        }
        sum
    }
}
