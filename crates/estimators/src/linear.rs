//! Points on linear lights, by every technique of Peters 2021; diffuse and glossy samples together.
//!
//! A linear light has no surface: no ray and no direction drawn from a BSDF can meet it, so the
//! samples of its own techniques have the weight one and are the only ones it gets.

use crate::point_block::{BLOCK, PointBlock};
use crate::{
    Buffers, EmissionTexture, LinearHeuristic, LinearOptions, Query, SampleBuffers, ShadingPoint,
    Stream, closed_form, point_sum,
};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::finite::below_one;
use linelit_geometry::{DMat3, DVec3, Segment};
use linelit_lights::linear::{LinearSample, LinearSampler, LinearTechnique, LtcSampler};
use linelit_lights::{LinearLight, LinearPointTechnique};
use linelit_mis::{balance, clamped_optimal, visibility_optimal_contribution, weighted_balance};
use linelit_shading::quadrature::Model;
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

/// What diffuse albedos count at least in the weights, so that the technique that covers all of the
/// light is always heard.
const LEAST_ALBEDO: f64 = 0.01;
/// Samples made at a time.
const BATCH: usize = 32;

/// Points on a linear light: the mean of L R f_r V cos θ/p, with p per solid angle and radius.
pub(crate) fn points<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    options: LinearOptions,
    buffers: &mut Buffers,
) -> DVec3 {
    match options {
        LinearOptions::Technique(technique) => by_technique(query, linear, technique, buffers),
        LinearOptions::Ltc(heuristic) => by_pair(query, linear, heuristic, buffers),
    }
}

/// The light of the visible parts: one line query finds all there is to know. In closed form, or by
/// quadrature where the peaks of the reflection are known; `None` for any other.
pub(crate) fn whole<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    buffers: &mut Buffers,
) -> Option<DVec3> {
    let point = query.point;
    let closed = point.known().closed_form();
    if closed.is_none() {
        let line = linear.segment.relative_to(point.position);
        point.bsdf.peaks(&line, point.outgoing, point.normal)?;
    }
    let ends = [linear.segment.p0, linear.segment.p1];
    let asked = query.shaft(&ends);
    let Buffers { scratch, samples } = buffers;
    let mut shaft = query.occluders.shaft(asked, scratch);
    shaft.visible(&[linear.segment], &mut samples.visible);
    let parts = samples.visible.line(0);
    samples.segments.lines += 1;
    samples.segments.pieces += parts.len() as u64;
    Some(match closed {
        Some(reflection) => closed_form::linear(linear, point, &reflection, parts),
        None => {
            let sum = closed_form::by_quadrature(&linear.segment, point, parts, Model::Cylinder);
            linear.radiance_radius * sum
        }
    })
}

/// One technique.
fn by_technique<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    technique: LinearTechnique,
    buffers: &mut Buffers,
) -> DVec3 {
    let (x, n) = (query.point.position, query.point.normal);
    let Some(sampler) = LinearSampler::new(technique, &linear.segment, x, n) else {
        return DVec3::ZERO;
    };
    let (set, count, emitted) = (query.numbers(), query.samples, linear.radiance_radius);
    let (mut numbers, mut drawn) = ([0.0; BATCH], [LinearSample::default(); BATCH]);
    let draw = |wanted: Range<u32>, block: &mut PointBlock| {
        for first in wanted.clone().step_by(BATCH) {
            let size = BATCH.min((wanted.end - first) as usize);
            for (slot, i) in numbers[..size].iter_mut().zip(first..) {
                *slot = set.get_1d(i);
            }
            sampler.sample_into(&numbers[..size], &mut drawn[..size]);
            for sample in &drawn[..size] {
                let value = query.point.reflected(emitted, sample.direction);
                block.push(value, sample.pdf.value(), sample.offset);
            }
        }
    };
    let Buffers { scratch, samples } = buffers;
    let free = |to_light: &[DVec3]| query.free(to_light, scratch);
    point_sum::mean(count, &mut samples.points, draw, free)
}

/// As many diffuse samples as glossy ones, weighted.
fn by_pair<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    heuristic: LinearHeuristic,
    buffers: &mut Buffers,
) -> DVec3 {
    let technique = match heuristic {
        LinearHeuristic::Balance(first) => first,
        LinearHeuristic::WeightedBalance
        | LinearHeuristic::Optimal(_)
        | LinearHeuristic::ClampedOptimal(_) => LinearTechnique::ProjectedSolidAngle,
    };
    let (x, n) = (query.point.position, query.point.normal);
    let glossy = query.point.cosines().and_then(|c| {
        let glossy = Glossy::new(&c, query.point, &linear.segment)?;
        Some((c.diffuse, glossy))
    });
    let Some((diffuse, glossy)) = glossy else {
        return by_technique(query, linear, technique, buffers);
    };
    let Some(flat) = LinearSampler::new(technique, &linear.segment, x, n) else {
        return DVec3::ZERO;
    };
    let emitted = linear.radiance_radius;
    let albedo = diffuse.max(DVec3::splat(LEAST_ALBEDO));
    let pair = DiffuseGlossyPair {
        heuristic,
        count: f64::from(query.samples),
        parts: [
            emitted * albedo * (FRAC_1_PI * flat.irradiance()),
            emitted * glossy.reflected,
        ],
    };
    pair.sum(query, &flat, &glossy, emitted, buffers)
}

/// Diffuse and glossy samples of a linear light, as their heuristic knows them.
struct DiffuseGlossyPair {
    heuristic: LinearHeuristic,
    /// Samples of each.
    count: f64,
    /// The unshadowed light of each technique's part, by channel.
    parts: [DVec3; 2],
}

impl DiffuseGlossyPair {
    /// The weighted sum of all samples of both.
    fn sum<R: Reflection, T: EmissionTexture>(
        &self,
        query: &Query<'_, R, T>,
        flat: &LinearSampler,
        glossy: &Glossy,
        emitted: DVec3,
        buffers: &mut Buffers,
    ) -> DVec3 {
        let sets =
            [Stream::Samples, Stream::Glossy].map(|s| query.numbers.points(s, query.samples));
        let Buffers { scratch, samples } = buffers;
        let SampleBuffers { pairs, targets, .. } = samples;
        let mut sum = DVec3::ZERO;
        let mut first = 0;
        while first < query.samples {
            let end = query.samples.min(first.saturating_add(BLOCK / 2));
            pairs.clear();
            targets.clear();
            for i in first..end {
                let a = flat.sample(sets[0].get_1d(i));
                let (b, density) = glossy.sample(sets[1].get_1d(i));
                let densities = [
                    [a.pdf.value(), glossy.pdf(a.t)],
                    [flat.pdf(b.t).value(), density],
                ];
                for (sample, densities) in [a, b].iter().zip(densities) {
                    let value = query.point.reflected(emitted, sample.direction);
                    pairs.push((value, densities));
                    if value != DVec3::ZERO {
                        targets.push(sample.offset);
                    }
                }
            }
            let mut free = query.free(targets, scratch);
            for (i, (value, densities)) in pairs.iter_mut().enumerate() {
                if *value != DVec3::ZERO {
                    *value = if free & 1 != 0 { *value } else { DVec3::ZERO };
                    free >>= 1;
                }
                sum += self.contribution(*value, *densities, i % 2);
            }
            first = end;
        }
        sum
    }

    /// What a sample of technique `k` adds: its weight times value over density and count.
    fn contribution(&self, value: DVec3, pdfs: [f64; 2], k: usize) -> DVec3 {
        let counts = [self.count; 2];
        let by_channel = |c: usize| {
            let parts = self.parts.map(|p| p[c]);
            let weight = match self.heuristic {
                LinearHeuristic::Balance(_) => balance(&counts, &pdfs, k),
                LinearHeuristic::WeightedBalance => weighted_balance(&parts, &pdfs, k),
                LinearHeuristic::ClampedOptimal(nu) => {
                    clamped_optimal(&parts, &counts, &pdfs, nu, k)
                }
                LinearHeuristic::Optimal(nu) => {
                    return visibility_optimal_contribution(
                        &parts, &counts, &pdfs, nu, value[c], k,
                    );
                }
            };
            if value[c] > 0.0 && pdfs[k] > 0.0 {
                weight * value[c] / (pdfs[k] * self.count)
            } else {
                0.0
            }
        };
        DVec3::new(by_channel(0), by_channel(1), by_channel(2))
    }
}

/// The lobes of a reflection over a linear light, drawn from as one technique.
struct Glossy {
    /// Each with its share of the samples.
    first: (LtcSampler, f64),
    others: [Option<(LtcSampler, f64)>; TransformedCosines::MAX],
    /// What they reflect of a unit of radiance × radius, unshadowed.
    reflected: DVec3,
}

impl Glossy {
    /// Shares in proportion to what each lobe reflects of the unshadowed light. `None` if there are
    /// no lobes, or none reflects any of it.
    fn new<R>(
        cosines: &TransformedCosines,
        point: &ShadingPoint<R>,
        line: &Segment,
    ) -> Option<Self> {
        let frame = cosines.frame;
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        let mut lobes = [None; TransformedCosines::MAX];
        let mut reflected = DVec3::ZERO;
        for (slot, lobe) in lobes.iter_mut().zip(cosines.lobes()) {
            let map = to_world * lobe.map;
            if let Some(sampler) = LtcSampler::new(line, point.position, point.normal, map) {
                let part = lobe.albedo * sampler.integral();
                reflected += part;
                *slot = Some((sampler, part.element_sum())).filter(|(_, part)| *part > 0.0);
            }
        }
        let total = reflected.element_sum();
        for (_, share) in lobes.iter_mut().flatten() {
            *share /= total;
        }
        let first = lobes.iter_mut().find_map(Option::take)?;
        total.is_finite().then_some(Self {
            first,
            others: lobes,
            reflected,
        })
    }

    /// Draws from one of the lobes, for the choice of which `xi` is split and rescaled; with the
    /// density of all together.
    fn sample(&self, mut xi: f64) -> (LinearSample, f64) {
        let mut drawn = &self.first;
        for next in self.others.iter().flatten() {
            if xi < drawn.1 {
                break;
            }
            xi -= drawn.1;
            drawn = next;
        }
        let sample = drawn.0.sample(below_one(xi / drawn.1));
        (sample, self.pdf(sample.t))
    }

    fn pdf(&self, t: f64) -> f64 {
        let lobes = std::iter::once(&self.first).chain(self.others.iter().flatten());
        lobes.map(|(s, share)| share * s.pdf(t).value()).sum()
    }
}
