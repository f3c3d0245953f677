//! What a study cannot be told: flags that it would ignore are refused.

use crate::args::{ConvergeArgs, ReadArgs, StudyArgs, UsageError};
use anyhow::Result;
use linelit_papers::Fixed;
use linelit_scenes::Place;

/// A flag, whether it was given, and what stands in its place.
type Refused = (&'static str, bool, &'static str);

/// Refuses the first flag that a study of pictures and tables sets itself.
///
/// # Errors
/// A [`UsageError`] that names the flag and what is fixed instead.
pub(super) fn refuse_fixed(name: &str, args: &ConvergeArgs, fixed: &Fixed) -> Result<()> {
    let (study, read) = (&args.study, &args.common.read);
    let mut all = of_study(study, fixed).to_vec();
    all.push((
        "--time-budget",
        args.time_budget.is_some(),
        "all that it shows is measured",
    ));
    all.extend(of_files(read, "its scenes are built in, and name no files"));
    if let Some(scene) = fixed.no_scene {
        all.push(("--strict", read.strict, scene));
    }
    first(name, &all)
}

fn of_study(args: &StudyArgs, fixed: &Fixed) -> [Refused; 8] {
    let seed = (args.seed.is_some() && fixed.seed.is_some(), fixed.seed);
    [
        ("--estimators", args.estimators.is_some(), fixed.estimators),
        ("--samplers", args.samplers.is_some(), fixed.samplers),
        ("--lights", args.lights.is_some(), fixed.lights),
        ("--spheres", args.spheres.is_some(), fixed.spheres),
        ("--samples", args.samples.is_some(), fixed.samples),
        ("--trials", args.trials.is_some(), fixed.trials),
        ("--pixels", args.pixels.is_some(), fixed.pixels),
        ("--seed", seed.0, seed.1.unwrap_or_default()),
    ]
}

fn of_files(read: &ReadArgs, instead: &'static str) -> [Refused; 2] {
    [
        ("--root", read.root.is_some(), instead),
        ("--allow-outside", read.allow_outside, instead),
    ]
}

fn first(name: &str, all: &[Refused]) -> Result<()> {
    match all.iter().find(|(_, given, _)| *given) {
        Some((flag, _, instead)) => {
            Err(UsageError(format!("`{name}` sets {flag} itself: {instead}")).into())
        }
        None => Ok(()),
    }
}

/// Refuses flags about the files of scenes where no scene is a file.
///
/// # Errors
/// A [`UsageError`] that names the flag.
pub(super) fn refuse_without_files(scenes: &[String], read: &ReadArgs) -> Result<()> {
    let is_file = |scene: &String| matches!(Place::find(scene), Ok(Place::File(_)));
    if scenes.iter().any(is_file) {
        return Ok(());
    }
    first(
        &scenes.join(" "),
        &of_files(read, "built-in scenes name no files"),
    )
}

/// How scenes are read, as one would say it again.
pub(super) fn words(read: &ReadArgs) -> Vec<String> {
    let mut words = Vec::new();
    if read.strict {
        words.push("--strict".to_owned());
    }
    if let Some(root) = &read.root {
        words.push(format!("--root={}", root.display()));
    }
    if read.allow_outside {
        words.push("--allow-outside".to_owned());
    }
    words
}
