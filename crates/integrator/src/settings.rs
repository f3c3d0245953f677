//! How a picture is estimated.

use linelit_direct::LightChoice;
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
    /// shading point. From 1 to [`MOST_SAMPLES`](linelit_estimators::MOST_SAMPLES), to which other
    /// numbers are clamped: all samples of a light are in memory at once.
    pub samples: u32,
    /// The lights that a shading point samples.
    pub lights: LightChoice,
    /// Representation of emissive spheres, disks and cylinders.
    pub spheres: Spheres,
    /// Camera samples per pixel: 1 goes through the pixel's centre, more jitter it. Each takes a
    /// [`Block`](linelit_samplers::Block) of the pixel's patterns. 0 counts as 1.
    pub pixel_samples: u32,
    /// The seed, any number; two seeds give independent estimates.
    pub seed: u64,
    /// Whether a light that the camera sees shows its radiance.
    pub show_lights: bool,
    /// The number of perfect reflections and refractions in a row that the view follows; 0 leaves
    /// mirrors and glass black (but for lights), as direct light alone does. Above
    /// [`Settings::MOST_BOUNCES`] it counts as that many.
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

/// The number of camera samples of a block, unless there are more than its square, and the most
/// blocks of a pixel.
const BLOCK: u32 = 64;

impl Settings {
    /// The most reflections and refractions in a row that a view follows.
    pub const MOST_BOUNCES: u32 = 64;

    /// The blocks in which the camera samples of a pixel are added up: of 64 each, or longer ones
    /// so that there are at most 64. Up to 64 samples are one block.
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

    /// The settings of the light at a point.
    pub(crate) const fn direct(&self) -> linelit_direct::Settings<'_> {
        linelit_direct::Settings {
            estimator: &self.estimator,
            sampler: self.sampler,
            seed: self.seed,
            samples: self.samples,
            lights: self.lights,
            skip: self.skip,
            share: self.share,
        }
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
            _ => Err(format!("spheres `{text}`; expected one of facets, exact")),
        }
    }
}
