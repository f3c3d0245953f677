//! Convergence studies as plans, which `converge` plans, runs and merges in one go, and `plan`,
//! `run` and `merge` step by step.

use super::threads::pool_of;
use super::{list, units};
use crate::args::{
    ConvergeArgs, MergeArgs, PlanConvergeArgs, PlannedArguments, ReadArgs, StudyArgs, UsageError,
    given,
};
use crate::folder::OutputFolder;
use crate::inputs::{self, Sources};
use crate::output::{Output, OutputError, note};
use anyhow::{Context as _, Result, anyhow};
use clap::Parser as _;
use linelit_papers::{Study, default_study, studies, study, takes_scene};
use linelit_plan::{BoxError, Folder, Plan, PlanError, Run, RunCounts, Task, Unit};
use linelit_scene::SceneDescription;
use linelit_scenes::SceneLocation;
use linelit_study::report::{Exhibits, Verdict};
use linelit_study::scene_study::{PlannedUnit, SceneUnit, StudySpec, Work, with_work};
use linelit_study::tables::{GalleryRow, SlopeRow, StudyRecord};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// The kind of plans of convergence studies.
pub(super) const CONVERGE: &str = "converge";

/// Returns the study that the command line names.
///
/// # Errors
/// A [`UsageError`] if a study is named together with scenes, has too many scenes, or lacks one.
pub(super) fn resolve(what: &[String]) -> Result<Study> {
    // A study that can be run on a scene of the user's.
    if let [name, scene @ ..] = what
        && takes_scene(name)
    {
        if scene.len() > 1 {
            let scenes = scene.join(" ");
            return Err(usage(format!("`{name}` takes one scene at most: {scenes}")));
        }
        let found = study(name, scene.first().map(String::as_str));
        return found.ok_or_else(|| {
            usage(format!(
                "`{name}` needs a scene: converge {name} SCENE.pbrt"
            ))
        });
    }
    // Any other study, or a list of scenes for the default study.
    let named = |what: &String| studies().any(|(n, _)| n == what && !takes_scene(n));
    match what {
        [] => Ok(Study::Convergence(Box::new(default_study()))),
        [_, _, ..] if what.iter().any(named) => Err(usage(format!(
            "name one study, or any number of scenes, not both: {}",
            what.join(" ")
        ))),
        scenes => {
            let named = match scenes {
                [name] => study(name, None),
                _ => None,
            };
            let spec = || StudySpec {
                scenes: scenes.to_vec(),
                ..default_study()
            };
            Ok(named.unwrap_or_else(|| Study::Convergence(Box::new(spec()))))
        }
    }
}

/// Checks that a name refers to a scene. The error suggests a study if the name looks like a
/// misspelt study.
fn scene_is_there(name: &str) -> Result<()> {
    SceneLocation::find(name).map(drop).map_err(|error| {
        let studies = studies().map(|(name, _)| name);
        match linelit_formats::nearest(name, studies) {
            Some(study) if !Path::new(name).exists() => {
                anyhow!("no scene or study `{name}`; did you mean the study `{study}`?")
            }
            None if !Path::new(name).exists() && SceneLocation::nearest(name).is_none() => {
                anyhow!("{error}, nor a study:\n{}", list::studies())
            }
            _ => error,
        }
    })
}

/// Returns a usage error.
fn usage(what: String) -> anyhow::Error {
    UsageError(what).into()
}

/// Refuses flags that a page of claims and drawings sets itself.
///
/// # Errors
/// A [`UsageError`] that names the flag.
pub(super) fn refuse_fixed(name: &str, args: &ConvergeArgs) -> Result<()> {
    let study = &args.study;
    let own = [
        ("--estimators", study.estimators.is_some()),
        ("--samplers", study.samplers.is_some()),
        ("--lights", study.lights.is_some()),
        ("--spheres", study.spheres.is_some()),
        ("--samples", study.samples.is_some()),
        ("--trials", study.trials.is_some()),
        ("--pixels", study.pixels.is_some()),
        ("--time-budget", args.time_budget.is_some()),
    ];
    first(name, "it repeats a figure or a table", &own)?;
    first(name, BUILT_IN, &of_files(&args.common.read))
}

/// The reason, for messages, why flags about the files of scenes are refused.
const BUILT_IN: &str = "built-in scenes name no files";

/// Returns the flags about the files of scenes, and whether they were given.
fn of_files(read: &ReadArgs) -> [(&'static str, bool); 2] {
    [
        ("--root", read.root.is_some()),
        ("--allow-outside", read.allow_outside),
    ]
}

/// Refuses the first of `flags` that was given, if any; `why` is the reason for the message.
fn first(name: &str, why: &str, flags: &[(&str, bool)]) -> Result<()> {
    match flags.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(UsageError(format!("`{name}` takes no {flag}: {why}")).into()),
        None => Ok(()),
    }
}

/// Checks that the scenes exist, and refuses flags about their files if none is a file.
///
/// # Errors
/// A [`UsageError`] that names the flag, or an error that names the missing scene.
pub(super) fn check_scenes(scenes: &[String], read: &ReadArgs) -> Result<()> {
    scenes.iter().try_for_each(|scene| scene_is_there(scene))?;
    let is_file = |scene: &String| matches!(SceneLocation::find(scene), Ok(SceneLocation::File(_)));
    if scenes.iter().any(is_file) {
        return Ok(());
    }
    first(&scenes.join(" "), BUILT_IN, &of_files(read))
}

/// Applies the flags of the command line to a study.
pub(super) fn apply_flags(spec: &mut StudySpec, args: &StudyArgs) {
    // Shrink the study first, so that the other flags override the smallest sizes.
    if args.smallest {
        spec.shrink();
    }
    if let Some(list) = &args.estimators {
        spec.estimators.clone_from(&list.0);
    }
    if let Some(list) = &args.samplers {
        spec.samplers.clone_from(&list.0);
    }
    if let Some(counts) = &args.samples {
        spec.samples.clone_from(&counts.0);
    }
    if let Some(trials) = args.trials {
        spec.trials = trials;
        spec.independent_trials = None;
    }
    // Pixels replace the named spots of a study, too.
    if let Some(pixels) = &args.pixels {
        spec.pixels.clone_from(pixels);
        spec.spots.clear();
    }
    spec.seed = args.seed;
    if let Some(choice) = args.lights {
        spec.lights = vec![choice];
    }
    spec.spheres = args.spheres.unwrap_or(spec.spheres);
}

/// The settings in the plan of a study.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// The words of `converge` that the numbers depend on.
    converge: Vec<String>,
    /// The values of the study's settings, for people who read the plan.
    settings: BTreeMap<String, String>,
}

/// Returns the plan of a study, including the files that its scenes were read from.
pub(super) fn plan(
    args: &StudyArgs,
    work: &Work<'_, '_, '_>,
    sources: &Sources<'_>,
) -> Result<Plan> {
    // Keep the words that numbers depend on, with whole paths of scenes.
    let is_scene = |name: &&String| !studies().any(|(known, _)| known == **name);
    let whole = |name: &String| match Some(name).filter(is_scene) {
        Some(scene) => inputs::whole_path(scene),
        None => Ok(name.clone()),
    };
    let mut words: Vec<String> = args.what.iter().map(whole).collect::<Result<_>>()?;
    words.extend(given::<PlannedArguments<StudyArgs>>()?);
    // No number depends on the time budget: with more time the plan is the same, and can be
    // continued.
    let spec = StudySpec {
        time_budget: None,
        ..work.spec().clone()
    };
    let settings = Settings {
        converge: words,
        settings: spec.record(String::new()).settings,
    };
    // List the units with their estimated costs and needs.
    let number = |k: usize| u32::try_from(k).context("too many units");
    let unit = |planned: PlannedUnit| -> Result<Unit> {
        let work = serde_json::to_string(&planned.unit)?;
        Ok(Unit {
            needs: number(planned.needs.start)?..number(planned.needs.end)?,
            ..Unit::new(planned.name, planned.seconds, work)
        })
    };
    let units = work.plan()?.into_iter().map(unit).collect::<Result<_>>()?;
    sources.plan(CONVERGE, &settings, &spec.scenes, units)
}

/// Returns the plan that `plan converge` writes.
pub(super) fn make(args: &PlanConvergeArgs) -> Result<Plan> {
    let mut spec = spec_of(&args.study)?;
    check_scenes(&spec.scenes, &args.read)?;
    apply_flags(&mut spec, &args.study);
    let sources = Sources::new(&args.read);
    let load = |name: &str| sources.load_to_measure(name);
    pool_of(0)?.install(|| with_work(&spec, &load, |work| plan(&args.study, work, &sources)))
}

/// Returns the convergence study that words name, before flags change it.
fn spec_of(args: &StudyArgs) -> Result<StudySpec> {
    match resolve(&args.what)? {
        Study::Convergence(spec) => Ok(*spec),
        Study::Findings(_) => Err(usage(format!(
            "`{}` is a page of claims and drawings, which cannot be planned: `linelit converge` \
             runs it whole",
            args.what.join(" ")
        ))),
    }
}

/// Returns the units of a plan as the units of a study.
pub(super) fn units(plan: &Plan) -> Result<Vec<SceneUnit>> {
    let unit = |unit: &Unit| Ok(serde_json::from_str(&unit.work)?);
    plan.units.iter().map(unit).collect()
}

/// Returns the units of a plan with their names, costs and needs.
pub(super) fn planned(plan: &Plan) -> Result<Vec<PlannedUnit>> {
    let known = |(unit, own): (SceneUnit, &Unit)| PlannedUnit {
        unit,
        name: own.name.clone(),
        seconds: own.cost,
        needs: own.needs.start as usize..own.needs.end as usize,
    };
    Ok(units(plan)?
        .into_iter()
        .zip(&plan.units)
        .map(known)
        .collect())
}

/// Computes a plan's remaining units, one at a time on all threads of the pool, because their times
/// are measured.
pub(super) fn run(
    work: &Work<'_, '_, '_>,
    folder: &Folder,
    options: &Run<'_>,
    pool: &ThreadPool,
) -> Result<RunCounts> {
    let units = units(folder.plan())?;
    let options = Run {
        threads: 1,
        ..*options
    };
    // Compute a unit from the parts that it needs, if these were not left out.
    let compute = |task: &Task<'_>| {
        let needed = |each: &mut dyn FnMut(usize, Vec<u8>) -> Result<()>| {
            let mut needs = task.unit().needs.clone().filter(|k| !task.is_left_out(*k));
            needs.try_for_each(|k| each(k as usize, task.part(k)?))
        };
        let computed = work.compute(&units, task.number() as usize, &needed);
        // Pass on errors of the plan unchanged: whether to try again depends on them.
        computed.map_err(|e| match e.downcast::<PlanError>() {
            Ok(error) => BoxError::from(error),
            Err(error) => error.into(),
        })
    };
    Ok(linelit_plan::run(folder, &options, |task| {
        pool.install(|| compute(task))
    })?)
}

/// A convergence study that was read from a plan.
#[derive(Debug)]
pub(super) struct StudyPlan {
    spec: StudySpec,
    words: Vec<String>,
    read: ReadArgs,
}

impl StudyPlan {
    /// Returns the study of a plan.
    pub(super) fn open(folder: &Folder) -> Result<Self> {
        let settings: Settings = serde_json::from_str(&folder.plan().settings)?;
        let PlannedArguments { args, read } =
            PlannedArguments::<StudyArgs>::try_parse_from(&settings.converge)?;
        let mut spec = spec_of(&args)?;
        apply_flags(&mut spec, &args);
        Ok(Self {
            spec,
            words: settings.converge,
            read,
        })
    }

    /// Reads a scene of the study.
    fn load(&self, folder: &Folder, name: &str) -> Result<SceneDescription> {
        let number = self.spec.scenes.iter().position(|scene| scene == name);
        let number = number.with_context(|| format!("the plan does not say what {name} is"))?;
        inputs::open(folder, number, &self.read)
    }

    /// Computes the remaining units of the plan.
    pub(super) fn run(&self, folder: &Folder, options: &Run<'_>) -> Result<RunCounts> {
        let pool = pool_of(options.threads)?;
        let load = |name: &str| self.load(folder, name);
        with_work(&self.spec, &load, |work| run(work, folder, options, &pool))
    }

    /// Puts the parts together and writes the report.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let start = Instant::now();
        // Check that all parts exist and that the report can be written.
        units::refuse_picture_flags(&args.file)?;
        let missing = folder.read_all(|_, _| Ok(()))?;
        units::check(folder, &missing)?;
        let default = Path::new("out");
        let to = OutputFolder::open(args.output.as_deref().unwrap_or(default))?;
        // Gather the parts, and write the report.
        let pool = pool_of(args.threads)?;
        let load = |name: &str| self.load(folder, name);
        let command = format!("linelit converge {}", quoted(self.words.iter().cloned()));
        let mut record = self.spec.record(command);
        let exhibits = pool
            .install(|| with_work(&self.spec, &load, |work| gather(work, folder, &mut record)))?;
        record.seconds = start.elapsed().as_secs_f64();
        write(&record, exhibits, to, args.json, out)
    }
}

/// Puts parts together. Missing and broken parts are left out.
pub(super) fn gather(
    work: &Work<'_, '_, '_>,
    folder: &Folder,
    record: &mut StudyRecord,
) -> Result<Exhibits> {
    let part = |k: usize| {
        let number = u32::try_from(k).context("too many units")?;
        match folder.part(number) {
            Err(PlanError::Broken { .. }) => Ok(None),
            other => Ok(other?),
        }
    };
    let units = units(folder.plan())?;
    work.gather(&units, &part, record)
}

/// Writes the files of a study, and prints its results.
pub(super) fn write(
    record: &StudyRecord,
    exhibits: Exhibits,
    mut folder: OutputFolder,
    json: bool,
    out: &mut Output,
) -> Result<()> {
    // Write the files.
    for (name, bytes) in record.files(exhibits)? {
        folder.add(&name, bytes);
    }
    let report = folder.path_of("report.html");
    folder.finish()?;
    // Print what was left out, and the results.
    for sentence in record.left_out_sentences() {
        note(format_args!("note: {sentence}"));
    }
    if json {
        write!(out, "{}", record.to_json()?)?;
    } else {
        print_verdicts(record, out)?;
        print_slopes(&record.slopes, out)?;
        print_gallery(&record.gallery, out)?;
        let seconds = record.seconds;
        writeln!(out, "{seconds:.1} s; report: {}", report.display())?;
    }
    Ok(())
}

/// Joins words, quoted for a shell.
pub(super) fn quoted(words: impl Iterator<Item = String>) -> String {
    let words: Vec<String> = words.map(|word| units::quoted(&word)).collect();
    words.join(" ")
}

/// Prints the verdicts with which the report begins.
fn print_verdicts(record: &StudyRecord, out: &mut Output) -> Result<(), OutputError> {
    for verdict in Verdict::all(record) {
        let [scene, lines, error, time, points, theirs, ratio, exact] = verdict.cells();
        writeln!(out, "{scene}: {lines} have an RMSE of {error} in {time}")?;
        match &verdict.points {
            Some(_) => writeln!(
                out,
                "  {points} reaches it in {theirs}: {ratio} times as long"
            )?,
            None => writeln!(out, "  no number of points that was measured reaches it")?,
        }
        if verdict.exact.is_some() {
            writeln!(out, "  no noise at all in {exact}")?;
        }
    }
    Ok(())
}

/// Prints the table of orders of convergence.
fn print_slopes(slopes: &[SlopeRow], out: &mut Output) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:<22} {:<20} {:<12} {:>7} {:>17} {:>11}  paper",
        "scene", "estimator", "sampler", "order", "95 %", "N"
    )?;
    for s in slopes {
        let fit = s.fit;
        let paper = match (s.paper_order, &s.paper_source) {
            (Some(order), Some(source)) => format!("{order:.3} ({source})"),
            _ => String::new(),
        };
        // With too few trials there is no interval.
        let [low, high] = [fit.ci_low, fit.ci_high].map(|end| {
            if end.is_finite() {
                format!("{end:.3}")
            } else {
                "–".to_owned()
            }
        });
        writeln!(
            out,
            "{:<22} {:<20} {:<12} {:>7.3} {low:>8} {high:>8} {:>5}–{:<5}  {paper}",
            s.scene, s.estimator, s.sampler, fit.order, fit.n_min, fit.n_max
        )?;
    }
    Ok(())
}

/// Prints the table of the pictures of the gallery, if there are any.
fn print_gallery(gallery: &[GalleryRow], out: &mut Output) -> Result<(), OutputError> {
    if gallery.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "\n{:<22} {:>8} {:>9} {:>11}  estimator",
        "picture of", "samples", "CPU s", "MRSE"
    )?;
    for g in gallery {
        writeln!(
            out,
            "{:<22} {:>8} {:>9.3} {:>11.3e}  {}",
            g.scene, g.samples, g.cpu_seconds, g.mrse, g.estimator
        )?;
    }
    Ok(())
}
