//! Lights of a call, and scenes that are kept with them.

use crate::errors::{of_scene, value_error, whole};
use crate::light::{Light, kind};
use crate::threads::alone;
use linelit::lights::Light as RustLight;
use linelit::{Error, Estimator, Scene};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// A scene with lights and a method.
struct Lit {
    lights: Vec<Py<Light>>,
    method: Method,
    scene: Scene,
}

#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Method {
    pub(crate) estimator: String,
    pub(crate) samples: u32,
    pub(crate) sampler: String,
}

/// Scenes with lights that are kept.
const KEPT: usize = 8;

/// The latest scenes with lights and a method.
#[derive(Default)]
pub(crate) struct Latest(Mutex<Vec<Lit>>);

impl Latest {
    /// The scene with lights and a method, which is made once.
    pub(crate) fn get(
        &self,
        py: Python<'_>,
        bare: &Scene,
        lights: Vec<Bound<'_, Light>>,
        method: Method,
    ) -> PyResult<Scene> {
        let locked = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_same = |lit: &Lit| {
            let mut pairs = lit.lights.iter().zip(&lights);
            lit.lights.len() == lights.len()
                && lit.method == method
                && pairs.all(|(a, b)| a.as_ptr() == b.as_ptr())
        };
        if let Some(lit) = locked().iter().find(|lit| is_same(lit)) {
            return Ok(lit.scene.clone());
        }
        let estimator = method.parse()?;
        let sampler = method
            .sampler
            .parse()
            .map_err(|e| value_error(format!("sampler: {e}")))?;
        if method.samples == 0 {
            return Err(value_error("samples is 0, and needs to be at least 1"));
        }
        let all: Vec<RustLight> = lights.iter().map(|l| l.get().light.clone()).collect();
        let scene = alone(py, || {
            let scene = bare.with_sampler(sampler).with_lights(all)?;
            scene.with_method(estimator, method.samples)
        })?;
        let scene = scene.map_err(|e| value_error(not_lit(&e, &lights)))?;
        let mut kept = locked();
        kept.truncate(KEPT - 1);
        let lit = Lit {
            lights: lights.into_iter().map(Bound::unbind).collect(),
            method,
            scene: scene.clone(),
        };
        kept.insert(0, lit);
        Ok(scene)
    }
}

/// The message of lights that were refused.
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
    /// A method as the keywords of a query name it.
    pub(crate) fn new(estimator: &str, samples: i128, sampler: &str) -> PyResult<Self> {
        Ok(Self {
            estimator: estimator.to_owned(),
            samples: whole("samples", samples)?,
            sampler: sampler.to_owned(),
        })
    }

    /// A method that looks at no light beforehand, for queries of geometry.
    pub(crate) fn plain() -> Self {
        Self {
            estimator: "point-area".to_owned(),
            samples: 1,
            sampler: "auto".to_owned(),
        }
    }

    fn parse(&self) -> PyResult<Estimator> {
        let parsed = self.estimator.parse();
        parsed.map_err(|e| value_error(format!("method=\"{}\": {e}", self.estimator)))
    }
}

/// The lights of an argument: one, or a sequence.
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

/// One light.
pub(crate) fn one_light<'py>(given: &Bound<'py, PyAny>) -> PyResult<Vec<Bound<'py, Light>>> {
    let all = lights(given)?;
    match all.len() {
        1 => Ok(all),
        count => Err(value_error(format!(
            "light is a list of {count}, and needs one light"
        ))),
    }
}
