//! `linelit converge`.

use super::study::{self, Sources};
use super::{bar, flags, list, pool};
use crate::args::{ConvergeArgs, ListArgs, Listed, UsageError};
use crate::folder::OutputFolder;
use crate::interrupt;
use crate::output::{Output, note};
use crate::program::TryAgain;
use anyhow::{Context as _, Result, anyhow, bail};
use indicatif::{ProgressBar, ProgressStyle};
use linelit_papers::{Context, Findings, Study};
use linelit_plan::{Event, Folder, Plan, PlanError, Run};
use linelit_study::scene_study::{StudySpec, Work, with_work};
use rayon::ThreadPool;
use std::time::{Duration, Instant};

/// Runs a study and writes its report.
///
/// # Errors
/// If a scene cannot be read, the folder is not to be had, or the report cannot be written.
pub fn run(args: &ConvergeArgs, out: &mut Output) -> Result<()> {
    if args.list {
        let what = Some(Listed::Studies);
        let json = args.common.json;
        return list::run(&ListArgs { what, json }, out);
    }
    let study = study::resolve(&args.study.what)?;
    match &study {
        Study::Convergence(spec) => {
            let mut scenes = spec.scenes.iter();
            scenes.try_for_each(|scene| study::scene_is_there(scene))?;
            flags::refuse_without_files(&spec.scenes, &args.common.read)?;
        }
        Study::Findings(_) => flags::refuse_fixed(name(args), args)?,
    }
    if args.full && name(args) != "claims" {
        let what = "--full is for `claims`: other studies have no quick form";
        return Err(UsageError(what.to_owned()).into());
    }
    let folder = OutputFolder::open(&args.out)?;
    let pool = pool(&args.common)?;
    match study {
        Study::Convergence(mut spec) => {
            study::apply_flags(&mut spec, &args.study);
            spec.time_budget = args.time_budget.or(spec.time_budget);
            converge(args, &spec, folder, &pool, out)
        }
        Study::Findings(run) => pool.install(|| findings(args, run, folder, out)),
    }
}

/// The first word, which names a study of pictures and tables.
fn name(args: &ConvergeArgs) -> &str {
    args.study.what.first().map_or("", String::as_str)
}

/// Plans a study in a folder of its own within that of the report, does what is left, and puts the
/// parts together. When the report is whole the plan goes.
fn converge(
    args: &ConvergeArgs,
    spec: &StudySpec,
    mut folder: OutputFolder,
    pool: &ThreadPool,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let path = folder.temporary(args.fresh)?;
    interrupt::watch().context("watching for signals")?;
    let sources = Sources::new(&args.common.read, false);
    let load = |name: &str| sources.load(name);
    let mut record = spec.record(command());
    let (exhibits, undone) = with_work(spec, &load, |work| {
        let (plan, packed) = pool.install(|| study::plan(&args.study, work, &sources))?;
        let plan = Folder::create(&path, &plan, &packed).map_err(|e| match e {
            PlanError::Refused(why) => anyhow!("{why}. {INTERRUPTED}"),
            other => other.into(),
        })?;
        let undone = measure(spec, work, &plan, pool, start)?;
        record.unfinished = matches!(undone, Undone::Interrupted(_));
        let complete = !record.unfinished;
        let exhibits = pool.install(|| study::gather(work, &plan, complete, &mut record))?;
        Ok::<_, anyhow::Error>((exhibits, undone))
    })?;
    record.seconds = start.elapsed().as_secs_f64();
    if let Undone::Interrupted(how) = undone {
        folder.set_unfinished();
        study::write(&record, exhibits, folder, args.common.json, out)?;
        return Err(TryAgain(how).into());
    }
    study::write(&record, exhibits, folder, args.common.json, out)
}

/// What to do about the plan of another study.
const INTERRUPTED: &str = "An interrupted study is there: the command that began it goes on, \
                           --fresh begins anew";

/// The command that was given, as one would give it again.
fn command() -> String {
    let words = std::env::args_os().skip(1);
    let words = words.map(|word| word.to_string_lossy().into_owned());
    format!("linelit {}", study::quoted(words))
}

/// What is not measured of a study, and why.
enum Undone {
    Nothing,
    /// What the time budget left out.
    Late,
    /// The text says how to go on.
    Interrupted(String),
}

/// Measures what is left, until it is time to stop.
fn measure(
    spec: &StudySpec,
    work: &Work<'_, '_, '_>,
    plan: &Folder,
    pool: &ThreadPool,
    start: Instant,
) -> Result<Undone> {
    let budget = |seconds: f64| start.checked_add(Duration::from_secs_f64(seconds.min(1e9)));
    let end = spec.time_budget.and_then(budget);
    let late = || end.is_some_and(|end| Instant::now() > end);
    let before = plan.status()?;
    if before.done > 0 {
        note(format_args!(
            "note: going on with an interrupted study, {} of {} units are done (--fresh begins anew)",
            before.done, before.units
        ));
    }
    let progress = cost_bar(plan.plan());
    let options = Run {
        stop: &|| interrupt::stopped() || late(),
        note: &|event| match event {
            Event::Found(unit) | Event::Done(unit) => progress.inc(milliseconds(unit.cost)),
            Event::Broken(unit, why) => {
                note(format_args!("note: {}, once more: {why}", unit.name));
            }
            _ => {}
        },
        ..Run::default()
    };
    let ran = study::run(work, plan, &options, pool, &progress);
    progress.finish_and_clear();
    match ran {
        Ok(_) => Ok(Undone::Nothing),
        Err(PlanError::Interrupted) if !interrupt::stopped() => Ok(Undone::Late),
        Err(PlanError::Interrupted) => {
            let status = plan.status()?;
            Ok(Undone::Interrupted(format!(
                "interrupted: {} of {} units are done, and the report in `unfinished` says what of it \
                 there is; the same command goes on",
                status.done, status.units
            )))
        }
        Err(e) => Err(e.into()),
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
fn cost_bar(plan: &Plan) -> ProgressBar {
    let style = ProgressStyle::with_template("{wide_msg} {bar:20} {eta:>6}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let cost = plan.units.iter().map(|unit| milliseconds(unit.cost)).sum();
    let bar = ProgressBar::new(cost).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

/// Runs a study of pictures and tables, and writes its page.
fn findings(
    args: &ConvergeArgs,
    find: fn(&Context<'_>) -> Result<Findings>,
    mut folder: OutputFolder,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let name = name(args);
    if folder.temporary(args.fresh)?.exists() {
        bail!("{INTERRUPTED}");
    }
    let progress = bar(name);
    let mut found = find(&Context {
        library: args.common.read.library(),
        seed: args.study.seed.unwrap_or(0),
        smallest: args.study.smallest,
        full: args.full,
        most_side: u32::MAX,
        progress: &progress,
    })?;
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
    anyhow::ensure!(
        found.failures.is_empty(),
        "{} of what is on record came out otherwise:\n{}",
        found.failures.len(),
        found.failures.join("\n")
    );
    Ok(())
}
