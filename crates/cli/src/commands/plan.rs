//! `linelit plan`.

use super::picture::{self, PicturePlan};
use super::study::{self, StudyPlan};
use super::units::{CONVERGE, RENDER, program, quoted};
use crate::args::{PlanArgs, PlanKind, PlannedArgs, Script};
use crate::output::Output;
use anyhow::{Context as _, Result, bail};
use linelit_plan::{Folder, Plan};
use std::collections::BTreeMap;
use std::path::Path;

/// What a plan is of.
pub(super) enum Planned {
    Picture(Box<PicturePlan>),
    Study(Box<StudyPlan>),
}

/// Opens a plan that this program made.
pub(super) fn open(path: &Path) -> Result<(Folder, Planned)> {
    let folder = Folder::open(path)?;
    folder.check_program(&program())?;
    let planned = match folder.plan().kind.as_str() {
        RENDER => Planned::Picture(Box::new(PicturePlan::open(&folder)?)),
        CONVERGE => Planned::Study(Box::new(StudyPlan::open(&folder)?)),
        other => bail!("a plan of the kind `{other}`, which this program does not know"),
    };
    Ok((folder, planned))
}

/// Makes the folder of a plan.
///
/// # Errors
/// If what is planned cannot be read, or the folder cannot be made or holds something else.
pub fn run(args: &PlanArgs, out: &mut Output) -> Result<()> {
    match &args.kind {
        PlanKind::Render(args) => {
            let (plan, packed) = picture::plan(args)?;
            finish(&plan, &packed, &args.planned, "picture.exr", out)
        }
        PlanKind::Converge(args) => {
            let (plan, packed) = study::make(args)?;
            finish(&plan, &packed, &args.planned, "out", out)
        }
    }
}

/// Writes a plan of any kind, and says what it is or how it is run; `result` is what merging it
/// writes.
pub(super) fn finish(
    plan: &Plan,
    packed: &BTreeMap<String, Vec<u8>>,
    args: &PlannedArgs,
    result: &str,
    out: &mut Output,
) -> Result<()> {
    let folder = Folder::create(&args.output, plan, packed)?;
    if let Some(kind) = args.script {
        write!(out, "{}", script(kind, args, result)?)?;
        return Ok(());
    }
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
            "packed": packed.len(),
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

/// The lines that run a plan.
fn script(kind: Script, args: &PlannedArgs, result: &str) -> Result<String> {
    let whole = std::path::absolute(&args.output).context("finding the whole path of the plan")?;
    let program = std::env::current_exe().context("finding this program")?;
    let word = |path: &Path| quoted(&path.display().to_string());
    let (plan, program, log) = (
        word(&whole),
        word(&program),
        word(&whole.join("log-%a.txt")),
    );
    let (shards, last) = (args.shards, args.shards - 1);
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
