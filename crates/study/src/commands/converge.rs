//! `linelit converge`.

use super::{bar, page, pool};
use crate::cli::{ConvergeArgs, Pixels};
use crate::engine::{CellResult, SceneResult, open_all, run_scene};
use crate::folder::OutputFolder;
use crate::output::{Output, OutputError, note};
use crate::stats::slopes::{Bootstrap, Order, SlopePoint, fit_trials};
use crate::studies::{self, Study, StudySpec};
use crate::tables::{
    GalleryRow, LeftOutRow, ResultRow, SceneRecord, SlopeRow, StudyRecord, commit, cpu_name,
};
use anyhow::Result;
use indicatif::ProgressBar;
use linelit_integrator::Estimator;
use linelit_samplers::SamplerKind;
use std::time::{Duration, Instant};

/// Runs a study and writes its report.
///
/// # Errors
/// If a scene cannot be read, the folder is not to be had, or the report cannot be written.
pub fn run(args: &ConvergeArgs, out: &mut Output) -> Result<()> {
    let study = studies::resolve(args)?;
    let folder = OutputFolder::open(&args.out)?;
    let pool = pool(&args.common)?;
    pool.install(|| match study {
        Study::Convergence(spec) => converge(args, &spec, folder, out),
        Study::BillenTable1 => table1(args, folder, out),
        Study::BillenFigures => figures(args, folder, out),
        Study::Exhibition(name, make) => exhibition(args, (name, make), folder, out),
    })
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
    let mut record = new_record(spec);
    let mut results = Vec::new();
    for opened in open_all(spec, &args.common.read.library())? {
        let view = opened.view().clone();
        let progress = bar(&view.label);
        progress
            .set_length((spec.samples.len() * spec.estimators.len() * spec.samplers.len()) as u64);
        let result = run_scene(spec, opened, deadline, &progress)?;
        progress.finish_and_clear();
        append(&mut record, spec, &view.pixels, &result);
        results.push(result);
    }
    record.seconds = start.elapsed().as_secs_f64();
    for (name, text) in record.files()? {
        folder.add(name, text);
    }
    page::add_study(&mut folder, &record, &results)?;
    let report = folder.place("report.html");
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
    format!("cargo xtask {}", words.join(" "))
}

fn new_record(spec: &StudySpec) -> StudyRecord {
    let names = |list: &[SamplerKind]| {
        list.iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(",")
    };
    let settings = [
        ("pixels", spec.pixels.to_string()),
        (
            "samples",
            spec.samples
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(","),
        ),
        ("samplers", names(&spec.samplers)),
        (
            "estimators",
            spec.estimators
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join(","),
        ),
        ("trials", spec.trials.to_string()),
        ("lights", spec.lights.to_string()),
        ("skip", spec.skip.to_string()),
        (
            "time budget",
            spec.time_budget.map_or(String::new(), |s| format!("{s} s")),
        ),
    ];
    StudyRecord {
        title: spec.title.clone(),
        command: command(),
        version: crate::version(),
        commit: commit(),
        cpu: cpu_name(),
        threads: rayon::current_num_threads(),
        seed: spec.seed,
        settings: settings.map(|(k, v)| (k.to_owned(), v)).into(),
        ..StudyRecord::default()
    }
}

fn append(record: &mut StudyRecord, spec: &StudySpec, pixels: &Pixels, result: &SceneResult) {
    let reference = &result.reference;
    record.scenes.push(SceneRecord {
        scene: result.scene.clone(),
        triangles: result.triangles,
        pixels: result.pixels,
        shading_points: result.points,
        load_seconds: result.load_seconds,
        build_seconds: result.build_seconds,
        hierarchy_bytes: result.hierarchy_bytes,
        reference_mse: reference.mse,
        reference: format!(
            "{} replicates of {} with {} stratified samples",
            reference.replicates, reference.estimator, reference.samples
        ),
    });
    record
        .gallery
        .extend(result.gallery.iter().map(|p| GalleryRow {
            scene: result.scene.clone(),
            estimator: p.estimator.to_string(),
            samples: p.samples,
            cpu_seconds: p.cpu_seconds,
            mrse: p.mrse,
        }));
    record
        .rows
        .extend(result.cells.iter().map(|cell| row(pixels, result, cell)));
    record
        .left_out
        .extend(result.left_out.iter().map(|cell| LeftOutRow {
            scene: result.scene.clone(),
            estimator: cell.estimator.to_string(),
            sampler: cell.sampler.to_string(),
            samples: cell.samples,
        }));
    for estimator in &spec.estimators {
        for &sampler in &spec.samplers {
            record
                .slopes
                .extend(slope(spec, result, *estimator, sampler));
        }
    }
}

fn row(pixels: &Pixels, result: &SceneResult, cell: &CellResult) -> ResultRow {
    let visibility = &cell.counts.visibility;
    ResultRow {
        scene: result.scene.clone(),
        pixels: pixels.to_string(),
        estimator: cell.estimator.to_string(),
        sampler: cell.sampler.to_string(),
        samples: cell.samples,
        trials: cell.trials,
        mse: cell.score.mse,
        mse_stderr: cell.score.mse_stderr,
        mrse: cell.score.mrse,
        bias: cell.score.bias,
        bias_stderr: cell.score.bias_stderr,
        cpu_seconds: cell.times.seconds(),
        cpu_error: cell.times.error(),
        wall_seconds: cell.times.wall_seconds(),
        rays: visibility.rays,
        line_queries: visibility.line_queries,
        node_tests: visibility.node_tests,
        triangle_tests: visibility.triangle_tests,
        intervals: visibility.intervals,
    }
}

/// The order of the standard deviation of one estimator and pattern, from the spread of the trials
/// (which needs no reference).
fn slope(
    spec: &StudySpec,
    result: &SceneResult,
    estimator: Estimator,
    sampler: SamplerKind,
) -> Option<SlopeRow> {
    let points = slope_points(result, estimator, sampler);
    let fit = fit_trials(&points, &Bootstrap::default())?;
    let name = estimator.to_string();
    let row = SlopeRow::new(&result.scene, &name, &sampler.to_string(), &fit);
    let paper = spec
        .papers
        .iter()
        .find(|p| p.scene == result.scene && p.estimator == name && p.sampler == sampler);
    let Some(paper) = paper else {
        return Some(row);
    };
    let mut row = row.with_paper(paper.order, paper.source);
    if fit.ci_low > paper.order {
        row.remark = Some(remark(&points, &fit));
    }
    Some(row)
}

fn slope_points(
    result: &SceneResult,
    estimator: Estimator,
    sampler: SamplerKind,
) -> Vec<SlopePoint> {
    let wanted = |cell: &&CellResult| cell.estimator == estimator && cell.sampler == sampler;
    let point = |cell: &CellResult| SlopePoint {
        samples: f64::from(cell.samples),
        trial_variances: cell.score.trial_variance.clone(),
    };
    result.cells.iter().filter(wanted).map(point).collect()
}

/// Where an order is weaker than the paper's: what the curve does at its ends.
fn remark(points: &[SlopePoint], fit: &Order) -> String {
    let deviation = |p: &SlopePoint| {
        #[allow(clippy::cast_precision_loss, reason = "few trials")]
        let n = p.trial_variances.len() as f64;
        0.5 * (p.trial_variances.iter().sum::<f64>() / n).ln()
    };
    let step = |a: &SlopePoint, b: &SlopePoint| {
        (deviation(b) - deviation(a)) / (b.samples.ln() - a.samples.ln())
    };
    let (Some(first), Some(last)) = (points.windows(2).next(), points.windows(2).last()) else {
        return String::new();
    };
    let (early, late) = (step(&first[0], &first[1]), step(&last[0], &last[1]));
    let why = if late < fit.order - 0.02 {
        "the curve still steepens, so the fit over the whole range is weaker than its end"
    } else {
        "a straight line over the whole range: the order of this scene, which is not the paper's"
    };
    format!(
        "{why}: {early:.2} from N = {} to {}, {late:.2} from N = {} to {}; lack of fit {:.1}",
        first[0].samples, first[1].samples, last[0].samples, last[1].samples, fit.lack_of_fit
    )
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

/// What studies that are shown rather than fitted are told.
fn context<'a>(args: &ConvergeArgs, progress: &'a ProgressBar) -> studies::Context<'a> {
    studies::Context {
        library: args.common.read.library(),
        seed: args.seed,
        smallest: args.smallest,
        progress,
    }
}

fn table1(args: &ConvergeArgs, mut folder: OutputFolder, out: &mut Output) -> Result<()> {
    let rows = studies::billen_table1(&context(args, &bar("table")))?;
    let json = serde_json::to_string_pretty(&rows)?;
    let text = studies::billen_table1_text(&rows);
    folder.add("billen-table1.json", json.as_str());
    folder.add("billen-table1.txt", text.as_str());
    page::add_table1(&mut folder, &rows, &command());
    folder.finish()?;
    writeln!(out, "{}", if args.common.json { &json } else { &text })?;
    Ok(())
}

fn figures(args: &ConvergeArgs, mut folder: OutputFolder, out: &mut Output) -> Result<()> {
    let figures = studies::billen_figures(&context(args, &bar("figures")))?;
    page::add_figures(&mut folder, &figures, &command())?;
    let report = folder.place("report.html");
    folder.finish()?;
    for figure in &figures {
        let rmse = figure
            .rmse
            .map_or(String::new(), |r| format!("  RMSE {r:.5}"));
        writeln!(
            out,
            "{} {}: {}{rmse}",
            figure.figure, figure.scene, figure.caption
        )?;
    }
    writeln!(out, "report: {}", report.display())?;
    Ok(())
}

fn exhibition(
    args: &ConvergeArgs,
    (name, make): (
        &str,
        fn(&studies::Context<'_>) -> Result<studies::Exhibition>,
    ),
    mut folder: OutputFolder,
    out: &mut Output,
) -> Result<()> {
    let start = Instant::now();
    let exhibition = make(&context(args, &bar(name)))?;
    let json = serde_json::to_string_pretty(&exhibition.rows)?;
    let text = exhibition.text();
    folder.add(&format!("{name}.json"), json.as_str());
    page::add_exhibition(&mut folder, name, exhibition, &command());
    let report = folder.place("report.html");
    folder.finish()?;
    writeln!(out, "{}", if args.common.json { &json } else { &text })?;
    if !args.common.json {
        let seconds = start.elapsed().as_secs_f64();
        writeln!(out, "{seconds:.1} s; report: {}", report.display())?;
    }
    Ok(())
}
