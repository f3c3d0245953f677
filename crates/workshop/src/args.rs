//! The command line of the workshop. The doc comments of arguments are its help.

use clap::{Args, Parser, Subcommand};
use linelit_cli::args::{ReadArgs, SceneArgs};
use linelit_cli::words::{List, MOST_SAMPLES, SampleCounts, instruction_set, seconds};
use linelit_integrator::Estimator;
use linelit_simd::InstructionSet;
use linelit_study::pixels::Resolution;
use std::path::PathBuf;

/// The tools of those who work on linelit; `cargo xtask` starts them.
#[derive(Debug, Parser)]
#[command(name = "workshop", version, about, disable_help_subcommand = true)]
pub(crate) struct Cli {
    /// The command to execute.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// No vector instructions beyond scalar, avx2 or avx512: for tests, as results do not depend
    /// on it.
    #[arg(long, global = true, hide = true, value_name = "SET", value_parser = instruction_set)]
    pub(crate) isa: Option<InstructionSet>,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Hold renders to the reference images below a folder.
    CheckReferences(CheckArgs),
    /// Load and render every scene file below a folder; a line per file.
    LoadAll(LoadAllArgs),
    /// Draw the pictures of README and gallery.
    Pictures(PicturesArgs),
    /// Measure the figures of README, and write their page.
    Figures(FiguresArgs),
    /// Measure speed.
    #[command(subcommand)]
    Bench(Bench),
}

/// The benchmarks.
#[derive(Debug, Subcommand)]
pub(crate) enum Bench {
    /// Error against time.
    EqualTime(BenchArgs),
    /// The cost of rays and lines, compared with obvhs's rays.
    Visibility(VisibilityArgs),
    /// Seconds of pictures, compared with an older program.
    Speed(SpeedArgs),
    /// Whether `hybrid` is the best choice.
    Choice(ChoiceArgs),
}

/// `bench choice`.
#[derive(Args, Debug)]
pub(crate) struct ChoiceArgs {
    /// Scene files or names of built-in scenes, in place of all built-in ones.
    #[arg(long, value_name = "PATH,PATH…", value_delimiter = ',')]
    pub(crate) scenes: Vec<String>,
    /// Numbers of samples, in ascending order.
    #[arg(long, value_name = "N,N…", default_value = "1,4,16,64")]
    pub(crate) samples: SampleCounts,
    /// An older `linelit`, to compare its `hybrid` with.
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) against: Option<PathBuf>,
    /// Resolution of the image whose pixels are measured.
    #[arg(long, value_name = "WxH", default_value = "48x48")]
    pub(crate) resolution: Resolution,
    /// Times that methods near the best are run, in alternation.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) rounds: u32,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bench speed`.
#[derive(Args, Debug)]
pub(crate) struct SpeedArgs {
    /// An older `linelit`, to compare with.
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) against: PathBuf,
    /// Times that each program renders each picture; the least time counts.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) runs: u32,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bench equal-time`.
#[derive(Args, Debug)]
pub(crate) struct BenchArgs {
    /// Scene file, or the name of a built-in scene, in place of all built-in ones.
    #[arg(long, value_name = "PATH")]
    pub(crate) scene: Option<String>,
    /// Estimators to measure, separated by commas outside brackets; the last competes with the
    /// rest.
    #[arg(long, value_name = "E,E…")]
    pub(crate) estimators: Option<List<Estimator>>,
    /// Numbers of samples, in ascending order; powers of two by default.
    #[arg(long, value_name = "N,N…")]
    pub(crate) samples: Option<SampleCounts>,
    /// Resolution of the image whose pixels are measured.
    #[arg(long, value_name = "WxH", default_value = "32x24")]
    pub(crate) resolution: Resolution,
    /// An image of that resolution, without lights, to measure errors by.
    #[arg(long, value_name = "IMAGE")]
    pub(crate) reference: Option<PathBuf>,
    /// Times that everything is run, in alternation.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) rounds: u32,
    /// The options for reading scenes.
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bench visibility`.
#[derive(Args, Debug)]
pub(crate) struct VisibilityArgs {
    /// Scene file, or the name of a built-in scene, in place of three built-in ones.
    #[arg(long, value_name = "PATH")]
    pub(crate) scene: Option<String>,
    /// The only light to measure: S, L, S1, L1 … or linear.
    #[arg(long, value_name = "NAME")]
    pub(crate) light_name: Option<String>,
    /// Fewer points and rounds.
    #[arg(long)]
    pub(crate) quick: bool,
    /// The options for reading scenes.
    #[command(flatten)]
    pub(crate) read: ReadArgs,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `pictures`.
#[derive(Args, Debug)]
pub(crate) struct PicturesArgs {
    /// Folder of the pictures.
    #[arg(long, default_value = "docs/pictures")]
    pub(crate) out: PathBuf,
    /// Draw this built-in scene alone.
    #[arg(long, value_name = "NAME")]
    pub(crate) scene: Option<String>,
    /// Write nothing, and fail if a picture of the gallery is of an old state.
    #[arg(long)]
    pub(crate) check: bool,
    /// The options for reading scenes.
    #[command(flatten)]
    pub(crate) read: ReadArgs,
}

/// `figures`.
#[derive(Args, Debug)]
pub(crate) struct FiguresArgs {
    /// The page.
    #[arg(long, default_value = "docs/figures.md")]
    pub(crate) out: PathBuf,
    /// Times that everything is run, in alternation.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) rounds: u32,
    /// How scenes are read.
    #[command(flatten)]
    pub(crate) read: ReadArgs,
}

/// `load-all`.
#[derive(Args, Debug)]
pub(crate) struct LoadAllArgs {
    /// The folder.
    pub(crate) dir: PathBuf,
    /// Seconds on the processor that a file may take.
    #[arg(long, default_value_t = 5.0, value_parser = seconds)]
    pub(crate) seconds: f64,
    /// Print a line of JSON per file.
    #[arg(long)]
    pub(crate) json: bool,
    /// Do one file in this process: what the command starts for each.
    #[arg(long, hide = true)]
    pub(crate) one: bool,
}

/// `check-references`.
#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// The folder with `references/` and `scenes/` below it.
    pub(crate) dir: PathBuf,
    /// Light samples per shading point and light.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub(crate) samples: u32,
    /// Part of the names of the only references to check, such as `kitchen`.
    #[arg(long, value_name = "NAME")]
    pub(crate) only: Option<String>,
    /// Common flags.
    #[command(flatten)]
    pub(crate) common: SceneArgs,
}
