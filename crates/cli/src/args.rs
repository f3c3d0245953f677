//! The command line: what can be said, and what the words mean.

use crate::output::note;
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand};
use linelit_film::Compression;
use linelit_formats::{LoadOptions, Root};
use linelit_integrator::{Estimator, LightChoice, Spheres};
use linelit_samplers::SamplerKind;
use linelit_scenes::Library;
use linelit_simd::InstructionSet;
use linelit_study::pixels::{Pixels, Resolution};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The most samples of a light for one shading point: they are all in memory at once.
pub const MOST_SAMPLES: i64 = 1 << 24;

/// The most threads for a core, beyond [`ALWAYS_THREADS`]: more than one of each only wait.
const THREADS_OF_CORE: usize = 4;
/// Threads that any machine may start.
const ALWAYS_THREADS: usize = 64;

/// A contradiction in the command line itself: the program exits with 2.
#[derive(Debug)]
pub struct UsageError(pub String);

impl fmt::Display for UsageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// A path whose name must end in one of these.
fn path_ending(endings: &'static [&'static str]) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| {
        let ending = path.extension().and_then(|e| e.to_str());
        if ending.is_some_and(|e| endings.contains(&e)) {
            return Ok(path);
        }
        let list: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
        Err(format!("the name must end in {}", list.join(" or ")))
    })
}

/// A number of threads that the machine has any use for.
fn threads(text: &str) -> Result<usize, String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = ALWAYS_THREADS.max(THREADS_OF_CORE * cores);
    match text.parse::<usize>() {
        Ok(threads) if threads <= most => Ok(threads),
        Ok(_) => Err(format!("at most {most} threads on {cores} cores")),
        Err(e) => Err(e.to_string()),
    }
}

/// Seconds, more than none.
///
/// # Errors
/// What is expected.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

/// Direct light with line samples, and studies of how fast it converges.
#[derive(Debug, Parser)]
#[command(name = "linelit", version, about, disable_help_subcommand = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// No vector instructions beyond scalar, avx2 or avx512: for tests, as results do not depend
    /// on it.
    #[arg(long, global = true, hide = true, value_name = "SET", value_parser = instruction_set)]
    pub isa: Option<InstructionSet>,
}

/// An instruction set that this processor has.
///
/// # Errors
/// The sets there are.
pub fn instruction_set(text: &str) -> Result<InstructionSet, String> {
    let set: InstructionSet = text.parse().map_err(|e| format!("{e}"))?;
    if set.is_available() {
        return Ok(set);
    }
    let all = InstructionSet::ALL.into_iter();
    let names: Vec<_> = all
        .filter(|s| s.is_available())
        .map(|s| s.to_string())
        .collect();
    Err(format!(
        "this processor has no {set}; it has {}",
        names.join(", ")
    ))
}

/// The commands.
#[derive(Debug, Subcommand)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, made when the program starts"
)]
pub enum Command {
    /// Render a scene to an EXR or PNG image.
    Render(Box<RenderArgs>),
    /// Measure how the error falls with samples and with time; writes a report.
    Converge(ConvergeArgs),
    /// Compare two images (EXR or PFM): MSE, RMSE, MRSE, bias.
    Compare(CompareArgs),
    /// Say what is in a scene and what the plan skips.
    Info(InfoArgs),
    /// Write a scene as pbrt-v4 text, for other renderers.
    Convert(ConvertArgs),
}

/// How a scene is read.
#[derive(Args, Clone, Debug, Default)]
pub struct ReadArgs {
    /// Treat warnings about a scene as errors.
    #[arg(long)]
    pub strict: bool,
    /// The folder that must hold, itself or below it, the files that a scene names; unless told,
    /// that of the scene's file.
    #[arg(long, value_name = "DIR", conflicts_with = "allow_outside")]
    pub root: Option<PathBuf>,
    /// Let a scene name files anywhere.
    #[arg(long)]
    pub allow_outside: bool,
}

impl ReadArgs {
    /// Options for the loader.
    #[must_use]
    pub fn options(&self) -> LoadOptions {
        LoadOptions {
            strict: self.strict,
            root: match &self.root {
                Some(folder) => Root::Folder(folder.clone()),
                None if self.allow_outside => Root::Anywhere,
                None => Root::SceneFolder,
            },
            ..LoadOptions::default()
        }
    }

    /// Reads scenes so, and says what is strange about them on standard error.
    #[must_use]
    pub fn library(&self) -> Library {
        Library {
            options: self.options(),
            note,
        }
    }
}

/// Flags that every command that reads a scene takes.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// How scenes are read.
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
    /// Scene file, or the name of a built-in scene.
    pub scene: String,
    /// Image to write: .exr (linear, with metadata) or .png.
    #[arg(short, long, value_parser = path_ending(&["exr", "png"]))]
    pub output: PathBuf,
    /// Estimator, such as point-solid-angle or line-analytic[offset=uniform]; a wrong name lists
    /// all, docs/estimators.md says what they do.
    #[arg(long, default_value = "hybrid")]
    pub estimator: Estimator,
    /// Another estimator for light K of the scene, counted from 0; may be repeated.
    #[arg(long, value_name = "K=ESTIMATOR")]
    pub light_estimator: Vec<LightEstimator>,
    /// Light K is sampled for itself where --lights picks one of the others; may be repeated. For
    /// lights that are bright and mostly hidden.
    #[arg(long, value_name = "K")]
    pub light_apart: Vec<u32>,
    /// Have hybrid go by what closed forms and lines cost on this machine, measured first, in place
    /// of its table; the picture's noise then depends on the machine.
    #[arg(long)]
    pub calibrate: bool,
    /// Sampling pattern.
    #[arg(long, default_value = "stratified")]
    pub sampler: SamplerKind,
    /// Light samples per shading point and light.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES))]
    pub samples: u32,
    /// Which lights a point samples: all, or for each sample one: one:uniform, one:power,
    /// one:estimate, one:exact, tree.
    #[arg(long, default_value = "all")]
    pub lights: LightChoice,
    /// Emissive spheres, disks and cylinders: exact, where they are whole, emit outwards and no
    /// image, or facets.
    #[arg(long, default_value = "exact")]
    pub spheres: Spheres,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Resolution in place of the scene's.
    #[arg(long, value_name = "WxH")]
    pub resolution: Option<Resolution>,
    /// Part of the image to render, as fractions of it.
    #[arg(long, value_name = "X0,X1,Y0,Y1")]
    pub crop: Option<Crop>,
    /// Camera samples per pixel: 1 goes through the centre, more jitter under the scene's filter.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub pixel_samples: u32,
    /// Do not show lights that the camera sees.
    #[arg(long)]
    pub hide_lights: bool,

    /// Follow up to this many perfect mirrors and sheets of glass in a row.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=64))]
    pub bounces: u32,
    /// How an EXR file is packed, always without loss: none, rle, or zip:1 (fast, the default) to
    /// zip:9 (small).
    #[arg(long, value_name = "HOW")]
    pub compression: Option<Compression>,
    /// Print what is done about which lights on which materials, what was skipped and why, and what
    /// visibility cost.
    #[arg(long)]
    pub explain: bool,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `converge`.
#[derive(Args, Debug)]
pub struct ConvergeArgs {
    /// A named study, or scene files and names of built-in scenes; without any, the default study.
    pub what: Vec<String>,
    /// Estimators to compare, separated by commas outside brackets.
    #[arg(long, value_name = "E,E…")]
    pub estimators: Option<List<Estimator>>,
    /// Sampling patterns to compare.
    #[arg(long, value_name = "S,S…")]
    pub samplers: Option<List<SamplerKind>>,
    /// Which lights a point samples: all, or for each sample one: one:uniform, one:power,
    /// one:estimate, one:exact, tree.
    #[arg(long, default_value = "all")]
    pub lights: LightChoice,
    /// Emissive spheres, disks and cylinders: exact, where they are whole, emit outwards and no
    /// image, or facets.
    #[arg(long, default_value = "exact")]
    pub spheres: Spheres,
    /// Light samples per shading point, ascending.
    #[arg(long, value_name = "1,4,16…")]
    pub samples: Option<SampleCounts>,
    /// Independent trials per estimator, pattern and number of samples.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..))]
    pub trials: Option<u32>,
    /// Pixels: a grid over the image (WxH) or single pixels of the scene's resolution (x,y;…).
    #[arg(long, value_name = "WxH|x,y;…")]
    pub pixels: Option<Pixels>,
    /// Stop adding samples once this much time has gone, in seconds.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time_budget: Option<f64>,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Folder for the report.
    #[arg(long, default_value = "out")]
    pub out: PathBuf,
    /// Run every step at the smallest size, whatever comes out: for tests.
    #[arg(long, hide = true)]
    pub smallest: bool,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The image to judge.
    pub image: PathBuf,
    /// The image to judge it by.
    pub reference: PathBuf,
    /// Print machine-readable results on standard output.
    #[arg(long)]
    pub json: bool,
}

/// `info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Scene file, or the name of a built-in scene.
    pub scene: String,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `convert`.
#[derive(Args, Debug)]
pub struct ConvertArgs {
    /// Scene file, or the name of a built-in scene.
    pub scene: String,
    /// Text to write; its name must end in .pbrt.
    #[arg(short, long, value_parser = path_ending(&["pbrt"]))]
    pub output: PathBuf,
    /// Also write what linelit alone reads: linear lights, and materials as they were.
    #[arg(long)]
    pub extensions: bool,
    /// How the scene is read.
    #[command(flatten)]
    pub read: ReadArgs,
}

/// `K=ESTIMATOR`: the estimator of one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightEstimator {
    /// The light's number in the scene, from 0.
    pub light: u32,
    /// Its estimator.
    pub estimator: Estimator,
}

impl FromStr for LightEstimator {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('=');
        let light = parts.and_then(|(k, e)| Some((k.trim().parse().ok()?, e)));
        let Some((light, estimator)) = light else {
            return Err(format!(
                "`{text}` is not LIGHT=ESTIMATOR, such as 0=point-bsdf"
            ));
        };
        let estimator: Estimator = estimator.parse().map_err(|e| format!("{e}"))?;
        Ok(Self { light, estimator })
    }
}

/// A crop window in fractions of the image: x0, x1, y0, y1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop(pub [f64; 4]);

impl FromStr for Crop {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected =
            || format!("`{text}` is not X0,X1,Y0,Y1 with 0 <= X0 < X1 <= 1 and likewise Y");
        let numbers: Vec<f64> = text
            .split(',')
            .map(|t| t.trim().parse::<f64>())
            .collect::<Result<_, _>>()
            .map_err(|_| expected())?;
        let [x0, x1, y0, y1] = <[f64; 4]>::try_from(numbers).map_err(|_| expected())?;
        let ok = |a: f64, b: f64| (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b) && a < b;
        if ok(x0, x1) && ok(y0, y1) {
            Ok(Self([x0, x1, y0, y1]))
        } else {
            Err(expected())
        }
    }
}

/// A list separated by commas outside brackets.
#[derive(Clone, Debug, PartialEq)]
pub struct List<T>(pub Vec<T>);

/// Numbers of samples: positive, ascending, none above [`MOST_SAMPLES`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampleCounts(pub Vec<u32>);

impl FromStr for SampleCounts {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let List(counts) = text.parse::<List<u32>>()?;
        if counts.first() == Some(&0) || !counts.windows(2).all(|w| w[0] < w[1]) {
            return Err("the numbers must be positive and ascending".to_owned());
        }
        match counts.last() {
            Some(most) if i64::from(*most) > MOST_SAMPLES => {
                Err(format!("{most} is more than {MOST_SAMPLES}"))
            }
            _ => Ok(Self(counts)),
        }
    }
}

impl<T: FromStr> FromStr for List<T>
where
    T::Err: fmt::Display,
{
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed: Result<Vec<T>, String> = split_outside_brackets(text)
            .map(|t| t.parse::<T>().map_err(|e| format!("`{t}`: {e}")))
            .collect();
        match parsed? {
            list if list.is_empty() => Err("the list is empty".to_owned()),
            list => Ok(Self(list)),
        }
    }
}

fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    let comma = move |c: char| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        c == ',' && depth == 0
    };
    text.split(comma).map(str::trim).filter(|t| !t.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_split_outside_brackets() {
        let list: List<Estimator> =
            "point-area,line-area[orientation=fixed:0.5,offset=uniform],exact"
                .parse()
                .unwrap();
        assert_eq!(list.0.len(), 3);
        assert!("".parse::<List<u32>>().is_err());
        assert_eq!("1, 4,16".parse::<List<u32>>().unwrap().0, [1, 4, 16]);
        for (list, fine) in [
            ("1,4", true),
            ("0,4", false),
            ("4,1", false),
            ("16777217", false),
        ] {
            assert_eq!(list.parse::<SampleCounts>().is_ok(), fine, "{list}");
        }
        assert!("1,x".parse::<List<u32>>().unwrap_err().contains("`x`"));
    }

    #[test]
    fn crops_are_checked() {
        assert!("0,1,0.5".parse::<Crop>().is_err());
        assert!("0.5,0.2,0,1".parse::<Crop>().is_err());
        assert!("0,nan,0,1".parse::<Crop>().is_err());
        assert_eq!(
            "0,0.5,0,1".parse::<Crop>().unwrap(),
            Crop([0.0, 0.5, 0.0, 1.0])
        );
    }

    #[test]
    fn threads_have_a_limit() {
        assert_eq!((threads("0"), threads("64")), (Ok(0), Ok(64)));
        assert!(threads("1000000").unwrap_err().starts_with("at most "));
        assert!(threads("-1").is_err() && threads("99999999999999999999").is_err());
    }

    #[test]
    fn seconds_are_positive_numbers() {
        assert!(seconds("0.5").is_ok());
        for text in ["0", "-1", "nan", "inf", "x"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
