//! `linelit converge`.

use super::{bar, pool};
use crate::args::{ConvergeArgs, UsageError};
use crate::folder::OutputFolder;
use crate::output::{Output, OutputError, note};
use anyhow::{Result, anyhow};
use linelit_papers::scene_study::{StudySpec, open_all};
use linelit_papers::{Context, Findings, Study, default_study, studies, study, takes_scene};
use linelit_scenes::Place;
use linelit_study::report::Exhibits;
use linelit_study::tables::{GalleryRow, SlopeRow};
use std::path::Path;
use std::time::{Duration, Instant};

/// Runs a study and writes its report.
///
/// # Errors
/// If a scene cannot be read, the folder is not to be had, or the report cannot be written.
pub fn run(args: &ConvergeArgs, out: &mut Output) -> Result<()> {
    let study = resolve(args)?;
    let folder = OutputFolder::open(&args.out)?;
    let pool = pool(&args.common)?;
    pool.install(|| match study {
        Study::Convergence(mut spec) => {
            apply_flags(&mut spec, args);
            converge(args, &spec, folder, out)
        }
        Study::Findings(find) => findings(args, find, folder, out),
    })
}

/// The study that the command line names.
///
/// # Errors
/// A [`UsageError`] if a study is named beside scenes, or lacks one.
fn resolve(args: &ConvergeArgs) -> Result<Study> {
    if let [name, scene @ ..] = args.what.as_slice()
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
    match args.what.as_slice() {
        [] => Ok(Study::Convergence(Box::new(default_study()))),
        [_, _, ..] if args.what.iter().any(named) => Err(usage(format!(
            "name one study, or any number of scenes, not both: {}",
            args.what.join(" ")
        ))),
        [what] if let Some(study) = study(what, None) => Ok(study),
        scenes => {
            scenes.iter().try_for_each(|scene| scene_is_there(scene))?;
            Ok(Study::Convergence(Box::new(StudySpec {
                scenes: scenes.to_vec(),
                ..default_study()
            })))
        }
    }
}

/// That a name is that of a scene, and no misspelt study.
fn scene_is_there(name: &str) -> Result<()> {
    Place::find(name).map(drop).map_err(|error| {
        let studies = studies().map(|(name, _)| name);
        match linelit_formats::nearest(name, studies) {
            Some(study) if !Path::new(name).exists() => {
                anyhow!("no scene or study `{name}`; did you mean the study `{study}`?")
            }
            _ => error,
        }
    })
}

fn usage(what: String) -> anyhow::Error {
    UsageError(what).into()
}

fn apply_flags(spec: &mut StudySpec, args: &ConvergeArgs) {
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
    spec.time_budget = args.time_budget.or(spec.time_budget);
    spec.seed = args.seed;
    spec.lights = args.lights;
    spec.spheres = args.spheres;
}

fn converge(
    args: &ConvergeArgs,
    spec: &StudySpec,
    mut folder: OutputFolder,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let deadline = spec
        .time_budget
        .map(|s| start + Duration::from_secs_f64(s.min(1e9)));
    let mut record = spec.record(command());
    let mut exhibits = Exhibits {
        compared: spec.compared(),
        ..Exhibits::default()
    };
    let library = args.common.read.library();
    for opened in open_all(spec, &mut |name| Ok(library.load_lit(name)?.scene))? {
        let label = opened.label().to_owned();
        let progress = bar(&label);
        opened.run(spec, deadline, &progress, &mut record, &mut exhibits)?;
        progress.finish_and_clear();
    }
    record.seconds = start.elapsed().as_secs_f64();
    for (name, bytes) in record.files(exhibits)? {
        folder.add(&name, bytes);
    }
    let report = folder.path_of("report.html");
    folder.finish()?;
    for sentence in record.left_out_sentences() {
        note(format_args!("note: {sentence}"));
    }
    if args.common.json {
        write!(out, "{}", record.to_json()?)?;
    } else {
        print_slopes(&record.slopes, out)?;
        print_gallery(&record.gallery, out)?;
        let seconds = record.seconds;
        writeln!(out, "{seconds:.1} s; report: {}", report.display())?;
    }
    Ok(())
}

/// The command that was given, as one would give it again.
fn command() -> String {
    let words = std::env::args().skip(1).map(|word| {
        if word.contains(['[', ';', ' ', '*']) {
            format!("'{word}'")
        } else {
            word
        }
    });
    let words: Vec<String> = words.collect();
    format!("linelit {}", words.join(" "))
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
        writeln!(
            out,
            "{:<22} {:<20} {:<12} {:>7.3} {:>8.3} {:>8.3} {:>5}–{:<5}  {paper}",
            s.scene, s.estimator, s.sampler, s.order, s.ci_low, s.ci_high, s.n_min, s.n_max
        )?;
        if let Some(remark) = &s.remark {
            writeln!(out, "{:>24}{remark}", "")?;
        }
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

/// Runs a study of pictures and tables, and writes its page.
fn findings(
    args: &ConvergeArgs,
    find: fn(&Context<'_>) -> Result<Findings>,
    mut folder: OutputFolder,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let name = args.what.first().map_or("", String::as_str);
    let progress = bar(name);
    let mut found = find(&Context {
        library: args.common.read.library(),
        seed: args.seed,
        smallest: args.smallest,
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
    Ok(())
}
