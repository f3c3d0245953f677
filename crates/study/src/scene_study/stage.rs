//! The scenes of a study in memory: each is opened, built and searched for shading points when it
//! is first needed, and then cached.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::{StudySpec, Targets, View, all_pixels};
use crate::engine::{BLOCK_ESTIMATES, Design, Job, Reference, Truth};
use crate::memory;
use crate::pixels::Pixels;
use anyhow::{Context as _, Result, bail};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint};
use linelit_scene::SceneDescription;
use std::sync::OnceLock;
use std::time::Instant;

/// A function that reads a scene by file or name.
pub type Load<'a> = &'a (dyn Fn(&str) -> Result<SceneDescription> + Sync);

/// A view whose scene is in memory.
pub(super) struct Opened {
    pub(super) scene: SceneDescription,
    pixels: Vec<[u32; 2]>,
    /// The width and height, in pixels, that the scene's file states.
    pub(super) aspect: [u32; 2],
    pub(super) load_seconds: f64,
}

/// A renderer, and the seconds that building it took.
pub(super) struct Built<'o> {
    pub(super) renderer: Renderer<'o>,
    pub(super) seconds: f64,
}

/// The integrals that are measured on a view, and the method of their reference.
pub(super) struct ViewIntegrals<'r> {
    pub(super) targets: Targets<'r>,
    truth: Truth<Settings>,
}

/// A study of scenes while it is planned, run or merged. Each scene is opened when its first unit
/// is computed, and stays in memory.
#[allow(missing_debug_implementations, reason = "a function reads scenes")]
pub struct Work<'w, 'r, 'o> {
    pub(super) spec: &'w StudySpec,
    pub(super) design: Design<Settings>,
    pub(super) views: &'w [View],
    opened: &'o [OnceLock<Opened>],
    built: &'r [OnceLock<Built<'o>>],
    seen: &'w [OnceLock<ViewIntegrals<'r>>],
    references: Vec<OnceLock<Reference>>,
    load: Load<'w>,
}

/// Calls a function with the work of a study whose scenes are read by `load`.
pub fn with_work<T>(
    spec: &StudySpec,
    load: Load<'_>,
    call: impl FnOnce(&Work<'_, '_, '_>) -> T,
) -> T {
    let views = spec.views();
    let (opened, built, seen) = (empty(&views), empty(&views), empty(&views));
    call(&Work {
        spec,
        design: spec.design(),
        references: empty(&views),
        views: &views,
        opened: &opened,
        built: &built,
        seen: &seen,
        load,
    })
}

/// Returns a cache with an empty entry for each view.
fn empty<T>(views: &[View]) -> Vec<OnceLock<T>> {
    views.iter().map(|_| OnceLock::new()).collect()
}

/// Returns the cached value of a view, which is made if it is missing.
fn kept<T>(list: &[OnceLock<T>], view: usize, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    let place = list.get(view).context(NO_VIEW)?;
    if let Some(there) = place.get() {
        return Ok(there);
    }
    let made = make()?;
    Ok(place.get_or_init(|| made))
}

const NO_VIEW: &str = "a unit of a scene that the study has not";

impl<'w, 'r, 'o> Work<'w, 'r, 'o> {
    /// Returns the specification of the study.
    #[must_use]
    pub const fn spec(&self) -> &'w StudySpec {
        self.spec
    }

    /// Returns the view with this index; an error if there is none.
    pub(super) fn view(&self, view: usize) -> Result<&'w View> {
        self.views.get(view).context(NO_VIEW)
    }

    /// Returns the scene of a view, at the resolution of its pixels.
    pub(super) fn opened(&self, view: usize) -> Result<&'o Opened> {
        let about = self.view(view)?;
        kept(self.opened, view, || {
            let start = Instant::now();
            let mut scene = (self.load)(&about.scene)?;
            let load_seconds = start.elapsed().as_secs_f64();
            let aspect = [scene.film.width.max(1), scene.film.height.max(1)];
            check_memory(self.spec, &about.pixels)?;
            Ok(Opened {
                pixels: pixels(&mut scene, &about.pixels)?,
                scene,
                aspect,
                load_seconds,
            })
        })
    }

    /// Returns the renderer of a view.
    pub(super) fn built(&self, view: usize) -> Result<&'r Built<'o>> {
        let opened = self.opened(view)?;
        kept(self.built, view, || {
            let start = Instant::now();
            let renderer = Renderer::new(&opened.scene);
            Ok(Built {
                renderer,
                seconds: start.elapsed().as_secs_f64(),
            })
        })
    }

    /// Returns the job of measuring a view.
    pub(super) fn job(&self, view: usize) -> Result<Job<'_, Targets<'r>>> {
        let (opened, built) = (self.opened(view)?, self.built(view)?);
        let seen = kept(self.seen, view, || {
            let targets = Targets::find(&built.renderer, &opened.pixels);
            if targets.points.is_empty() {
                let label = &self.view(view)?.label;
                bail!("`{label}`: the camera sees nothing at the pixels of the study");
            }
            let truth = targets.truth(self.spec.spheres);
            Ok(ViewIntegrals { targets, truth })
        })?;
        Ok(Job {
            problem: &seen.targets,
            truth: &seen.truth,
            design: &self.design,
        })
    }

    /// Returns the reference of a view, which `make` computes the first time.
    pub(super) fn reference(
        &self,
        view: usize,
        make: impl FnOnce() -> Result<Reference>,
    ) -> Result<&Reference> {
        kept(&self.references, view, make)
    }

    /// Returns the scene of a view at another resolution.
    pub(super) fn resized(
        &self,
        view: usize,
        [width, height]: [u32; 2],
    ) -> Result<SceneDescription> {
        let mut scene = self.opened(view)?.scene.clone();
        scene.set_resolution(width, height);
        Ok(scene)
    }
}

/// The bytes that are stored of each trial for its score and for the fits: three sums.
const BYTES_PER_TRIAL: u64 = 24;

/// Refuses a study that does not fit into memory: the shading points with their references, the
/// estimates of one unit, and the sums of all trials.
fn check_memory(spec: &StudySpec, pixels: &Pixels) -> Result<()> {
    let count = match pixels {
        Pixels::Grid(r) => u64::from(r.width) * u64::from(r.height),
        Pixels::List(list) => list.len() as u64,
    };
    // Count the measurements and their trials.
    let trials = spec.samplers.iter().map(|s| u64::from(spec.trials_of(*s)));
    let cells = [spec.samples.len(), spec.estimators.len(), spec.lights.len()];
    let cells: u64 = cells.into_iter().map(|n| n as u64).product();
    let most = trials.clone().max().unwrap_or(0);
    let trials = trials.sum::<u64>().saturating_mul(cells);
    let point = size_of::<([u32; 2], ShadingPoint)>() as u64;
    let estimate = size_of::<DVec3>() as u64;
    // A reference has the mean and sum of squares of each integral, both also of the round that is
    // being computed, and values and variances.
    let reference = 6 * estimate + 4;
    // Estimates of the running unit exist twice.
    let estimates = most.max(count.saturating_mul(most).min(BLOCK_ESTIMATES as u64));
    let bytes = count
        .saturating_mul(point.saturating_add(reference))
        .saturating_add(estimates.saturating_mul(2 * estimate))
        .saturating_add(trials.saturating_mul(BYTES_PER_TRIAL));
    let what = format!("a study of {count} pixels and {trials} trials of each");
    memory::check(&what, bytes)
}

/// Returns the pixels that a study measures, and sets the scene's resolution to theirs.
fn pixels(scene: &mut SceneDescription, pixels: &Pixels) -> Result<Vec<[u32; 2]>> {
    match pixels {
        Pixels::Grid(r) => {
            scene.set_resolution(r.width, r.height);
            Ok(all_pixels(r.width, r.height))
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
