//! The function `converge`, which measures how the error of estimators falls with samples and time.

use crate::errors::{value_error, whole};
use crate::picture::{not_read, parsed};
use crate::threads::{Done, watched};
use anyhow::{Context as _, Result, bail};
use linelit::Estimator;
use linelit::samplers::SamplerKind;
use linelit::study::scene_study::{Piece, SceneUnit, StudySpec, Work, with_work};
use linelit_scenes::Library;
use pyo3::prelude::*;
use std::sync::atomic::Ordering;

/// The tables of a study, each the name of a file and its text.
type Tables = Vec<(String, String)>;

/// converge(scenes, …)
#[pyfunction]
#[pyo3(signature = (scenes, *, estimators, samplers, samples, trials = 16, pixels = "64x64", seed = 1, threads = None, progress = None))]
#[allow(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn converge(
    py: Python<'_>,
    scenes: Vec<String>,
    estimators: Vec<String>,
    samplers: Vec<String>,
    samples: Vec<i128>,
    trials: i128,
    pixels: &str,
    seed: i128,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Tables> {
    // Read the arguments.
    let estimators = estimators
        .iter()
        .map(|name| parsed::<Estimator>("estimators", name));
    let samplers = samplers
        .iter()
        .map(|name| parsed::<SamplerKind>("samplers", name));
    let samples = samples.into_iter().map(|n| whole("samples", n));
    let trials = whole("trials", trials)?;
    let spec = StudySpec {
        scenes,
        estimators: estimators.collect::<PyResult<_>>()?,
        samplers: samplers.collect::<PyResult<_>>()?,
        samples: samples.collect::<PyResult<_>>()?,
        trials,
        pixels: parsed("pixels", pixels)?,
        seed: whole("seed", seed)?,
        ..StudySpec::default()
    };
    // Check them.
    if spec.estimators.is_empty() || spec.samplers.is_empty() || spec.scenes.is_empty() {
        return Err(value_error(
            "scenes, estimators and samplers need one each at least",
        ));
    }
    if !spec.samples.is_sorted_by(|a, b| a < b) || spec.samples.first().is_none_or(|n| *n == 0) {
        let samples = &spec.samples;
        return Err(value_error(format!(
            "samples are {samples:?}, and need to ascend from 1"
        )));
    }
    if trials < 2 {
        return Err(value_error(format!(
            "trials is {trials}, and needs to be at least 2"
        )));
    }
    // Measure without the interpreter's lock, and report the units that are done.
    let units = Done::default();
    let told = units.tell(progress.as_ref());
    let measured = watched(py, threads, || measure(&spec, &units), told)?;
    measured.map_err(|error| not_read(&spec.scenes[0], &error))
}

/// Measures a study unit by unit, counts in `done` the units that are finished, and returns the
/// tables.
fn measure(spec: &StudySpec, done: &Done) -> Result<Tables> {
    let load = |name: &str| {
        let loaded = Library::default().load(name)?;
        if loaded.scene.lights.is_empty() {
            bail!("`{name}` has no lights, and a study measures those of the file");
        }
        Ok(loaded.scene)
    };
    with_work(spec, &load, |work| {
        // Plan the units of the tables: pictures are left out.
        let planned = work.plan()?;
        let units: Vec<_> = planned.iter().map(|planned| planned.unit.clone()).collect();
        let mut parts: Vec<Option<Vec<u8>>> = vec![None; units.len()];
        let wanted = |k: &usize| matches!(units[*k].piece, Piece::Errors(_));
        let numbers: Vec<usize> = (0..units.len()).filter(wanted).collect();
        done.all.store(numbers.len(), Ordering::Relaxed);
        // Compute them in their order, each from the parts that it needs.
        for k in numbers {
            let needed = |each: &mut dyn FnMut(usize, Vec<u8>) -> Result<()>| {
                let mut needs = planned[k].needs.clone();
                needs.try_for_each(|k| each(k, parts[k].clone().context("a part is missing")?))
            };
            let part = work.compute(&units, k, &needed)?;
            parts[k] = Some(part);
            done.done.fetch_add(1, Ordering::Relaxed);
        }
        tables(spec, work, &units, &parts)
    })
}

/// Returns the tables of the results of all units.
fn tables(
    spec: &StudySpec,
    work: &Work<'_, '_, '_>,
    units: &[SceneUnit],
    parts: &[Option<Vec<u8>>],
) -> Result<Tables> {
    let mut record = spec.record("linelit.converge".to_owned());
    work.gather(units, &|k| Ok(parts[k].clone()), &mut record)?;
    let tables = record.tables()?.into_iter();
    Ok(tables.map(|(name, text)| (name.to_owned(), text)).collect())
}
