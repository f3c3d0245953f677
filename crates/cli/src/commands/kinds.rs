//! What plans are of: here each kind says what its units compute and how they are put together.

use super::picture::PicturePlan;
use super::study::StudyPlan;
use crate::args::MergeArgs;
use crate::output::Output;
use anyhow::{Result, bail};
use linelit_plan::{Folder, Ran, Run};
use std::path::Path;

/// The kind of plans of pictures.
pub(super) const RENDER: &str = "render";
/// The kind of plans of convergence studies.
pub(super) const CONVERGE: &str = "converge";

/// The version of the program, and its commit, that plans are held to.
pub(super) fn program() -> String {
    let (version, commit) = (linelit_study::version(), linelit_study::tables::commit());
    format!("linelit {version} ({commit})")
}

/// Opens a plan that this program made.
pub(super) fn open(path: &Path) -> Result<Folder> {
    let folder = Folder::open(path)?;
    folder.check_program(&program())?;
    Ok(folder)
}

/// Does what is left of a plan.
pub(super) fn run(folder: &Folder, options: &Run<'_>) -> Result<Ran> {
    match folder.plan().kind.as_str() {
        RENDER => PicturePlan::open(folder)?.run(folder, options),
        CONVERGE => StudyPlan::open(folder)?.run(folder, options),
        other => unknown(other),
    }
}

/// Puts the parts of a plan together.
pub(super) fn merge(folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
    match folder.plan().kind.as_str() {
        RENDER => PicturePlan::open(folder)?.merge(folder, args, out),
        CONVERGE => StudyPlan::open(folder)?.merge(folder, args, out),
        other => unknown(other),
    }
}

fn unknown<T>(kind: &str) -> Result<T> {
    bail!("a plan of the kind `{kind}`, which this program does not know")
}
