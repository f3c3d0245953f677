//! From a study of scenes to its results.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::duel::duel;
use super::gallery::{GalleryPicture, gallery};
use super::{StudySpec, Targets, View, all_pixels, render};
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use linelit_film::{Exposure, FilmError, Image, Tile};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, ShadingPoint};
use linelit_scene::Scene;
use linelit_study::engine::measure;
use linelit_study::memory;
use linelit_study::pixels::Pixels;
use linelit_study::report::{Exhibits, Picture, scientific};
use linelit_study::tables::{GalleryRow, SceneRecord, StudyRecord};
use std::time::Instant;

/// A view whose scene is in memory, checked as far as that goes without measuring.
#[derive(Debug)]
pub struct Opened {
    view: View,
    scene: Scene,
    pixels: Vec<[u32; 2]>,
    /// The scene's own proportions.
    aspect: [u32; 2],
    load_seconds: f64,
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
        .map(|view| Opened::open(spec, view, load))
        .collect::<Result<_>>()?;
    // The first is looked at next anyway, when nothing can be lost yet.
    for later in opened.iter().skip(1) {
        let renderer = Renderer::new(&later.scene);
        find(&renderer, &later.view, &later.pixels)?;
    }
    Ok(opened)
}

impl Opened {
    fn open(
        spec: &StudySpec,
        view: View,
        load: &mut dyn FnMut(&str) -> Result<Scene>,
    ) -> Result<Self> {
        let start = Instant::now();
        let mut scene = load(&view.scene)?;
        let load_seconds = start.elapsed().as_secs_f64();
        let aspect = [scene.film.width.max(1), scene.film.height.max(1)];
        check_memory(spec, &view.pixels)?;
        let pixels = pixels(&mut scene, &view.pixels)?;
        Ok(Self {
            view,
            scene,
            pixels,
            aspect,
            load_seconds,
        })
    }

    /// The name under which results stand.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.view.label
    }

    /// Runs a study on this view, and adds what was found to `record`, and what the report shows of
    /// it to `exhibits`.
    ///
    /// # Errors
    /// If the camera sees nothing at the pixels.
    pub fn run(
        self,
        spec: &StudySpec,
        deadline: Option<Instant>,
        progress: &ProgressBar,
        record: &mut StudyRecord,
        exhibits: &mut Exhibits,
    ) -> Result<()> {
        let Self {
            view, mut scene, ..
        } = self;
        let design = spec.design(deadline);
        let built = Instant::now();
        let renderer = Renderer::new(&scene);
        let build_seconds = built.elapsed().as_secs_f64();
        let targets = find(&renderer, &view, &self.pixels)?;
        progress.set_length((design.samples.len() * design.methods.len()) as u64);
        let results = measure(&targets, &targets.truth(spec.spheres), &design, || {
            progress.inc(1)
        });
        let about = SceneRecord {
            scene: view.label.clone(),
            triangles: scene.triangles.len(),
            load_seconds: self.load_seconds,
            build_seconds,
            hierarchy_bytes: renderer.occluders().memory(),
            ..SceneRecord::default()
        };
        let pixels = view.pixels.to_string();
        record.add(about, &pixels, &design.methods, &results, &spec.papers);
        let name = view.label.clone();
        let compared = match &spec.duel {
            Some(wanted) => {
                let size = fitted(self.aspect, wanted.side);
                duel(spec, wanted, &name, record, &mut scene, size)?
            }
            None => None,
        };
        let mut shown = Vec::new();
        // The comparison shows the scene already.
        if let Some(compared) = compared {
            exhibits.comparisons.insert(name.clone(), compared);
        } else {
            let image = picture(&mut scene, fitted(self.aspect, PICTURE_SIDE));
            let caption = format!("{name}: line-analytic, 16 stratified lines a point");
            shown.push(Picture::exposed(&image, exposure(&image), &caption)?);
        }
        let gallery = match &spec.gallery {
            Some(wanted) if view.with_gallery => gallery(spec, wanted, &mut scene, progress),
            _ => Vec::new(),
        };
        record.gallery.extend(gallery.iter().map(|p| GalleryRow {
            scene: view.label.clone(),
            estimator: p.estimator.to_string(),
            samples: p.samples,
            cpu_seconds: p.cpu_seconds,
            mrse: p.mrse,
        }));
        shown.extend(pictures(&gallery)?);
        exhibits.pictures.insert(name, shown);
        Ok(())
    }
}

/// Bytes of what is kept of a trial for its score and for the fits, beside its estimates.
const BYTES_PER_TRIAL: u64 = 48;

/// Refuses what does not fit: the shading points, and all estimates of all methods, which are kept
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
    // Those that are running are there twice.
    let values = estimate.saturating_mul(trials.saturating_add(most));
    let bytes = count
        .saturating_mul(point.saturating_add(values))
        .saturating_add(trials.saturating_mul(BYTES_PER_TRIAL));
    let what = format!("a study of {count} pixels and {trials} trials of each");
    memory::check(&what, bytes)
}

fn find<'a>(renderer: &'a Renderer<'a>, view: &View, pixels: &[[u32; 2]]) -> Result<Targets<'a>> {
    let targets = Targets::find(renderer, pixels);
    if targets.points.is_empty() {
        let label = &view.label;
        bail!("`{label}`: the camera sees nothing at the pixels of the study");
    }
    Ok(targets)
}

fn pixels(scene: &mut Scene, pixels: &Pixels) -> Result<Vec<[u32; 2]>> {
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

/// Pixels on the longer side of the picture of a scene.
const PICTURE_SIDE: u32 = 320;

/// A picture's proportions with this many pixels on the longer side.
fn fitted([w, h]: [u32; 2], side: u32) -> [u32; 2] {
    [w, h].map(|length| {
        let scaled = u64::from(side) * u64::from(length) / u64::from(w.max(h));
        u32::try_from(scaled).unwrap_or(side).max(1)
    })
}

fn picture(scene: &mut Scene, [width, height]: [u32; 2]) -> Image {
    scene.set_resolution(width, height);
    let window = Tile::whole(width, height);
    let (renderer, settings) = (Renderer::new(scene), Settings::default());
    render(&renderer, &settings, window, &ProgressBar::hidden()).0
}

/// A tenth of the pixels are white, so that a light in the picture leaves the rest bright.
fn exposure(image: &Image) -> Exposure {
    Exposure::fitting(image, 0.9)
}

/// A gallery, for the report.
fn pictures(gallery: &[GalleryPicture]) -> Result<Vec<Picture>, FilmError> {
    let Some(first) = gallery.first() else {
        return Ok(Vec::new());
    };
    let picture = |one: &GalleryPicture| {
        let caption = format!(
            "{}: N = {}, {:.2} s of CPU, MRSE {}",
            one.estimator,
            one.samples,
            one.cpu_seconds,
            scientific(one.mrse)
        );
        Picture::exposed(&one.image, exposure(&first.image), &caption)
    };
    gallery.iter().map(picture).collect()
}
