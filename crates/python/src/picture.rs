//! The function `render`, which renders the picture of a scene file.

use crate::arrays::out;
use crate::errors::{value_error, warn, whole};
use crate::threads::{Done, watched};
use linelit::integrator::{Counts, LightChoice, Renderer, Settings, Window};
use linelit::samplers::SamplerKind;
use linelit::scene::SceneDescription;
use linelit_scenes::Library;
use pyo3::exceptions::PyFileNotFoundError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::Ordering;

/// Parses a text argument; the error names the argument.
pub(crate) fn parsed<T: std::str::FromStr<Err: std::fmt::Display>>(
    name: &str,
    text: &str,
) -> PyResult<T> {
    let parsed = text.parse();
    parsed.map_err(|e| value_error(format!("{name}=\"{text}\": {e}")))
}

/// Returns the error of a scene that cannot be read: `FileNotFoundError` where the name looks like
/// a path and there is no such file, else `ValueError`.
pub(crate) fn not_read(name: &str, error: &anyhow::Error) -> PyErr {
    let text = format!("{error:#}");
    let is_path = name.contains(['/', '\\', '.']) && !std::path::Path::new(name).exists();
    match is_path {
        true => PyFileNotFoundError::new_err(text),
        false => value_error(text),
    }
}

/// render(scene, …)
#[pyfunction]
#[pyo3(signature = (scene, *, estimator = "hybrid", samples = 16, camera_samples = 1, resolution = None, sampler = "auto", lights = "all", seed = 0, bounces = 0, show_lights = true, threads = None, progress = None))]
#[allow(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn render<'py>(
    py: Python<'py>,
    scene: &str,
    estimator: &str,
    samples: i128,
    camera_samples: i128,
    resolution: Option<[i128; 2]>,
    sampler: &str,
    lights: &str,
    seed: i128,
    bounces: i128,
    show_lights: bool,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
    // Read the arguments.
    let samples = whole("samples", samples)?;
    let camera_samples = whole("camera_samples", camera_samples)?;
    let settings = Settings {
        estimator: parsed("estimator", estimator)?,
        sampler: parsed::<SamplerKind>("sampler", sampler)?,
        samples,
        lights: parsed::<LightChoice>("lights", lights)?,
        pixel_samples: camera_samples,
        seed: whole("seed", seed)?,
        show_lights,
        bounces: whole("bounces", bounces)?,
        ..Settings::default()
    };
    if samples == 0 || camera_samples == 0 {
        return Err(value_error(
            "samples and camera_samples need to be at least 1",
        ));
    }
    // Load the scene, and pass its warnings on.
    let load = || Library::default().load_lit(scene);
    let loaded = watched(py, threads, load, |_| Ok(()))?;
    let mut loaded = loaded.map_err(|e| not_read(scene, &e))?;
    for warning in &loaded.warnings {
        warn(py, warning)?;
    }
    set_resolution(&mut loaded.scene, resolution)?;
    // Render the rows of the crop, counting those that are done.
    let scene = &loaded.scene;
    let [x0, x1, y0, y1] = scene.film.crop;
    let height = (y1 - y0) as usize;
    let rows = Done::default();
    rows.all.store(height, Ordering::Relaxed);
    let work = || {
        let renderer = Renderer::for_estimators(scene, [&settings.estimator]);
        let window = Window {
            columns: x0..x1,
            rows: y0..y1,
        };
        renderer.picture(&settings, &window, || {
            rows.done.fetch_add(1, Ordering::Relaxed);
        })
    };
    let (pixels, counts) = watched(py, threads, work, rows.tell(progress.as_ref()))?;
    let metadata = metadata(py, &settings, &counts)?;
    let shape = [height, (x1 - x0) as usize, 3];
    Ok((out(py, pixels.into_flattened(), &shape)?, metadata))
}

/// Gives a scene another resolution, if one is requested.
fn set_resolution(scene: &mut SceneDescription, resolution: Option<[i128; 2]>) -> PyResult<()> {
    if let Some([width, height]) = resolution {
        let (width, height) = (whole("resolution", width)?, whole("resolution", height)?);
        if width == 0 || height == 0 || u64::from(width) * u64::from(height) > 1 << 28 {
            let what = format!("resolution is ({width}, {height}), and needs 1 to 2^28 pixels");
            return Err(value_error(what));
        }
        scene.set_resolution(width, height);
    }
    Ok(())
}

/// Returns the metadata of a picture: its settings, and the numbers of rays, lines and shafts that
/// it took.
fn metadata<'py>(
    py: Python<'py>,
    settings: &Settings,
    counts: &Counts,
) -> PyResult<Bound<'py, PyDict>> {
    let metadata = PyDict::new(py);
    metadata.set_item("estimator", settings.estimator.to_string())?;
    metadata.set_item("sampler", settings.sampler.to_string())?;
    metadata.set_item("samples", settings.samples)?;
    metadata.set_item("camera_samples", settings.pixel_samples)?;
    metadata.set_item("seed", settings.seed)?;
    metadata.set_item("rays", counts.visibility.rays)?;
    metadata.set_item("lines", counts.visibility.line_queries)?;
    metadata.set_item("shafts", counts.visibility.shafts)?;
    Ok(metadata)
}
