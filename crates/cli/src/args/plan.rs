//! `plan`, `run`, `merge` and `status`.

use super::{ImageArgs, PictureArgs, PlanConvergeArgs, PlanViewFactorsArgs, ReadArgs};
use crate::words::threads;
use clap::{Args, Subcommand, ValueEnum};
use linelit_plan::Shard;
use std::path::PathBuf;

pub(super) const PLAN_EXAMPLES: &str = "\
Examples:
  linelit plan render hall.pbrt -o hall-plan --pixel-samples 4096
      a picture in units of a second or two
  linelit plan render colonnade -o plan --script slurm
      the same plan again is no harm; prints the script that submits it
  linelit plan converge billen-orders -o orders-plan
      a convergence study, whose report `merge` writes";

pub(super) const RUN_EXAMPLES: &str = "\
Examples:
  linelit run plan
      all that is left, with the threads of this machine; Ctrl-C and the same again goes on
  linelit run plan --shard 3/16
      a sixteenth; Slurm's job arrays, Indexed Jobs of Kubernetes and array jobs of AWS Batch say
      it by themselves";

pub(super) const MERGE_EXAMPLES: &str = "\
Examples:
  linelit merge plan -o hall.exr
  linelit merge plan -o hall.png --exposure 1 --json";

pub(super) const STATUS_EXAMPLES: &str = "\
Examples:
  linelit status plan
  linelit status plan --watch";

/// `plan`.
#[derive(Args, Debug)]
pub struct PlanArgs {
    /// The kind of plan.
    #[command(subcommand)]
    pub kind: PlanKind,
}

/// The kinds of plans.
#[derive(Debug, Subcommand)]
pub enum PlanKind {
    /// Plan a picture; flags are those of `render`.
    #[command(long_about = RENDER_ABOUT)]
    Render(Box<PlanRenderArgs>),
    /// Plan a convergence study; flags are those of `converge`.
    #[command(long_about = CONVERGE_ABOUT)]
    Converge(Box<PlanConvergeArgs>),
    /// Plan view factors; flags are those of `viewfactors`, but for its output and report.
    #[command(name = "viewfactors")]
    ViewFactors(Box<PlanViewFactorsArgs>),
}

const CONVERGE_ABOUT: &str = "\
Plan a convergence study. Flags are those of `converge`, but for --time-budget: what a plan has is measured. Studies of pictures \
and tables (`linelit list studies` says what each shows) are no plans, and refused.";

const RENDER_ABOUT: &str = "\
Plan a picture. Flags are those of `render`, but for --explain, and those \
of the picture's file (--exposure, --compression), which `merge` takes.";

/// `plan render`.
#[derive(Args, Debug)]
pub struct PlanRenderArgs {
    /// Scene file, or the name of a built-in scene (`linelit list scenes`).
    pub scene: String,
    /// The picture.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Side of the tiles in pixels; by default such that one takes a second or two.
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=1 << 14))]
    pub tile: Option<u32>,
    /// Make units of single blocks of camera samples, not of all samples of a tile; by
    /// default done where a few pixels take too long.
    #[arg(long)]
    pub split_samples: bool,
    /// The options for reading the scene.
    #[command(flatten)]
    pub read: ReadArgs,
    /// The options of all kinds of plans.
    #[command(flatten)]
    pub planned: PlannedArgs,
}

/// The options of all kinds of plans.
#[derive(Args, Debug)]
pub struct PlannedArgs {
    /// Folder of the plan.
    #[arg(short, long, value_name = "PLAN")]
    pub output: PathBuf,
    /// Print the script that runs the plan in this way, instead of its figures.
    #[arg(long, value_name = "SCHEDULER")]
    pub script: Option<Script>,
    /// Processes that the script starts.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub shards: u32,
    /// Print machine-readable results on standard output.
    #[arg(long, conflicts_with = "script")]
    pub json: bool,
}

/// The system for which a script starts numbered processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Script {
    /// A job array of Slurm.
    Slurm,
    /// GNU parallel, on this machine.
    Parallel,
    /// An Indexed Job of Kubernetes.
    Kubernetes,
}

/// `run`.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Folder of a plan.
    pub plan: PathBuf,
    /// The shard of this process and the number of shards, 1/N to N/N; by default from
    /// SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX or AWS_BATCH_JOB_ARRAY_INDEX, or else all.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// The number of shards, where the environment only says which one this is.
    #[arg(long, value_name = "N", conflicts_with = "shard", value_parser = clap::value_parser!(u32).range(1..))]
    pub shards: Option<u32>,
    /// Threads, at most 64 or 4 per core; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    pub threads: usize,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// `merge`.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// Folder of a plan.
    pub plan: PathBuf,
    /// Output: of a picture, the image to write, .exr (linear, with metadata) or .png; of a study,
    /// the folder for its report, by default `out`; of view factors, .csv, .npz, .txt or .vf.
    #[arg(short, long, value_name = "PATH")]
    pub output: Option<PathBuf>,
    /// Folder for a report of view factors.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// The picture's file.
    #[command(flatten)]
    pub file: ImageArgs,
    /// Threads, at most 64 or 4 per core; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    pub threads: usize,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// `status`.
#[derive(Args, Debug)]
pub struct StatusArgs {
    /// Folder of a plan.
    pub plan: PathBuf,
    /// Say it again every two seconds until all is done.
    #[arg(long)]
    pub watch: bool,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}
