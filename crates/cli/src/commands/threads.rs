//! Pools of threads, and the progress bar that a terminal shows while they work.

use crate::args::SceneArgs;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;

/// Creates a pool with the number of threads that the flags request.
pub fn pool(args: &SceneArgs) -> Result<ThreadPool> {
    pool_of(args.threads)
}

/// Creates a pool of this many threads, or for zero of as many as there are cores.
pub(super) fn pool_of(threads: usize) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .context("starting the threads")
}

/// Creates a progress bar, which is hidden where there is no terminal.
#[must_use]
pub fn bar(message: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:28} {wide_bar} {pos}/{len} {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(0)
        .with_style(style)
        .with_message(message.to_owned())
}
