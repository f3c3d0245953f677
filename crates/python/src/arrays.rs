//! numpy's arrays as slices. An array is used without a copy where its type and layout allow that;
//! other arrays and sequences are converted by numpy, and arguments that are no numbers are refused
//! by messages that name them.

use crate::errors::value_error;
use linelit::geometry::DVec3;
use numpy::{Element, PyArrayDescrMethods as _, PyArrayDyn, PyReadonlyArrayDyn};
use numpy::{PyArray1, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};

/// An array of real numbers in C order, in single or double precision.
pub(crate) enum Reals<'py> {
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

/// The vectors of an array as a slice, in single or double precision.
#[derive(Clone, Copy)]
pub(crate) enum Rows<'a> {
    Single(&'a [[f32; 3]]),
    Double(&'a [[f64; 3]]),
}

/// An array of vectors: the last axis has three numbers, and there may be any other axes before it.
pub(crate) struct Vectors<'py> {
    array: Reals<'py>,
    /// The lengths of the axes before the last.
    pub(crate) shape: Vec<usize>,
}

/// A copy of an array of vectors, for objects that outlive the array, whose owner may change it.
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
    /// Returns the vectors as an array of shape (n, 3).
    pub(crate) fn array<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::Single(rows) => out(py, rows.as_flattened().to_vec(), &[rows.len(), 3]),
            Self::Double(rows) => out(py, rows.as_flattened().to_vec(), &[rows.len(), 3]),
        }
    }
}

impl Rows<'_> {
    /// Returns the number of vectors.
    pub(crate) const fn len(self) -> usize {
        match self {
            Self::Single(rows) => rows.len(),
            Self::Double(rows) => rows.len(),
        }
    }

    /// Returns the vector with the index `i`.
    pub(crate) fn get(self, i: usize) -> [f64; 3] {
        match self {
            Self::Single(rows) => rows[i].map(f64::from),
            Self::Double(rows) => rows[i],
        }
    }
}

impl<'py> Vectors<'py> {
    /// Reads the vectors of an argument of shape (…, 3); an empty list has no vectors.
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

    /// Reads the vectors of an argument of shape (n, 3).
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

    /// Returns all vectors as one slice, in C order.
    pub(crate) fn rows(&self) -> PyResult<Rows<'_>> {
        Ok(match &self.array {
            Reals::Single(array) => Rows::Single(array.as_slice()?.as_chunks().0),
            Reals::Double(array) => Rows::Double(array.as_slice()?.as_chunks().0),
        })
    }
}

impl<'py> Reals<'py> {
    /// Reads the numbers of an argument: float32 stays single precision, all other types of real
    /// numbers become double precision.
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

    /// Returns the lengths of all axes.
    pub(crate) fn shape(&self) -> &[usize] {
        match self {
            Self::Single(array) => array.shape(),
            Self::Double(array) => array.shape(),
        }
    }

    /// Returns all numbers in C order, in double precision.
    pub(crate) fn to_f64(&self) -> PyResult<Vec<f64>> {
        Ok(match self {
            Self::Single(array) => array.as_slice()?.iter().map(|&x| x.into()).collect(),
            Self::Double(array) => array.as_slice()?.to_vec(),
        })
    }
}

/// Reads an argument that is one vector.
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

/// Reads an argument that is one number for all channels or three numbers, and returns the channels
/// and whether it was one number.
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

/// Reads an argument of triangles: an array of shape (m, 3) of indices of vertices.
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

/// Reads an argument of polygons, given by the indices of their vertices: an array of shape (m, k),
/// or a list or tuple of sequences, which may have different lengths.
pub(crate) fn polygons(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<u32>>> {
    // Take the polygons of a list or a tuple one by one.
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
    // Take each row of an array as a polygon.
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

/// Reads an argument of integers that are indices of vertices.
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

/// Converts integers to `u32`, and refuses negative and larger numbers. An array of int32 without
/// negative numbers is viewed as uint32 without a copy.
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

/// Returns the argument itself, if it is an aligned array of this type in C order.
fn as_it_is<'py, T: Element>(given: &Bound<'py, PyAny>) -> Option<PyReadonlyArrayDyn<'py, T>> {
    let array = given.cast_exact::<PyArrayDyn<T>>().ok()?;
    let is_plain = array.is_c_contiguous() && array.is_aligned();
    is_plain.then(|| array.try_readonly().ok()).flatten()
}

/// Converts an array of another type or layout by numpy.
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

/// Converts any argument to an array of its own type by numpy's `asarray`; refuses masked arrays,
/// texts and `None`.
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

/// Returns the module `numpy`, which is imported once.
fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = NUMPY.get_or_try_init(py, || Ok::<_, PyErr>(py.import("numpy")?.unbind()))?;
    Ok(module.bind(py))
}

/// Returns a shape as Python writes it, such as `(2, 3)`.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    let lengths: Vec<_> = shape.iter().map(usize::to_string).collect();
    match lengths.as_slice() {
        [one] => format!("({one},)"),
        many => format!("({})", many.join(", ")),
    }
}

/// Converts numbers to an array of this shape; for the empty shape to a scalar, as numpy does.
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
