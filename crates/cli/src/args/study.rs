//! What convergence studies are made of, by `converge` and by plans.

use super::{PlannedArgs, ReadArgs, SceneArgs};
use crate::words::{List, SampleCounts, light_choice, seconds, spheres};
use clap::Args;
use linelit_integrator::{Estimator, LightChoice, Spheres};
use linelit_samplers::SamplerKind;
use linelit_study::pixels::Pixels;
use std::path::PathBuf;

/// Everything that the numbers of a study depend on, beside the files of its scenes.
#[derive(Args, Clone, Debug)]
pub struct StudyArgs {
    /// A named study (`linelit list studies`), or scene files and names of built-in scenes; without
    /// any, the default study.
    pub what: Vec<String>,
    /// Estimators to compare, separated by commas outside brackets (`linelit list estimators`).
    #[arg(long, value_name = "E,E…")]
    pub estimators: Option<List<Estimator>>,
    /// Sampling patterns to compare (`linelit list samplers`).
    #[arg(long, value_name = "S,S…")]
    pub samplers: Option<List<SamplerKind>>,
    /// The strategy for selecting lights at a point; all lights by default.
    #[arg(long, value_parser = light_choice())]
    pub lights: Option<LightChoice>,
    /// Emissive spheres, disks and cylinders; exact by default.
    #[arg(long, value_parser = spheres())]
    pub spheres: Option<Spheres>,
    /// Light samples per shading point, ascending.
    #[arg(long, value_name = "1,4,16…")]
    pub samples: Option<SampleCounts>,
    /// Independent trials per estimator, pattern and number of samples.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub trials: Option<u32>,
    /// Pixels: a grid over the image (WxH) or single pixels of the scene's resolution (x,y;…).
    #[arg(long, value_name = "WxH|x,y;…")]
    pub pixels: Option<Pixels>,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Run every step at the smallest size, to test that it runs; its results mean nothing.
    #[arg(long, hide = true)]
    pub smallest: bool,
}

/// `converge`.
#[derive(Args, Debug)]
pub struct ConvergeArgs {
    /// The study.
    #[command(flatten)]
    pub study: StudyArgs,
    /// Seconds for all of it, the reference and the pictures too: what is not expected to end in
    /// time is left out, and named.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// Folder for the report.
    #[arg(short, long, default_value = "out")]
    pub out: PathBuf,
    /// List the studies with the cost of each, and run none of them.
    #[arg(long)]
    pub list: bool,
    /// Measure everything, instead of the quick form (`claims` alone has both).
    #[arg(long, conflicts_with = "smallest")]
    pub full: bool,
    /// Begin anew, even if an interrupted study in that folder could be continued.
    #[arg(long)]
    pub fresh: bool,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `plan converge`.
#[derive(Args, Debug)]
pub struct PlanConvergeArgs {
    /// The study.
    #[command(flatten)]
    pub study: StudyArgs,
    /// The options for reading scenes.
    #[command(flatten)]
    pub read: ReadArgs,
    /// The options of all kinds of plans.
    #[command(flatten)]
    pub planned: PlannedArgs,
}
