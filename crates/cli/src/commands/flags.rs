//! What a study cannot be told: flags that it would ignore are refused.

use crate::args::{ConvergeArgs, ReadArgs, UsageError};
use anyhow::Result;
use linelit_scenes::Place;

/// Refuses the first flag that a study of pictures and tables sets itself.
///
/// # Errors
/// A [`UsageError`] that names the flag.
pub(super) fn refuse_fixed(name: &str, args: &ConvergeArgs) -> Result<()> {
    let study = &args.study;
    let own = [
        ("--estimators", study.estimators.is_some()),
        ("--samplers", study.samplers.is_some()),
        ("--lights", study.lights.is_some()),
        ("--spheres", study.spheres.is_some()),
        ("--samples", study.samples.is_some()),
        ("--trials", study.trials.is_some()),
        ("--pixels", study.pixels.is_some()),
        ("--time-budget", args.time_budget.is_some()),
    ];
    first(name, "it repeats a figure or a table", &own)?;
    first(name, BUILT_IN, &of_files(&args.common.read))
}

/// Why the files of scenes are not to be spoken of.
const BUILT_IN: &str = "built-in scenes name no files";

fn of_files(read: &ReadArgs) -> [(&'static str, bool); 2] {
    [
        ("--root", read.root.is_some()),
        ("--allow-outside", read.allow_outside),
    ]
}

fn first(name: &str, why: &str, flags: &[(&str, bool)]) -> Result<()> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(UsageError(format!("`{name}` takes no {flag}: {why}")).into()),
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
    first(&scenes.join(" "), BUILT_IN, &of_files(read))
}
