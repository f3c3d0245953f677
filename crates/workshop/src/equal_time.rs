//! `bench equal-time`: measures error against time, to see which estimator reaches an error first.

use crate::args::BenchArgs;
use anyhow::{Context, Result, bail};
use linelit_cli::args::ReadArgs;
use linelit_cli::output::{Output, OutputError};
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, ShadingPoint, Workspace};
use linelit_study::engine::{Contest, ContestPoint, CpuClock, Problem, contest};
use linelit_study::pixels::Resolution;
use linelit_study::scene_study::{Targets, all_pixels};
use serde_json::json;
use std::path::Path;

/// The error of an estimator as a function of its time.
pub(crate) type Curve = linelit_study::engine::Curve<Settings>;

/// The estimators that are compared by default. The last one competes with all others.
const ESTIMATORS: [&str; 7] = [
    "point-area",
    "point-solid-angle",
    "point-area[visibility=shaft]",
    "point-solid-angle[visibility=shaft]",
    "line-analytic",
    "exact",
    "hybrid",
];

/// The scenes that are measured by default.
const SCENES: [&str; 8] = [
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "cornell-box-small",
    "cornell-box-large",
    "colonnade-small",
    "colonnade-large",
];

/// Prints the curves, and how the last estimator compares.
pub(crate) fn run(args: &BenchArgs, out: &mut Output) -> Result<()> {
    let mut rows = Vec::new();
    let scenes = args.scene.as_deref().map(|name| vec![name]);
    for name in scenes.unwrap_or(SCENES.to_vec()) {
        let curves = measure(name, args)?;
        if args.json {
            rows.extend(json_rows(name, &curves));
        } else {
            print(name, args, &curves, out)?;
        }
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&rows)?)?;
    }
    Ok(())
}

/// Measures the requested estimators, or the default ones, on a scene.
fn measure(name: &str, args: &BenchArgs) -> Result<Vec<Curve>> {
    let estimators = match &args.estimators {
        Some(list) => list.0.clone(),
        None => parsed(ESTIMATORS)?,
    };
    curves(name, &estimators, args)
}

/// Returns the curves of some estimators on a built-in scene.
pub(crate) fn contest_of<'a>(
    name: &str,
    estimators: impl IntoIterator<Item = &'a str>,
    rounds: u32,
    read: &ReadArgs,
) -> Result<Vec<Curve>> {
    let args = BenchArgs {
        scene: None,
        estimators: None,
        samples: None,
        resolution: Resolution {
            width: 32,
            height: 24,
        },
        reference: None,
        rounds,
        read: read.clone(),
        json: false,
    };
    curves(name, &parsed(estimators)?, &args)
}

/// Parses estimators.
pub(crate) fn parsed<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Vec<Estimator>> {
    let parse = |text: &str| text.parse().context("a built-in name");
    texts.into_iter().map(parse).collect()
}

/// Measures the curves of estimators on a scene.
fn curves(name: &str, estimators: &[Estimator], args: &BenchArgs) -> Result<Vec<Curve>> {
    let mut scene = args.read.library().load_lit(name)?.scene;
    let Resolution { width, height } = args.resolution;
    scene.set_resolution(width, height);
    let renderer = Renderer::new(&scene);
    let targets = Targets::find(&renderer, &all_pixels(width, height));
    let asked = args.samples.as_ref().map(|counts| &counts.0);
    // Points have more samples by default than lines.
    let entry = |estimator: &Estimator| {
        let is_points = estimator.to_string().starts_with("point");
        let last = if is_points { 10 } else { 8 };
        let usual = || (0..=last).map(|k| 1 << k).collect();
        (settings(*estimator), asked.cloned().unwrap_or_else(usual))
    };
    // Compare them with a given picture or with a computed one.
    let what = Contest {
        entries: estimators.iter().map(entry).collect(),
        rounds: args.rounds,
        truth: match &args.reference {
            Some(path) => given(path, [width, height], &targets)?,
            None => reference(&targets).0,
        },
    };
    Ok(contest(&targets, &what))
}

/// Returns the settings of an estimator.
pub(crate) fn settings(estimator: Estimator) -> Settings {
    Settings {
        estimator,
        ..Settings::default()
    }
}

/// The estimators by which references are computed; each scene uses the one with the least noise
/// for its time. Some of them are for textured lights.
const TRUE: [&str; 6] = [
    "exact",
    "line-analytic",
    "line-texture",
    "hybrid",
    "point-area[visibility=shaft]",
    "point-texture",
];

/// Returns a reference of all integrals, computed by the method that has the least noise for its
/// time, and the mean squared error of this reference over its mean square. The error is zero where
/// the method has no noise.
pub(crate) fn reference<P>(problem: &P) -> (Vec<DVec3>, f64)
where
    P: Problem<Settings = Settings, Workspace = Workspace>,
{
    /// The first seed of the reference's trials, which no round of a measurement uses.
    const SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;
    /// The number of samples of each estimate in a trial.
    const SAMPLES: u32 = 1024;
    /// The number of samples of each estimate by which the method is chosen.
    const FEW: u32 = 64;
    /// The method is chosen by every `STEP`-th integral.
    const STEP: usize = 16;
    /// The largest number of trials whose mean is the reference.
    const TRIALS: usize = 16;
    /// The processor seconds after which no further trial is begun.
    const SECONDS: f64 = 10.0;
    let mut workspace = Workspace::new();
    let mut trial = |settings: &Settings, samples: u32, trial: u64, step: usize| -> Vec<DVec3> {
        let integrals = (0..problem.integrals()).step_by(step);
        let seed = SEED + trial;
        integrals
            .map(|k| problem.estimate(settings, samples, seed, k, &mut workspace))
            .collect()
    };
    let square = |values: &[DVec3]| values.iter().map(|v| v.length_squared()).sum::<f64>();
    let difference = |a: &[DVec3], b: &[DVec3]| {
        square(&a.iter().zip(b).map(|(a, b)| *a - *b).collect::<Vec<_>>())
    };
    // Find the best method: the first of those without noise, or the least variance × time.
    let mut best = (f64::INFINITY, settings(Estimator::exact()));
    for settings in parsed(TRUE).into_iter().flatten().map(settings) {
        let clock = CpuClock::start();
        let [a, b] = [0, 1].map(|k| trial(&settings, FEW, k, STEP));
        let score = difference(&a, &b) * clock.seconds();
        if score < best.0 {
            best = (score, settings);
        }
    }
    // Average the trials of the best method, and find the variance of their mean from their
    // scatter.
    let clock = CpuClock::start();
    let mut trials: Vec<Vec<DVec3>> = Vec::new();
    while trials.len() < 2 || (trials.len() < TRIALS && clock.seconds() < SECONDS) {
        trials.push(trial(&best.1, SAMPLES, trials.len() as u64, 1));
        if trials.len() == 2 && difference(&trials[0], &trials[1]) <= 0.0 {
            break;
        }
    }
    let count = trials.len() as f64;
    let mean = |k: usize| trials.iter().map(|values| values[k]).sum::<DVec3>() / count;
    let mean: Vec<_> = (0..problem.integrals()).map(mean).collect();
    let scatter: f64 = trials.iter().map(|values| difference(values, &mean)).sum();
    let error = scatter / (count * (count - 1.0)) / square(&mean).max(f64::MIN_POSITIVE);
    (mean, error)
}

/// Returns the values of an image at the targets.
fn given(path: &Path, [width, height]: [u32; 2], targets: &Targets<'_>) -> Result<Vec<DVec3>> {
    let image = Image::read(path)?;
    if [image.width, image.height] != [width, height] {
        bail!(
            "{} is {} x {} pixels, not {width} x {height}",
            path.display(),
            image.width,
            image.height
        );
    }
    let value = |([x, y], _): &([u32; 2], ShadingPoint)| {
        DVec3::from_array(image.rgb[(y * width + x) as usize].map(f64::from))
    };
    Ok(targets.points.iter().map(value).collect())
}

/// Returns the largest ratio of the last estimator's time to an error and the least time in which
/// another reaches it, with the last one's number of samples there.
fn worst(curves: &[Curve]) -> Option<(f64, u32)> {
    let (hybrid, others) = curves.split_last()?;
    let ratio = |point: &ContestPoint| {
        let times = others.iter().filter_map(|curve| curve.time_to(point.mse));
        let best = times.reduce(f64::min)?;
        Some((point.time / best, point.samples))
    };
    let ratios = hybrid.points.iter().filter_map(ratio);
    ratios.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Prints the curves of a scene as a table.
fn print(
    name: &str,
    args: &BenchArgs,
    curves: &[Curve],
    out: &mut Output,
) -> Result<(), OutputError> {
    let is_given = args.reference.is_some();
    let error = match is_given {
        true => "mean relative squared error",
        false => "relative mean squared error",
    };
    writeln!(out, "{name}: microseconds a point and {error}")?;
    // Choose the numbers of samples to print.
    let mut counts: Vec<u32> = [1, 4, 16, 64, 256, 1024].to_vec();
    if let Some(curve) = curves.first().filter(|_| args.samples.is_some()) {
        counts = curve.points.iter().map(|p| p.samples).collect();
    }
    write!(out, "{:38}", "samples")?;
    for n in &counts {
        write!(out, "{n:>18}")?;
    }
    writeln!(out)?;
    // Print time and error of each.
    for curve in curves {
        write!(out, "{:38}", curve.settings.estimator.to_string())?;
        for n in &counts {
            match curve.points.iter().find(|p| p.samples == *n) {
                Some(p) => {
                    let error = if is_given { p.mrse } else { p.mse };
                    write!(out, "{:9.2} {error:8.1e}", p.time)?;
                }
                None => write!(out, "{:>18}", "")?,
            }
        }
        writeln!(out)?;
    }
    if let Some((ratio, samples)) = worst(curves) {
        writeln!(
            out,
            "  hybrid: at most {ratio:.2} of the best of the others' time to equal error (N = {samples})"
        )?;
    }
    writeln!(out)
}

/// Returns the curves of a scene as JSON.
fn json_rows(name: &str, curves: &[Curve]) -> Vec<serde_json::Value> {
    let (scene, light) = match name.rsplit_once('-') {
        Some((scene, light @ ("small" | "large"))) => (scene, light),
        _ => (name, ""),
    };
    let mut rows = Vec::new();
    for curve in curves {
        rows.extend(curve.points.iter().map(|p| {
            json!({
                "scene": scene, "light": light, "estimator": curve.settings.estimator.to_string(),
                "samples": p.samples, "us_point": p.time, "mse": p.mse, "mrse": p.mrse,
            })
        }));
    }
    rows
}
