//! Points on linear lights, by every technique of Peters 2021; diffuse and glossy samples together.
//!
//! A linear light has no surface: no ray and no direction drawn from a BSDF can meet it, so the
//! samples of its own techniques have the weight one and are the only ones it gets.

use crate::estimator::ParseEstimatorError;
use crate::options::pairs;
use crate::pair::Pair;
use crate::{ShadingPoint, Workspace};
use linelit_bsdf::{GlossyLobe, Phong, Reflection};
use linelit_geometry::{DMat3, DVec3, Frame, Segment};
use linelit_lights::LinearLight;
use linelit_lights::linear::{LinearSample, LinearSampler, LinearTechnique, LtcSampler};
use linelit_mis::{balance, clamped_optimal, visibility_optimal_contribution, weighted_balance};
use linelit_samplers::Sampler;
use linelit_shading::ltc::GgxLobes;
use linelit_shading::phong;
use std::f64::consts::FRAC_1_PI;
use std::fmt;

/// How points on linear lights are drawn: the options of `point-linear`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearOptions {
    /// `technique=area`, `solid-angle`, `clipped-solid-angle`, `linear-cosine`, `quadratic-cosine`,
    /// `newton-bisection`, `projected-solid-angle`: one technique.
    Technique(LinearTechnique),
    /// `technique=ltc`: as many samples by projected solid angle, for what is diffuse, as by a
    /// linearly transformed cosine, for the lobe; weighted by `mis=…`. On a surface without a lobe,
    /// the first alone.
    Ltc(LinearHeuristic),
}

/// How diffuse and glossy samples of a linear light are weighted (Peters 2021, section 4.2).
///
/// The heuristics but the first know the unshadowed diffuse and glossy light cₖ, by channel, in
/// closed form. The share ν of them is the visibility that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinearHeuristic {
    /// `mis=balance`: by the densities.
    Balance,
    /// `mis=weighted-balance`: by cₖ times the densities; perfect where nothing is hidden.
    WeightedBalance,
    /// `mis=optimal`, `nu=ν`: the optimal heuristic for the visibility ν. Contributions of hidden
    /// samples count, and may be negative.
    Optimal(f64),
    /// `mis=clamped-optimal`, `nu=ν`: ν times the weighted balance and 1 − ν times the balance.
    ClampedOptimal(f64),
}

/// Peters' ν.
const NU: f64 = 0.5;
/// What diffuse albedos count at least in the weights, so that the technique that covers all of the
/// light is always heard.
const LEAST_ALBEDO: f64 = 0.01;
/// Samples made at a time.
const BATCH: usize = 32;

impl Default for LinearOptions {
    fn default() -> Self {
        Self::Technique(LinearTechnique::ProjectedSolidAngle)
    }
}

impl LinearOptions {
    /// Reads what stands in the brackets of `point-linear[…]`.
    pub(crate) fn parse(options: &str) -> Result<Self, ParseEstimatorError> {
        let (mut technique, mut mis, mut nu) = (None, None, None);
        for (key, value) in pairs(options) {
            match key {
                "technique" => technique = Some(value),
                "mis" => mis = Some(value),
                "nu" => nu = Some(parse_nu(value)?),
                _ => {
                    return Err(ParseEstimatorError::new(format!(
                        "`point-linear` has no option `{key}`; expected technique, mis or nu"
                    )));
                }
            }
        }
        if technique == Some("ltc") {
            return heuristic(mis, nu).map(Self::Ltc);
        }
        if mis.is_some() || nu.is_some() {
            return Err(ParseEstimatorError::new(
                "`mis` and `nu` weigh the two techniques of `technique=ltc`",
            ));
        }
        let Some(name) = technique else {
            return Ok(Self::default());
        };
        let found = LinearTechnique::ALL.into_iter().find(|t| t.name() == name);
        found.map(Self::Technique).ok_or_else(|| {
            let names = LinearTechnique::ALL.map(LinearTechnique::name).join(", ");
            ParseEstimatorError::new(format!("technique `{name}`; expected {names} or ltc"))
        })
    }
}

fn parse_nu(value: &str) -> Result<f64, ParseEstimatorError> {
    let nu = value.parse().ok().filter(|v| (0.0..=1.0).contains(v));
    nu.ok_or_else(|| ParseEstimatorError::new(format!("nu `{value}`; expected 0 to 1")))
}

fn heuristic(mis: Option<&str>, nu: Option<f64>) -> Result<LinearHeuristic, ParseEstimatorError> {
    let found = match mis {
        None | Some("clamped-optimal") => LinearHeuristic::ClampedOptimal(nu.unwrap_or(NU)),
        Some("optimal") => LinearHeuristic::Optimal(nu.unwrap_or(NU)),
        Some("balance") if nu.is_none() => LinearHeuristic::Balance,
        Some("weighted-balance") if nu.is_none() => LinearHeuristic::WeightedBalance,
        Some(name @ ("balance" | "weighted-balance")) => {
            return Err(ParseEstimatorError::new(format!(
                "`mis={name}` knows no nu"
            )));
        }
        Some(name) => {
            return Err(ParseEstimatorError::new(format!(
                "mis `{name}`; expected balance, weighted-balance, optimal or clamped-optimal"
            )));
        }
    };
    Ok(found)
}

impl fmt::Display for LinearOptions {
    /// The options in brackets; those that are the default are left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let heuristic = match self {
            Self::Technique(LinearTechnique::ProjectedSolidAngle) => return Ok(()),
            Self::Technique(technique) => return write!(f, "[technique={}]", technique.name()),
            Self::Ltc(heuristic) => heuristic,
        };
        let (name, nu) = match heuristic {
            LinearHeuristic::Balance => (",mis=balance", None),
            LinearHeuristic::WeightedBalance => (",mis=weighted-balance", None),
            LinearHeuristic::Optimal(nu) => (",mis=optimal", Some(nu)),
            LinearHeuristic::ClampedOptimal(nu) => ("", Some(nu)),
        };
        write!(f, "[technique=ltc{name}")?;
        if let Some(nu) = nu.filter(|nu| (**nu - NU).abs() > 0.0) {
            write!(f, ",nu={nu}")?;
        }
        f.write_str("]")
    }
}

impl Pair<'_> {
    /// Points on a linear light: the mean of L R f_r V cos θ/p, with p per solid angle and radius.
    pub(crate) fn points_on_line(
        &self,
        linear: &LinearLight,
        options: LinearOptions,
        workspace: &mut Workspace,
    ) -> DVec3 {
        match options {
            LinearOptions::Technique(technique) => self.by_one(linear, technique, workspace),
            LinearOptions::Ltc(heuristic) => self.by_two(linear, heuristic, workspace),
        }
    }

    fn by_one(
        &self,
        linear: &LinearLight,
        technique: LinearTechnique,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let (x, n) = (self.point.position, self.point.normal);
        let Some(sampler) = LinearSampler::new(technique, &linear.segment, x, n) else {
            return DVec3::ZERO;
        };
        let (set, count) = (self.samples(), self.count());
        let mut sum = DVec3::ZERO;
        let (mut numbers, mut samples) = ([0.0; BATCH], [LinearSample::default(); BATCH]);
        let mut first = 0;
        while first < count {
            let some = (count - first).min(32);
            for (slot, i) in numbers.iter_mut().zip(first..first + some) {
                *slot = set.get_1d(i);
            }
            first += some;
            let taken = &mut samples[..some as usize];
            sampler.sample_into(&numbers[..taken.len()], taken);
            for sample in taken {
                let value = unshadowed(linear, self.point, sample.direction);
                let pdf = sample.pdf.value();
                if pdf > 0.0 && value != DVec3::ZERO && self.is_free(sample.offset, workspace) {
                    sum += value * (1.0 / pdf);
                }
            }
        }
        sum / f64::from(count)
    }

    fn by_two(
        &self,
        linear: &LinearLight,
        heuristic: LinearHeuristic,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let Some(glossy) = Lobe::new(self.point, &linear.segment) else {
            return self.by_one(linear, LinearTechnique::ProjectedSolidAngle, workspace);
        };
        let (x, n) = (self.point.position, self.point.normal);
        let (technique, line) = (LinearTechnique::ProjectedSolidAngle, &linear.segment);
        let Some(flat) = LinearSampler::new(technique, line, x, n) else {
            return DVec3::ZERO;
        };
        let albedo = self
            .point
            .bsdf
            .diffuse_albedo()
            .max(DVec3::splat(LEAST_ALBEDO));
        let two = Two {
            heuristic,
            count: f64::from(self.count()),
            // Diffuse and glossy light without shadows.
            parts: [
                linear.radiance_radius * albedo * (FRAC_1_PI * flat.irradiance()),
                linear.radiance_radius * glossy.reflected,
            ],
        };
        let sampler = Sampler::new(self.settings.sampler, self.settings.seed);
        let sets = [0, 1].map(|k| sampler.points(self.pixel, self.dimension + k, self.count()));
        let mut sum = DVec3::ZERO;
        for i in 0..self.count() {
            let a = flat.sample(sets[0].get_1d(i));
            let b = glossy.sampler.sample(sets[1].get_1d(i));
            let densities = [
                [a.pdf.value(), glossy.sampler.pdf(a.t).value()],
                [flat.pdf(b.t).value(), b.pdf.value()],
            ];
            for (k, sample) in [a, b].iter().enumerate() {
                let value = unshadowed(linear, self.point, sample.direction);
                let free = value != DVec3::ZERO && self.is_free(sample.offset, workspace);
                let value = if free { value } else { DVec3::ZERO };
                sum += two.contribution(value, densities[k], k);
            }
        }
        sum
    }
}

/// What the heuristics know of the two techniques.
struct Two {
    heuristic: LinearHeuristic,
    /// Samples of each.
    count: f64,
    /// The unshadowed light of each technique's part, by channel.
    parts: [DVec3; 2],
}

impl Two {
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
    fn new(point: &ShadingPoint, line: &Segment) -> Option<Self> {
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
fn ggx(roughness: f64, f0: DVec3, point: &ShadingPoint, seen: &Segment) -> (DMat3, DVec3) {
    let frame = Frame::from_normal_and_tangent(point.normal, point.outgoing);
    let cosine = point.normal.dot(point.outgoing);
    // With F0 = ½ both lobes have half their albedo.
    let halves = GgxLobes::new(roughness, cosine, 0.5);
    let [flat, grazing] = halves.lobes();
    let [a, b] = [flat, grazing].map(|l| 2.0 * l.line(&frame, seen.p0, seen.p1));
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

/// L R f_r cos θ towards `w`, whatever stands between.
fn unshadowed(linear: &LinearLight, point: &ShadingPoint, w: DVec3) -> DVec3 {
    let cosine = point.cosine(w);
    if cosine <= 0.0 {
        return DVec3::ZERO;
    }
    linear.radiance_radius * point.bsdf.eval(w, point.outgoing, point.normal) * cosine
}

#[cfg(test)]
mod tests {
    use crate::Estimator;

    #[test]
    fn names_round_trip() {
        let texts = [
            "point-linear",
            "point-linear[technique=area]",
            "point-linear[technique=solid-angle]",
            "point-linear[technique=clipped-solid-angle]",
            "point-linear[technique=linear-cosine]",
            "point-linear[technique=quadratic-cosine]",
            "point-linear[technique=newton-bisection]",
            "point-linear[technique=ltc]",
            "point-linear[technique=ltc,mis=balance]",
            "point-linear[technique=ltc,mis=weighted-balance]",
            "point-linear[technique=ltc,mis=optimal]",
            "point-linear[technique=ltc,mis=optimal,nu=0.25]",
            "point-linear[technique=ltc,nu=0.75]",
        ];
        for text in texts {
            assert_eq!(text.parse::<Estimator>().unwrap().to_string(), text);
        }
        let spelt = "point-linear[technique=projected-solid-angle]";
        assert_eq!(spelt.parse::<Estimator>().unwrap().to_string(), texts[0]);
    }

    #[test]
    fn errors_say_what_was_expected() {
        let error = |t: &str| t.parse::<Estimator>().unwrap_err().to_string();
        assert!(error("point-linear[technique=cosine]").contains("quadratic-cosine"));
        assert!(error("point-linear[technique=ltc,mis=power]").contains("clamped-optimal"));
        assert!(error("point-linear[technique=ltc,mis=balance,nu=1]").contains("knows no nu"));
        assert!(error("point-linear[technique=ltc,nu=2]").contains("0 to 1"));
        assert!(error("point-linear[mis=balance]").contains("technique=ltc"));
        assert!(error("point-linear[width=2]").contains("no option `width`"));
    }
}
