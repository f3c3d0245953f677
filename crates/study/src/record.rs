//! From what was measured to what is told: the record of a study.

use crate::engine::{CellResult, SceneResult};
use crate::pixels::Pixels;
use crate::report::{Picture, Report, plot_files, scientific};
use crate::spec::StudySpec;
use crate::stats::slopes::{Bootstrap, Order, SlopePoint, fit_trials};
use crate::tables::{
    GalleryRow, LeftOutRow, ResultRow, SceneRecord, SlopeRow, StudyRecord, commit, cpu_name,
};
use linelit_film::{Exposure, FilmError, Image};
use linelit_integrator::Estimator;
use linelit_samplers::SamplerKind;
use std::collections::BTreeMap;

/// A record without results.
///
/// `command` is the one that repeats the study.
#[must_use]
pub fn new_record(spec: &StudySpec, command: String) -> StudyRecord {
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
        command,
        version: crate::version(),
        commit: commit(),
        cpu: cpu_name(),
        threads: rayon::current_num_threads(),
        seed: spec.seed,
        settings: settings.map(|(k, v)| (k.to_owned(), v)).into(),
        ..StudyRecord::default()
    }
}

/// Adds the results of one view, looked at through `pixels`.
pub fn append(record: &mut StudyRecord, spec: &StudySpec, pixels: &Pixels, result: &SceneResult) {
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

/// The files of a study, by name: its tables, `plots/*.svg` and `report.html`.
///
/// # Errors
/// [`FilmError`] if a number cannot be written as JSON, or a picture has no pixels.
pub fn files(
    record: &StudyRecord,
    results: &[SceneResult],
) -> Result<Vec<(String, Vec<u8>)>, FilmError> {
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    for (name, text) in record.files()? {
        files.push((name.to_owned(), text.into_bytes()));
    }
    for (name, svg) in plot_files(record) {
        files.push((format!("plots/{name}"), svg.into_bytes()));
    }
    let mut pictures = BTreeMap::new();
    for result in results {
        let caption = format!(
            "{}: line-analytic, 16 stratified lines a point",
            result.scene
        );
        let picture = Picture::exposed(&result.picture, exposure(&result.picture), &caption)?;
        let mut shown = vec![picture];
        for one in &result.gallery {
            let caption = format!(
                "{}: N = {}, {:.2} s of CPU, MRSE {}",
                one.estimator,
                one.samples,
                one.cpu_seconds,
                scientific(one.mrse)
            );
            let exposure = exposure(&result.gallery[0].image);
            shown.push(Picture::exposed(&one.image, exposure, &caption)?);
        }
        pictures.insert(result.scene.clone(), shown);
    }
    let page = Report::of_study(record, pictures).render();
    files.push(("report.html".to_owned(), page.into_bytes()));
    Ok(files)
}

/// Shows a tenth of the pixels as white, so that a light in the picture leaves the rest bright.
fn exposure(image: &Image) -> Exposure {
    Exposure::fitting(image, 0.9)
}
