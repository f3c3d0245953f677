//! `linelit merge`.

use super::plan::{self, Planned};
use crate::args::MergeArgs;
use crate::output::Output;
use anyhow::Result;

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
