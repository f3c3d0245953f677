//! `linelit converge`: runs a convergence study or a page of claims, and writes its report.

use super::threads::{bar, pool};
use super::units::{keep, work_off};
use super::{list, study};
use crate::args::{ConvergeArgs, ListArgs, Listed, UsageError};
use crate::folder::OutputFolder;
use crate::inputs::{Sources, locked};
use crate::output::{Output, note};
use crate::program::TryAgain;
use anyhow::{Result, bail};
use linelit_papers::{Context, Page, Study};
use linelit_plan::{Plan, Shard};
use linelit_study::scene_study::{StudySpec, TimeBudget, with_work};
use rayon::ThreadPool;
use std::sync::Mutex;
use std::time::Instant;

/// Runs a study and writes its report.
///
/// # Errors
/// If a scene cannot be read, the folder cannot be created or locked, or the report cannot be
/// written.
pub fn run(args: &ConvergeArgs, out: &mut Output) -> Result<()> {
    if args.list {
        let what = Some(Listed::Studies);
        let json = args.common.json;
        return list::run(&ListArgs { what, json }, out);
    }
    // Find the study, and refuse flags that do not apply to it.
    let study = study::resolve(&args.study.what)?;
    match &study {
        Study::Convergence(spec) => {
            study::check_scenes(&spec.scenes, &args.common.read)?;
        }
        Study::Findings(_) => study::refuse_fixed(name(args), args)?,
    }
    if args.full && name(args) != "claims" {
        let what = "--full is for `claims`: other studies have no quick form";
        return Err(UsageError(what.to_owned()).into());
    }
    // Lock the output folder, and run the study.
    let folder = OutputFolder::open(&args.out)?;
    let pool = pool(&args.common)?;
    match study {
        Study::Convergence(mut spec) => {
            study::apply_flags(&mut spec, &args.study);
            spec.time_budget = args.time_budget.or(spec.time_budget);
            converge(args, &spec, folder, &pool, out)
        }
        Study::Findings(page) => pool.install(|| findings(args, page, folder, out)),
    }
}

/// Returns the first word, which names a page of claims and drawings.
fn name(args: &ConvergeArgs) -> &str {
    args.study.what.first().map_or("", String::as_str)
}

/// Plans a study in a temporary folder within the output folder, computes the missing parts, and
/// merges all of them. When the report is complete, the plan is deleted.
fn converge(
    args: &ConvergeArgs,
    spec: &StudySpec,
    mut folder: OutputFolder,
    pool: &ThreadPool,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let path = folder.temporary(args.fresh)?;
    let sources = Sources::new(&args.common.read);
    let load = |name: &str| sources.load_to_measure(name);
    let mut record = spec.record(command());
    let (exhibits, interrupted) = with_work(spec, &load, |work| {
        // Plan the units, or continue the existing plan.
        let planned = pool.install(|| study::plan(&args.study, work, &sources))?;
        let plan = keep(&path, &planned, "study")?;
        // Compute what is missing and fits into the time budget.
        let clock = BudgetClock::new(spec, plan.plan(), start, pool.current_num_threads())?;
        let ran = work_off(
            &plan,
            Shard::ALL,
            1,
            GOES_ON,
            &|k| clock.leaves(k),
            |options| study::run(work, &plan, options, pool),
        );
        let interrupted = ran.err().map(|e| e.downcast::<TryAgain>()).transpose()?;
        record.unfinished = interrupted.is_some();
        // Put together the parts that exist, also of an interrupted study.
        let exhibits = pool.install(|| study::gather(work, &plan, &mut record))?;
        Ok::<_, anyhow::Error>((exhibits, interrupted))
    })?;
    // Write the report, unless no measurement fitted into the time.
    record.seconds = start.elapsed().as_secs_f64();
    if interrupted.is_some() {
        folder.set_unfinished();
    } else if record.rows.is_empty() && record.gallery.is_empty() {
        bail!(
            "no measurement fits into the time budget; what is done is kept, and the same command \
             with more time goes on"
        );
    }
    study::write(&record, exhibits, folder, args.common.json, out)?;
    interrupted.map_or(Ok(()), |how| Err(how.into()))
}

/// The time budget of a study, if it has one.
struct BudgetClock<'a> {
    begun: Instant,
    budget: Option<Mutex<TimeBudget>>,
    plan: &'a Plan,
}

impl<'a> BudgetClock<'a> {
    /// Creates the clock for the plan of a study that began at `start`.
    fn new(spec: &StudySpec, plan: &'a Plan, start: Instant, threads: usize) -> Result<Self> {
        let begun = Instant::now();
        let units = study::planned(plan)?;
        let budget = spec.time_budget.map(|seconds| {
            let left = seconds - (begun - start).as_secs_f64();
            Mutex::new(TimeBudget::new(units, left, threads))
        });
        Ok(Self {
            begun,
            budget,
            plan,
        })
    }

    /// Returns whether a unit is left out. A note is printed about the first unit of each scene and
    /// kind; the tables and the report list all of them.
    fn leaves(&self, number: u32) -> bool {
        let now = self.begun.elapsed().as_secs_f64();
        let budget = self.budget.as_ref();
        let begin = |b: &Mutex<TimeBudget>| locked(b).begin(number as usize, now);
        let Some(Err(shortage)) = budget.map(begin) else {
            return false;
        };
        if shortage.is_first {
            let name = &self.plan.units[number as usize].name;
            note(format_args!(
                "note: {name} is left out: it would take {:.1} s with all that it needs, and {:.1} s \
                 of the time budget are left for it",
                shortage.expected, shortage.left
            ));
        }
        true
    }
}

/// The words that say how to continue an interrupted study.
const GOES_ON: &str = "the report in `unfinished` says what of it there is, and the same command";

/// Returns the command of this process, quoted for a shell.
pub(super) fn command() -> String {
    let words = std::env::args_os().skip(1);
    let words = words.map(|word| word.to_string_lossy().into_owned());
    format!("linelit {}", study::quoted(words))
}

/// Runs a page of claims and drawings, and writes it.
fn findings(
    args: &ConvergeArgs,
    page: Page,
    mut folder: OutputFolder,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let name = name(args);
    if folder.temporary(args.fresh)?.exists() {
        bail!(
            "an interrupted study is there: the command that began it goes on, --fresh begins anew"
        );
    }
    // Measure and judge.
    let progress = bar(name);
    let mut found = page.run(&Context {
        library: args.common.read.library(),
        seed: args.study.seed,
        smallest: args.study.smallest,
        full: args.full,
        most_side: u32::MAX,
        progress: &progress,
    })?;
    // Write the page and its files.
    let json = serde_json::to_string_pretty(&found.rows)?;
    folder.add(&format!("{name}.json"), json.as_str());
    for (file, bytes) in found.files {
        folder.add(&file, bytes);
    }
    found.report.command = command();
    folder.add("report.html", found.report.render());
    let report = folder.path_of("report.html");
    folder.finish()?;
    if args.common.json {
        writeln!(out, "{json}")?;
    } else {
        let seconds = start.elapsed().as_secs_f64();
        write!(out, "{}", found.text)?;
        writeln!(out, "\n{seconds:.1} s; report: {}", report.display())?;
    }
    // Fail if a verdict contradicts the record.
    anyhow::ensure!(
        found.failures.is_empty(),
        "{} of what is on record came out otherwise:\n{}",
        found.failures.len(),
        found.failures.join("\n")
    );
    Ok(())
}
