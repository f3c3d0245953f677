//! Measurements that no cell of estimators can express: each is a function of its own, which
//! evaluates formulas and algorithms as the papers print them.
#![allow(
    clippy::disallowed_methods,
    reason = "times, and formulas as they are printed"
)]

mod billen;
pub(crate) mod inverse;
pub(crate) mod peters;
mod salesin;
mod shirley;

use super::bench::Bench;
use crate::measured::Measured;
use anyhow::Result;
use linelit_geometry::DVec3;
use linelit_samplers::{Sampler, SamplerKind};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The measured numbers by name.
pub(super) type Out = BTreeMap<String, Measured>;

/// The name of a function, the study that it belongs to (empty for none), and the function.
pub(super) type Special = (
    &'static str,
    &'static str,
    fn(&Bench<'_>, &mut Out) -> Result<()>,
);

/// All functions that measure such numbers.
pub(super) const ALL: [Special; 14] = [
    ("diffuse line", "", billen::diffuse_line),
    ("phong line", "", billen::phong_line),
    ("growth", "billen-growth", billen::growth),
    ("share", "billen-growth", billen::share),
    ("combination", "", salesin::combination),
    ("sequences", "", salesin::sequences),
    ("weights", "salesin-fig4", salesin::weights),
    ("linear formulas", "peters-fig3", peters::linear_lights),
    ("two steps", "peters-fig3", peters::two_steps),
    ("rounding", "peters-fig4", peters::single_precision),
    ("costs", "peters-table1", peters::costs),
    ("blur", "peters-fig7", peters::blurred),
    ("proxy", "shirley", shirley::grazing),
    ("far side", "shirley", shirley::unseen),
];

/// A stream of independent uniform random numbers.
pub(super) struct Numbers {
    sampler: Sampler,
    next: u32,
}

impl Numbers {
    /// Creates the stream of a seed.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            sampler: Sampler::new(SamplerKind::Independent, seed),
            next: 0,
        }
    }

    /// Draws a number that is uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        self.next += 1;
        let block = self.next / BLOCK;
        let set = self.sampler.points([block, 0], 0, BLOCK);
        set.get_1d(self.next % BLOCK)
    }

    /// Draws a number that is uniform between two others.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Draws a direction, uniform on the sphere.
    pub(super) fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, 2.0 * PI).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// The number of points that are drawn from one set of the sampler.
const BLOCK: u32 = 1 << 12;

/// Integrates by Simpson's rule with 2,000 steps. The error of integrands as smooth as those here
/// is below 1e-11 of the largest value, by (b − a)⁵/180/n⁴ times a fourth derivative below 1e4.
pub(super) fn integral(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    const STEPS: u32 = 2000;
    let h = (b - a) / f64::from(STEPS);
    let weight = |k: u32| match k {
        0 | STEPS => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=STEPS)
        .map(|k| weight(k) * f(a + h * f64::from(k)))
        .sum();
    sum * h / 3.0
}
