//! The functions `sample`, which draws points of lights from random numbers, and `pdf`, which
//! returns their densities.

use crate::arrays::{Reals, Rows, Vectors, out, shape_text};
use crate::errors::{shown, value_error};
use crate::light::{Light, kind};
use crate::threads::alone;
use linelit::geometry::{DVec3, predicates, stop};
use linelit::lights::linear::{LinearSampler, LinearTechnique};
use linelit::lights::{Light as RustLight, LightPoint, LinearPointTechnique as _};
use linelit::lights::{NoTexture, PointDensity, PointSource, Surface, Viewer};
use pyo3::prelude::*;

/// A point of a light, and its density.
type Drawn = ([f64; 3], f64);

/// A light with one of the techniques that sample its points.
#[derive(Clone, Copy)]
enum Technique<'a> {
    Surface(&'a RustLight, PointDensity),
    Line(&'a linelit::lights::LinearLight, LinearTechnique),
}

/// The names that Python has for the densities of points on surfaces.
const DENSITIES: [(&str, PointDensity); 5] = [
    ("area", PointDensity::Area),
    ("visible-area", PointDensity::VisibleArea),
    ("proxy", PointDensity::Proxy),
    ("solid-angle", PointDensity::SolidAngle),
    ("projected-solid-angle", PointDensity::ProjectedSolidAngle),
];

impl<'a> Technique<'a> {
    /// Creates the technique with this name for a light; the error names the techniques that the
    /// light has.
    fn new(light: &'a RustLight, name: &str) -> PyResult<Self> {
        // Collect the names of the light's techniques.
        let known: Vec<&str> = match light {
            RustLight::Linear(line) => {
                let mut all = LinearTechnique::ALL.into_iter();
                if let Some(technique) = all.find(|technique| technique.name() == name) {
                    return Ok(Self::Line(line, technique));
                }
                LinearTechnique::ALL.map(LinearTechnique::name).to_vec()
            }
            surface => {
                let has = |density| surface.densities().contains(density);
                let all = DENSITIES.iter().filter(|(_, density)| has(density));
                all.map(|(name, _)| *name).collect()
            }
        };
        // Take the density of this name, if the light has it.
        let found = DENSITIES
            .iter()
            .find(|(density, _)| *density == name && known.contains(&name));
        match found {
            Some((_, density)) => Ok(Self::Surface(light, *density)),
            None if known.is_empty() => Err(value_error(format!(
                "light is a {}, which has no surface to sample",
                kind(light)
            ))),
            None => Err(value_error(format!(
                "technique is \"{name}\", and needs for a {} one of \"{}\"",
                kind(light),
                known.join("\", \"")
            ))),
        }
    }

    /// Calls `on_surface` or `on_line` with what draws the light's points for a shading point, and
    /// returns the result; `None` where the shading point sees no part of the light.
    fn seen_from<T>(
        self,
        position: DVec3,
        normal: DVec3,
        on_surface: impl FnOnce(&PointSource<'_>, &Surface<'_>) -> Option<T>,
        on_line: impl FnOnce(&LinearSampler) -> Option<T>,
    ) -> Option<T> {
        // Make the sampler of a line.
        let (light, density) = match self {
            Self::Line(line, technique) => {
                let sampler = LinearSampler::new(technique, &line.segment, position, normal);
                return on_line(&sampler?);
            }
            Self::Surface(light, density) => (light, density),
        };
        // Make the sampler of a surface: of the part that the point may see.
        let seen = light.seen_from(position)?;
        let surface = seen.surface();
        let viewer = Viewer {
            position,
            normal,
            geometric_normal: normal,
            cosines: None,
        };
        let source = PointSource::new::<NoTexture>(density, surface, None, &viewer);
        on_surface(&source, &surface)
    }

    /// Draws a point from random numbers, of which lines use only the first, and returns it with
    /// its density; both are zero where no point can be drawn.
    fn sample(self, position: DVec3, normal: DVec3, u: [f64; 2]) -> Drawn {
        let on_surface = |source: &PointSource<'_>, surface: &Surface<'_>| {
            let (at, density) = source.draw(u, surface, position)?;
            Some((at.point.to_array(), density))
        };
        let on_line = |sampler: &LinearSampler| {
            let sample = sampler.sample(u[0]);
            Some(((position + sample.offset).to_array(), sample.pdf.value()))
        };
        let drawn = self.seen_from(position, normal, on_surface, on_line);
        // Return zeros where the density is zero or NaN.
        drawn
            .filter(|(_, pdf)| *pdf > 0.0)
            .unwrap_or(([0.0; 3], 0.0))
    }

    /// Returns the density with which the technique draws `point` on the light from a shading
    /// point; zero where it cannot be drawn.
    fn pdf(self, position: DVec3, normal: DVec3, point: DVec3) -> f64 {
        let on_surface = |source: &PointSource<'_>, surface: &Surface<'_>| {
            Some(source.density(&LightPoint::new(point, position, surface)))
        };
        let on_line = |sampler: &LinearSampler| {
            let Self::Line(line, _) = self else {
                return None;
            };
            let along = line.segment.p1 - line.segment.p0;
            let t = (point - line.segment.p0).dot(along) / along.length_squared();
            Some(sampler.pdf(t.clamp(0.0, 1.0)).value())
        };
        let density = self.seen_from(position, normal, on_surface, on_line);
        density.filter(|pdf| *pdf > 0.0).unwrap_or(0.0)
    }
}

/// The shading points and normals of a call, either of which may be one for all.
struct ShadingPoints<'a> {
    points: Rows<'a>,
    normals: Rows<'a>,
    shape: Vec<usize>,
}

impl<'a> ShadingPoints<'a> {
    /// Checks that all arguments have the same shape, except for those that are one for all. The
    /// third argument has the name `name` and the shape `other`.
    fn new(
        points: &'a Vectors<'_>,
        normals: &'a Vectors<'_>,
        name: &str,
        other: &[usize],
    ) -> PyResult<Self> {
        let shapes = [&points.shape, &normals.shape, other];
        let shape = shapes.into_iter().find(|shape| !shape.is_empty());
        let shape = shape.unwrap_or_default().to_vec();
        if shapes.iter().any(|own| !own.is_empty() && **own != *shape) {
            let [a, b, c] = shapes.map(shape_text);
            return Err(value_error(format!(
                "points are {a}, normals {b} and {name} {c}: each needs the same shape, or one"
            )));
        }
        Ok(Self {
            points: points.rows()?,
            normals: normals.rows()?,
            shape,
        })
    }

    /// Calls `one` with the index, the position and the unit normal of each shading point, and
    /// returns the points and the densities that it returned.
    fn each(
        &self,
        py: Python<'_>,
        one: impl Fn(usize, DVec3, DVec3) -> PyResult<Drawn> + Sync,
    ) -> PyResult<(Vec<[f64; 3]>, Vec<f64>)> {
        let each = |i| {
            stop::check();
            let [position, normal] = self.get(i)?;
            one(i, position, normal)
        };
        let count: usize = self.shape.iter().product();
        alone(py, || (0..count).map(each).collect())?
    }

    /// Returns the shading point with the index `i` and its unit normal.
    fn get(&self, i: usize) -> PyResult<[DVec3; 2]> {
        let of = |rows: Rows<'_>| rows.get(if rows.len() == 1 { 0 } else { i });
        let (point, normal) = (of(self.points), of(self.normals));
        let point = DVec3::from(point);
        if !point.is_finite() {
            let point = shown(point.to_array());
            return Err(value_error(format!("points[{i}] is not finite: {point}")));
        }
        let unit = predicates::normalize(normal.into());
        let refused = || format!("normals[{i}] is zero or not finite: {}", shown(normal));
        Ok([point, unit.ok_or_else(|| value_error(refused()))?])
    }
}

/// Draw points of a light from random numbers.
///
/// Parameters
/// ----------
/// light : Light
///     A polygon, a sphere, a disk, a cylinder or a line.
/// points, normals : (…, 3) array
///     Shading points and their normals, of any length but zero; either may be one for all.
/// xi : (…, 2) array, for a line (…)
///     Random numbers in [0, 1).
/// technique : str
///     ``"area"``, ``"solid-angle"`` or ``"projected-solid-angle"``; ``"proxy"`` for polygons
///     (Shirley and Wang 1991), ``"visible-area"`` for spheres and cylinders; for lines also
///     ``"clipped-solid-angle"``, ``"linear-cosine"``, ``"quadratic-cosine"`` and
///     ``"newton-bisection"`` (Peters 2021).
///
/// Returns
/// -------
/// x : ndarray of float64, shape (…, 3)
///     Points of the light.
/// pdf : ndarray of float64, shape (…)
///     Their densities per solid angle, in 1/sr; for a line times its radius, in m/sr. The density
///     is zero where no point can be drawn; skip these points.
///
/// Raises
/// ------
/// ValueError
///     If an argument is not valid, or the light does not have the technique.
///
/// Examples
/// --------
/// >>> import numpy as np, linelit as ll
/// >>> lamp = ll.Rectangle([-1, -1, 1], [0, 2, 0], [2, 0, 0], radiance=1.0)
/// >>> x, pdf = ll.sample(lamp, [0, 0, 0], [0, 0, 1], np.random.default_rng(1).random((5, 2)))
/// >>> cosine = x[:, 2] / np.linalg.norm(x, axis=1)
/// >>> (cosine / pdf).round(12)
/// array([1.7408395, 1.7408395, 1.7408395, 1.7408395, 1.7408395])
#[pyfunction]
#[pyo3(signature = (light, points, normals, xi, *, technique = "projected-solid-angle"))]
pub(crate) fn sample<'py>(
    py: Python<'py>,
    light: &Bound<'py, Light>,
    points: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
    xi: &Bound<'py, PyAny>,
    technique: &str,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    // Read the arguments.
    let by = Technique::new(&light.get().light, technique)?;
    let (points, normals) = (
        Vectors::new("points", points)?,
        Vectors::new("normals", normals)?,
    );
    let numbers = Reals::new("xi", xi)?;
    // Check the random numbers: a point of a line takes one number, a point of a surface two.
    let (shape, width) = match (by, numbers.shape().split_last()) {
        (Technique::Line(..), _) => (numbers.shape(), 1),
        (Technique::Surface(..), Some((2, shape))) => (shape, 2),
        (Technique::Surface(..), Some((0, []))) => (numbers.shape(), 2),
        (Technique::Surface(..), _) => {
            let shape = shape_text(numbers.shape());
            return Err(value_error(format!(
                "xi has the shape {shape}, and needs (…, 2)"
            )));
        }
    };
    let asked = ShadingPoints::new(&points, &normals, "xi", shape)?;
    let numbers = numbers.to_f64()?;
    if let Some(i) = numbers.iter().position(|x| !(0.0..1.0).contains(x)) {
        let (row, x) = (i / width, numbers[i]);
        return Err(value_error(format!(
            "xi[{row}] is {x}, and needs to be in [0, 1)"
        )));
    }
    // Draw a point for each shading point.
    let one = numbers.len() == width;
    let (places, densities) = asked.each(py, |i, position, normal| {
        let first = if one { 0 } else { i * width };
        let u = [numbers[first], numbers[first + width - 1]];
        Ok(by.sample(position, normal, u))
    })?;
    let vectors: Vec<usize> = asked.shape.iter().copied().chain([3]).collect();
    Ok((
        out(py, places.into_flattened(), &vectors)?,
        out(py, densities, &asked.shape)?,
    ))
}

/// Compute the density with which `sample` draws points of a light.
///
/// Parameters
/// ----------
/// light : Light
///     A polygon, a sphere, a disk, a cylinder or a line.
/// points, normals : (…, 3) array
///     Shading points and their normals, of any length but zero; either may be one for all.
/// x : (…, 3) array
///     Points of the light.
/// technique : str
///     ``"area"``, ``"solid-angle"`` or ``"projected-solid-angle"``; ``"proxy"`` for polygons
///     (Shirley and Wang 1991), ``"visible-area"`` for spheres and cylinders; for lines also
///     ``"clipped-solid-angle"``, ``"linear-cosine"``, ``"quadratic-cosine"`` and
///     ``"newton-bisection"`` (Peters 2021).
///
/// Returns
/// -------
/// ndarray of float64, shape (…)
///     Densities per solid angle, in 1/sr; for a line times its radius, in m/sr.
///
/// Raises
/// ------
/// ValueError
///     If an argument is not valid, or the light does not have the technique.
#[pyfunction]
#[pyo3(signature = (light, points, normals, x, *, technique = "projected-solid-angle"))]
pub(crate) fn pdf<'py>(
    py: Python<'py>,
    light: &Bound<'py, Light>,
    points: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
    x: &Bound<'py, PyAny>,
    technique: &str,
) -> PyResult<Bound<'py, PyAny>> {
    // Read the arguments.
    let by = Technique::new(&light.get().light, technique)?;
    let (points, normals) = (
        Vectors::new("points", points)?,
        Vectors::new("normals", normals)?,
    );
    let places = Vectors::new("x", x)?;
    let asked = ShadingPoints::new(&points, &normals, "x", &places.shape)?;
    // Compute the density of each point.
    let rows = places.rows()?;
    let (_, densities) = asked.each(py, |i, position, normal| {
        let place = rows.get(if rows.len() == 1 { 0 } else { i });
        if !place.iter().all(|x| x.is_finite()) {
            return Err(value_error(format!(
                "x[{i}] is not finite: {}",
                shown(place)
            )));
        }
        Ok((place, by.pdf(position, normal, place.into())))
    })?;
    out(py, densities, &asked.shape)
}
