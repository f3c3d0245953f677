//! A cache of scenes with lights and a method. In Python every query names its lights and its
//! method, but preparing a scene for them takes time (the estimator may measure how much hides each
//! light), so that the latest such scenes are stored with the scene of triangles.

use crate::errors::{of_scene, value_error, whole};
use crate::light::{Light, kind};
use crate::threads::alone;
use linelit::lights::Light as RustLight;
use linelit::{Error, Estimator, Scene};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A cached scene with the lights and the method that it was prepared for.
struct PreparedScene {
    lights: Vec<Py<Light>>,
    method: Method,
    scene: Scene,
}

/// The keywords of a query that decide how light is estimated.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Method {
    pub(crate) estimator: String,
    pub(crate) samples: u32,
    pub(crate) sampler: String,
}

/// The largest number of scenes with lights that are cached for each scene of triangles; a new one
/// replaces the oldest.
const KEPT: usize = 8;

/// The cache of the latest scenes with lights and a method, the latest first.
#[derive(Default)]
pub(crate) struct Latest(Mutex<Vec<PreparedScene>>);

impl Latest {
    /// Returns the scene `bare` with these lights and this method, from the cache if it is there.
    /// Two lights are the same if they are the same Python object, as lights cannot be changed.
    pub(crate) fn get(
        &self,
        py: Python<'_>,
        bare: &Scene,
        lights: Vec<Bound<'_, Light>>,
        method: Method,
    ) -> PyResult<Scene> {
        // Look for a cached scene with the same lights and the same method.
        let locked = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |lit: &PreparedScene| {
            let mut pairs = lit.lights.iter().zip(&lights);
            lit.lights.len() == lights.len()
                && lit.method == method
                && pairs.all(|(a, b)| a.as_ptr() == b.as_ptr())
        };
        if let Some(lit) = locked().iter().find(|lit| is_same(lit)) {
            return Ok(lit.scene.clone());
        }
        // Check the method.
        let estimator = method.parse()?;
        let sampler = method
            .sampler
            .parse()
            .map_err(|e| value_error(format!("sampler: {e}")))?;
        if method.samples == 0 {
            return Err(value_error("samples is 0, and needs to be at least 1"));
        }
        // Prepare the scene without the interpreter's lock; the cache is not locked meanwhile.
        let all: Vec<RustLight> = lights.iter().map(|l| l.get().light.clone()).collect();
        let scene = alone(py, || {
            let scene = bare.with_sampler(sampler).with_lights(all)?;
            scene.with_method(estimator, method.samples)
        })?;
        let scene = scene.map_err(|e| value_error(not_lit(&e, &lights)))?;
        // Store it in place of the oldest.
        let mut kept = locked();
        kept.truncate(KEPT - 1);
        let lit = PreparedScene {
            lights: lights.into_iter().map(Bound::unbind).collect(),
            method,
            scene: scene.clone(),
        };
        kept.insert(0, lit);
        Ok(scene)
    }
}

/// Returns the message of an error about lights or a method.
fn not_lit(error: &Error, lights: &[Bound<'_, Light>]) -> String {
    match error {
        Error::NotExact(i) => format!(
            "method=\"exact\" has noise for light {i}, a {}: it is for polygons, lines, points and \
             parallel light; method=\"hybrid\" and points such as \"point-solid-angle\" take all",
            kind(&lights[*i].get().light)
        ),
        other => of_scene(other),
    }
}

impl Method {
    /// Makes a method from the keywords of a query.
    pub(crate) fn new(estimator: &str, samples: i128, sampler: &str) -> PyResult<Self> {
        Ok(Self {
            estimator: estimator.to_owned(),
            samples: whole("samples", samples)?,
            sampler: sampler.to_owned(),
        })
    }

    /// Returns a method for queries about visibility, which estimate no light: one that needs no
    /// measurement of how much hides each light.
    pub(crate) fn plain() -> Self {
        Self {
            estimator: "point-area".to_owned(),
            samples: 1,
            sampler: "auto".to_owned(),
        }
    }

    /// Returns the estimator that the method names.
    fn parse(&self) -> PyResult<Estimator> {
        let parsed = self.estimator.parse();
        parsed.map_err(|e| value_error(format!("method=\"{}\": {e}", self.estimator)))
    }
}

/// Returns the lights of an argument, which is a light or a sequence of lights.
pub(crate) fn lights<'py>(given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, Light>>> {
    let refused = |what: &Bound<'_, PyAny>| {
        let kind = what.get_type();
        PyTypeError::new_err(format!(
            "light is {kind}, and needs a linelit.Light, or a list"
        ))
    };
    if let Ok(light) = given.cast::<Light>() {
        return Ok(vec![light.clone()]);
    }
    let all = given.try_iter().map_err(|_| refused(given))?;
    let each = all.map(|light| {
        let light = light?;
        light
            .cast_into::<Light>()
            .map_err(|e| refused(&e.into_inner()))
    });
    each.collect()
}

/// Returns the light of an argument that has to be one light, as a list of one.
pub(crate) fn one_light<'py>(given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, Light>>> {
    let all = lights(given)?;
    match all.len() {
        1 => Ok(all),
        count => Err(value_error(format!(
            "light is a list of {count}, and needs one light"
        ))),
    }
}
