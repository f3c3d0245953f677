//! The command line: what can be said.

use crate::output::note;
use crate::words::{Crop, instruction_set, path_ending, stops, threads};
use anyhow::{Context as _, Result};
use clap::{Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use linelit_formats::{LoadOptions, Root};
use linelit_scenes::Library;
use linelit_simd::InstructionSet;
use std::path::PathBuf;

mod picture;
mod plan;
mod study;
mod viewfactors;

pub use picture::{Aov, ImageArgs, PictureArgs};
pub use plan::{
    MergeArgs, PlanArgs, PlanKind, PlanRenderArgs, PlannedArgs, RunArgs, Script, StatusArgs,
};

pub use study::{ConvergeArgs, PlanConvergeArgs, StudyArgs};
pub(crate) use viewfactors::ENDINGS;
pub use viewfactors::{FactorArgs, PlanViewFactorsArgs, ViewFactorsArgs};

/// An error in the command line itself, such as flags that contradict each other: the program exits
/// with status 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UsageError(pub String);

/// The version and the commit that the program was built from.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("LINELIT_COMMIT"), ")");

/// Direct light with line samples, and studies of how fast it converges.
#[derive(Debug, Parser)]
#[command(name = "linelit", version = VERSION, about)]
pub struct Cli {
    /// The command to execute.
    #[command(subcommand)]
    pub command: Command,
    /// No vector instructions beyond scalar, avx2 or avx512: for tests, as results do not depend
    /// on it.
    #[arg(long, global = true, hide = true, value_name = "SET", value_parser = instruction_set)]
    pub isa: Option<InstructionSet>,
}

/// The commands.
#[derive(Debug, Subcommand)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, made when the program starts"
)]
pub enum Command {
    /// Render a scene to an EXR or PNG image.
    #[command(after_help = RENDER_EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Measure how the error falls with samples and with time; writes a report.
    #[command(after_help = CONVERGE_EXAMPLES)]
    Converge(ConvergeArgs),
    /// Compute the view factors of facets, past all that stands between them, with an error bound
    /// for each row.
    #[command(name = "viewfactors", after_help = viewfactors::VIEWFACTORS_EXAMPLES)]
    ViewFactors(ViewFactorsArgs),
    /// Plan work for any number of machines: a folder that `run` works off and `merge` reads.
    #[command(after_help = plan::PLAN_EXAMPLES)]
    Plan(PlanArgs),
    /// Do the remaining units of a plan, or a shard of it; any number at once, on any machines.
    #[command(after_help = plan::RUN_EXAMPLES)]
    Run(RunArgs),
    /// Put the parts of a plan together; says what is missing.
    #[command(after_help = plan::MERGE_EXAMPLES)]
    Merge(MergeArgs),
    /// Say how far a plan is.
    #[command(after_help = plan::STATUS_EXAMPLES)]
    Status(StatusArgs),
    /// Compare two images: MSE, RMSE, MRSE, bias, and maps of them.
    #[command(after_help = COMPARE_EXAMPLES)]
    Compare(CompareArgs),
    /// Say what is in a scene and what the plan skips.
    #[command(after_help = INFO_EXAMPLES)]
    Info(InfoArgs),
    /// Name the built-in scenes, studies, estimators, sampling patterns and methods.
    #[command(after_help = LIST_EXAMPLES)]
    List(ListArgs),
    /// Print a script that completes the words of this command in a shell.
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArgs),
    /// Print the manual page, or write those of all commands into a folder.
    #[command(after_help = MAN_EXAMPLES)]
    Man(ManArgs),
}

const RENDER_EXAMPLES: &str = "\
Examples:
  linelit render cornell-box -o box.exr
      16 samples of what is cheapest at each point, as linear radiance
  linelit render room.pbrt -o room.png --estimator line-analytic --samples 4 --resolution 640x480
      four lines a point and light, as an 8-bit picture
  linelit render colonnade-line -o hall.exr --crop 0.25,0.5,0.25,0.5 --explain
      a part of it, and what was done about which lights
  linelit render cornell-box -o box.png --exposure 1
      twice as bright
  linelit render cornell-box -o box.exr --pixel-samples 4 --aovs albedo,normal,depth,variance
      for a denoiser
  linelit render hall.pbrt -o hall.exr --pixel-samples 4096
      long pictures are kept as they grow: after Ctrl-C or a kill the same command goes on";

const CONVERGE_EXAMPLES: &str = "\
Examples:
  linelit converge
      the default study: out/report.html, results.csv, slopes.csv, results.json, plots
  linelit converge room.gltf --estimators point-solid-angle,line-analytic,hybrid --out study
      a scene of your own
  linelit converge grid-planes --samples 1,4,16,64 --trials 32 --pixels 64x48 --time-budget 60
      more of it, for a minute
  linelit converge billen-orders --out orders
      Ctrl-C leaves a report of what is done; the same command goes on";

const COMPARE_EXAMPLES: &str = "\
Examples:
  linelit compare a.exr reference.exr
  linelit compare a.exr:LAYER reference.pfm --json
      a layer of an EXR file
  linelit compare a.exr reference.exr --crop 0.5,1,0,0.5 --error-map errors.png
      a quarter of the pictures, and where the errors are";

const INFO_EXAMPLES: &str = "\
Examples:
  linelit info room.obj
  linelit info plates --json";

const LIST_EXAMPLES: &str = "\
Examples:
  linelit list
  linelit list estimators
  linelit list methods
      what each of them does on which light and reflection
  linelit list scenes --json";

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  linelit completions bash > ~/.local/share/bash-completion/completions/linelit
  linelit completions zsh > ~/.zfunc/_linelit
  linelit completions fish > ~/.config/fish/completions/linelit.fish";

const MAN_EXAMPLES: &str = "\
Examples:
  linelit man | man -l -
  linelit man ~/.local/share/man/man1";

/// The options for reading a scene.
#[derive(Args, Clone, Debug, Default)]
pub struct ReadArgs {
    /// Treat warnings about a scene as errors.
    #[arg(long)]
    pub strict: bool,
    /// The folder that must hold, itself or below it, the files that a scene names; by
    /// by default the one of the scene's file.
    #[arg(long, value_name = "DIR", conflicts_with = "allow_outside")]
    pub root: Option<PathBuf>,
    /// Let a scene name files anywhere.
    #[arg(long)]
    pub allow_outside: bool,
}

impl ReadArgs {
    /// Returns a reader of scenes with these options, which prints warnings about scenes on
    /// standard error.
    #[must_use]
    pub fn library(&self) -> Library {
        let options = LoadOptions {
            strict: self.strict,
            root: match &self.root {
                Some(folder) => Root::Folder(folder.clone()),
                None if self.allow_outside => Root::Anywhere,
                None => Root::SceneFolder,
            },
            ..LoadOptions::default()
        };
        Library { options, note }
    }
}

/// Flags that every command that reads a scene takes.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// The options for reading scenes.
    #[command(flatten)]
    pub read: ReadArgs,
    /// Threads, at most 64 or 4 per core; 0 for one per core.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    pub threads: usize,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// `render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Scene file, or the name of a built-in scene (`linelit list scenes`).
    pub scene: String,
    /// Image to write: .exr (linear, with metadata), .pfm (linear) or .png.
    #[arg(short, long, value_parser = path_ending(&["exr", "pfm", "png"]))]
    pub output: PathBuf,
    /// The picture.
    #[command(flatten)]
    pub picture: PictureArgs,
    /// The options for writing its file.
    #[command(flatten)]
    pub file: ImageArgs,
    /// Whether what is done is kept, in a hidden folder beside the picture, so that the same
    /// command goes on after Ctrl-C, a kill or a loss of power; never with
    /// --explain.
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub checkpoints: Checkpoints,
    /// Begin anew what was interrupted.
    #[arg(long)]
    pub fresh: bool,
    /// Show the picture in the viewer tev as its tiles come, such as 127.0.0.1:14158; then nothing
    /// is kept for another time.
    #[arg(long, value_name = "HOST:PORT", conflicts_with = "fresh")]
    pub tev: Option<String>,
    /// Print what is done about which lights on which materials, what was skipped and why, and what
    /// visibility cost.
    #[arg(long)]
    pub explain: bool,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// The choice of when `render` keeps the finished parts of a picture until it is whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Checkpoints {
    /// Keep those of pictures that take, by an estimate, half a minute of one thread or more.
    Auto,
    /// Keep those of all pictures.
    Always,
    /// Keep none.
    Never,
}

/// `compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The image to judge: EXR (a layer as FILE:LAYER), PFM, PNG, TGA or JPEG.
    pub image: PathBuf,
    /// The image to judge it by, of the same size.
    pub reference: PathBuf,
    /// Part of the images to compare, as fractions of them (as `render --crop`).
    #[arg(long, value_name = "X0,X1,Y0,Y1")]
    pub crop: Option<Crop>,
    /// Doublings of brightness, in a PNG file of the difference.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = stops, allow_negative_numbers = true)]
    pub exposure: f64,
    /// Write image − reference: .exr as it is, .png around a middle grey.
    #[arg(long, value_name = "FILE", value_parser = path_ending(&["exr", "png"]))]
    pub difference: Option<PathBuf>,
    /// Write the relative squared error of each pixel, whose mean is the MRSE: .exr as it is, .png
    /// in false colours over four powers of ten.
    #[arg(long, value_name = "FILE", value_parser = path_ending(&["exr", "png"]))]
    pub error_map: Option<PathBuf>,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// `info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Scene file, or the name of a built-in scene (`linelit list scenes`).
    pub scene: String,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `list`.
#[derive(Args, Debug)]
pub struct ListArgs {
    /// The kind of names to list; all by default.
    pub what: Option<Listed>,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// The kinds of names that `list` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Listed {
    /// Built-in scenes.
    Scenes,
    /// Named studies.
    Studies,
    /// Techniques that estimators are put together from.
    Estimators,
    /// Sampling patterns.
    Samplers,
    /// Methods of each technique by the kind of light and of reflection.
    Methods,
}

/// `completions`.
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

/// `man`.
#[derive(Args, Debug)]
pub struct ManArgs {
    /// Folder for a page for each command, linelit-render.1 and so on.
    pub dir: Option<PathBuf>,
}

/// Returns the flags of the group `A` as words of a command line, with the values of this process
/// or the defaults. Paths are absolute, so that the words are valid in any working folder.
///
/// # Errors
/// If a path cannot be made absolute, or is not valid text, so that a plan could not store it.
pub fn given<A: Args>() -> Result<Vec<String>> {
    let mut own = Cli::command().get_matches();
    while let Some((_, below)) = own.remove_subcommand() {
        own = below;
    }
    let mut words = Vec::new();
    for flag in A::augment_args(clap::Command::new("")).get_arguments() {
        let (id, Some(name)) = (flag.get_id().as_str(), flag.get_long()) else {
            continue;
        };
        if !flag.get_action().takes_values() {
            words.extend(own.get_flag(id).then(|| format!("--{name}")));
        } else if let Ok(Some(path)) = own.try_get_one::<PathBuf>(id) {
            let whole = std::path::absolute(path).with_context(|| format!("--{name}"))?;
            let failed = || format!("--{name}: the path is no text");
            let whole = whole.to_str().with_context(failed)?;
            words.push(format!("--{name}={whole}"));
        } else {
            let values = own.get_raw(id).into_iter().flatten();
            words.extend(values.map(|value| format!("--{name}={}", value.display())));
        }
    }
    Ok(words)
}

/// Words that a plan was made of, and how its scenes are read.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
pub struct PlannedArguments<A: Args> {
    /// Everything that numbers depend on beside the scenes.
    #[command(flatten)]
    pub args: A,
    /// The options for reading scenes.
    #[command(flatten)]
    pub read: ReadArgs,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parses the examples of `--help`.
    #[test]
    fn examples_are_understood() {
        let mut count = 0;
        for command in Cli::command().get_subcommands() {
            let Some(text) = command.get_after_help() else {
                panic!("no examples of {}", command.get_name());
            };
            let text = text.to_string();
            let lines = text.lines().filter(|line| line.starts_with("  linelit "));
            for line in lines {
                let words = line
                    .split_whitespace()
                    .take_while(|w| !["|", ">"].contains(w));
                let parsed = Cli::try_parse_from(words);
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
                count += 1;
            }
        }
        assert!(count >= 15, "{count}");
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
