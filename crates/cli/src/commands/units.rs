//! What plans of all kinds share: their names, working them off, and what is missing.

use super::bar;
use crate::{interrupt, output::note, program::TryAgain};
use anyhow::{Context as _, Result};
use linelit_plan::{Event, Folder, Missing, PlanError, Ran, Run, Shard};
use std::sync::atomic::{AtomicBool, Ordering};

/// The kind of plans of pictures.
pub(super) const RENDER: &str = "render";
/// The kind of plans of convergence studies.
pub(super) const CONVERGE: &str = "converge";

/// The version of the program, and its commit, that plans are held to.
pub(super) fn program() -> String {
    let (version, commit) = (linelit_study::version(), linelit_study::tables::commit());
    format!("linelit {version} ({commit})")
}

/// A word as one would give it to a shell.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./+,:=@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Works off a plan until it is done or a signal comes; then says what `goes_on` with it.
pub(super) fn work_off(
    folder: &Folder,
    shard: Shard,
    threads: usize,
    goes_on: &str,
    work: impl FnOnce(&Run<'_>) -> Result<Ran>,
) -> Result<Ran> {
    interrupt::watch().context("watching for signals")?;
    let progress = bar("units");
    progress.set_length(folder.units().into());
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
        note: &|event| match event {
            Event::Done(_) | Event::Found(_) => progress.inc(1),
            Event::Broken(unit, why) => {
                note(format_args!("note: {}, once more: {why}", unit.name));
            }
            _ => {}
        },
    };
    let result = work(&options);
    progress.finish_and_clear();
    match result {
        Err(e) if matches!(e.downcast_ref(), Some(PlanError::Interrupted)) => {
            let status = folder.status()?;
            let (done, all) = (status.done, status.units);
            let text = format!("interrupted: {done} of {all} units are done; {goes_on} goes on");
            Err(TryAgain(text).into())
        }
        other => other,
    }
}

/// Units that are named one by one.
const NAMED: usize = 8;

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
