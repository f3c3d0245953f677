//! What each command does.

mod check_references;
mod converge;
mod info;
mod page;
mod render;

pub use check_references::run as check_references;
pub use converge::run as converge;
pub use info::run as info;
pub use render::run as render;

use crate::cli::SceneArgs;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;

/// A pool of the threads that the flags ask for.
fn pool(args: &SceneArgs) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads)
        .build()
        .context("starting the threads")
}

/// A progress bar that hides itself where there is no terminal.
fn bar(message: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(0)
        .with_style(style)
        .with_message(message.to_owned())
}
