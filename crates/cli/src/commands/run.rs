//! `linelit run`.

use super::plan::{self, Planned};
use super::units::work_off;
use crate::args::{RunArgs, UsageError};
use crate::output::{Output, note};
use anyhow::Result;
use linelit_plan::{Folder, Ran, Shard};

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
