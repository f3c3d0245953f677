//! What each command does.

mod aovs;
mod compare;
mod converge;
mod info;
mod list;
mod methods;
mod pages;
mod picture;
mod plan;
mod render;
mod study;
mod tev;
mod units;
mod viewfactors;

pub use compare::run as compare;
pub use converge::run as converge;
pub use info::run as info;
pub use list::run as list;
pub use pages::{completions, man};
pub use plan::{merge, plan, run, status};
pub use render::run as render;
pub use viewfactors::run as viewfactors;

use crate::args::SceneArgs;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPool;

/// A pool of the threads that the flags ask for.
pub fn pool(args: &SceneArgs) -> Result<ThreadPool> {
    pool_of(args.threads)
}

fn pool_of(threads: usize) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
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
