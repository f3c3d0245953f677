//! Convergence studies.

use crate::errors::value_error;
use crate::picture::{not_read, parsed};
use crate::threads::pool;
use anyhow::{Context as _, Result, bail};
use linelit::Estimator;
use linelit::samplers::SamplerKind;
use linelit::study::scene_study::{Piece, SceneUnit, StudySpec, Work, with_work};
use linelit_scenes::Library;
use pyo3::prelude::*;
use rayon::ThreadPool;

/// The tables of a study: the names of files, and their texts.
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
    samples: Vec<u32>,
    trials: u32,
    pixels: &str,
    seed: u64,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Tables> {
    let estimators = estimators
        .iter()
        .map(|name| parsed::<Estimator>("estimators", name));
    let samplers = samplers
        .iter()
        .map(|name| parsed::<SamplerKind>("samplers", name));
    let spec = StudySpec {
        scenes,
        estimators: estimators.collect::<PyResult<_>>()?,
        samplers: samplers.collect::<PyResult<_>>()?,
        samples,
        trials,
        pixels: parsed("pixels", pixels)?,
        seed,
        ..StudySpec::default()
    };
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
    let pool = pool(threads)?;
    let measured = py.detach(|| measure(&spec, pool.as_deref(), progress.as_ref()));
    measured.map_err(|error| match error.downcast::<PyErr>() {
        Ok(error) => error,
        Err(error) => not_read(&spec.scenes[0], &error),
    })
}

/// Measures a study, unit by unit, and tells `progress` after each.
fn measure(
    spec: &StudySpec,
    pool: Option<&ThreadPool>,
    progress: Option<&Py<PyAny>>,
) -> Result<Tables> {
    let load = |name: &str| {
        let loaded = Library::default().load(name)?;
        if loaded.scene.lights.is_empty() {
            bail!("`{name}` has no lights, and a study measures those of the file");
        }
        Ok(loaded.scene)
    };
    with_work(spec, &load, |work| {
        let planned = work.plan()?;
        let units: Vec<_> = planned.iter().map(|planned| planned.unit.clone()).collect();
        let mut parts: Vec<Option<Vec<u8>>> = vec![None; units.len()];
        let wanted = |k: &usize| matches!(units[*k].piece, Piece::Errors(_));
        let numbers: Vec<usize> = (0..units.len()).filter(wanted).collect();
        for (done, &k) in numbers.iter().enumerate() {
            let part = {
                let needed = |each: &mut dyn FnMut(usize, Vec<u8>) -> Result<()>| {
                    let mut needs = planned[k].needs.clone();
                    needs.try_for_each(|k| each(k, parts[k].clone().context("a part is missing")?))
                };
                let compute = || work.compute(&units, k, &needed);
                match pool {
                    Some(pool) => pool.install(compute),
                    None => compute(),
                }?
            };
            parts[k] = Some(part);
            Python::attach(|py| {
                py.check_signals()?;
                let told = progress.map(|progress| progress.call1(py, (done + 1, numbers.len())));
                told.transpose()
            })?;
        }
        tables(spec, work, &units, &parts)
    })
}

/// The tables of what was measured.
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
