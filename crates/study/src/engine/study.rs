//! A whole convergence study: scenes × estimators × patterns × numbers of samples.

use super::gallery::{GalleryPicture, gallery};
use super::image::{self, Window};
use super::{Cell, CellRun, Reference, Score, Targets, reference, run_cell, score};
use crate::cli::{Pixels, ReadArgs};
use crate::scenes;
use crate::studies::StudySpec;
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use linelit_film::Image;
use linelit_integrator::{Counts, Estimator, Renderer, Settings};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use std::time::{Duration, Instant};

/// What was measured on one scene.
#[derive(Clone, Debug)]
pub struct SceneResult {
    /// Short name.
    pub scene: String,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Bytes of the occluders' hierarchy.
    pub hierarchy_bytes: usize,
    /// Pixels asked for, and those with something to shade.
    pub pixels: usize,
    /// Shading points.
    pub points: usize,
    /// Seconds to load the scene.
    pub load_seconds: f64,
    /// Seconds to build the hierarchy and the plan.
    pub build_seconds: f64,
    /// The reference.
    pub reference: Reference,
    /// All cells, in the order they were run.
    pub cells: Vec<CellResult>,
    /// A picture of the scene.
    pub picture: Image,
    /// Pictures by several estimators.
    pub gallery: Vec<GalleryPicture>,
}

/// What was measured for one estimator, pattern and number of samples.
#[derive(Clone, Debug)]
pub struct CellResult {
    /// The estimator.
    pub estimator: Estimator,
    /// The pattern.
    pub sampler: SamplerKind,
    /// Samples.
    pub samples: u32,
    /// Trials.
    pub trials: u32,
    /// Errors.
    pub score: Score,
    /// Processor seconds of one trial.
    pub cpu_seconds: f64,
    /// Wall seconds of one trial.
    pub wall_seconds: f64,
    /// Counts of one trial (all trials divided by their number).
    pub counts: Counts,
}

/// The longest that a reference may take beyond its first round, in seconds.
const REFERENCE_SECONDS: u64 = 60;

/// Where a study looks: a scene, and which of its pixels.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene, by file or name.
    pub scene: String,
    /// The name under which results stand.
    pub label: String,
    /// The pixels.
    pub pixels: Pixels,
    /// Whether the gallery is rendered here.
    pub with_gallery: bool,
}

/// Runs a study on one view of a scene.
///
/// # Errors
/// If the scene cannot be loaded or a pixel is outside it.
pub fn run_scene(
    spec: &StudySpec,
    view: &View,
    read: &ReadArgs,
    deadline: Option<Instant>,
    progress: &ProgressBar,
) -> Result<SceneResult> {
    let start = Instant::now();
    let name = &view.scene;
    let mut scene = scenes::load(name, read)?.scene;
    let load_seconds = start.elapsed().as_secs_f64();
    let picture_size = picture_size(&scene);
    let pixels = pixels(&mut scene, &view.pixels)?;
    let built = Instant::now();
    let renderer = Renderer::new(&scene);
    let build_seconds = built.elapsed().as_secs_f64();
    let targets = Targets::find(&renderer, &pixels);
    if targets.points.is_empty() {
        bail!("`{name}`: the camera sees nothing at the pixels of the study");
    }
    let runs = run_cells(spec, &renderer, &targets, deadline, progress);
    let reference = best_reference(spec, &renderer, &targets, &runs);
    let cells = runs
        .iter()
        .map(|run| cell_result(run, &reference, &targets))
        .collect();
    let triangles = scene.triangles.len();
    let hierarchy_bytes = renderer.occluders().memory();
    let picture = picture(&mut scene, picture_size);
    let gallery = match &spec.gallery {
        Some(wanted) if view.with_gallery => gallery(spec, wanted, &mut scene, progress),
        _ => Vec::new(),
    };
    Ok(SceneResult {
        scene: view.label.clone(),
        triangles,
        hierarchy_bytes,
        pixels: pixels.len(),
        points: targets.points.len(),
        load_seconds,
        build_seconds,
        reference,
        cells,
        picture,
        gallery,
    })
}

fn pixels(scene: &mut Scene, pixels: &Pixels) -> Result<Vec<[u32; 2]>> {
    match pixels {
        Pixels::Grid(r) => {
            scene.set_resolution(r.width, r.height);
            Ok((0..r.height)
                .flat_map(|y| (0..r.width).map(move |x| [x, y]))
                .collect())
        }
        Pixels::List(list) => {
            let (w, h) = (scene.film.width, scene.film.height);
            match list.iter().find(|[x, y]| *x >= w || *y >= h) {
                Some([x, y]) => bail!("pixel {x},{y} is outside the image of {w}x{h} pixels"),
                None => Ok(list.clone()),
            }
        }
    }
}

fn run_cells(
    spec: &StudySpec,
    renderer: &Renderer<'_>,
    targets: &Targets,
    deadline: Option<Instant>,
    progress: &ProgressBar,
) -> Vec<CellRun> {
    let mut runs = Vec::new();
    for &samples in &spec.samples {
        for estimator in &spec.estimators {
            for &sampler in &spec.samplers {
                progress.inc(1);
                if deadline.is_some_and(|d| Instant::now() > d) {
                    continue;
                }
                let settings = Settings {
                    estimator: *estimator,
                    sampler,
                    samples,
                    seed: spec.seed,
                    lights: spec.lights,
                    skip: spec.skip,
                    ..Settings::default()
                };
                runs.push(run_cell(
                    renderer,
                    targets,
                    Cell {
                        settings,
                        trials: spec.trials_of(sampler),
                    },
                ));
            }
        }
    }
    runs
}

/// A reference whose own error is below a tenth of the smallest variance found: the variance needs
/// no reference, and is what is left of the error of an unbiased estimate.
fn best_reference(
    spec: &StudySpec,
    renderer: &Renderer<'_>,
    targets: &Targets,
    runs: &[CellRun],
) -> Reference {
    let zeros = Reference::black(targets.points.len());
    let variance = |run: &CellRun| score(run, &zeros, targets).variance;
    let positive = runs.iter().map(variance).filter(|v| *v > 0.0);
    let smallest = positive.fold(f64::INFINITY, f64::min);
    let samples = spec
        .samples
        .last()
        .copied()
        .unwrap_or(1)
        .saturating_mul(4)
        .clamp(256, 4096);
    reference(
        renderer,
        targets,
        samples,
        0.1 * smallest,
        Duration::from_secs(REFERENCE_SECONDS),
    )
}

fn cell_result(run: &CellRun, reference: &Reference, targets: &Targets) -> CellResult {
    let settings = &run.cell.settings;
    let trials = f64::from(run.cell.trials);
    CellResult {
        estimator: settings.estimator,
        sampler: settings.sampler,
        samples: settings.samples,
        trials: run.cell.trials,
        score: score(run, reference, targets),
        cpu_seconds: run.cpu_seconds / trials,
        wall_seconds: run.wall_seconds / trials,
        counts: run.counts,
    }
}

/// The scene's own proportions at 320 pixels on the longer side.
fn picture_size(scene: &Scene) -> [u32; 2] {
    let (w, h) = (scene.film.width.max(1), scene.film.height.max(1));
    let fit = |side: u32| (320 * side / w.max(h)).max(1);
    [fit(w), fit(h)]
}

fn picture(scene: &mut Scene, [width, height]: [u32; 2]) -> Image {
    scene.set_resolution(width, height);
    let renderer = Renderer::new(scene);
    let settings = Settings {
        samples: 16,
        ..Settings::default()
    };
    let window = Window::whole(width, height);
    image::render(&renderer, &settings, window, &ProgressBar::hidden()).0
}
