//! Working off plans, whichever command asks for it, and what is missing of them.

use crate::args::{ImageArgs, UsageError};
use crate::folder::remove_all;
use crate::{interrupt, output::note, program::TryAgain};
use anyhow::{Context as _, Result, anyhow};
use indicatif::{ProgressBar, ProgressStyle};
use linelit_plan::{Event, Folder, Missing, Plan, PlanError, Ran, Run, Shard};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Units that are named one by one.
const NAMED: usize = 8;

/// Begins to keep what is done of a picture or a study, as `what` says, or goes on with what an
/// interrupted command kept.
pub(super) fn keep(path: &Path, plan: &Plan, what: &str) -> Result<Folder> {
    let create = || Folder::create(path, plan);
    let made = match create() {
        // Nothing of it is lost.
        Err(PlanError::Another { .. }) if Folder::open(path)?.status()?.done == 0 => {
            remove_all(path)?;
            create()
        }
        made => made,
    };
    let folder = made.map_err(|e| match e {
        PlanError::Another { path, differs } => anyhow!(
            "{} keeps an interrupted {what} of another command ({differs}): that command goes on \
             with it, --fresh begins anew",
            path.display()
        ),
        other => other.into(),
    })?;
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

/// Works off a plan, but for the units that it is to `leave` out, until it is done or a signal
/// comes ([`TryAgain`]); then says what `goes_on` with it.
pub(super) fn work_off(
    folder: &Folder,
    shard: Shard,
    threads: usize,
    goes_on: &str,
    leave: &(dyn Fn(u32) -> bool + Sync),
    work: impl FnOnce(&Run<'_>) -> Result<Ran>,
) -> Result<Ran> {
    interrupt::watch().context("watching for signals")?;
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

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "of a plan: finite and not negative"
)]
const fn milliseconds(cost: f64) -> u64 {
    (1e3 * cost) as u64 + 1
}

/// The unit in hand, and the time left by what units cost, at the terminal if there is one.
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

/// Refuses the flags of a picture's file where none is written.
pub(super) fn refuse_picture_flags(file: &ImageArgs) -> Result<(), UsageError> {
    if file.exposure.abs() > 0.0 || file.compression.is_some() {
        let text = "--exposure and --compression are for plans of pictures";
        return Err(UsageError(text.to_owned()));
    }
    Ok(())
}

/// A word as one would give it to a shell.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+,:=@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
