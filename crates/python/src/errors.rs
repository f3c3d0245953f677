//! Errors of linelit as Python's, with the argument, the index and the value.

use linelit::Error;
use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// The names that a function gives its arguments.
#[derive(Clone, Copy)]
pub(crate) struct Named {
    pub(crate) points: &'static str,
    pub(crate) normals: &'static str,
}

/// The names of most functions.
pub(crate) const NAMED: Named = Named {
    points: "points",
    normals: "normals",
};

/// An error of an argument.
pub(crate) fn value_error(what: impl Into<String>) -> PyErr {
    PyValueError::new_err(what.into())
}

/// A vector as messages show it.
pub(crate) fn shown([x, y, z]: [f64; 3]) -> String {
    format!("[{x}, {y}, {z}]")
}

/// The error of a query of points.
///
/// `value` gives the point and the normal of a number.
pub(crate) fn of_query(
    error: Error,
    names: Named,
    value: impl Fn(usize) -> [[f64; 3]; 2],
) -> PyErr {
    let Named { points, normals } = names;
    value_error(match error {
        Error::Point(i) => {
            let [point, _] = value(i);
            format!(
                "{points}[{i}] is not finite, or beyond 2^60: {}",
                shown(point)
            )
        }
        Error::Normal(i) => {
            let [_, normal] = value(i);
            format!("{normals}[{i}] is zero or not finite: {}", shown(normal))
        }
        other => of_scene(&other),
    })
}

/// The message of an error that is about no point.
pub(crate) fn of_scene(error: &Error) -> String {
    match error {
        Error::Vertex(i) => format!("vertices[{i}] is not finite, or beyond 2^60"),
        Error::Triangle {
            triangle,
            vertex,
            vertices,
        } => format!("faces[{triangle}] has vertex {vertex}, but there are {vertices} vertices"),
        Error::Light(i) => format!("light {i} is not finite, or without size or direction"),
        Error::NotExact(i) => format!(
            "light {i} has no exact answer: polygons, points and parallel light have one, and \
             lines for all but solid angles and polygons; method=\"hybrid\" and points such as \
             \"point-solid-angle\" take all lights"
        ),
        Error::Setting => {
            "surface_offset is negative or not finite, or light_margin is not in [0, 1)".to_owned()
        }
        other => other.to_string(),
    }
}
