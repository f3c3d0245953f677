//! The class `Scene` of Python: triangles, and queries of light and visibility at points.

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

/// Triangles that cast shadows, in a hierarchy that is built once.
///
/// Parameters
/// ----------
/// vertices : (n, 3) array
///     Positions, with coordinates up to 2⁶⁰. Positions in float64 are rounded to float32 once,
///     relative to the middle of all vertices that faces use, so that scenes at map coordinates
///     lose no precision.
/// faces : (m, 3) array of int
///     The vertices of each triangle, counted from 0. Triangles cast shadows from both sides;
///     triangles without area cast none.
/// surface_offset : float, optional
///     The distance by which points are lifted off their surface, along the normal, before
///     irradiance is computed. The default is 2⁻⁴⁶ of the point's largest coordinate, which suits
///     points that were computed in float64, and more where rounding moved the point's own face
///     above it. Points in float32 need some 1e-6 of the coordinates.
/// light_margin : float, optional
///     The fraction of the way from a light to a point within which triangles hide nothing. The
///     default is 1e-10, and 1e-6 for a light in whose plane there are triangles that rounding may
///     have moved in front of it, such as the ceiling around a lamp.
/// threads : int, optional
///     The number of threads that build the hierarchy. The default is one for each core.
///
/// Raises
/// ------
/// ValueError, TypeError
///     If an array has a wrong shape or type, a vertex is not finite, or a face names a vertex
///     that does not exist. The message has the index.
///
/// Warns
/// -----
/// UserWarning
///     If rounding moves a vertex by more than a thousandth of the median edge.
///
/// Notes
/// -----
/// A scene can be pickled, and so passed to other processes: it has a copy of its arrays, and the
/// other process builds the hierarchy anew.
///
/// Examples
/// --------
/// >>> import linelit as ll
/// >>> ll.Scene([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
/// <linelit.Scene: 1 triangles>
#[pyclass(frozen, module = "linelit")]
pub(crate) struct Scene {
    /// The triangles without lights.
    bare: RustScene,
    /// The latest scenes with lights and a method.
    lit: Latest,
    made: Made,
}

/// The arguments that a scene was made from, for pickling.
struct Made {
    vertices: Kept,
    faces: Vec<[u32; 3]>,
    surface_offset: Option<f64>,
    light_margin: Option<f64>,
}

/// The lower and the upper ends of intervals, and the index of each line's first interval.
type Intervals<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
);

/// Builds a scene of triangles without lights.
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

/// Returns an array of this shape with three channels for each point. If `is_single`, because the
/// arguments had one number for all channels, the array has one number for each point instead.
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
        // Read the arrays.
        let vertices = Vectors::list("vertices", vertices)?;
        let faces = triangles("faces", faces)?;
        let faces = faces.as_slice()?.as_chunks::<3>().0;
        let rows = vertices.rows()?;
        // Build the hierarchy without the interpreter's lock.
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

    /// Compute the irradiance at points, with the shadows of all triangles.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces; an empty list has no points. Arrays of float32 and float64 are not
    ///     copied.
    /// normals : (…, 3) array
    ///     The normal of each point, of any length but zero, or one for all.
    /// light : Light or list of Light
    ///     One light or several, whose light is added up. Without lights the result is zero.
    /// method : str
    ///     ``"hybrid"`` chooses the method that is expected to be the cheapest at each point;
    ///     ``"exact"`` integrates over the visible part of polygons, lines, points and parallel
    ///     light without noise; ``linelit list estimators`` prints the others, such as
    ///     ``"line-analytic"`` and ``"point-solid-angle"``.
    /// samples : int
    ///     The number of samples for each point and light, where the method takes samples.
    /// seed : int
    ///     From 0 to 2⁶⁴ − 1. Two seeds give independent noise. A point's noise depends on the
    ///     seed, its position and its normal alone.
    /// sampler : str
    ///     The sampling pattern, such as ``"stratified"`` or ``"sobol"``.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…, 3), or (…) where each radiance is one number
    ///     Irradiance in W/m².
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If an argument is not valid (the message has its name, index and value), or the method
    ///     is ``"exact"`` and a light has no exact irradiance.
    ///
    /// Notes
    /// -----
    /// ``"exact"`` evaluates Lambert's formula over the boundary of the visible part (Billen and
    /// Dutré 2016 have it along lines). Results are the same as those of the Rust library to the
    /// bit.
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

    /// Compute the radiance that points reflect to their viewers, with the shadows of all
    /// triangles.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces; an empty list has no points.
    /// normals : (…, 3) array
    ///     The normal of each point, of any length but zero, or one for all.
    /// bsdf : Reflection or list of Reflection
    ///     How the surface reflects light: one for all points, or one for each, in the order of
    ///     the flattened points.
    /// outgoing : (…, 3) array
    ///     The direction from each point to its viewer, on the side of the normal, of any length
    ///     but zero; or one for all.
    /// light : Light or list of Light
    ///     One light or several, whose light is added up. Without lights the result is zero.
    /// method : str
    ///     As for `irradiance`. ``"exact"`` has no noise where the reflection is diffuse; for other
    ///     reflections it samples the part that has no closed form.
    /// samples : int
    ///     The number of samples for each point and light, where the method takes samples.
    /// seed : int
    ///     From 0 to 2⁶⁴ − 1. Two seeds give independent noise.
    /// sampler : str
    ///     The sampling pattern, such as ``"stratified"`` or ``"sobol"``.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…, 3), or (…) where colours and radiances are one number each
    ///     Radiance in W/(m² sr).
    ///
    /// Raises
    /// ------
    /// ValueError, TypeError
    ///     If an argument is not valid. The message has its index and value.
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

    /// Compute the fraction of a light that points see between the triangles, without noise.
    ///
    /// Parameters
    /// ----------
    /// points : (…, 3) array
    ///     Points of surfaces. Arrays of float32 and float64 are not copied.
    /// light : Light
    ///     A polygon, a disk, a sphere, a line, a point or parallel light. A sphere is seen as the
    ///     flat disk of its outline.
    /// measure : str
    ///     ``"area"`` (for a line, its length), ``"solid-angle"``, or ``"cosine"``: the fraction of
    ///     the irradiance that the light would cause without shadows.
    /// normals : (…, 3) array, optional
    ///     The normals, for ``"cosine"`` alone.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// ndarray of float64, shape (…)
    ///     Between 0 and 1. NaN where the measure of the whole light is zero: from a point in its
    ///     plane or inside a sphere, or for a light below the horizon of the normal.
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
        // Read the arguments: the cosine needs normals, and other measures take none.
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
        // Compute without the interpreter's lock.
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
    ///     The point that sees the light, or several.
    /// light : Light
    ///     A polygon, a disk, or a sphere, which is seen as the flat disk of its outline.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// list of ndarray of float64, shape (k, 3), or for several points a list of such lists
    ///     Rings of corners. As the point sees them, outer rings run counter-clockwise and rings
    ///     around holes clockwise. The list is empty where no part is visible, such as inside a
    ///     sphere. On the rim of a disk, neighbouring corners are at most a 256th of the circle
    ///     apart, so that chords are within 7.6e-5 of the radius from their arcs.
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
    ///     The points that see the lines.
    /// lines : (…, 2, 3) array
    ///     Both ends of a line for each point. One point may be for all lines, and one line for all
    ///     points.
    /// threads : int, optional
    ///     The number of threads; the default is one for each core. No bit of the result depends
    ///     on it.
    ///
    /// Returns
    /// -------
    /// lo, hi : ndarray of float64
    ///     The lower and upper ends of all visible parts, as parameters of their line from 0 at its
    ///     first end to 1 at its second, in ascending order along each line.
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
        // Read the arguments: a line for each point, or one of either for all of the other.
        let points = Vectors::new("points", points)?;
        let lines = Vectors::new("lines", lines)?;
        let shape = match lines.shape.split_last() {
            Some((2, shape)) => shape,
            // An array from an empty list has one axis only.
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
        // Find the visible parts without the interpreter's lock, some lines at a time.
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
        // Write them to three arrays.
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

    /// Find the triangles that meet the convex hull of a point and a polygon, the space between
    /// them.
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
    ///     The numbers of the triangles, in ascending order. A triangle that touches the space is
    ///     in the list; triangles without area are not.
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
        // Read the point.
        let point = vector("point", point)?;
        if !point.is_finite() {
            let point = shown(point.to_array());
            return Err(value_error(format!("point is not finite: {point}")));
        }
        // Read the polygon, which is a light or an array of corners.
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

    /// The size of the hierarchy in bytes.
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

    /// Return this scene itself: scenes cannot be changed, so that a copy would be equal.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<linelit.Scene: {} triangles>", self.face_count())
    }
}
