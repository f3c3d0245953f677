//! Pickling, by which objects also go to other processes: an object is stored as the function that
//! made it and the arguments, and is made anew from them.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The value that `__reduce__` returns: the function `make` of `_pickle.py`, and its arguments: the
/// name of a function of `_linelit`, and the arguments of that by position and by name.
pub(crate) type Reduced<'py> = (
    Bound<'py, PyAny>,
    (String, Bound<'py, PyTuple>, Bound<'py, PyDict>),
);

/// Returns the value of `__reduce__` for an object that the function `by` of `_linelit` makes from
/// these arguments.
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
