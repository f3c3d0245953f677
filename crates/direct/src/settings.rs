//! How the light at a point is estimated.

use linelit_estimators::Estimator;
use linelit_samplers::{Block, SamplerKind};
use std::fmt;
use std::str::FromStr;

/// The settings of an estimate of the light at a point.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    /// The estimator of lights that have none of their own.
    pub estimator: &'a Estimator,
    /// The sampling pattern.
    pub sampler: SamplerKind,
    /// The seed, any number; two seeds give independent estimates.
    pub seed: u64,
    /// Samples of each light, or, where a light is chosen at random for each sample
    /// ([`LightChoice`]), of all of them together. From 1 to
    /// [`MOST_SAMPLES`](linelit_estimators::MOST_SAMPLES), to which other numbers are clamped.
    pub samples: u32,
    /// The lights that a point samples.
    pub lights: LightChoice,
    /// Whether lights that cannot contribute are skipped and closed forms are used where nothing is
    /// hidden. Off, every sample is taken, as published.
    pub skip: bool,
    /// Whether the lines and points of a combination share one traversal of the hierarchy. Off,
    /// each has its own, as published; estimates differ by rounding.
    pub share: bool,
}

impl<'a> Settings<'a> {
    /// The settings that skip what they can: all lights, by the pattern `auto` with the seed 0.
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

/// The names of the random numbers of a shading point. Points of one seed with different names have
/// independent numbers.
#[derive(Clone, Copy, Debug)]
pub struct SampleNames {
    /// The pixel, or for points of no picture a hash of the point.
    pub pixel: [u32; 2],
    /// The number of the shading point on the path of perfect reflections of a camera sample.
    pub path: u32,
    /// The part of the pixel's patterns that the camera sample takes.
    pub block: Block,
}

impl SampleNames {
    /// The names for the only sample of a pixel.
    #[must_use]
    pub const fn of_pixel(pixel: [u32; 2]) -> Self {
        Self {
            pixel,
            path: 0,
            block: Block::WHOLE,
        }
    }
}

/// The lights that a shading point samples: all of them, or for each sample one, light i with the
/// probability αᵢ (Shirley & Wang 1991, section 3).
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
    /// random point of each light, with a lower bound for every light that can contribute (Shirley
    /// & Wang's rule). Its cost grows with the number of lights.
    Estimate,
    /// `one:exact`: αᵢ in proportion to the unshadowed light of each light in closed form, with the
    /// BSDF as an LTC: the goal of the other choices. Its cost grows with the number of lights.
    Exact,
    /// `one:centre`: αᵢ in proportion to the unshadowed light of each light's centre, without a
    /// lower bound. **Wrong** where a light's centre is below the horizon and other parts of it are
    /// not: it makes the bands of Shirley & Wang's Fig. 10, and is here to show them.
    Centre,
    /// `tree`: αᵢ by a hierarchy of the lights, whose groups are taken as one blurred light under
    /// that LTC. Its cost grows with the logarithm of the number of lights.
    Tree,
}

/// The choices by their names in command lines and files.
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
