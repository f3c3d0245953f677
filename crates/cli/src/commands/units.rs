//! The shared work of all commands that run plans: running until done or interrupted, and listing
//! what is missing.

use crate::args::{ImageArgs, UsageError};
use crate::folder::remove_all;
use crate::{interrupt, output::note, program::TryAgain};
use anyhow::{Context as _, Result, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use linelit_plan::{Event, Folder, Missing, Plan, PlanError, Run, RunCounts, Shard};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The largest number of missing units that are named one by one.
const NAMED: usize = 8;

/// Creates a plan for storing the intermediate results of a picture or study (`what`), or opens the
/// plan of an interrupted command to continue it.
pub(super) fn keep(path: &Path, plan: &Plan, what: &str) -> Result<Folder> {
    let create = || Folder::create(path, plan);
    let made = match create() {
        // Replace the plan of another command if no unit of it was done.
        Err(PlanError::Another { .. }) if Folder::open(path)?.status()?.done == 0 => {
            remove_all(path)?;
            create()
        }
        made => made,
    };
    // Refuse to continue the plan of another command.
    let folder = made.map_err(|e| match e {
        PlanError::Another { path, differs } => anyhow!(
            "{} keeps an interrupted {what} of another command ({differs}): that command goes on \
             with it, --fresh begins anew",
            path.display()
        ),
        other => other.into(),
    })?;
    // Note how much is already done.
    let before = folder.status()?;
    if before.done > 0 {
        note(format_args!(
            "note: going on with an interrupted {what}, {} of {} units are done (--fresh begins \
             anew)",
            before.done, before.units
        ));
    }
    Ok(folder)
}

/// Computes the units of a plan, except those that `leave` leaves out, until all are done or a
/// signal comes. The error is then [`TryAgain`], which says how the work `goes_on`.
pub(super) fn work_off(
    folder: &Folder,
    shard: Shard,
    threads: usize,
    goes_on: &str,
    leave: &(dyn Fn(u32) -> bool + Sync),
    work: impl FnOnce(&Run<'_>) -> Result<RunCounts>,
) -> Result<RunCounts> {
    interrupt::watch().context("watching for signals")?;
    // Show progress, and stop at the first signal.
    let progress = cost_bar(folder);
    let said = AtomicBool::new(false);
    let options = Run {
        shard,
        threads,
        stop: &|| {
            let stopped = interrupt::stopped();
            if stopped && !said.swap(true, Ordering::Relaxed) {
                note(format_args!(
                    "stopping: units in hand are finished; once more to drop them"
                ));
            }
            stopped
        },
        leave,
        note: &|event| match event {
            Event::Begun(unit) => progress.set_message(unit.name.clone()),
            Event::Done(unit) | Event::Found(unit) => progress.inc(milliseconds(unit.cost)),
            Event::Broken(unit, why) => {
                note(format_args!("note: {}, once more: {why}", unit.name));
            }
            _ => {}
        },
    };
    let result = work(&options);
    progress.finish_and_clear();
    // Turn an interruption into advice on how to continue.
    match result {
        Err(e)
            if matches!(e.downcast_ref(), Some(PlanError::Interrupted)) && interrupt::stopped() =>
        {
            let status = folder.status()?;
            let (done, all) = (status.done, status.units);
            let text = format!("interrupted: {done} of {all} units are done; {goes_on} goes on");
            Err(TryAgain(text).into())
        }
        other => other,
    }
}

/// Returns the length of a unit on the progress bar.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "of a plan: finite and not negative"
)]
const fn milliseconds(cost: f64) -> u64 {
    (1e3 * cost) as u64 + 1
}

/// Creates a progress bar that shows the current unit and the time left according to the costs of
/// units.
fn cost_bar(folder: &Folder) -> ProgressBar {
    let style = ProgressStyle::with_template("{wide_msg} {bar:20} {eta:>6}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let cost = folder
        .plan()
        .units
        .iter()
        .map(|unit| milliseconds(unit.cost));
    let bar = ProgressBar::new(cost.sum()).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// Checks that no unit is missing.
pub(super) fn check(folder: &Folder, missing: &Missing) -> Result<()> {
    if missing.is_empty() {
        return Ok(());
    }
    // Name some of the units that have no part, and some whose part is broken.
    let units = &folder.plan().units;
    let mut text = format!("{} of {} units are missing", missing.len(), units.len());
    let named = |number: &u32| units[*number as usize].name.as_str();
    let more = |count: usize| match count.saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    if !missing.absent.is_empty() {
        let names: Vec<&str> = missing.absent.iter().take(NAMED).map(named).collect();
        text += &format!(
            "; not done: {}{}",
            names.join(", "),
            more(missing.absent.len())
        );
    }
    for (number, why) in missing.broken.iter().take(NAMED) {
        text += &format!("; broken: {} ({why})", named(number));
    }
    text += &more(missing.broken.len());
    let path = folder.path().display();
    Err(TryAgain(format!("{text}. `linelit run {path}` does them")).into())
}

/// Refuses the flags about a picture's file where no picture is written.
pub(super) fn refuse_picture_flags(file: &ImageArgs) -> Result<(), UsageError> {
    if file.exposure.abs() > 0.0 || file.compression.is_some() {
        let text = "--exposure and --compression are for plans of pictures";
        return Err(UsageError(text.to_owned()));
    }
    Ok(())
}

/// Quotes a word for a shell.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+,:=@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
