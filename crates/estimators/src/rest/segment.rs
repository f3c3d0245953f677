//! Points on linear lights are sampled here, by every technique of Peters 2021, with diffuse and
//! glossy samples together.
//!
//! A linear light has no surface, so that no ray and no direction drawn from a BSDF can hit it.
//! Hence the techniques for linear lights are the only ones that sample it, and they are not
//! weighted with any others.

use super::alone::mean;
use crate::draw::block::{BLOCK, PointBlock};
use crate::streams::Samples;
use crate::visible::Visible;
use crate::{LinearHeuristic, LinearOptions, ShadingPoint, Stream};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{DVec3, Segment, stop};
use linelit_lights::linear::{LinearSample, LinearSampler, LinearTechnique, SegmentLtc};
use linelit_lights::{LinearPointTechnique, Pdf};
use linelit_mis::{balance, clamped_optimal, visibility_optimal_contribution, weighted_balance};
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

/// The least diffuse albedo in the weights. It makes sure that the technique that covers all of the
/// light always has some weight.
const LEAST_ALBEDO: f64 = 0.01;
/// The number of samples that are drawn at a time.
const BATCH: usize = 32;

/// The memory of pairs of a diffuse and a glossy point, which is reused.
#[derive(Debug, Default)]
pub(crate) struct SegmentMemory {
    /// The light that each point sends to the viewer, and its densities by both techniques.
    pairs: Vec<(DVec3, [f64; 2])>,
    targets: Vec<DVec3>,
}

/// What is sampled: a linear light as a shading point sees it.
#[derive(Debug)]
pub(crate) struct SegmentQuery<'a, R> {
    pub point: &'a ShadingPoint<R>,
    pub line: &'a Segment,
    /// The light's radiance times its radius.
    pub emitted: DVec3,
    pub samples: Samples<'a>,
}

/// The mean over points on a linear light of L R f_r V cos θ/p, where R is the radius, and p is per
/// solid angle and per radius.
pub(crate) fn points<R: Reflection>(
    asked: &SegmentQuery<'_, R>,
    options: LinearOptions,
    cosines: Option<&LtcMixture>,
    visible: &mut Visible<'_>,
    memory: &mut SegmentMemory,
    block: &mut PointBlock,
) -> DVec3 {
    // Choose the technique for diffuse light, and the heuristic if there are two techniques.
    let (technique, heuristic) = match options {
        LinearOptions::Technique(technique) => (technique, None),
        LinearOptions::Ltc(heuristic @ LinearHeuristic::Balance(technique)) => {
            (technique, Some(heuristic))
        }
        LinearOptions::Ltc(heuristic) => (LinearTechnique::ProjectedSolidAngle, Some(heuristic)),
    };
    let (line, x, n) = (asked.line, asked.point.position, asked.point.normal);
    let Some(flat) = LinearSampler::new(technique, line, x, n) else {
        return DVec3::ZERO;
    };
    // Sample by that technique alone if there is no lobe.
    let (Some(heuristic), Some(cosines)) = (heuristic, cosines) else {
        return by_technique(asked, &flat, visible, block);
    };
    let Some(glossy) = SegmentLtc::new(line, x, n, cosines) else {
        return by_technique(asked, &flat, visible, block);
    };
    // Otherwise weight it with samples by the LTCs of the lobes.
    let albedo = cosines.diffuse.max(DVec3::splat(LEAST_ALBEDO));
    let pair = DiffuseGlossyPair {
        heuristic,
        count: f64::from(asked.samples.count),
        parts: [
            // The balance heuristic does not use these parts, so that its first technique need not
            // know its irradiance.
            asked.emitted * albedo * (FRAC_1_PI * flat.irradiance().unwrap_or(0.0)),
            asked.emitted * glossy.reflected,
        ],
    };
    pair.sum(asked, &flat, &glossy, visible, memory)
}

/// The mean over points that one technique draws.
fn by_technique<R: Reflection>(
    asked: &SegmentQuery<'_, R>,
    sampler: &LinearSampler,
    visible: &mut Visible<'_>,
    block: &mut PointBlock,
) -> DVec3 {
    let set = asked.samples.set();
    let (mut numbers, mut drawn) = ([0.0; BATCH], [LinearSample::default(); BATCH]);
    let draw = |wanted: Range<u32>, block: &mut PointBlock| {
        for first in wanted.clone().step_by(BATCH) {
            let size = BATCH.min((wanted.end - first) as usize);
            for (slot, i) in numbers[..size].iter_mut().zip(first..) {
                *slot = set.get_1d(i);
            }
            sampler.sample_into(&numbers[..size], &mut drawn[..size]);
            for sample in &drawn[..size] {
                let value = asked.point.reflected(asked.emitted, sample.direction);
                block.push(value, sample.pdf.value(), sample.offset);
            }
        }
    };
    mean(asked.samples.count, block, visible, draw)
}

/// Diffuse and glossy samples of a linear light, and what the heuristic needs to weight them.
struct DiffuseGlossyPair {
    heuristic: LinearHeuristic,
    /// The number of samples of each technique.
    count: f64,
    /// The unshadowed diffuse and glossy light, by channel.
    parts: [DVec3; 2],
}

impl DiffuseGlossyPair {
    /// The weighted sum of all samples of both techniques.
    fn sum<R: Reflection>(
        &self,
        asked: &SegmentQuery<'_, R>,
        flat: &LinearSampler,
        glossy: &SegmentLtc,
        visible: &mut Visible<'_>,
        memory: &mut SegmentMemory,
    ) -> DVec3 {
        let (samples, count) = (&asked.samples, asked.samples.count);
        let sets = [Stream::Samples, Stream::Glossy].map(|s| samples.numbers.points(s, count));
        let SegmentMemory { pairs, targets } = memory;
        let mut sum = DVec3::ZERO;
        let mut first = 0;
        while first < count {
            let end = count.min(first.saturating_add(BLOCK / 2));
            stop::check();
            // Draw the samples of a block by both techniques, with the densities of both.
            pairs.clear();
            targets.clear();
            for i in first..end {
                let a = flat.sample(sets[0].get_1d(i));
                let b = glossy.sample(sets[1].get_1d(i));
                let densities = [[a.pdf, glossy.pdf(a.t)], [flat.pdf(b.t), b.pdf]];
                for (sample, densities) in [a, b].iter().zip(densities) {
                    let value = asked.point.reflected(asked.emitted, sample.direction);
                    pairs.push((value, densities.map(Pdf::value)));
                    if value != DVec3::ZERO {
                        targets.push(sample.offset);
                    }
                }
            }
            // Query their visibility, and add them by their weights.
            let mut free = visible.points(targets);
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

    /// The contribution of a sample of technique `k`: weight × value / (density × count).
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
