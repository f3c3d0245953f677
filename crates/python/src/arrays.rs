//! Arrays of numpy as slices: as they are where type and layout allow, else converted or refused.

use crate::errors::value_error;
use linelit::geometry::DVec3;
use numpy::{Element, PyArrayDescrMethods as _, PyArrayDyn, PyReadonlyArrayDyn};
use numpy::{PyArray1, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};

/// An array of real numbers, in rows one after another.
pub(crate) enum Reals<'py> {
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

/// The rows of an array of vectors.
#[derive(Clone, Copy)]
pub(crate) enum Rows<'a> {
    Single(&'a [[f32; 3]]),
    Double(&'a [[f64; 3]]),
}

/// Vectors of any number of axes before the last, which has three numbers.
pub(crate) struct Vectors<'py> {
    array: Reals<'py>,
    /// The lengths of the other axes.
    pub(crate) shape: Vec<usize>,
}

/// Rows that outlive their array, which others may change.
pub(crate) enum Kept {
    Single(Vec<[f32; 3]>),
    Double(Vec<[f64; 3]>),
}

impl From<Rows<'_>> for Kept {
    fn from(rows: Rows<'_>) -> Self {
        match rows {
            Rows::Single(rows) => Self::Single(rows.to_vec()),
            Rows::Double(rows) => Self::Double(rows.to_vec()),
        }
    }
}

impl Kept {
    /// An array of the rows.
    pub(crate) fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::Single(rows) => out(py, rows.as_flattened().to_vec(), &[rows.len(), 3]),
            Self::Double(rows) => out(py, rows.as_flattened().to_vec(), &[rows.len(), 3]),
        }
    }
}

impl Rows<'_> {
    pub(crate) const fn len(self) -> usize {
        match self {
            Self::Single(rows) => rows.len(),
            Self::Double(rows) => rows.len(),
        }
    }

    pub(crate) fn get(self, i: usize) -> [f64; 3] {
        match self {
            Self::Single(rows) => rows[i].map(f64::from),
            Self::Double(rows) => rows[i],
        }
    }
}

impl<'py> Vectors<'py> {
    /// The vectors of an argument, none of an empty list.
    pub(crate) fn new(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = Reals::new(name, given)?;
        match array.shape().split_last() {
            Some((3, shape)) => Ok(Self {
                shape: shape.to_vec(),
                array,
            }),
            Some((0, [])) => Ok(Self {
                shape: vec![0],
                array,
            }),
            _ => Err(value_error(format!(
                "{name} has the shape {}, and needs (…, 3)",
                shape_text(array.shape())
            ))),
        }
    }

    /// The vectors of an argument of shape (n, 3).
    pub(crate) fn list(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        let vectors = Self::new(name, given)?;
        match vectors.shape.len() {
            1 => Ok(vectors),
            _ => Err(value_error(format!(
                "{name} are {} vectors, and need (n,)",
                shape_text(&vectors.shape)
            ))),
        }
    }

    pub(crate) fn rows(&self) -> PyResult<Rows<'_>> {
        Ok(match &self.array {
            Reals::Single(array) => Rows::Single(array.as_slice()?.as_chunks().0),
            Reals::Double(array) => Rows::Double(array.as_slice()?.as_chunks().0),
        })
    }
}

impl<'py> Reals<'py> {
    /// The numbers of an argument.
    pub(crate) fn new(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Some(array) = as_it_is(given) {
            return Ok(Self::Single(array));
        }
        if let Some(array) = as_it_is(given) {
            return Ok(Self::Double(array));
        }
        let array = any_array(name, given)?;
        match array.dtype().kind() {
            b'f' if array.dtype().itemsize() == 4 => Ok(Self::Single(converted(name, &array)?)),
            b'f' | b'i' | b'u' => Ok(Self::Double(converted(name, &array)?)),
            _ => Err(PyTypeError::new_err(format!(
                "{name} has the type {}, and needs real numbers",
                array.dtype()
            ))),
        }
    }

    pub(crate) fn shape(&self) -> &[usize] {
        match self {
            Self::Single(array) => array.shape(),
            Self::Double(array) => array.shape(),
        }
    }

    /// All numbers in the order of the rows.
    pub(crate) fn to_f64(&self) -> PyResult<Vec<f64>> {
        Ok(match self {
            Self::Single(array) => array.as_slice()?.iter().map(|&x| x.into()).collect(),
            Self::Double(array) => array.as_slice()?.to_vec(),
        })
    }
}

/// Three numbers.
pub(crate) fn vector(name: &str, given: &Bound<'_, PyAny>) -> PyResult<DVec3> {
    let vectors = Vectors::new(name, given)?;
    let found = (vectors.shape.is_empty()).then(|| Ok(vectors.rows()?.get(0).into()));
    found.unwrap_or_else(|| {
        let shape = shape_text(vectors.array.shape());
        Err(value_error(format!(
            "{name} has the shape {shape}, and needs (3,)"
        )))
    })
}

/// A number for all channels, or three numbers; and whether it was one.
pub(crate) fn channels(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(DVec3, bool)> {
    let numbers = Reals::new(name, given)?;
    match (numbers.to_f64()?.as_slice(), numbers.shape()) {
        ([x], []) => Ok((DVec3::splat(*x), true)),
        (&[r, g, b], [3]) => Ok((DVec3::new(r, g, b), false)),
        _ => Err(value_error(format!(
            "{name} has the shape {}, and needs one number or three",
            shape_text(numbers.shape())
        ))),
    }
}

/// The triangles of an argument, by the numbers of their vertices.
pub(crate) fn triangles<'py>(
    name: &str,
    given: &Bound<'py, PyAny>,
) -> PyResult<PyReadonlyArrayDyn<'py, u32>> {
    let found = integers(name, given)?;
    match found.shape() {
        [_, 3] | [0] => Ok(found),
        shape => Err(value_error(format!(
            "{name} has the shape {}, and needs (m, 3): triangles",
            shape_text(shape)
        ))),
    }
}

/// The polygons of an argument, by the numbers of their vertices: an array of two axes, or a
/// sequence of sequences of different lengths.
pub(crate) fn polygons(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<u32>>> {
    if given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        let one = |(i, each): (usize, PyResult<Bound<'_, PyAny>>)| {
            let name = format!("{name}[{i}]");
            let found = integers(&name, &each?)?;
            match found.shape() {
                [_] => Ok(found.as_slice()?.to_vec()),
                shape => Err(value_error(format!(
                    "{name} has the shape {}, and needs (k,): the vertices of a polygon",
                    shape_text(shape)
                ))),
            }
        };
        return given.try_iter()?.enumerate().map(one).collect();
    }
    let found = integers(name, given)?;
    match found.shape() {
        [0] => Ok(Vec::new()),
        &[count, width] => {
            let all = found.as_slice()?;
            let row = |i| all[i * width..(i + 1) * width].to_vec();
            Ok((0..count).map(row).collect())
        }
        shape => Err(value_error(format!(
            "{name} has the shape {}, and needs (m, k): polygons of k corners",
            shape_text(shape)
        ))),
    }
}

/// The numbers of vertices of an argument.
fn integers<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, u32>> {
    if let Some(array) = as_it_is::<u32>(given) {
        return Ok(array);
    }
    let array = any_array(name, given)?;
    match array.dtype().kind() {
        b'i' | b'u' => whole(name, &array),
        _ if array.is_empty() => converted(name, &array),
        _ => Err(PyTypeError::new_err(format!(
            "{name} has the type {}, and needs integers",
            array.dtype()
        ))),
    }
}

/// Integers as `u32`, after a look at their range; those of 32 bits are taken as they are.
fn whole<'py>(
    name: &str,
    array: &Bound<'py, PyUntypedArray>,
) -> PyResult<PyReadonlyArrayDyn<'py, u32>> {
    let short = as_it_is::<i32>(array);
    if short.is_some_and(|all| all.as_slice().is_ok_and(|all| all.iter().all(|x| *x >= 0))) {
        let same = array.call_method1("view", ("uint32",))?;
        if let Some(same) = as_it_is(&same) {
            return Ok(same);
        }
    }
    let wide: PyReadonlyArrayDyn<'_, i64> = converted(name, array)?;
    let bad = |&(_, x): &(usize, &i64)| u32::try_from(*x).is_err();
    if let Some((i, x)) = wide.as_slice()?.iter().enumerate().find(bad) {
        let row = array.shape().get(1).map_or(i, |width| i / width.max(&1));
        return Err(value_error(format!("{name}[{row}] has the vertex {x}")));
    }
    converted(name, array)
}

/// The argument itself, if it is an array of this type in rows one after another.
fn as_it_is<'py, T: Element>(given: &Bound<'py, PyAny>) -> Option<PyReadonlyArrayDyn<'py, T>> {
    let array = given.cast_exact::<PyArrayDyn<T>>().ok()?;
    let is_plain = array.is_c_contiguous() && array.is_aligned();
    is_plain.then(|| array.try_readonly().ok()).flatten()
}

/// An array of another type or layout, as numpy converts it.
fn converted<'py, T: Element>(
    name: &str,
    array: &Bound<'py, PyUntypedArray>,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    if let Some(array) = as_it_is(array) {
        return Ok(array);
    }
    let py = array.py();
    let options = PyDict::new(py);
    options.set_item("dtype", numpy::dtype::<T>(py))?;
    options.set_item("order", "C")?;
    let array = numpy(py)?.call_method("array", (array,), Some(&options))?;
    let found = as_it_is(&array);
    found.ok_or_else(|| PyTypeError::new_err(format!("{name} is no array")))
}

/// Any argument as an array of whatever type it has.
fn any_array<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let refused = |what: String| Err(PyTypeError::new_err(what));
    if given.hasattr("mask")? && given.hasattr("filled")? {
        return refused(format!("{name} is a masked array: fill it first"));
    }
    if given.is_instance_of::<PyString>() || given.is_none() {
        return refused(format!("{name} is {}, and needs numbers", given.repr()?));
    }
    let array = numpy(given.py())?.call_method1("asarray", (given,));
    match array.and_then(|array| Ok(array.cast_into::<PyUntypedArray>()?)) {
        Ok(array) => Ok(array),
        Err(error) => Err(value_error(format!("{name}: {}", error.value(given.py())))),
    }
}

fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = NUMPY.get_or_try_init(py, || Ok::<_, PyErr>(py.import("numpy")?.unbind()))?;
    Ok(module.bind(py))
}

/// A shape as Python writes it.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    let lengths: Vec<_> = shape.iter().map(usize::to_string).collect();
    match lengths.as_slice() {
        [one] => format!("({one},)"),
        many => format!("({})", many.join(", ")),
    }
}

/// Numbers as an array of a shape; a single one as a scalar, as numpy does.
pub(crate) fn out<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let flat = PyArray1::from_vec(py, values);
    let array = flat.reshape(shape.to_vec())?.into_any();
    match shape {
        [] => array.get_item(()),
        _ => Ok(array),
    }
}
