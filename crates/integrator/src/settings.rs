//! These settings say how a picture is estimated.

use linelit_direct::LightChoice;
use linelit_estimators::Estimator;
use linelit_samplers::SamplerKind;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// The settings of a picture: the estimator, the sampling pattern, the samples, and how lights are
/// treated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The estimator for lights that have no estimator of their own.
    pub estimator: Estimator,
    /// The sampling pattern.
    pub sampler: SamplerKind,
    /// The number of samples for each shading point and light. If a light is chosen at random for
    /// each sample ([`LightChoice`]), it is the number of samples for each shading point. It is
    /// clamped to the range from 1 to [`MOST_SAMPLES`](linelit_estimators::MOST_SAMPLES), since all
    /// samples of a light are in memory at the same time.
    pub samples: u32,
    /// Which lights a shading point samples.
    pub lights: LightChoice,
    /// The form in which spheres, disks and cylinders that emit light are estimated.
    pub spheres: Spheres,
    /// The number of camera samples per pixel. A single sample goes through the pixel's centre, and
    /// more samples are jittered. Each of them gets a [`Block`](linelit_samplers::Block) of the
    /// pixel's patterns. 0 counts as 1.
    pub pixel_samples: u32,
    /// The seed, which may be any number; two seeds give independent estimates.
    pub seed: u64,
    /// Whether the camera sees the radiance of the lights themselves.
    pub show_lights: bool,
    /// The largest number of successive perfect reflections and refractions that the view follows.
    /// With 0, as for direct light alone, mirrors and glass are black, unless they emit light
    /// themselves. More than [`Settings::MOST_BOUNCES`] counts as that many.
    pub bounces: u32,
    /// Whether lights that cannot contribute are skipped, and closed forms are used where nothing
    /// is hidden. If `false`, every sample is taken: for tests, and for studies of an estimator as
    /// it was published.
    pub skip: bool,
    /// Whether the lines and points of a combination share one traversal of the hierarchy. If
    /// `false`, each has its own, as published, so that its cost can be measured. Estimates differ
    /// by rounding only.
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

/// The number of camera samples in a block, unless there are more than its square, and the largest
/// number of blocks of a pixel.
const BLOCK: u32 = 64;

impl Settings {
    /// The largest number of successive reflections and refractions that a view follows.
    pub const MOST_BOUNCES: u32 = 64;

    /// The blocks in which the camera samples of a pixel are added up. They have 64 samples each,
    /// or more so that there are at most 64 blocks. Up to 64 samples are one block.
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

    /// The settings of the light at one point.
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

/// The form in which spheres, disks and cylinders that emit light are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spheres {
    /// `facets`: their triangles, which are also what the camera sees.
    Facets,
    /// `exact`: the exact shapes. These shapes keep their facets: spheres and cylinders that emit
    /// inwards or on both sides, disks with a hole, disks and cylinders with a missing sector, and
    /// shapes that emit an image.
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
