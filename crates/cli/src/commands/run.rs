//! `linelit run`.

use super::bar;
use super::plan::{self, Planned};
use crate::args::{RunArgs, UsageError};
use crate::interrupt;
use crate::output::{Output, note};
use crate::program::TryAgain;
use anyhow::{Context as _, Result};
use linelit_plan::{Event, Folder, PlanError, Ran, Run, Shard};
use std::sync::atomic::{AtomicBool, Ordering};

/// Does what is left of a plan, or of a shard of it.
///
/// # Errors
/// If the plan cannot be read, is of another program, or a unit fails.
pub fn run(args: &RunArgs, out: &mut Output) -> Result<()> {
    let (folder, planned) = plan::open(&args.plan)?;
    let shard = shard(args)?;
    let go_on = format!("`linelit run {}`", folder.path().display());
    let ran = work_off(
        &folder,
        shard,
        threads(args.threads),
        &go_on,
        |options| match &planned {
            Planned::Picture(plan) => plan.run(&folder, options),
            Planned::Study(plan) => plan.run(&folder, options),
        },
    )?;
    report(args, &folder, shard, ran, out)
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

/// The shard that words or environment say, which is noted.
fn shard(args: &RunArgs) -> Result<Shard> {
    if let Some(shard) = args.shard {
        return Ok(shard);
    }
    let named = Shard::from_environment(|name| std::env::var(name).ok(), args.shards);
    match named.map_err(|e| UsageError(e.to_string()))? {
        Some(named) => {
            note(format_args!("shard {} by {}", named.shard, named.by));
            Ok(named.shard)
        }
        None if args.shards.is_some() => Err(UsageError(
            "--shards says how many there are, and nothing which one this is: --shard I/N says both"
                .to_owned(),
        )
        .into()),
        None => Ok(Shard::ALL),
    }
}

/// As many as are asked for, or as this process may use.
fn threads(asked: usize) -> usize {
    match asked {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        asked => asked,
    }
}

fn report(args: &RunArgs, folder: &Folder, shard: Shard, ran: Ran, out: &mut Output) -> Result<()> {
    let Ran {
        computed,
        found,
        elsewhere,
    } = ran;
    if args.json {
        let found = serde_json::json!({
            "plan": folder.hash(),
            "shard": shard.to_string(),
            "units": folder.units(),
            "computed": computed,
            "found": found,
            "elsewhere": elsewhere,
        });
        writeln!(out, "{found}")?;
        return Ok(());
    }
    writeln!(
        out,
        "shard {shard}: {computed} units computed, {found} found; {elsewhere} of {} are left to \
         others",
        folder.units()
    )?;
    Ok(())
}
