//! The class `ViewFactors` of Python: facets, and the view factors between them and from points.

use crate::arrays::{Vectors, out, polygons};
use crate::errors::{NAMED, of_query, of_scene, shown, value_error, warn_if_coarse};
use crate::light::positive;
use crate::pickle::{Reduced, reduced};
use crate::receivers::Receivers;
use crate::threads::{alone, detached, watched};
use linelit::Error;
use linelit::geometry::{DVec3, predicates};
use linelit::viewfactors::{FacetError, Facets, Memory, Sides};
use numpy::{IntoPyArray as _, PyArray1};
use pyo3::IntoPyObjectExt as _;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyType};
use rayon::prelude::*;

/// Facets that exchange radiation and cast shadows on each other.
///
/// A view factor is the fraction of the radiation leaving one facet, uniformly and diffusely, that
/// reaches another facet directly. The fraction that no facet receives goes to the sky.
///
/// Parameters
/// ----------
/// vertices : (n, 3) array
///     Positions, with coordinates up to 2⁶⁰.
/// polygons : (m, k) array of int, or list of sequences of int
///     The vertices of each facet, counted from 0: 3 to 16 corners of a flat and convex polygon.
///     A list may mix triangles, quadrangles and others.
/// sides : int
///     1 if facets send and receive on the side from which their corners run counter-clockwise, 2
///     if they do on both. Both sides cast shadows in either case. With 2, a factor is the fraction
///     of the radiation that leaves both sides together.
///
/// Raises
/// ------
/// ValueError, TypeError
///     If an array has a wrong shape or type, a vertex is not finite, or a facet is not flat, not
///     convex or without area. The message has its index.
///
/// Notes
/// -----
/// Coordinates are rounded to float32 once, relative to the middle of all vertices that polygons
/// use. `displacement` is the largest distance by which that moved a vertex, and there is a warning
/// if it is more than a thousandth of the median edge. Factors from points to a facet that is not
/// much wider than this distance have no correct digits. Where facets overlap in one plane, only
/// the one with the lowest number counts.
///
/// Examples
/// --------
/// Two unit squares face each other, and a square of half their side is between them.
///
/// >>> import linelit as ll
/// >>> low = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
/// >>> high = [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]
/// >>> between = [[0, 0, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0.5], [0, 0.5, 0.5]]
/// >>> v = ll.ViewFactors(low + high + between, [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]])
/// >>> v, len(v), v.area
/// (<linelit.ViewFactors: 3 facets>, 3, array([1.  , 1.  , 0.25]))
/// >>> round(v.between(0, 1, tolerance=1e-7).value, 6)
/// 0.149869
#[pyclass(frozen, module = "linelit")]
pub(crate) struct ViewFactors {
    facets: Facets,
    /// The arguments that the facets were made from, for pickling.
    positions: Vec<[f64; 3]>,
    polygons: Vec<Vec<u32>>,
    sides: i64,
}

/// The largest number of pieces into which the work of a call is divided among threads.
const PIECES: usize = 1024;

#[pymethods]
impl ViewFactors {
    #[new]
    #[pyo3(signature = (vertices, polygons, sides = 1))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        polygons: &Bound<'_, PyAny>,
        sides: i64,
    ) -> PyResult<Self> {
        // Read the arguments.
        let vertices = Vectors::list("vertices", vertices)?;
        let rows = vertices.rows()?;
        let positions: Vec<_> = (0..rows.len()).map(|i| rows.get(i)).collect();
        let polygons = self::polygons("polygons", polygons)?;
        let which = match sides {
            1 => Sides::One,
            2 => Sides::Two,
            other => {
                return Err(value_error(format!(
                    "sides is {other}, and needs to be 1 or 2"
                )));
            }
        };
        // Build the hierarchy without the interpreter's lock.
        let build = || Facets::new(&positions, &polygons, which);
        let built = detached(py, polygons.len(), None, build)?;
        let facets = built.map_err(|e| value_error(not_built(e, positions.len())))?;
        warn_if_coarse(py, facets.rounding())?;
        Ok(Self {
            facets,
            positions,
            polygons,
            sides,
        })
    }

    /// Compute the view factor from one facet to another.
    ///
    /// Parameters
    /// ----------
    /// i, j : int
    ///     The facet that sends, and the one that receives.
    /// tolerance : float
    ///     The absolute error that is allowed. If there are facets between the two, the time is in
    ///     inverse proportion to it.
    ///
    /// Returns
    /// -------
    /// Estimate
    ///     ``value``, and ``error``, a bound of its error. The bound is at most the tolerance,
    ///     unless the adaptive rule reached its limit of evaluations first.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If there is no such facet, or the tolerance is not positive.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    /// >>> wall = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
    /// >>> value, error = ll.ViewFactors(square + wall, [[0, 1, 2, 3], [4, 5, 6, 7]]).between(0, 1)
    /// >>> round(value, 12), error < 1e-4
    /// (0.200043776075, True)
    #[pyo3(signature = (i, j, tolerance = 1e-4))]
    fn between<'py>(
        &self,
        py: Python<'py>,
        i: i64,
        j: i64,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let [i, j] = [self.number("i", i)?, self.number("j", j)?];
        let tolerance = positive("tolerance", tolerance)?;
        let between = || self.facets.between(i, j, tolerance, &mut Memory::default());
        let found = alone(py, between)?;
        named(py, &ESTIMATE, "Estimate")?.call1((found.value, found.error))
    }

    /// Compute the view factors from points to all facets, exactly but for rounding.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     The points that see the facets.
    /// normals : (…, 3) array
    ///     The normal of each point, of any length but zero, or one for all.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// PointFactors
    ///     ``facets``, the factors to all facets, an array of shape (…, m); and ``sky``, of shape
    ///     (…), 1 minus the sum of a point's factors.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not valid, with its name, index and value.
    /// MemoryError
    ///     If there is not enough memory for the factors.
    ///
    /// Notes
    /// -----
    /// A factor is Lambert's sum over the boundary of the visible part of a facet, divided by π.
    /// Points are lifted along their normals by twice `displacement`, so that a point on a facet is
    /// above it.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> roof = [[-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]]
    /// >>> v = ll.ViewFactors(roof, [[0, 1, 2, 3]])
    /// >>> seen = v.from_point([[0, 0, 0], [0, 0, 0.5]], [0, 0, 1])
    /// >>> seen.facets.round(6).tolist(), seen.sky.round(6).tolist()
    /// ([[0.554126], [0.831029]], [0.445874, 0.168971])
    #[pyo3(signature = (points, normals, *, threads = None))]
    #[allow(
        clippy::wrong_self_convention,
        reason = "factors are from a point, as in Rust"
    )]
    fn from_point<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        normals: &Bound<'py, PyAny>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Read and check the points.
        let points = Vectors::new("points", points)?;
        let normals = Vectors::new("normals", normals)?;
        let asked = Receivers::new(&points, &normals)?;
        let checked = (0..asked.points.len()).try_for_each(|i| check(asked.get(i), i));
        checked.map_err(|e| of_query(e, NAMED, |i| asked.get(i)))?;
        // Compute a row of factors for each point.
        let (count, width) = (asked.points.len(), self.facets.len());
        let (mut found, mut sky) = (zeros(count, width)?, vec![1.0; count]);
        let rows = found.par_chunks_exact_mut(width.max(1));
        self.for_each(py, rows.zip(&mut sky), threads, |i, (row, sky), memory| {
            let [point, normal] = asked.get(i);
            let seen = self.facets.from_point(point, normal, memory);
            row.copy_from_slice(&seen.facets);
            *sky = seen.sky;
        })?;
        // Make arrays of them.
        let sky = out(py, sky, &points.shape)?;
        let mut shape = points.shape.clone();
        shape.push(width);
        let facets = out(py, found, &shape)?;
        named(py, &POINT_FACTORS, "PointFactors")?.call1((facets, sky))
    }

    /// Compute the matrix of all view factors, as a sparse matrix in compressed rows.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float
    ///     The absolute error that is allowed in the sum of a row.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// FactorMatrix
    ///     ``data``, ``indices`` and ``indptr`` as ``scipy.sparse.csr_matrix`` takes them,
    ///     ``error``, a bound of the error of each factor, and ``sky``, 1 minus the sum of each
    ///     row.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the tolerance is not positive.
    ///
    /// Notes
    /// -----
    /// The factors of two facets are reciprocal: area times factor is computed once for both
    /// directions, so that the two products differ by the rounding of the division alone.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    /// >>> wall = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
    /// >>> m = ll.ViewFactors(square + wall, [[0, 1, 2, 3], [4, 5, 6, 7]]).matrix(1e-6)
    /// >>> m.data.round(5), m.indices.tolist(), m.indptr.tolist()
    /// (array([0.20004, 0.20004]), [1, 0], [0, 1, 2])
    /// >>> # scipy.sparse.csr_matrix((m.data, m.indices, m.indptr), shape=(2, 2))
    #[pyo3(signature = (tolerance = 1e-4, *, threads = None))]
    fn matrix<'py>(
        &self,
        py: Python<'py>,
        tolerance: f64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Compute without the interpreter's lock.
        let tolerance = positive("tolerance", tolerance)?;
        let found = watched(py, threads, || self.facets.matrix(tolerance), |_| Ok(()))?;
        // Convert the indices to the types of scipy.
        #[allow(
            clippy::cast_possible_wrap,
            reason = "facets have 3 corners of 2³² vertices"
        )]
        let indices: Vec<_> = found.indices.into_iter().map(|i| i as i32).collect();
        let ends = found
            .indptr
            .into_iter()
            .map(|end| i64::try_from(end).unwrap_or(i64::MAX));
        let ends: Vec<_> = ends.collect();
        named(py, &FACTOR_MATRIX, "FactorMatrix")?.call1((
            found.data.into_pyarray(py),
            indices.into_pyarray(py),
            ends.into_pyarray(py),
            found.error.into_pyarray(py),
            found.sky.into_pyarray(py),
        ))
    }

    /// Compute the fraction of each facet's area that parallel light reaches, exactly but for
    /// rounding.
    ///
    /// Parameters
    /// ----------
    /// direction : (…, 3) array
    ///     Towards the light, such as the sun, of any length but zero.
    /// i : int, optional
    ///     The number of one facet; the default is all facets.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…, m), or (…) where ``i`` is given
    ///     Between 0 and 1; 0 where a facet faces away from the light. Where facets have two sides,
    ///     it is the fraction of the side that faces the light.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a direction is zero or not finite, or there is no such facet.
    /// MemoryError
    ///     If there is not enough memory for the result.
    ///
    /// Examples
    /// --------
    /// A plate hangs over a quarter of a floor.
    ///
    /// >>> import linelit as ll
    /// >>> floor = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
    /// >>> plate = [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    /// >>> v = ll.ViewFactors(floor + plate, [[0, 1, 2, 3], [4, 5, 6, 7]])
    /// >>> v.sunlit([0, 0, 1]), v.sunlit([[0, 0, 1], [2, 0, 1]], 0)
    /// (array([0.75, 1.  ]), array([0.75, 1.  ]))
    #[pyo3(signature = (direction, i = None, *, threads = None))]
    fn sunlit<'py>(
        &self,
        py: Python<'py>,
        direction: &Bound<'py, PyAny>,
        i: Option<i64>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Read and check the directions and the facet.
        let directions = Vectors::new("direction", direction)?;
        let rows = directions.rows()?;
        let bad = |i: &usize| predicates::normalize(DVec3::from(rows.get(*i))).is_none();
        if let Some(k) = (0..rows.len()).find(bad) {
            let value = shown(rows.get(k));
            return Err(value_error(format!(
                "direction[{k}] is zero or not finite: {value}"
            )));
        }
        let only = i.map(|i| self.number("i", i)).transpose()?;
        // Compute the fraction of each facet for each direction.
        let width = only.map_or(self.facets.len(), |_| 1);
        let mut found = zeros(rows.len(), width)?;
        self.for_each(py, found.par_iter_mut(), threads, |k, share, memory| {
            let facet = only.unwrap_or(k % width);
            *share = self.facets.sunlit(facet, rows.get(k / width), memory);
        })?;
        let mut shape = directions.shape.clone();
        shape.extend(only.is_none().then_some(width));
        out(py, found, &shape)
    }

    /// The area of one side of each facet.
    #[getter]
    fn area<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let areas: Vec<_> = (0..self.facets.len())
            .map(|i| self.facets.area(i))
            .collect();
        areas.into_pyarray(py)
    }

    /// The largest distance by which rounding to float32 moved a vertex.
    #[getter]
    const fn displacement(&self) -> f64 {
        self.facets.displacement()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let positions = self.positions.as_flattened().to_vec();
        let positions = out(py, positions, &[self.positions.len(), 3])?;
        // Where all facets have the same number of corners, store them as one array, which is read
        // faster.
        let width = self.polygons.first().map_or(0, Vec::len);
        let polygons = match self.polygons.iter().all(|polygon| polygon.len() == width) {
            true => out(py, self.polygons.concat(), &[self.polygons.len(), width])?,
            false => PyList::new(py, &self.polygons)?.into_any(),
        };
        let arguments = vec![positions, polygons, self.sides.into_bound_py_any(py)?];
        reduced(py, "ViewFactors", arguments, PyDict::new(py))
    }

    /// Return this object itself: facets cannot be changed, so that a copy would be equal.
    const fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Return this object itself: facets cannot be changed, so that a copy would be equal.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    const fn __len__(&self) -> usize {
        self.facets.len()
    }

    fn __repr__(&self) -> String {
        format!("<linelit.ViewFactors: {} facets>", self.facets.len())
    }
}

impl ViewFactors {
    /// Checks that the argument `i`, called `name` in the message, is the index of a facet, and
    /// returns it.
    fn number(&self, name: &str, i: i64) -> PyResult<usize> {
        let count = self.facets.len();
        let found = usize::try_from(i).ok().filter(|i| *i < count);
        found.ok_or_else(|| value_error(format!("{name} is {i}, but there are {count} facets")))
    }

    /// Calls `one` with the index of each value, the value and a thread's memory, on all threads.
    fn for_each<T: Send>(
        &self,
        py: Python<'_>,
        values: impl IndexedParallelIterator<Item = T>,
        threads: Option<usize>,
        one: impl Fn(usize, T, &mut Memory) + Sync,
    ) -> PyResult<()> {
        let work = || {
            // Limit the number of pieces of work: once stopped, each unwinds by itself.
            let least = 1 + values.len() / PIECES;
            let all = values.enumerate().with_min_len(least);
            all.for_each_init(Memory::default, |memory, (i, value)| one(i, value, memory));
        };
        watched(py, threads, work, |_| Ok(()))
    }
}

static ESTIMATE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static POINT_FACTORS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
static FACTOR_MATRIX: PyOnceLock<Py<PyType>> = PyOnceLock::new();

/// Returns the class of named tuples called `name` in `_viewfactors.py`, which is imported once.
fn named<'py>(
    py: Python<'py>,
    once: &'static PyOnceLock<Py<PyType>>,
    name: &str,
) -> PyResult<&'py Bound<'py, PyType>> {
    once.import(py, "linelit._viewfactors", name)
}

/// Checks that the point with the index `i` and its normal are valid.
fn check([point, normal]: [[f64; 3]; 2], i: usize) -> Result<(), Error> {
    const LARGEST: f64 = (1_u64 << 60) as f64;
    if !point.iter().all(|x| x.abs() <= LARGEST) {
        return Err(Error::Point(i));
    }
    let is_direction = predicates::normalize(DVec3::from(normal)).is_some();
    is_direction.then_some(()).ok_or(Error::Normal(i))
}

/// Returns a matrix of zeros by rows, or `MemoryError` if there is not enough memory for it.
fn zeros(rows: usize, width: usize) -> PyResult<Vec<f64>> {
    let mut values = Vec::new();
    let room = rows.checked_mul(width).ok_or(());
    let room = room.and_then(|all| values.try_reserve_exact(all).map(|()| all).map_err(drop));
    let all =
        room.map_err(|()| PyMemoryError::new_err(format!("{rows} rows of {width} factors")))?;
    values.resize(all, 0.0);
    Ok(values)
}

/// Returns the message of an error about facets.
fn not_built(error: FacetError, vertices: usize) -> String {
    match error {
        FacetError::Vertex(i) => of_scene(&Error::Vertex(i)),
        FacetError::NoVertex { facet, vertex } => {
            format!("polygons[{facet}] has vertex {vertex}, but there are {vertices} vertices")
        }
        FacetError::NoArea(i) => format!("polygons[{i}] has no area"),
        FacetError::NotFlat(i) => format!("polygons[{i}] is not flat: split it into triangles"),
        FacetError::Crossing(i) => format!("polygons[{i}] crosses or touches itself"),
        FacetError::TooMany => error.to_string(),
    }
}
