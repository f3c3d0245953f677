//! What pictures are made of, by `render` and by plans.

use crate::words::{
    Crop, LightEstimator, MOST_SAMPLES, Word as _, light_choice, sampler, spheres, stops,
};
use clap::{Args, ValueEnum};
use linelit_film::Compression;
use linelit_integrator::{Estimator, LightChoice, Settings, Spheres};
use linelit_samplers::SamplerKind;
use linelit_study::pixels::Resolution;

/// Everything that the values of a picture depend on, beside its scene.
#[derive(Args, Clone, Debug)]
pub struct PictureArgs {
    /// Estimator, such as point-solid-angle or line-analytic[offset=uniform]; `linelit list
    /// estimators` names all.
    #[arg(long, default_value = "hybrid", value_parser = Estimator::read)]
    pub estimator: Estimator,
    /// Another estimator for light K of the scene, by the numbers of `linelit info`; may be
    /// repeated.
    #[arg(long, value_name = "K=ESTIMATOR")]
    pub light_estimator: Vec<LightEstimator>,
    /// Light K, by the numbers of `linelit info`, is sampled for itself where --lights picks one of
    /// the others; may be repeated. For lights that are bright and mostly hidden.
    #[arg(long, value_name = "K")]
    pub light_apart: Vec<u32>,
    /// Sampling pattern.
    #[arg(long, default_value = "auto", value_parser = sampler())]
    pub sampler: SamplerKind,
    /// Light samples per shading point and light.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub samples: u32,
    /// The strategy for selecting lights at a point.
    #[arg(long, default_value = "all", value_parser = light_choice())]
    pub lights: LightChoice,
    /// Emissive spheres, disks and cylinders.
    #[arg(long, default_value = "exact", value_parser = spheres())]
    pub spheres: Spheres,
    /// Take every sample, of lights that cannot contribute and where a closed form is known, too:
    /// to measure what is saved. The mean stays.
    #[arg(long)]
    pub no_skips: bool,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Resolution of the picture, instead of the scene's own.
    #[arg(long, value_name = "WxH")]
    pub resolution: Option<Resolution>,
    /// Part of the image to render, as fractions of it.
    #[arg(long, value_name = "X0,X1,Y0,Y1")]
    pub crop: Option<Crop>,
    /// Camera samples per pixel: 1 goes through the centre, more jitter under the scene's filter.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub pixel_samples: u32,
    /// Independent pictures of as many samples each, by seeds in a row, whose mean this one is:
    /// their scatter is the variance of --aovs.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub trials: u32,
    /// Do not show lights that the camera sees.
    #[arg(long)]
    pub hide_lights: bool,
    /// Follow up to this many perfect mirrors and sheets of glass in a row.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=i64::from(Settings::MOST_BOUNCES)))]
    pub bounces: u32,
    /// Additional layers of the EXR file, separated by commas.
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',')]
    pub aovs: Vec<Aov>,
}

impl PictureArgs {
    /// Returns the settings of the integrator for these flags.
    #[must_use]
    pub fn settings(&self) -> Settings {
        Settings {
            estimator: self.estimator,
            sampler: self.sampler,
            samples: self.samples,
            lights: self.lights,
            spheres: self.spheres,
            pixel_samples: self.pixel_samples,
            seed: self.seed,
            show_lights: !self.hide_lights,
            bounces: self.bounces,
            skip: !self.no_skips,
            share: true,
        }
    }

    /// Returns the settings of the trial with this index. Its seed is the seed of the picture plus
    /// the index: samplers hash seeds, so that neighbouring seeds give independent samples.
    #[must_use]
    pub fn settings_of(&self, trial: u32) -> Settings {
        Settings {
            seed: self.seed.wrapping_add(trial.into()),
            ..self.settings()
        }
    }

    /// Returns the number of blocks into which the work of a pixel is divided. The blocks are its
    /// trials, or, if there is only one trial, blocks of its camera samples. The results of blocks
    /// are added in the order of the blocks.
    #[must_use]
    pub fn blocks(&self) -> u32 {
        if self.trials > 1 {
            return self.trials;
        }
        u32::try_from(self.settings().sample_blocks().len()).unwrap_or(u32::MAX)
    }

    /// Returns the number of camera samples of a pixel, over all trials.
    #[must_use]
    pub fn camera_samples(&self) -> f64 {
        f64::from(self.pixel_samples.max(1)) * f64::from(self.trials.max(1))
    }
}

/// The options for writing an image to a file.
#[derive(Args, Debug)]
pub struct ImageArgs {
    /// Doublings of brightness, in a PNG file.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = stops, allow_negative_numbers = true)]
    pub exposure: f64,
    /// The lossless compression of an EXR file: none, rle, or zip:1 (fast, the default) to zip:9
    /// (small).
    #[arg(long, value_name = "HOW")]
    pub compression: Option<Compression>,
}

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Aov {
    /// Albedo of the surface in the middle of the pixel: what it reflects of uniform light.
    Albedo,
    /// The shading normal of that surface, towards the viewer; 0 where there is none.
    Normal,
    /// The distance of that surface from the camera; infinite where there is none.
    Depth,
    /// Variance of the pixel, by its trials if there are several (--trials), else by its camera
    /// samples (two or more) as if they were independent.
    Variance,
    /// Camera samples, rays and lines of the pixel: layers samples, rays, lines.
    Samples,
}
