//! These settings say how the light at a point is estimated.

use linelit_estimators::Estimator;
use linelit_samplers::{Block, SamplerKind};
use std::fmt;
use std::str::FromStr;

/// The settings of an estimate of the direct light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    /// The estimator for lights that have no estimator of their own.
    pub estimator: &'a Estimator,
    /// The sampling pattern.
    pub sampler: SamplerKind,
    /// The seed, which may be any number; two seeds give independent estimates.
    pub seed: u64,
    /// The number of samples of each light. If a light is chosen at random for each sample
    /// ([`LightChoice`]), it is the number of samples of all lights together. It is clamped to the
    /// range from 1 to [`MOST_SAMPLES`](linelit_estimators::MOST_SAMPLES).
    pub samples: u32,
    /// Which lights a point samples.
    pub lights: LightChoice,
    /// Whether lights that cannot contribute are skipped, and closed forms are used where nothing
    /// is hidden. If `false`, every sample is taken, as published.
    pub skip: bool,
    /// Whether the lines and points of a combination share one traversal of the hierarchy. If
    /// `false`, each has its own, as published. Estimates differ by rounding only.
    pub share: bool,
}

impl<'a> Settings<'a> {
    /// The default settings: all lights are sampled with the pattern `auto` and the seed 0, and
    /// what can be skipped is skipped.
    #[must_use]
    pub const fn new(estimator: &'a Estimator, samples: u32) -> Self {
        Self {
            estimator,
            sampler: SamplerKind::Auto,
            seed: 0,
            samples,
            lights: LightChoice::All,
            skip: true,
            share: true,
        }
    }
}

/// The names by which a shading point gets its random numbers. With one seed, points with different
/// names have independent numbers.
#[derive(Clone, Copy, Debug)]
pub struct SampleNames {
    /// The pixel; for a point that belongs to no picture, a hash of the point.
    pub pixel: [u32; 2],
    /// The number of the shading point along a path of perfect reflections that begins with a
    /// camera sample.
    pub path: u32,
    /// The part of the pixel's patterns that belongs to the camera sample.
    pub block: Block,
}

impl SampleNames {
    /// The names for a pixel that has one sample.
    #[must_use]
    pub const fn of_pixel(pixel: [u32; 2]) -> Self {
        Self {
            pixel,
            path: 0,
            block: Block::WHOLE,
        }
    }
}

/// Which lights a shading point samples: all of them, or one for each sample. In the latter case
/// light i is chosen with the probability αᵢ (Shirley & Wang 1991, section 3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightChoice {
    /// `all`: each light gets all samples.
    #[default]
    All,
    /// `one:uniform`: αᵢ = 1/N.
    Uniform,
    /// `one:power`: αᵢ in proportion to the emitted power.
    Power,
    /// `one:estimate`: αᵢ in proportion to the unshadowed light that the BSDF reflects from a
    /// random point of each light, with a lower bound for every light that can contribute (the rule
    /// of Shirley & Wang). Its cost grows with the number of lights.
    Estimate,
    /// `one:exact`: αᵢ in proportion to the unshadowed light of each light in closed form, with the
    /// BSDF as an LTC. The other choices approximate this one. Its cost grows with the number of
    /// lights.
    Exact,
    /// `one:centre`: αᵢ in proportion to the unshadowed light of each light's centre, without a
    /// lower bound. This is **biased** where a light's centre is below the horizon and other parts
    /// of it are not. It causes the bands of Shirley & Wang's Fig. 10, and exists to show them.
    Centre,
    /// `tree`: αᵢ by a hierarchy of the lights, in which each group is approximated by one blurred
    /// light, with the BSDF as an LTC. Its cost grows with the logarithm of the number of lights.
    Tree,
}

/// The choices, and their names in command lines and files.
const CHOICES: [(&str, LightChoice); 7] = [
    ("all", LightChoice::All),
    ("one:uniform", LightChoice::Uniform),
    ("one:power", LightChoice::Power),
    ("one:estimate", LightChoice::Estimate),
    ("one:exact", LightChoice::Exact),
    ("one:centre", LightChoice::Centre),
    ("tree", LightChoice::Tree),
];

impl fmt::Display for LightChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = CHOICES.iter().find(|(_, choice)| choice == self);
        f.pad(named.map_or("", |(name, _)| name))
    }
}

impl FromStr for LightChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = CHOICES.iter().find(|(name, _)| *name == text);
        named.map(|(_, choice)| *choice).ok_or_else(|| {
            let names = CHOICES.map(|(name, _)| name).join(", ");
            format!("lights `{text}`; expected one of {names}")
        })
    }
}
