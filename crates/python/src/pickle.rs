//! Objects as pickles and other processes take them: by what they were made of.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// What `__reduce__` returns: a function and its arguments, the name of a maker first.
pub(crate) type Reduced<'py> = (
    Bound<'py, PyAny>,
    (String, Bound<'py, PyTuple>, Bound<'py, PyDict>),
);

/// An object that a function of `_linelit` makes, by the arguments of that.
pub(crate) fn reduced<'py>(
    py: Python<'py>,
    by: &str,
    arguments: Vec<Bound<'py, PyAny>>,
    options: Bound<'py, PyDict>,
) -> PyResult<Reduced<'py>> {
    let make = py.import("linelit._pickle")?.getattr("make")?;
    let arguments = PyTuple::new(py, arguments)?;
    Ok((make, (by.to_owned(), arguments, options)))
}
