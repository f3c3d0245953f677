//! `linelit status`.

use crate::args::StatusArgs;
use crate::interrupt;
use crate::output::Output;
use anyhow::{Context as _, Result};
use linelit_plan::{Folder, Status};
use std::time::Duration;

/// Between two looks.
const PAUSE: Duration = Duration::from_secs(2);

/// Says how far a plan is, whichever program made it.
///
/// # Errors
/// If it cannot be looked at.
pub fn run(args: &StatusArgs, out: &mut Output) -> Result<()> {
    let folder = Folder::open(&args.plan)?;
    if args.watch {
        interrupt::watch().context("watching for signals")?;
    }
    loop {
        let status = folder.status()?;
        say(args, &folder, &status, out)?;
        out.flush()?;
        if !args.watch || status.done == status.units || interrupt::stopped() {
            return Ok(());
        }
        std::thread::sleep(PAUSE);
    }
}

fn say(args: &StatusArgs, folder: &Folder, status: &Status, out: &mut Output) -> Result<()> {
    let open = status.units - status.done;
    if args.json {
        let found = serde_json::json!({
            "plan": folder.hash(),
            "kind": folder.plan().kind,
            "program": folder.plan().program,
            "units": status.units,
            "done": status.done,
            "open": open,
            "cost": status.cost,
            "cost_done": status.cost_done,
            "seconds_left": status.seconds_left,
        });
        writeln!(out, "{found}")?;
        return Ok(());
    }
    let percent = 100.0 * status.cost_done / status.cost.max(f64::MIN_POSITIVE);
    let left = status.seconds_left.map_or(String::new(), |seconds| {
        format!("; about {seconds:.0} s left")
    });
    writeln!(
        out,
        "{} of {} units done ({percent:.0} % by cost), {open} open{left}",
        status.done, status.units
    )?;
    Ok(())
}
