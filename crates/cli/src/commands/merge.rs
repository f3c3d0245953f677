//! `linelit merge`.

use super::plan::{self, Planned};
use crate::args::MergeArgs;
use crate::output::Output;
use crate::program::TryAgain;
use anyhow::Result;
use linelit_plan::{Folder, Missing};

/// Units that are named one by one.
const NAMED: usize = 8;

/// Puts the parts of a plan together.
///
/// # Errors
/// If parts are missing, which are named, or the result cannot be written.
pub fn run(args: &MergeArgs, out: &mut Output) -> Result<()> {
    match plan::open(&args.plan)? {
        (folder, Planned::Picture(plan)) => plan.merge(&folder, args, out),
        (folder, Planned::Study(plan)) => plan.merge(&folder, args, out),
    }
}

/// That nothing is missing.
pub(super) fn check(folder: &Folder, missing: &Missing) -> Result<()> {
    if missing.is_empty() {
        return Ok(());
    }
    let units = &folder.plan().units;
    let mut text = format!("{} of {} units are missing", missing.len(), units.len());
    let named = |number: &u32| units[*number as usize].name.as_str();
    if !missing.absent.is_empty() {
        let names: Vec<&str> = missing.absent.iter().take(NAMED).map(named).collect();
        let more = missing.absent.len() - names.len();
        text += &format!("; not done: {}", names.join(", "));
        if more > 0 {
            text += &format!(" and {more} more");
        }
    }
    for (number, why) in missing.broken.iter().take(NAMED) {
        text += &format!("; broken: {} ({why})", named(number));
    }
    if missing.broken.len() > NAMED {
        text += &format!(" and {} more", missing.broken.len() - NAMED);
    }
    let path = folder.path().display();
    Err(TryAgain(format!("{text}. `linelit run {path}` does them")).into())
}
