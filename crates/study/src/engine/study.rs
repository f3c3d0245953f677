//! A whole convergence study: scenes × estimators × patterns × numbers of samples.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::gallery::{GalleryPicture, gallery};
use super::image::{self, Window};
use super::{Cell, CellRun, Reference, Score, Targets, Times, reference, run_cell, score};
use crate::memory;
use crate::pixels::Pixels;
use crate::spec::{StudySpec, View};
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use linelit_film::Image;
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Estimator, Renderer, Settings, ShadingPoint};
use linelit_samplers::SamplerKind;
use linelit_scene::Scene;
use std::time::Instant;

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
    /// What was not run, as the time was over.
    pub left_out: Vec<LeftOut>,
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
    /// Seconds of one trial.
    pub times: Times,
    /// Counts of one trial (all trials divided by their number).
    pub counts: Counts,
}

/// An estimator, a pattern and a number of samples for which there was no time.
#[derive(Clone, Copy, Debug)]
pub struct LeftOut {
    /// The estimator.
    pub estimator: Estimator,
    /// The pattern.
    pub sampler: SamplerKind,
    /// Samples.
    pub samples: u32,
}

/// A view whose scene is in memory, checked as far as that goes without measuring.
#[derive(Debug)]
pub struct Opened {
    view: View,
    scene: Scene,
    pixels: Vec<[u32; 2]>,
    picture_size: [u32; 2],
    load_seconds: f64,
}

impl Opened {
    /// What is looked at.
    #[must_use]
    pub const fn view(&self) -> &View {
        &self.view
    }
}

/// Opens everything a study looks at with `load`, by file or name, so that what is wrong with the
/// last scene is found before the first is measured.
///
/// # Errors
/// If a scene cannot be loaded or has nothing to light, a pixel is outside it, the camera sees
/// nothing at the pixels, or the study does not fit into memory.
pub fn open_all(
    spec: &StudySpec,
    load: &mut dyn FnMut(&str) -> Result<Scene>,
) -> Result<Vec<Opened>> {
    let views = spec.views().into_iter();
    let opened: Vec<Opened> = views
        .map(|view| open(spec, view, load))
        .collect::<Result<_>>()?;
    // The first is looked at next anyway, when nothing can be lost yet.
    for later in opened.iter().skip(1) {
        let renderer = Renderer::new(&later.scene);
        find(&renderer, &later.view, &later.pixels)?;
    }
    Ok(opened)
}

fn open(
    spec: &StudySpec,
    view: View,
    load: &mut dyn FnMut(&str) -> Result<Scene>,
) -> Result<Opened> {
    let start = Instant::now();
    let mut scene = load(&view.scene)?;
    let load_seconds = start.elapsed().as_secs_f64();
    let picture_size = picture_size(&scene);
    check_memory(spec, &view.pixels)?;
    let pixels = pixels(&mut scene, &view.pixels)?;
    Ok(Opened {
        view,
        scene,
        pixels,
        picture_size,
        load_seconds,
    })
}

/// Bytes of what is kept of a trial for its score and for the fits, beside its estimates.
const BYTES_PER_TRIAL: u64 = 48;

/// Refuses what does not fit: the shading points, and all estimates of all cells, which are kept
/// until the reference is known.
fn check_memory(spec: &StudySpec, pixels: &Pixels) -> Result<()> {
    let count = match pixels {
        Pixels::Grid(r) => u64::from(r.width) * u64::from(r.height),
        Pixels::List(list) => list.len() as u64,
    };
    let trials = spec.samplers.iter().map(|s| u64::from(spec.trials_of(*s)));
    let cells = spec.samples.len() as u64 * spec.estimators.len() as u64;
    let most = trials.clone().max().unwrap_or(0);
    let trials = trials.sum::<u64>().saturating_mul(cells);
    let point = size_of::<([u32; 2], ShadingPoint)>() as u64;
    let estimate = size_of::<DVec3>() as u64;
    // Those of the cell that is running are there twice.
    let values = estimate.saturating_mul(trials.saturating_add(most));
    let bytes = count
        .saturating_mul(point.saturating_add(values))
        .saturating_add(trials.saturating_mul(BYTES_PER_TRIAL));
    let what = format!("a study of {count} pixels and {trials} trials of each");
    memory::check(&what, bytes)
}

fn find(renderer: &Renderer<'_>, view: &View, pixels: &[[u32; 2]]) -> Result<Targets> {
    let targets = Targets::find(renderer, pixels);
    if targets.points.is_empty() {
        let label = &view.label;
        bail!("`{label}`: the camera sees nothing at the pixels of the study");
    }
    Ok(targets)
}

/// Runs a study on one view of a scene.
///
/// # Errors
/// If the camera sees nothing at the pixels.
pub fn run_scene(
    spec: &StudySpec,
    opened: Opened,
    deadline: Option<Instant>,
    progress: &ProgressBar,
) -> Result<SceneResult> {
    let Opened {
        view,
        mut scene,
        pixels,
        picture_size,
        load_seconds,
    } = opened;
    let built = Instant::now();
    let renderer = Renderer::new(&scene);
    let build_seconds = built.elapsed().as_secs_f64();
    let targets = find(&renderer, &view, &pixels)?;
    let (runs, left_out) = run_cells(spec, &renderer, &targets, deadline, progress);
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
        scene: view.label,
        triangles,
        hierarchy_bytes,
        pixels: pixels.len(),
        points: targets.points.len(),
        load_seconds,
        build_seconds,
        reference,
        cells,
        left_out,
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
) -> (Vec<CellRun>, Vec<LeftOut>) {
    let over = || deadline.is_some_and(|d| Instant::now() > d);
    let (mut runs, mut left_out) = (Vec::new(), Vec::new());
    for &samples in &spec.samples {
        for &estimator in &spec.estimators {
            for &sampler in &spec.samplers {
                progress.inc(1);
                if over() {
                    left_out.push(LeftOut {
                        estimator,
                        sampler,
                        samples,
                    });
                    continue;
                }
                let settings = Settings {
                    estimator,
                    sampler,
                    samples,
                    seed: spec.seed,
                    lights: spec.lights,
                    skip: spec.skip,
                    ..Settings::default()
                };
                let trials = spec.trials_of(sampler);
                runs.push(run_cell(renderer, targets, Cell { settings, trials }));
            }
        }
    }
    // Short ones are measured again and again, in turns.
    let mut known = false;
    while !known && !over() {
        known = true;
        for run in &mut runs {
            known &= run.time_again(renderer, targets, spec.cell_seconds);
        }
    }
    (runs, left_out)
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
        spec.reference_limit,
    )
}

fn cell_result(run: &CellRun, reference: &Reference, targets: &Targets) -> CellResult {
    let settings = &run.cell.settings;
    CellResult {
        estimator: settings.estimator,
        sampler: settings.sampler,
        samples: settings.samples,
        trials: run.cell.trials,
        score: score(run, reference, targets),
        times: run.times.clone(),
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
