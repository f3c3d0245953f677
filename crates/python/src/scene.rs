//! Scenes of triangles, and what points ask of them.

use crate::arrays::{Kept, Rows, Vectors, out, shape_text, triangles, vector};
use crate::errors::{NAMED, Named, of_query, of_scene, shown, value_error, warn_if_coarse, whole};
use crate::light::{Light, kind};
use crate::lit::{Latest, Method, lights, one_light};
use crate::pickle::{Reduced, reduced};
use crate::receivers::{AT_ONCE, Receivers, from};
use crate::reflection::reflections;
use crate::threads::{alone, detached};
use linelit::geometry::{ConvexPolygon, DVec3, Margins, Vector3};
use linelit::lights::Light as RustLight;
use linelit::visibility::VisibleLines;
use linelit::{Error, Measure, Rings, Scene as RustScene};
use numpy::{IntoPyArray as _, PyArray1, PyArrayMethods as _};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Triangles that hide light, in a hierarchy that is built once.
///
/// Parameters
/// ----------
/// vertices : (n, 3) array
///     Positions, up to 2⁶⁰. Those of float64 are rounded to float32 once, relative to the middle
///     of those that faces use, so that scenes at map coordinates are as good as others.
/// faces : (m, 3) array of int
///     The vertices of each triangle, from 0. Both sides hide light; triangles without area hide
///     nothing.
/// surface_offset : float, optional
///     The distance by which points are lifted off their surface, along the normal, before
///     irradiance is computed: 2⁻⁴⁶ of the point's largest coordinate if none is given, which is
///     for points that were computed in float64, and more where rounding moved the point's own
///     face above it. Points in float32 need some 1e-6 of the coordinates.
/// light_margin : float, optional
///     The fraction of the way from a light within which triangles hide nothing. If none is given,
///     it is 1e-10, and 1e-6 for a light in whose plane triangles lie that rounding may have moved
///     before it, such as a lamp in a ceiling.
/// threads : int, optional
///     Threads that build the hierarchy, all cores if none is given.
///
/// Raises
/// ------
/// ValueError, TypeError
///     If an array has a wrong shape or type, a vertex is not finite, or a face names a vertex
///     that does not exist: with its index.
///
/// Warns
/// -----
/// UserWarning
///     If rounding moves a vertex by more than a thousandth of the median edge.
///
/// Notes
/// -----
/// A scene can be pickled, and so handed to other processes, by its arrays, of which it keeps a
/// copy; the hierarchy is built anew there.
///
/// Examples
/// --------
/// >>> import linelit as ll
/// >>> ll.Scene([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
/// <linelit.Scene: 1 triangles>
#[pyclass(frozen, module = "linelit")]
pub(crate) struct Scene {
    bare: RustScene,
    lit: Latest,
    made: Made,
}

/// What a scene was made of.
struct Made {
    vertices: Kept,
    faces: Vec<[u32; 3]>,
    surface_offset: Option<f64>,
    light_margin: Option<f64>,
}

/// Both ends of intervals, and the first of each line.
type Intervals<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
);

/// The scene of triangles without lights.
fn built<V: Vector3 + Copy + Sync>(
    vertices: &[V],
    faces: &[[u32; 3]],
    surface_offset: Option<f64>,
    light_margin: Option<f64>,
) -> Result<RustScene, Error> {
    let mut builder = RustScene::builder_from(vertices, faces);
    if let Some(offset) = surface_offset {
        builder = builder.surface_offset(offset);
    }
    if let Some(light) = light_margin {
        builder = builder.margins(Margins {
            light,
            ..Margins::DEFAULT
        });
    }
    builder.build()
}

/// An array of this shape with three channels for each point, or the one number that they are.
fn colours<'py>(
    py: Python<'py>,
    found: Vec<[f64; 3]>,
    is_single: bool,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    if is_single {
        let numbers: Vec<f64> = found.into_iter().map(|[first, ..]| first).collect();
        return out(py, numbers, shape);
    }
    out(py, found.into_flattened(), &[shape, &[3]].concat())
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (vertices, faces, *, surface_offset = None, light_margin = None, threads = None))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        surface_offset: Option<f64>,
        light_margin: Option<f64>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let vertices = Vectors::list("vertices", vertices)?;
        let faces = triangles("faces", faces)?;
        let faces = faces.as_slice()?.as_chunks::<3>().0;
        let rows = vertices.rows()?;
        let built = detached(py, faces.len(), threads, || match rows {
            Rows::Single(rows) => built(rows, faces, surface_offset, light_margin),
            Rows::Double(rows) => built(rows, faces, surface_offset, light_margin),
        })?;
        let bare = built.map_err(|e| value_error(of_scene(&e)))?;
        warn_if_coarse(py, bare.occluders().rounding())?;
        Ok(Self {
            bare,
            lit: Latest::default(),
            made: Made {
                vertices: vertices.rows()?.into(),
                faces: faces.to_vec(),
                surface_offset,
                light_margin,
            },
        })
    }

    /// Compute the irradiance at points, past all triangles.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces, none of an empty list. Arrays of float32 and float64 are taken as
    ///     they are.
    /// normals : (…, 3) array
    ///     The normal of each point, of any length but zero, or one for all.
    /// light : Light or list of Light
    ///     The lights, of which the sum is taken: zero of an empty list.
    /// method : str
    ///     ``"hybrid"`` chooses the method that is expected to be the cheapest at each point;
    ///     ``"exact"`` integrates over the visible part of polygons, lines, points and parallel
    ///     light without noise;
    ///     ``"line-analytic"``, ``"point-solid-angle"`` and others are those of the program
    ///     (``linelit list estimators``).
    /// samples : int
    ///     Samples for each point and light, where the method takes any.
    /// seed : int
    ///     From 0 to 2⁶⁴ − 1. Two seeds give independent noise. A point's noise depends on the
    ///     seed, its position and its normal alone.
    /// sampler : str
    ///     The sampling pattern, such as ``"stratified"`` or ``"sobol"``.
    /// threads : int, optional
    ///     All cores if none is given. No bit of the result depends on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…, 3), or (…) where each radiance is one number
    ///     Irradiance in W/m².
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not valid, with its name, index and value, or ``"exact"`` has noise
    ///     for a light.
    ///
    /// Notes
    /// -----
    /// Exact answers are Lambert's formula over the boundary of the visible part (Billen and Dutré
    /// 2016 have it along lines). Results are those of the Rust library to the bit.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, linelit as ll
    /// >>> scene = ll.Scene(np.zeros((0, 3)), np.zeros((0, 3), int))
    /// >>> lamp = ll.Rectangle([-1, -1, 1], [0, 2, 0], [2, 0, 0], radiance=1.0)
    /// >>> E = scene.irradiance(np.zeros((4, 3)), [0, 0, 1], lamp, method="exact")
    /// >>> E.round(12)
    /// array([1.7408395, 1.7408395, 1.7408395, 1.7408395])
    #[pyo3(signature = (points, normals, light, *, method = "hybrid", samples = 16, seed = 0, sampler = "auto", threads = None))]
    #[allow(clippy::too_many_arguments, reason = "keywords of Python")]
    fn irradiance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        normals: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        method: &str,
        samples: i128,
        seed: i128,
        sampler: &str,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Read the arguments.
        let (method, seed) = (Method::new(method, samples, sampler)?, whole("seed", seed)?);
        let points = Vectors::new("points", points)?;
        let normals = Vectors::new("normals", normals)?;
        let asked = Receivers::new(&points, &normals)?;
        let lights = lights(light)?;
        let is_single = lights.iter().all(|light| light.get().is_single);
        // Compute without the interpreter's lock.
        let scene = self
            .lit
            .get(py, &self.bare, lights, method)?
            .with_seed(seed);
        let mut found = vec![[0.0; 3]; asked.points.len()];
        asked.detached(py, threads, || asked.irradiances(&scene, &mut found))?;
        colours(py, found, is_single, &points.shape)
    }

    /// Compute the radiance that points reflect to their viewers, past all triangles.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces, none of an empty list.
    /// normals : (…, 3) array
    ///     The normal of each point, of any length but zero, or one for all.
    /// bsdf : Reflection or list of Reflection
    ///     How the surface reflects light: one for all points, or one for each, in the order of
    ///     the flattened points.
    /// outgoing : (…, 3) array
    ///     The direction from each point to its viewer, on the side of the normal, of any length
    ///     but zero; or one for all.
    /// light : Light or list of Light
    ///     The lights, of which the sum is taken: zero of an empty list.
    /// method : str
    ///     As for `irradiance`. ``"exact"`` has no noise where the reflection is diffuse; of other
    ///     reflections it samples what has no closed form.
    /// samples : int
    ///     Samples for each point and light, where the method takes any.
    /// seed : int
    ///     From 0 to 2⁶⁴ − 1. Two seeds give independent noise.
    /// sampler : str
    ///     The sampling pattern, such as ``"stratified"`` or ``"sobol"``.
    /// threads : int, optional
    ///     All cores if none is given. No bit of the result depends on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…, 3), or (…) where colours and radiances are one number each
    ///     Radiance in W/(m² sr).
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     If an argument is not valid: with its index and value.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> import numpy as np
    /// >>> scene = ll.Scene(np.zeros((0, 3)), np.zeros((0, 3), int))
    /// >>> lamp = ll.Rectangle([-1, -1, 1], [0, 2, 0], [2, 0, 0], radiance=1.0)
    /// >>> up = [0, 0, 1]
    /// >>> L = scene.radiance([0, 0, 0], up, ll.Lambert(0.5), up, lamp, method="exact")
    /// >>> E = scene.irradiance([0, 0, 0], up, lamp, method="exact")
    /// >>> bool(np.isclose(L, 0.5 / np.pi * E, rtol=1e-14))
    /// True
    #[pyo3(signature = (points, normals, bsdf, outgoing, light, *, method = "hybrid", samples = 16, seed = 0, sampler = "auto", threads = None))]
    #[allow(clippy::too_many_arguments, reason = "keywords of Python")]
    fn radiance<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        normals: &Bound<'py, PyAny>,
        bsdf: &Bound<'py, PyAny>,
        outgoing: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        method: &str,
        samples: i128,
        seed: i128,
        sampler: &str,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // Read the arguments.
        let (method, seed) = (Method::new(method, samples, sampler)?, whole("seed", seed)?);
        let points = Vectors::new("points", points)?;
        let normals = Vectors::new("normals", normals)?;
        let outgoing = Vectors::new("outgoing", outgoing)?;
        let asked = Receivers::new(&points, &normals)?;
        if !outgoing.shape.is_empty() && outgoing.shape != points.shape {
            let (points, outgoing) = (shape_text(&points.shape), shape_text(&outgoing.shape));
            return Err(value_error(format!(
                "points are {points} vectors, outgoing {outgoing}: each point needs one"
            )));
        }
        let (lights, reflections) = (lights(light)?, reflections(bsdf, asked.points.len())?);
        let is_single = lights.iter().all(|light| light.get().is_single)
            && reflections.iter().all(|one| one.get().is_single);
        let bsdfs: Vec<_> = reflections.iter().map(|one| one.get().bsdf()).collect();
        // Compute without the interpreter's lock.
        let scene = self
            .lit
            .get(py, &self.bare, lights, method)?
            .with_seed(seed);
        let mut found = vec![[0.0; 3]; asked.points.len()];
        let to_viewer = outgoing.rows()?;
        asked.detached(py, threads, || {
            asked.radiances(&scene, &bsdfs, to_viewer, &mut found)
        })?;
        colours(py, found, is_single, &points.shape)
    }

    /// Compute the share of a light that points see, past all triangles, without noise.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces. Arrays of float32 and float64 are taken as they are.
    /// light : Light
    ///     A polygon, a disk, a sphere, a line, a point or parallel light. A sphere is seen as the
    ///     flat disk of its outline.
    /// measure : str
    ///     ``"area"`` (of a line, its length), ``"solid-angle"``, or ``"cosine"``: the share of the
    ///     irradiance that it would cause unshadowed.
    /// normals : (…, 3) array, optional
    ///     The normals, for ``"cosine"`` alone.
    /// threads : int, optional
    ///     All cores if none is given. No bit of the result depends on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…)
    ///     Between 0 and 1. NaN where the whole light measures nothing: from a point in its plane
    ///     or inside a sphere, or below the horizon of the normal.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not valid, the light has no exact answer, or a triangle reaches into a
    ///     sphere.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> scene = ll.Scene([[0, -6, 1], [12, 0, 1], [0, 6, 1]], [[0, 1, 2]])
    /// >>> lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=1.0)
    /// >>> float(scene.visible_fraction([0, 0, 0], lamp))
    /// 0.5
    #[pyo3(signature = (points, light, *, measure = "area", normals = None, threads = None))]
    fn visible_fraction<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        measure: &str,
        normals: Option<&Bound<'py, PyAny>>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let points = Vectors::new("points", points)?;
        let normals = normals.map(|n| Vectors::new("normals", n)).transpose()?;
        let measured = match (measure, &normals) {
            ("area", None) => Measure::Area,
            ("solid-angle", None) => Measure::SolidAngle,
            ("cosine", Some(_)) => Measure::Cosine(DVec3::Z),
            ("cosine", None) => return Err(value_error("measure=\"cosine\" needs normals")),
            ("area" | "solid-angle", Some(_)) => {
                let what = format!("measure=\"{measure}\" takes no normals; \"cosine\" does");
                return Err(value_error(what));
            }
            _ => {
                return Err(value_error(format!(
                    "measure is \"{measure}\", and needs \"area\", \"solid-angle\" or \"cosine\""
                )));
            }
        };
        let asked = Receivers::new(&points, normals.as_ref().unwrap_or(&points))?;
        let scene = self
            .lit
            .get(py, &self.bare, one_light(light)?, Method::plain())?;
        let mut found = vec![0.0; asked.points.len()];
        let measure = |i: usize| match measured {
            Measure::Cosine(_) => Measure::Cosine(asked.normal(i)),
            plain => plain,
        };
        asked.detached(py, threads, || asked.fractions(&scene, measure, &mut found))?;
        out(py, found, &points.shape)
    }

    /// Find the visible part of a polygon, a disk or a sphere.
    ///
    /// Parameters
    /// ----------
    /// point : (…, 3) array
    ///     The points that see it.
    /// light : Light
    ///     A polygon, a disk or a sphere, which is seen as the flat disk of its outline.
    /// threads : int, optional
    ///     All cores if none is given. No bit of the result depends on it.
    ///
    /// Returns
    /// -------
    /// list of ndarray of float64, shape (k, 3), or of more than one point a list of such lists
    ///     Rings of corners: those around the visible part run counter-clockwise as the point sees
    ///     them, those around holes clockwise. Empty where nothing is visible, as of a sphere from
    ///     inside. Corners on the rim of a disk are at most a 256th of it apart: chords are within
    ///     7.6e-5 of the radius of their arcs.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a point is not finite, the light is of another kind, or a triangle reaches into a
    ///     sphere.
    #[pyo3(signature = (point, light, *, threads = None))]
    fn visible_polygons<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'py, PyAny>,
        light: &Bound<'py, PyAny>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyList>> {
        // Find the rings of each point without the interpreter's lock.
        let points = Vectors::new("point", point)?;
        let rows = points.rows()?;
        let scene = self
            .lit
            .get(py, &self.bare, one_light(light)?, Method::plain())?;
        let found = detached(py, rows.len(), threads, || match rows {
            Rows::Single(rows) => scene.visible_polygons_each(rows, 0),
            Rows::Double(rows) => scene.visible_polygons_each(rows, 0),
        })?;
        let names = Named {
            points: "point",
            ..NAMED
        };
        let found = found.map_err(|e| of_query(e, names, |i| [rows.get(i); 2]))?;
        // Make arrays of them: a list of rings for one point, a list of such lists for many.
        let array = |ring: Vec<[f64; 3]>| {
            let count = ring.len();
            PyArray1::from_vec(py, ring.into_flattened()).reshape([count, 3])
        };
        let mut each = found.into_iter().map(|rings: Rings| {
            let rings: Vec<_> = rings.into_iter().map(array).collect::<PyResult<_>>()?;
            PyList::new(py, rings)
        });
        match (points.shape.is_empty(), each.next()) {
            (true, Some(only)) => only,
            (_, first) => PyList::new(
                py,
                first
                    .into_iter()
                    .chain(each)
                    .collect::<PyResult<Vec<_>>>()?,
            ),
        }
    }

    /// Find the visible parts of lines.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     The points that see them.
    /// lines : (…, 2, 3) array
    ///     Both ends of a line for each point. One point sees many lines, and one line may be for
    ///     all.
    /// threads : int, optional
    ///     All cores if none is given. No bit of the result depends on it.
    ///
    /// Returns
    /// -------
    /// lo, hi : ndarray of float64
    ///     The ends of all visible parts, as parameters of their line from 0 to 1, ascending.
    /// offsets : ndarray of int64, shape (n + 1,)
    ///     The parts of line ``i`` are ``lo[offsets[i]:offsets[i + 1]]``.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not valid.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> scene = ll.Scene([[0, -6, 1], [12, 0, 1], [0, 6, 1]], [[0, 1, 2]])
    /// >>> scene.visible_intervals([0, 0, 0], [[-1, 0, 2], [1, 0, 2]])
    /// (array([0.]), array([0.5]), array([0, 1]))
    #[pyo3(signature = (points, lines, *, threads = None))]
    fn visible_intervals<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        lines: &Bound<'py, PyAny>,
        threads: Option<usize>,
    ) -> PyResult<Intervals<'py>> {
        let points = Vectors::new("points", points)?;
        let lines = Vectors::new("lines", lines)?;
        let shape = match lines.shape.split_last() {
            Some((2, shape)) => shape,
            // An empty list has lost its other axes.
            Some((0, [])) => &lines.shape,
            _ => {
                let what = "lines need the shape (…, 2, 3): both ends of each";
                return Err(value_error(what));
            }
        };
        let count = match (points.shape.as_slice(), shape) {
            (a, b) if a == b => points.rows()?.len(),
            ([], b) => b.iter().product(),
            (a, []) => a.iter().product(),
            (a, b) => {
                let (a, b) = (shape_text(a), shape_text(b));
                return Err(value_error(format!("points are {a} vectors, lines {b}")));
            }
        };
        let (rows, ends) = (points.rows()?, lines.rows()?);
        let point = |i: usize| rows.get(if points.shape.is_empty() { 0 } else { i });
        let line = |i: usize| {
            let i = if shape.is_empty() { 0 } else { i };
            [ends.get(2 * i), ends.get(2 * i + 1)]
        };
        let mut found = VisibleLines::new();
        let work = || {
            for first in (0..count).step_by(AT_ONCE) {
                let range = first..count.min(first + AT_ONCE);
                let points: Vec<_> = range.clone().map(point).collect();
                let lines: Vec<_> = range.map(line).collect();
                let visible = self.bare.visible_intervals(&points, &lines);
                found.append(&visible.map_err(|e| from(first, e))?);
            }
            Ok(())
        };
        let error = |e| match e {
            Error::Point(i) => {
                let [from, to] = line(i).map(shown);
                let point = shown(point(i));
                value_error(format!(
                    "points[{i}] = {point} or lines[{i}] = [{from}, {to}] is not finite, or \
                     beyond 2^60"
                ))
            }
            other => value_error(of_scene(&other)),
        };
        detached(py, count, threads, work)?.map_err(error)?;
        let (mut low, mut high, mut offsets) = (Vec::new(), Vec::new(), vec![0_i64]);
        for i in 0..count {
            low.extend(found.line(i).iter().map(|part| part.lo));
            high.extend(found.line(i).iter().map(|part| part.hi));
            offsets.push(low.len().try_into().unwrap_or(i64::MAX));
        }
        Ok((
            low.into_pyarray(py),
            high.into_pyarray(py),
            offsets.into_pyarray(py),
        ))
    }

    /// Find the triangles that meet the space between a point and a polygon, their convex hull.
    ///
    /// Parameters
    /// ----------
    /// point : (3,) array
    ///     The point.
    /// polygon : Light or (k, 3) array
    ///     A polygon, or the corners of a flat, convex one.
    ///
    /// Returns
    /// -------
    /// ndarray of uint32
    ///     The numbers of the triangles, ascending. Those that touch the space count; those without
    ///     area do not.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the point is not finite or the corners make no polygon.
    fn between<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'py, PyAny>,
        polygon: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let point = vector("point", point)?;
        if !point.is_finite() {
            let point = shown(point.to_array());
            return Err(value_error(format!("point is not finite: {point}")));
        }
        let polygon = match polygon.cast::<Light>() {
            Ok(light) => match &light.get().light {
                RustLight::Area(area) => area.polygon,
                other => {
                    let what = format!("polygon is a {}, and needs corners", kind(other));
                    return Err(PyTypeError::new_err(what));
                }
            },
            Err(_) => {
                let corners = Vectors::new("polygon", polygon)?;
                let rows = corners.rows()?;
                let corners: Vec<_> = (0..rows.len()).map(|i| rows.get(i)).collect();
                ConvexPolygon::new(&corners).map_err(|e| value_error(format!("polygon: {e}")))?
            }
        };
        let found = alone(py, || self.bare.occluders().between(point, &polygon))?;
        Ok(found.into_pyarray(py))
    }

    /// The number of triangles.
    #[getter]
    const fn face_count(&self) -> usize {
        self.made.faces.len()
    }

    /// The bytes that the hierarchy takes.
    #[getter]
    fn memory(&self) -> usize {
        self.bare.occluders().memory()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let Made {
            vertices, faces, ..
        } = &self.made;
        let indices = faces.as_flattened().to_vec();
        let arguments = vec![vertices.array(py)?, out(py, indices, &[faces.len(), 3])?];
        let options = PyDict::new(py);
        options.set_item("surface_offset", self.made.surface_offset)?;
        options.set_item("light_margin", self.made.light_margin)?;
        reduced(py, "Scene", arguments, options)
    }

    /// Return this scene itself: scenes cannot be changed, so that a copy would be equal.
    const fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Scenes cannot be changed: a copy is the scene itself.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<linelit.Scene: {} triangles>", self.face_count())
    }
}
