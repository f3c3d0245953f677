//! Convergence studies as plans: planned, run and merged, at once by `converge` or apart.

use super::units::{self, CONVERGE};
use super::{flags, list, pool_of};
use crate::args::{MergeArgs, PlanConvergeArgs, ReadArgs, StudyArgs, UsageError};
use crate::folder::OutputFolder;
use crate::inputs;
use crate::output::{Output, OutputError, note};
use anyhow::{Context as _, Result, anyhow};
use clap::Parser;
use indicatif::ProgressBar;
use linelit_film::ToneCurve;
use linelit_papers::{Study, default_study, studies, study, takes_scene};
use linelit_plan::{BoxError, Folder, Input, Plan, PlanError, Ran, Run, Task, Unit};
use linelit_scene::Scene;
use linelit_scenes::Place;
use linelit_study::report::Exhibits;
use linelit_study::scene_study::{SceneUnit, StudySpec, Work, with_work};
use linelit_study::tables::{GalleryRow, SlopeRow, StudyRecord};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// The study that the command line names.
///
/// # Errors
/// A [`UsageError`] if a study is named beside scenes, or lacks one; if there is no such scene.
pub(super) fn resolve(what: &[String]) -> Result<Study> {
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

/// That a name is that of a scene, and no misspelt study.
pub(super) fn scene_is_there(name: &str) -> Result<()> {
    Place::find(name).map(drop).map_err(|error| {
        let studies = studies().map(|(name, _)| name);
        match linelit_formats::nearest(name, studies) {
            Some(study) if !Path::new(name).exists() => {
                anyhow!("no scene or study `{name}`; did you mean the study `{study}`?")
            }
            None if !Path::new(name).exists() && !error.to_string().contains("did you mean") => {
                anyhow!("{error}, nor a study:\n{}", list::studies())
            }
            _ => error,
        }
    })
}

fn usage(what: String) -> anyhow::Error {
    UsageError(what).into()
}

/// What the flags change of a study.
pub(super) fn apply_flags(spec: &mut StudySpec, args: &StudyArgs) {
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
    if let Some(pixels) = &args.pixels {
        spec.pixels.clone_from(pixels);
        spec.spots.clear();
    }
    spec.seed = args.seed.unwrap_or(0);
    spec.lights = args.lights.unwrap_or(spec.lights);
    spec.spheres = args.spheres.unwrap_or(spec.spheres);
}

/// What a plan says of its study, as JSON.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// The words of `converge` that mean it, every default spelled out.
    converge: Vec<String>,
    /// How scenes are read.
    read: ReadArgs,
    /// What the words come to, for those who look.
    settings: BTreeMap<String, String>,
}

/// Words of `converge`, read again.
#[derive(Parser)]
struct Again {
    #[command(flatten)]
    study: StudyArgs,
}

/// The words of `converge` that mean a study, from any working folder of this machine.
fn words(args: &StudyArgs, spec: &StudySpec) -> Vec<String> {
    fn joined<T: ToString>(list: &[T]) -> String {
        let texts: Vec<String> = list.iter().map(ToString::to_string).collect();
        texts.join(",")
    }
    let is_study = |name: &str| studies().any(|(n, _)| n == name);
    let whole = |name: &String| match Place::find(name) {
        Ok(Place::File(path)) if !is_study(name) => {
            std::path::absolute(&path).map_or(name.clone(), |path| path.display().to_string())
        }
        _ => name.clone(),
    };
    let mut words: Vec<String> = args.what.iter().map(whole).collect();
    let mut flag = |name: &str, value: String| words.push(format!("--{name}={value}"));
    flag("estimators", joined(&spec.estimators));
    flag("samplers", joined(&spec.samplers));
    flag("lights", spec.lights.to_string());
    flag("spheres", spec.spheres.to_string());
    flag("samples", joined(&spec.samples));
    // More trials of the independent pattern, and single pixels, are the named study's own.
    if spec.independent_trials.is_none() {
        flag("trials", spec.trials.to_string());
    }
    if spec.spots.is_empty() {
        flag("pixels", spec.pixels.to_string());
    }
    flag("seed", spec.seed.to_string());
    if args.smallest {
        words.push("--smallest".to_owned());
    }
    words
}

/// Scenes as they are read for a plan, with what it says of them.
#[derive(Debug)]
pub(super) struct Sources<'a> {
    read: &'a ReadArgs,
    pack: bool,
    found: Mutex<Found>,
}

#[derive(Debug, Default)]
struct Found {
    inputs: Vec<(String, Input)>,
    packed: BTreeMap<String, Vec<u8>>,
}

impl<'a> Sources<'a> {
    pub(super) fn new(read: &'a ReadArgs, pack: bool) -> Self {
        Self {
            read,
            pack,
            found: Mutex::default(),
        }
    }

    /// Reads a scene.
    pub(super) fn load(&self, name: &str) -> Result<Scene> {
        let planned = inputs::plan(name, self.read, self.pack)?;
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        if found.inputs.iter().all(|(known, _)| known != name) {
            found.inputs.push((name.to_owned(), planned.input));
        }
        found.packed.extend(planned.packed);
        Ok(planned.loaded.scene)
    }
}

/// The plan of a study, and the files that it keeps.
pub(super) fn plan(
    args: &StudyArgs,
    work: &Work<'_, '_, '_>,
    sources: &Sources<'_>,
) -> Result<(Plan, BTreeMap<String, Vec<u8>>)> {
    let planned = work.plan()?;
    let spec = work.spec();
    let settings = Settings {
        converge: words(args, spec),
        read: sources.read.clone(),
        settings: spec.record(String::new()).settings,
    };
    let number = |k: usize| u32::try_from(k).context("too many units");
    let unit = |planned: linelit_study::scene_study::PlannedUnit| -> Result<Unit> {
        let work = serde_json::to_string(&planned.unit)?;
        Ok(Unit {
            needs: number(planned.needs.start)?..number(planned.needs.end)?,
            ..Unit::new(planned.name, planned.seconds, work)
        })
    };
    let found = std::mem::take(&mut *sources.found.lock().unwrap_or_else(PoisonError::into_inner));
    let input = |name: &String| {
        let own = found.inputs.iter().find(|(known, _)| known == name);
        own.map(|(_, input)| input.clone())
            .with_context(|| format!("{name} was not read"))
    };
    let plan = Plan {
        program: units::program(),
        kind: CONVERGE.to_owned(),
        settings: serde_json::to_string(&settings)?,
        inputs: spec.scenes.iter().map(input).collect::<Result<_>>()?,
        units: planned.into_iter().map(unit).collect::<Result<_>>()?,
    };
    Ok((plan, found.packed))
}

/// The plan that `plan converge` asks for.
pub(super) fn make(args: &PlanConvergeArgs) -> Result<(Plan, BTreeMap<String, Vec<u8>>)> {
    let mut spec = spec_of(&args.study)?;
    spec.scenes
        .iter()
        .try_for_each(|scene| scene_is_there(scene))?;
    flags::refuse_without_files(&spec.scenes, &args.read)?;
    apply_flags(&mut spec, &args.study);
    let sources = Sources::new(&args.read, args.planned.pack);
    let load = |name: &str| sources.load(name);
    pool_of(0)?.install(|| with_work(&spec, &load, |work| plan(&args.study, work, &sources)))
}

/// The convergence study that words name, before flags change it.
fn spec_of(args: &StudyArgs) -> Result<StudySpec> {
    match resolve(&args.what)? {
        Study::Convergence(spec) => Ok(*spec),
        Study::Findings(_) => Err(usage(format!(
            "`{}` is a study of pictures and tables, which cannot be planned: `linelit converge` \
             runs it whole",
            args.what.join(" ")
        ))),
    }
}

/// The units of a plan, as a study has them.
pub(super) fn units(plan: &Plan) -> Result<Vec<SceneUnit>> {
    let unit = |unit: &Unit| Ok(serde_json::from_str(&unit.work)?);
    plan.units.iter().map(unit).collect()
}

/// Does what is left of a plan, one unit at a time on all threads of the pool: times are measured.
/// `progress` shows which is in hand.
pub(super) fn run(
    work: &Work<'_, '_, '_>,
    folder: &Folder,
    options: &Run<'_>,
    pool: &ThreadPool,
    progress: &ProgressBar,
) -> Result<Ran, PlanError> {
    let plan = folder.plan();
    let units = units(plan).map_err(|e| PlanError::Refused(e.to_string()))?;
    let options = Run {
        threads: 1,
        ..*options
    };
    linelit_plan::run(folder, &options, |task| {
        progress.set_message(task.unit().name.clone());
        pool.install(|| compute(work, &units, task))
    })
}

fn compute(
    work: &Work<'_, '_, '_>,
    units: &[SceneUnit],
    task: &Task<'_>,
) -> Result<Vec<u8>, BoxError> {
    // What the plan fails with is kept as it is: whether to try again depends on it.
    let failed: Mutex<Option<BoxError>> = Mutex::default();
    let needed = |each: &mut dyn FnMut(usize, Vec<u8>) -> Result<()>| {
        let parts = task.parts(|k, bytes| Ok(each(k as usize, bytes)?));
        parts.map_err(|e| {
            let text = e.to_string();
            *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(e);
            anyhow!(text)
        })
    };
    let computed = work.compute(units, task.number() as usize, &needed);
    computed.map_err(|e| {
        let failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
        failed.unwrap_or_else(|| e.into())
    })
}

/// A convergence study of a plan.
#[derive(Debug)]
pub(super) struct StudyPlan {
    spec: StudySpec,
    words: Vec<String>,
    read: ReadArgs,
}

impl StudyPlan {
    /// The study that a plan is of.
    pub(super) fn open(folder: &Folder) -> Result<Self> {
        let settings: Settings = serde_json::from_str(&folder.plan().settings)?;
        let words = std::iter::once("converge").chain(settings.converge.iter().map(String::as_str));
        let args = Again::try_parse_from(words)?.study;
        let mut spec = spec_of(&args)?;
        apply_flags(&mut spec, &args);
        Ok(Self {
            spec,
            words: settings.converge,
            read: settings.read,
        })
    }

    /// Reads a scene of the study.
    fn load(&self, folder: &Folder, name: &str) -> Result<Scene> {
        let number = self.spec.scenes.iter().position(|scene| scene == name);
        let input = number.and_then(|k| folder.plan().inputs.get(k));
        let input = input.with_context(|| format!("the plan does not say what {name} is"))?;
        Ok(inputs::open(folder, input, &self.read)?.scene)
    }

    /// Does what is left of the plan.
    pub(super) fn run(&self, folder: &Folder, options: &Run<'_>) -> Result<Ran> {
        let pool = pool_of(options.threads)?;
        let load = |name: &str| self.load(folder, name);
        Ok(with_work(&self.spec, &load, |work| {
            run(work, folder, options, &pool, &ProgressBar::hidden())
        })?)
    }

    /// Puts the parts together and writes the report.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let start = Instant::now();
        let file = &args.file;
        if file.exposure.abs() > 0.0
            || file.tone_curve != ToneCurve::Clip
            || file.compression.is_some()
        {
            let text = "--exposure, --tone-curve and --compression are for plans of pictures";
            return Err(usage(text.to_owned()));
        }
        let missing = folder.read_all(|_, _| Ok(()))?;
        units::check(folder, &missing)?;
        let default = Path::new("out");
        let to = OutputFolder::open(args.output.as_deref().unwrap_or(default))?;
        let pool = pool_of(args.threads)?;
        let load = |name: &str| self.load(folder, name);
        let words = self.words.iter().cloned().chain(flags::words(&self.read));
        let command = format!("linelit converge {}", quoted(words));
        let mut record = self.spec.record(command);
        let exhibits = pool.install(|| {
            with_work(&self.spec, &load, |work| {
                gather(work, folder, false, &mut record)
            })
        })?;
        record.seconds = start.elapsed().as_secs_f64();
        write(&record, exhibits, to, args.json, out)
    }
}

/// Puts parts together. What is missing or broken is left out, but for pictures if they are to be
/// `complete`.
pub(super) fn gather(
    work: &Work<'_, '_, '_>,
    folder: &Folder,
    complete: bool,
    record: &mut StudyRecord,
) -> Result<Exhibits> {
    let mut exhibits = Exhibits {
        compared: work.spec().compared(),
        ..Exhibits::default()
    };
    let mut part = |k: usize| {
        let number = u32::try_from(k).context("too many units")?;
        match folder.part(number) {
            Err(PlanError::Broken { .. }) => Ok(None),
            other => Ok(other?),
        }
    };
    let units = units(folder.plan())?;
    work.gather(&units, &mut part, complete, record, &mut exhibits)?;
    Ok(exhibits)
}

/// Writes the files of a study, and says what is in them.
pub(super) fn write(
    record: &StudyRecord,
    exhibits: Exhibits,
    mut folder: OutputFolder,
    json: bool,
    out: &mut Output,
) -> Result<()> {
    for (name, bytes) in record.files(exhibits)? {
        folder.add(&name, bytes);
    }
    let report = folder.path_of("report.html");
    folder.finish()?;
    for sentence in record.left_out_sentences() {
        note(format_args!("note: {sentence}"));
    }
    if json {
        write!(out, "{}", record.to_json()?)?;
    } else {
        print_slopes(&record.slopes, out)?;
        print_gallery(&record.gallery, out)?;
        let seconds = record.seconds;
        writeln!(out, "{seconds:.1} s; report: {}", report.display())?;
    }
    Ok(())
}

/// Words as one would give them to a shell again.
pub(super) fn quoted(words: impl Iterator<Item = String>) -> String {
    let words: Vec<String> = words.map(|word| units::quoted(&word)).collect();
    words.join(" ")
}

fn print_slopes(slopes: &[SlopeRow], out: &mut Output) -> Result<(), OutputError> {
    writeln!(
        out,
        "{:<22} {:<20} {:<12} {:>7} {:>17} {:>11}  paper",
        "scene", "estimator", "sampler", "order", "95 %", "N"
    )?;
    for s in slopes {
        let paper = match (s.paper_order, &s.paper_source) {
            (Some(order), Some(source)) => format!("{order:.3} ({source})"),
            _ => String::new(),
        };
        let [low, high] = [s.ci_low, s.ci_high].map(|end| {
            if end.is_finite() {
                format!("{end:.3}")
            } else {
                "–".to_owned()
            }
        });
        writeln!(
            out,
            "{:<22} {:<20} {:<12} {:>7.3} {low:>8} {high:>8} {:>5}–{:<5}  {paper}",
            s.scene, s.estimator, s.sampler, s.order, s.n_min, s.n_max
        )?;
    }
    Ok(())
}

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
