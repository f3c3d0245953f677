//! How a picture is estimated.

use crate::LightChoice;
use linelit_estimators::Estimator;
use linelit_samplers::SamplerKind;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Settings of a render: estimator, pattern, samples, lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The estimator.
    pub estimator: Estimator,
    /// The sampling pattern.
    pub sampler: SamplerKind,
    /// Light samples per shading point and light; of one light at a time ([`LightChoice`]), per
    /// shading point.
    pub samples: u32,
    /// Which lights a shading point samples.
    pub lights: LightChoice,
    /// Representation of emissive spheres, disks and cylinders.
    pub spheres: Spheres,
    /// Camera samples per pixel: 1 goes through the pixel's centre, more jitter it. Each takes a
    /// [`Block`](linelit_samplers::Block) of the pixel's patterns.
    pub pixel_samples: u32,
    /// The seed; two seeds give independent estimates.
    pub seed: u64,
    /// Whether a light that the camera sees shows its radiance.
    pub show_lights: bool,
    /// How many perfect reflections and refractions in a row the view follows; 0 leaves mirrors and
    /// glass black (but for lights), as direct light alone does.
    pub bounces: u32,
    /// Whether what cannot matter is skipped and what has a closed form takes it. Off, every
    /// sample is taken: for tests, and for studies of an estimator as its paper has it.
    pub skip: bool,
    /// Whether the lines and points of a combination share one traversal. Off, each has its own, as
    /// published: to measure what that costs. Estimates differ by rounding.
    pub share: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            estimator: Estimator::analytic(),
            sampler: SamplerKind::Auto,
            samples: 16,
            lights: LightChoice::All,
            spheres: Spheres::default(),
            pixel_samples: 1,
            seed: 0,
            show_lights: true,
            bounces: 0,
            skip: true,
            share: true,
        }
    }
}

/// Camera samples of a block, unless there are more than its square, and the most blocks of a
/// pixel.
const BLOCK: u32 = 64;

impl Settings {
    /// The blocks in which the camera samples of a pixel are added up: of 64 each, or longer ones
    /// so that there are at most 64. What has fewer samples is one block.
    ///
    /// ```
    /// let settings = linelit_integrator::Settings { pixel_samples: 150, ..Default::default() };
    /// assert!(settings.sample_blocks().eq([0..64, 64..128, 128..150]));
    /// ```
    pub fn sample_blocks(&self) -> impl ExactSizeIterator<Item = Range<u32>> + use<> {
        let count = self.pixel_samples.max(1);
        let block = BLOCK.max(count.div_ceil(BLOCK));
        (0..count.div_ceil(block)).map(move |k| k * block..count.min((k + 1).saturating_mul(block)))
    }
}

/// Representation of emissive spheres, disks and cylinders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spheres {
    /// `facets`: its triangles, which are what the camera sees.
    Facets,
    /// `exact`: spheres, disks and cylinders themselves. Spheres and cylinders that emit inwards or
    /// on both sides, disks with a hole, disks and cylinders with a missing sector, and those that
    /// emit an image keep their facets.
    #[default]
    Exact,
}

impl fmt::Display for Spheres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Facets => "facets",
            Self::Exact => "exact",
        })
    }
}

impl FromStr for Spheres {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "facets" => Ok(Self::Facets),
            "exact" => Ok(Self::Exact),
            _ => Err(format!("spheres `{text}`; expected facets or exact")),
        }
    }
}
