//! `linelit plan`, `run`, `merge` and `status`: the work of a command in a folder that any number
//! of processes share.

use super::picture::{self, Picture, RENDER};
use super::study::{self, CONVERGE, StudyPlan};
use super::units::{quoted, work_off};
use super::viewfactors::{self, Factors, VIEWFACTORS};
use crate::args::{
    MergeArgs, PlanArgs, PlanKind, PlannedArgs, ReadArgs, RunArgs, Script, StatusArgs, UsageError,
};
use crate::inputs::program;
use crate::interrupt;
use crate::output::{Output, note};
use anyhow::{Context as _, Result, bail};
use linelit_plan::{Folder, Plan, Shard};
use std::path::Path;
use std::time::Duration;

/// The time between two reports of `status --watch`.
const PAUSE: Duration = Duration::from_secs(2);

/// The work in a plan, by its kind.
enum Planned {
    Picture(Box<(Picture, ReadArgs)>),
    Study(Box<StudyPlan>),
    Factors(Box<Factors>),
}

/// Opens a plan that this version of the program made.
fn open(path: &Path) -> Result<(Folder, Planned)> {
    let folder = Folder::open(path)?;
    folder.check_program(&program())?;
    let planned = match folder.plan().kind.as_str() {
        RENDER => Planned::Picture(Box::new(Picture::open(&folder)?)),
        CONVERGE => Planned::Study(Box::new(StudyPlan::open(&folder)?)),
        VIEWFACTORS => Planned::Factors(Box::new(Factors::open(&folder)?)),
        other => bail!("a plan of the kind `{other}`, which this program does not know"),
    };
    Ok((folder, planned))
}

/// Writes the folder of a plan.
///
/// # Errors
/// If the scene or file cannot be read, or the folder cannot be created or holds other files.
pub fn plan(args: &PlanArgs, out: &mut Output) -> Result<()> {
    match &args.kind {
        PlanKind::Render(args) => finish(&picture::plan(args)?, &args.planned, "picture.exr", out),
        PlanKind::Converge(args) => finish(&study::make(args)?, &args.planned, "out", out),
        PlanKind::ViewFactors(args) => {
            finish(&viewfactors::plan(args)?, &args.planned, "factors.npz", out)
        }
    }
}

/// Computes the remaining units of a plan, or of one of its shards.
///
/// # Errors
/// If the plan cannot be read, was made by another version of the program, or a unit fails.
pub fn run(args: &RunArgs, out: &mut Output) -> Result<()> {
    // Open the plan, and find the shard and the number of threads.
    let (folder, planned) = open(&args.plan)?;
    let shard = shard(args)?;
    let goes_on = format!("`linelit run {}`", folder.path().display());
    let threads = match args.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        asked => asked,
    };
    // Compute the units.
    let ran = work_off(
        &folder,
        shard,
        threads,
        &goes_on,
        &|_| false,
        |options| match &planned {
            Planned::Picture(plan) => plan.0.run(&plan.1, &folder, options),
            Planned::Study(plan) => plan.run(&folder, options),
            Planned::Factors(plan) => plan.run(&folder, options),
        },
    )?;
    // Print what was done.
    let (computed, found, elsewhere) = (ran.computed, ran.found, ran.elsewhere);
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

/// Returns the shard from the command line or, with a note, from the environment.
fn shard(args: &RunArgs) -> Result<Shard> {
    if let Some(shard) = args.shard {
        return Ok(shard);
    }
    let named = Shard::from_environment(|name| std::env::var(name).ok(), args.shards);
    match named.map_err(|e| UsageError(e.to_string()))? {
        Some((shard, by)) => {
            note(format_args!("shard {shard} by {by}"));
            Ok(shard)
        }
        None if args.shards.is_some() => Err(UsageError(
            "--shards says how many there are, and nothing which one this is: --shard I/N says both"
                .to_owned(),
        )
        .into()),
        None => Ok(Shard::ALL),
    }
}

/// Puts the parts of a plan together, and writes the result.
///
/// # Errors
/// If parts are missing (the error names them), or the result cannot be written.
pub fn merge(args: &MergeArgs, out: &mut Output) -> Result<()> {
    match open(&args.plan)? {
        (folder, Planned::Factors(plan)) => plan.merge(&folder, args, out),
        _ if args.report.is_some() => {
            let text = "--report is for plans of view factors";
            Err(UsageError(text.to_owned()).into())
        }
        (folder, Planned::Picture(plan)) => plan.0.merge(&folder, args, out),
        (folder, Planned::Study(plan)) => plan.merge(&folder, args, out),
    }
}

/// Prints the progress of a plan, made by any version of the program.
pub fn status(args: &StatusArgs, out: &mut Output) -> Result<()> {
    let folder = Folder::open(&args.plan)?;
    if args.watch {
        interrupt::watch().context("watching for signals")?;
    }
    loop {
        // Print the numbers of units and their estimated costs.
        let status = folder.status()?;
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
        } else {
            let percent = 100.0 * status.cost_done / status.cost.max(f64::MIN_POSITIVE);
            let left = status
                .seconds_left
                .map(|seconds| format!("; about {seconds:.0} s left"));
            writeln!(
                out,
                "{} of {} units done ({percent:.0} % by cost), {open} open{}",
                status.done,
                status.units,
                left.unwrap_or_default()
            )?;
        }
        // Wait and print again, until all is done or a signal comes.
        out.flush()?;
        if !args.watch || open == 0 || interrupt::stopped() {
            return Ok(());
        }
        std::thread::sleep(PAUSE);
    }
}

/// Writes a plan of any kind, and prints what it is or how to run it. `result` is the name of the
/// file that merging it writes.
fn finish(plan: &Plan, args: &PlannedArgs, result: &str, out: &mut Output) -> Result<()> {
    // Write the folder, and print a script that runs the plan if one is requested.
    let folder = Folder::create(&args.output, plan)?;
    if let Some(kind) = args.script {
        write!(out, "{}", script(kind, args, result)?)?;
        return Ok(());
    }
    // Otherwise print what the plan is.
    let cost: f64 = plan.units.iter().map(|unit| unit.cost).sum();
    let most = plan.units.iter().map(|unit| unit.cost).fold(0.0, f64::max);
    if args.json {
        let found = serde_json::json!({
            "plan": folder.hash(),
            "output": args.output,
            "kind": plan.kind,
            "program": plan.program,
            "units": plan.units.len(),
            "cost": cost,
            "most_cost": most,
            "files": plan.inputs.iter().map(|input| input.files.len()).sum::<usize>(),
        });
        writeln!(out, "{found}")?;
        return Ok(());
    }
    let path = args.output.display();
    writeln!(
        out,
        "{path}: {} units, about {cost:.1} s of one thread in all and {most:.2} s the longest\n\
         next: linelit run {path}; linelit merge {path} -o {result}",
        plan.units.len()
    )?;
    Ok(())
}

/// Returns the script that runs a plan on a system.
fn script(kind: Script, args: &PlannedArgs, result: &str) -> Result<String> {
    // Make all paths absolute, as processes may run in other folders, and quote them for a shell.
    let whole = std::path::absolute(&args.output).context("finding the whole path of the plan")?;
    let program = std::env::current_exe().context("finding this program")?;
    let word = |path: &Path| quoted(&path.display().to_string());
    let (plan, program, log) = (
        word(&whole),
        word(&program),
        word(&whole.join("log-%a.txt")),
    );
    let (shards, last) = (args.shards, args.shards - 1);
    // Write the script of the system: it numbers the processes, starts one for each shard, and
    // starts those again that end with status 75.
    Ok(match kind {
        Script::Slurm => format!(
            "#!/bin/bash\n\
             #SBATCH --job-name=linelit\n\
             #SBATCH --array=0-{last}\n\
             #SBATCH --cpus-per-task=1\n\
             #SBATCH --requeue\n\
             #SBATCH --open-mode=append\n\
             #SBATCH --output={log}\n\
             # Submit by sbatch; then: {program} merge {plan} -o {result}\n\
             {program} run {plan} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"; status=$?\n\
             # 75: try again.\n\
             [ $status = 75 ] && scontrol requeue \"${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID\"\n\
             exit $status\n"
        ),
        Script::Parallel => format!(
            "#!/bin/sh\n\
             # One shard a core at a time; what fails is tried twice more.\n\
             seq {shards} | parallel --retries 3 {program} run {plan} --threads 1 --shard {{}}/{shards} &&\n\
             {program} merge {plan} -o {result}\n"
        ),
        Script::Kubernetes => format!(
            "# An image with the program, and a volume for the plan that all pods may write, are yours.\n\
             apiVersion: batch/v1\n\
             kind: Job\n\
             metadata: {{name: linelit}}\n\
             spec:\n\
             \x20 completions: {shards}\n\
             \x20 parallelism: {shards}\n\
             \x20 completionMode: Indexed\n\
             \x20 backoffLimitPerIndex: 9\n\
             \x20 template:\n\
             \x20   spec:\n\
             \x20     restartPolicy: Never\n\
             \x20     containers:\n\
             \x20     - name: linelit\n\
             \x20       image: linelit\n\
             \x20       command: [linelit, run, /plan, --shards, \"{shards}\", --threads, \"1\"]\n\
             \x20       resources: {{requests: {{cpu: \"1\"}}}}\n\
             \x20       volumeMounts: [{{name: plan, mountPath: /plan}}]\n\
             \x20     volumes:\n\
             \x20     - name: plan\n\
             \x20       persistentVolumeClaim: {{claimName: linelit-plan}}\n"
        ),
    })
}
