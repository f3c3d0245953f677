//! Points on linear lights, by every technique of Peters 2021; diffuse and glossy samples together.
//!
//! A linear light has no surface: no ray and no direction drawn from a BSDF can meet it, so the
//! samples of its own techniques have the weight one and are the only ones it gets.

use crate::{
    Buffers, EmissionTexture, LinearHeuristic, LinearOptions, Query, ShadingPoint, Stream,
    closed_form, point_sum,
};
use linelit_bsdf::{ClosedForm, GlossyLobe, Phong, Reflection};
use linelit_geometry::{DMat3, DVec3, Frame, Segment};
use linelit_lights::linear::{LinearSample, LinearSampler, LinearTechnique, LtcSampler};
use linelit_lights::{LinearLight, LinearPointTechnique};
use linelit_mis::{balance, clamped_optimal, visibility_optimal_contribution, weighted_balance};
use linelit_shading::ltc::GgxLobes;
use linelit_shading::phong;
use linelit_visibility::ShaftQuery;
use std::f64::consts::FRAC_1_PI;

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

/// The light of the visible parts in closed form: one line query finds all there is to know.
pub(crate) fn whole<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    reflection: &ClosedForm<'_>,
    buffers: &mut Buffers,
) -> DVec3 {
    let ends = [linear.segment.p0, linear.segment.p1];
    let asked = ShaftQuery {
        point: query.point.position,
        light: (&ends).into(),
        exclude: query.light.triangles.clone(),
    };
    let Buffers { scratch, samples } = buffers;
    let mut shaft = query.occluders.shaft(asked, scratch);
    shaft.visible(&[linear.segment], &mut samples.visible);
    let parts = samples.visible.line(0);
    samples.segments.lines += 1;
    samples.segments.pieces += parts.len() as u64;
    closed_form::linear(linear, query.point, reflection, parts)
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
    let (mut numbers, mut samples) = ([0.0; BATCH], [LinearSample::default(); BATCH]);
    let draw = |i: u32| {
        let in_batch = i as usize % BATCH;
        if in_batch == 0 {
            let size = BATCH.min((count - i) as usize);
            for (slot, i) in numbers[..size].iter_mut().zip(i..) {
                *slot = set.get_1d(i);
            }
            sampler.sample_into(&numbers[..size], &mut samples[..size]);
        }
        let sample = &samples[in_batch];
        let value = query.point.reflected(emitted, sample.direction);
        Some((value, sample.pdf.value(), sample.offset))
    };
    point_sum::mean(count, draw, |to_light| query.is_free(*to_light, buffers))
}

/// As many diffuse samples as glossy ones, weighted.
fn by_pair<R: Reflection, T: EmissionTexture>(
    query: &Query<'_, R, T>,
    linear: &LinearLight,
    heuristic: LinearHeuristic,
    buffers: &mut Buffers,
) -> DVec3 {
    let technique = LinearTechnique::ProjectedSolidAngle;
    let Some(glossy) = Lobe::new(query.point, &linear.segment) else {
        return by_technique(query, linear, technique, buffers);
    };
    let (x, n) = (query.point.position, query.point.normal);
    let Some(flat) = LinearSampler::new(technique, &linear.segment, x, n) else {
        return DVec3::ZERO;
    };
    let emitted = linear.radiance_radius;
    let albedo = query
        .point
        .bsdf
        .diffuse_albedo()
        .max(DVec3::splat(LEAST_ALBEDO));
    let pair = DiffuseGlossyPair {
        heuristic,
        count: f64::from(query.samples),
        parts: [
            emitted * albedo * (FRAC_1_PI * flat.irradiance()),
            emitted * glossy.reflected,
        ],
    };
    let sets = [Stream::Samples, Stream::Glossy].map(|s| query.numbers.points(s, query.samples));
    let mut sum = DVec3::ZERO;
    for i in 0..query.samples {
        let a = flat.sample(sets[0].get_1d(i));
        let b = glossy.sampler.sample(sets[1].get_1d(i));
        let densities = [
            [a.pdf.value(), glossy.sampler.pdf(a.t).value()],
            [flat.pdf(b.t).value(), b.pdf.value()],
        ];
        for (k, sample) in [a, b].iter().enumerate() {
            let value = query.point.reflected(emitted, sample.direction);
            let free = value != DVec3::ZERO && query.is_free(sample.offset, buffers);
            let value = if free { value } else { DVec3::ZERO };
            sum += pair.contribution(value, densities[k], k);
        }
    }
    sum
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
    /// What a sample of technique `k` adds: its weight times value over density and count.
    fn contribution(&self, value: DVec3, pdfs: [f64; 2], k: usize) -> DVec3 {
        let counts = [self.count; 2];
        let by_channel = |c: usize| {
            let parts = self.parts.map(|p| p[c]);
            let weight = match self.heuristic {
                LinearHeuristic::Balance => balance(&counts, &pdfs, k),
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

/// The glossy part of a material, as the LTC technique sees it.
struct Lobe {
    sampler: LtcSampler,
    /// What it reflects of a unit of radiance × radius, unshadowed.
    reflected: DVec3,
}

impl Lobe {
    /// `None` if the reflection has no such lobe, or the line does not meet its cosine.
    fn new<R: Reflection>(point: &ShadingPoint<R>, line: &Segment) -> Option<Self> {
        let relative = line.relative_to(point.position);
        let (map, reflected) = match point.bsdf.glossy_lobe()? {
            GlossyLobe::Phong { scale, lobe } => {
                let axis = Phong::axis(point.outgoing, point.normal);
                let (p0, p1) = (relative.p0, relative.p1);
                let whole = phong::cylinder(p0, p1, point.normal, axis, lobe.exponent);
                (phong_map(axis, lobe.exponent), scale * lobe.scale() * whole)
            }
            GlossyLobe::Ggx {
                scale,
                roughness,
                f0,
            } => {
                let (map, whole) = ggx(roughness, f0, point, &relative);
                (map, scale * whole)
            }
        };
        let sampler = LtcSampler::new(line, point.position, point.normal, map)?;
        Some(Self { sampler, reflected })
    }
}

/// GGX as its two fitted lobes, of weights F0 and 1 − F0: the map of the one that gives more, and
/// what both give.
fn ggx<R>(roughness: f64, f0: DVec3, point: &ShadingPoint<R>, line: &Segment) -> (DMat3, DVec3) {
    let frame = Frame::from_normal_and_tangent(point.normal, point.outgoing);
    let cosine = point.normal.dot(point.outgoing);
    // With F0 = ½ each lobe has one half of its albedo.
    let lobes = GgxLobes::new(roughness, cosine, 0.5);
    let [flat, grazing] = lobes.lobes();
    let [a, b] = [flat, grazing].map(|l| 2.0 * l.line(&frame, line.p0, line.p1));
    let f0_mean = f0.element_sum() / 3.0;
    let lobe = if f0_mean * a >= (1.0 - f0_mean) * b {
        flat
    } else {
        grazing
    };
    let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
    (to_world * lobe.map(), f0 * a + (DVec3::ONE - f0) * b)
}

/// A linear map from the cosine to a lobe as high as (k + 1)/(2π) cosᵏ about `axis`: across it, the
/// cosine shrinks by √(2/(k + 1)). Where the lobes differ, the weights make up for it.
fn phong_map(axis: DVec3, k: f64) -> DMat3 {
    let frame = Frame::from_normal(axis);
    let across = (2.0 / (k + 1.0)).sqrt().min(1.0);
    DMat3::from_cols(frame.x * across, frame.y * across, frame.z)
}
