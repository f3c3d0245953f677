//! The conversion of linelit's errors to Python's exceptions, whose messages name the argument, the
//! index and the value.

use linelit::Error;
use linelit::geometry::Rounding;
use pyo3::exceptions::{PyOverflowError, PyUserWarning, PyValueError};
use pyo3::{PyErr, PyResult, PyTypeInfo as _, Python};
use std::fmt::Display;

/// The names of a function's arguments for points and normals, as error messages use them.
#[derive(Clone, Copy)]
pub(crate) struct Named {
    pub(crate) points: &'static str,
    pub(crate) normals: &'static str,
}

/// The names that most functions use.
pub(crate) const NAMED: Named = Named {
    points: "points",
    normals: "normals",
};

/// Returns a `ValueError` with this message.
pub(crate) fn value_error(what: impl Into<String>) -> PyErr {
    PyValueError::new_err(what.into())
}

/// An unsigned integer type that an argument of Python is converted to.
pub(crate) trait Whole: TryFrom<i128> + Display {
    /// The largest value of the type.
    const MOST: Self;
}

impl Whole for u32 {
    const MOST: Self = Self::MAX;
}

impl Whole for u64 {
    const MOST: Self = Self::MAX;
}

/// Converts an argument to an unsigned integer; an `OverflowError` names the argument and the
/// range.
pub(crate) fn whole<T: Whole>(name: &str, x: i128) -> Result<T, PyErr> {
    let most = T::MOST;
    let what = || PyOverflowError::new_err(format!("{name} is {x}, and needs 0 to {most}"));
    T::try_from(x).map_err(|_| what())
}

/// Issues a Python `UserWarning` with this text.
pub(crate) fn warn(py: Python<'_>, what: &impl Display) -> PyResult<()> {
    let text = std::ffi::CString::new(what.to_string())?;
    PyErr::warn(py, &PyUserWarning::type_object(py), &text, 2)
}

/// Warns if rounding to float32 moved vertices far compared with the length of edges.
pub(crate) fn warn_if_coarse(py: Python<'_>, rounding: Rounding) -> PyResult<()> {
    match rounding.is_coarse() {
        true => warn(py, &rounding),
        false => Ok(()),
    }
}

/// Formats a vector as error messages show it.
pub(crate) fn shown([x, y, z]: [f64; 3]) -> String {
    format!("[{x}, {y}, {z}]")
}

/// Converts an error of a query for many points. `value` returns the point and the normal with a
/// given index, for the message.
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

/// Returns the message of an error that concerns the scene and not a point.
pub(crate) fn of_scene(error: &Error) -> String {
    match error {
        Error::Vertex(i) => format!("vertices[{i}] is not finite, or beyond 2^60"),
        Error::Triangle {
            triangle,
            vertex,
            vertices,
        } => format!("faces[{triangle}] has vertex {vertex}, but there are {vertices} vertices"),
        Error::Light(i) => format!("light {i} is not finite, or without size or direction"),
        Error::Pierced { point, light } => format!(
            "a triangle reaches into light {light}, a sphere, as point {point} sees it: what is \
             visible of it is no part of a disk"
        ),
        Error::NotExact(i) => format!(
            "light {i} has no exact answer: polygons, disks, spheres, lines, points and parallel \
             light have a visible fraction (of lines none of the solid angle), and polygons, disks \
             and spheres visible polygons"
        ),
        Error::Setting => {
            "surface_offset is negative or not finite, or light_margin is not in [0, 1)".to_owned()
        }
        other => other.to_string(),
    }
}
