//! What each command does.

mod compare;
mod converge;
mod convert;
mod info;
mod list;
mod pages;
mod render;

pub use converge::run as converge;
pub use convert::run as convert;
pub use info::run as info;
pub use list::run as list;
pub use pages::{completions, man};
pub use render::run as render;

use crate::args::{CompareArgs, SceneArgs};
use crate::output::Output;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;

/// `compare`: prints how two images differ.
///
/// # Errors
/// If an image cannot be read, the two differ in size, or nothing can be printed.
pub fn compare(args: &CompareArgs, out: &mut Output) -> Result<()> {
    let comparison = compare::run(&args.image, &args.reference)?;
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&comparison)?)?;
    } else {
        writeln!(out, "{comparison}")?;
    }
    Ok(())
}

/// A pool of the threads that the flags ask for.
///
/// # Errors
/// If the system starts none.
pub fn pool(args: &SceneArgs) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build()
        .context("starting the threads")
}

/// A progress bar that hides itself where there is no terminal.
#[must_use]
pub fn bar(message: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(0)
        .with_style(style)
        .with_message(message.to_owned())
}
