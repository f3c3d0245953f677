//! `linelit run`.

use super::{bar, kinds};
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
    let folder = kinds::open(&args.plan)?;
    let shard = shard(args)?;
    interrupt::watch().context("watching for signals")?;
    let progress = bar("units");
    progress.set_length(folder.units().into());
    let said = AtomicBool::new(false);
    let options = Run {
        shard,
        threads: threads(args.threads),
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
    let result = kinds::run(&folder, &options);
    progress.finish_and_clear();
    match result {
        Ok(ran) => report(args, &folder, shard, ran, out),
        Err(error) if is_stop(&error) => Err(TryAgain(how_to_go_on(&folder)?).into()),
        Err(error) => Err(error),
    }
}

fn is_stop(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(PlanError::Interrupted))
}

/// What is done and what to do, of a plan whose work was stopped.
fn how_to_go_on(folder: &Folder) -> Result<String> {
    let status = folder.status()?;
    Ok(format!(
        "stopped: {} of {} units are done; `linelit run {}` goes on",
        status.done,
        status.units,
        folder.path().display()
    ))
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
