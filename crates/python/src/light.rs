//! The class `Light` of Python, and the functions that make lights of each shape.

use crate::arrays::{Vectors, channels, out, shape_text, vector};
use crate::errors::value_error;
use crate::pickle::{Reduced, reduced};
use crate::threads::alone;
use linelit::geometry::DVec3;
use linelit::geometry::glam::DMat3;
use linelit::lights::{Light as RustLight, SkyEmission, SkyImage, SkyMapping};
use pyo3::IntoPyObjectExt as _;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::f64::consts::PI;
use std::sync::Arc;

/// A light: its shape and its emission.
///
/// Make one by `Polygon`, `Rectangle`, `Disk`, `Sphere`, `Cylinder`, `Line`, `Point`, `Spot`,
/// `Distant`, `Sun` or `Environment`. Where the radiance is given as one number, results have no
/// axis of channels. Lights cannot be changed.
#[pyclass(frozen, module = "linelit")]
pub(crate) struct Light {
    pub(crate) light: RustLight,
    /// Whether the emission of the light was given as one number for all channels.
    pub(crate) is_single: bool,
    made: Made,
}

/// The call that made an object, for pickling: the name of the function, and its arguments by
/// position and by name, without images.
pub(crate) struct Made(
    pub(crate) &'static str,
    pub(crate) Vec<Argument>,
    pub(crate) Vec<(&'static str, Argument)>,
);

/// An argument of a call in [`Made`].
#[derive(Clone, IntoPyObject)]
pub(crate) enum Argument {
    Number(f64),
    Pair([f64; 2]),
    Vector([f64; 3]),
    Vectors(Vec<[f64; 3]>),
}

impl From<f64> for Argument {
    fn from(x: f64) -> Self {
        Self::Number(x)
    }
}

impl From<DVec3> for Argument {
    fn from(v: DVec3) -> Self {
        Self::Vector(v.to_array())
    }
}

impl From<[f64; 2]> for Argument {
    fn from(pair: [f64; 2]) -> Self {
        Self::Pair(pair)
    }
}

/// The call of a function with arguments by position, as a [`Made`].
macro_rules! made {
    ($by:literal $(, $argument:expr)*) => { Made($by, vec![$($argument.into()),*], Vec::new()) };
}
pub(crate) use made;

/// Reads the emission of a light, an argument of this name, and makes the light with it.
fn lit(
    name: &str,
    given: &Bound<'_, PyAny>,
    made: Made,
    light: impl FnOnce(DVec3) -> RustLight,
) -> PyResult<Light> {
    let (radiance, is_single) = emitted(name, given)?;
    Ok(Light {
        light: light(radiance),
        is_single,
        made: made.and(radiance, is_single),
    })
}

/// Reads a radiance or a colour, which has to be finite and not negative, and returns its channels
/// and whether it was one number.
pub(crate) fn emitted(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(DVec3, bool)> {
    let found = channels(name, given)?;
    match found.0.is_finite() && found.0.min_element() >= 0.0 {
        true => Ok(found),
        false => Err(value_error(format!(
            "{name} is negative or not finite: {}",
            given.repr()?
        ))),
    }
}

impl Made {
    /// Adds an argument by its name, unless it is a zero vector.
    pub(crate) fn with(mut self, name: &'static str, argument: impl Into<Argument>) -> Self {
        let argument = argument.into();
        if !matches!(argument, Argument::Vector([0.0, 0.0, 0.0])) {
            self.2.push((name, argument));
        }
        self
    }

    /// Adds the emission as the last argument by position.
    fn and(mut self, radiance: DVec3, is_single: bool) -> Self {
        self.1.push(match is_single {
            true => radiance.x.into(),
            false => radiance.into(),
        });
        self
    }
}

/// Checks that a number is finite and above zero.
pub(crate) fn positive(name: &str, x: f64) -> PyResult<f64> {
    match x > 0.0 && x.is_finite() {
        true => Ok(x),
        false => Err(value_error(format!(
            "{name} is {x}, and needs to be above 0"
        ))),
    }
}

/// Reads a vector that has to be finite.
fn place(name: &str, given: &Bound<'_, PyAny>) -> PyResult<DVec3> {
    let v = vector(name, given)?;
    match v.is_finite() {
        true => Ok(v),
        false => Err(value_error(format!(
            "{name} is not finite: {}",
            given.repr()?
        ))),
    }
}

/// Reads a vector that has to be finite and not zero.
pub(crate) fn direction(name: &str, given: &Bound<'_, PyAny>) -> PyResult<DVec3> {
    let v = place(name, given)?;
    match v == DVec3::ZERO {
        true => Err(value_error(format!(
            "{name} is zero, and needs a direction"
        ))),
        false => Ok(v),
    }
}

#[pymethods]
impl Light {
    /// Make a convex polygon that emits.
    ///
    /// Parameters
    /// ----------
    /// corners : (k, 3) array
    ///     3 to 16 corners in one plane, counter-clockwise as seen from the side that emits.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    /// two_sided : bool
    ///     Whether the other side emits, too.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If the corners make no flat, convex polygon.
    ///
    /// Examples
    /// --------
    /// >>> import linelit as ll
    /// >>> ll.Polygon([[0, 0, 0], [0, 1, 0], [1, 0, 0]], radiance=40.0)
    /// <linelit.Light: polygon, 40>
    #[staticmethod]
    #[pyo3(signature = (corners, radiance, *, two_sided = false))]
    fn polygon(
        corners: &Bound<'_, PyAny>,
        radiance: &Bound<'_, PyAny>,
        two_sided: bool,
    ) -> PyResult<Self> {
        let vectors = Vectors::new("corners", corners)?;
        if vectors.shape.len() != 1 {
            let shape = shape_text(&vectors.shape);
            return Err(value_error(format!(
                "corners are {shape} vectors, and need (k,)"
            )));
        }
        let rows = vectors.rows()?;
        let corners: Vec<DVec3> = (0..rows.len()).map(|i| rows.get(i).into()).collect();
        let polygon = RustLight::polygon(&corners, DVec3::ZERO);
        let polygon = polygon.map_err(|e| value_error(format!("corners: {e}")))?;
        let corners = corners.iter().map(DVec3::to_array).collect();
        let made = made!("polygon", Argument::Vectors(corners));
        lit("radiance", radiance, made, |l| {
            with_radiance(polygon, l, two_sided)
        })
    }

    /// Make a parallelogram that emits along ``u × v``.
    ///
    /// Parameters
    /// ----------
    /// corner, u, v : (3,) array
    ///     A corner, and the sides from it.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    /// two_sided : bool
    ///     Whether the other side emits, too.
    #[staticmethod]
    #[pyo3(signature = (corner, u, v, radiance, *, two_sided = false))]
    fn rectangle(
        corner: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
        v: &Bound<'_, PyAny>,
        radiance: &Bound<'_, PyAny>,
        two_sided: bool,
    ) -> PyResult<Self> {
        let (corner, u, v) = (place("corner", corner)?, place("u", u)?, place("v", v)?);
        let polygon = RustLight::rectangle(corner, u, v, DVec3::ZERO);
        let polygon = polygon.map_err(|e| value_error(format!("corner, u, v: {e}")))?;
        let made = made!("rectangle", corner, u, v);
        lit("radiance", radiance, made, |l| {
            with_radiance(polygon, l, two_sided)
        })
    }

    /// Make a disk that emits along its normal.
    ///
    /// Parameters
    /// ----------
    /// center, normal : (3,) array
    ///     The centre, and the normal, which may have any length but zero.
    /// radius : float
    ///     The radius.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    /// two_sided : bool
    ///     Whether the other side emits, too.
    #[staticmethod]
    #[pyo3(signature = (center, normal, radius, radiance, *, two_sided = false))]
    fn disk(
        center: &Bound<'_, PyAny>,
        normal: &Bound<'_, PyAny>,
        radius: f64,
        radiance: &Bound<'_, PyAny>,
        two_sided: bool,
    ) -> PyResult<Self> {
        let (center, normal) = (place("center", center)?, direction("normal", normal)?);
        let radius = positive("radius", radius)?;
        let made = made!("disk", center, normal, radius);
        lit("radiance", radiance, made, |l| {
            let disk = RustLight::disk(center, normal, radius, l);
            if two_sided { disk.two_sided() } else { disk }
        })
    }

    /// Make a sphere that emits outwards: points inside it or on it receive no light.
    ///
    /// Parameters
    /// ----------
    /// center : (3,) array
    ///     The centre.
    /// radius : float
    ///     The radius.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    #[staticmethod]
    fn sphere(
        center: &Bound<'_, PyAny>,
        radius: f64,
        radiance: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (center, radius) = (place("center", center)?, positive("radius", radius)?);
        let made = made!("sphere", center, radius);
        lit("radiance", radiance, made, |l| {
            RustLight::sphere(center, radius, l)
        })
    }

    /// Make a cylinder whose curved side emits outwards; its ends do not emit.
    ///
    /// Parameters
    /// ----------
    /// start, end : (3,) array
    ///     The ends of its axis.
    /// radius : float
    ///     The radius.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    #[staticmethod]
    fn cylinder(
        start: &Bound<'_, PyAny>,
        end: &Bound<'_, PyAny>,
        radius: f64,
        radiance: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let [start, end] = ends(start, end)?;
        let radius = positive("radius", radius)?;
        let made = made!("cylinder", start, end, radius);
        lit("radiance", radiance, made, |l| {
            RustLight::cylinder(start, end, radius, l)
        })
    }

    /// Make a linear light: the limit of thin cylinders whose radiance times radius is constant.
    ///
    /// Parameters
    /// ----------
    /// start, end : (3,) array
    ///     Its ends.
    /// radiance_radius : float or (3,) array
    ///     Radiance times radius, in W/(m sr).
    #[staticmethod]
    fn line(
        start: &Bound<'_, PyAny>,
        end: &Bound<'_, PyAny>,
        radiance_radius: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let [start, end] = ends(start, end)?;
        let made = made!("line", start, end);
        lit("radiance_radius", radiance_radius, made, |l| {
            RustLight::line(start, end, l)
        })
    }

    /// Make a point light.
    ///
    /// Parameters
    /// ----------
    /// position : (3,) array
    ///     Its position.
    /// intensity : float or (3,) array
    ///     Intensity in W/sr, the same in all directions.
    #[staticmethod]
    fn point(position: &Bound<'_, PyAny>, intensity: &Bound<'_, PyAny>) -> PyResult<Self> {
        let position = place("position", position)?;
        let made = made!("point", position);
        lit("intensity", intensity, made, |l| {
            RustLight::point(position, l)
        })
    }

    /// Make a spot light: a point light whose intensity falls to zero between two angles, as
    /// pbrt's spot lights do.
    ///
    /// Parameters
    /// ----------
    /// position, direction : (3,) array
    ///     Its position, and the direction in which it shines, of any length but zero.
    /// inner, outer : float
    ///     Angles to the direction in radians: the intensity is full within the first, and zero
    ///     past the second.
    /// intensity : float or (3,) array
    ///     Intensity in W/sr along the direction.
    #[staticmethod]
    #[pyo3(signature = (position, direction, inner, outer, intensity))]
    fn spot(
        position: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        inner: f64,
        outer: f64,
        intensity: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (position, axis) = (
            place("position", position)?,
            self::direction("direction", direction)?,
        );
        if !(0.0 <= inner && inner <= outer && outer <= PI) {
            return Err(value_error(format!(
                "inner is {inner} and outer {outer}, and need 0 <= inner <= outer <= pi"
            )));
        }
        let made = made!("spot", position, axis, inner, outer);
        lit("intensity", intensity, made, |l| {
            RustLight::spot(position, axis, [inner, outer], l)
        })
    }

    /// Make parallel light.
    ///
    /// Parameters
    /// ----------
    /// direction : (3,) array
    ///     Towards the light, of any length but zero.
    /// irradiance : float or (3,) array
    ///     The irradiance in W/m² of a surface that faces the light.
    #[staticmethod]
    fn distant(direction: &Bound<'_, PyAny>, irradiance: &Bound<'_, PyAny>) -> PyResult<Self> {
        let direction = self::direction("direction", direction)?;
        let made = made!("distant", direction);
        lit("irradiance", irradiance, made, |l| {
            RustLight::distant(direction, l)
        })
    }

    /// Make a disk at infinity, such as the sun.
    ///
    /// Parameters
    /// ----------
    /// direction : (3,) array
    ///     Towards its middle, of any length but zero.
    /// half_angle : float
    ///     The angle between the directions to its middle and to its rim, in radians, above 0 and
    ///     up to π/2.
    /// radiance : float or (3,) array
    ///     Radiance in W/(m² sr), for all channels or for each.
    #[staticmethod]
    fn sun(
        direction: &Bound<'_, PyAny>,
        half_angle: f64,
        radiance: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let direction = self::direction("direction", direction)?;
        if !(half_angle > 0.0 && half_angle <= PI / 2.0) {
            let what = format!("half_angle is {half_angle}, and needs to be above 0, up to pi/2");
            return Err(value_error(what));
        }
        let made = made!("sun", direction, half_angle);
        lit("radiance", radiance, made, |l| {
            RustLight::sun(direction, half_angle, l)
        })
    }

    /// Make a sky, whose radiance depends on the direction.
    ///
    /// Parameters
    /// ----------
    /// image : float, (3,) array or (height, width, 3) array
    ///     One radiance for all directions, or an image by longitude and latitude: the columns go
    ///     from the x axis towards the y axis and all around, and the rows from the z axis, where
    ///     the first row is, down to its opposite.
    /// scale : float or (3,) array, optional
    ///     A factor of the image.
    /// to_image : (3, 3) array, optional
    ///     The rotation that turns directions of the world into directions of the image.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a pixel is negative or not finite, or the matrix is not a rotation.
    #[staticmethod]
    #[pyo3(signature = (image, *, scale = None, to_image = None))]
    fn environment(
        py: Python<'_>,
        image: &Bound<'_, PyAny>,
        scale: Option<&Bound<'_, PyAny>>,
        to_image: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (scale, is_single) = match scale {
            Some(given) => emitted("scale", given)?,
            None => (DVec3::ONE, true),
        };
        // One radiance makes a sky that is the same in all directions.
        if image.extract::<f64>().is_ok() || !is_image(image)? {
            let (radiance, is_one) = emitted("image", image)?;
            let (radiance, is_single) = (radiance * scale, is_one && is_single);
            return Ok(Self {
                light: RustLight::sky(radiance),
                is_single,
                made: made!("environment").and(radiance, is_single),
            });
        }
        // An array is an image by longitude and latitude.
        let vectors = Vectors::new("image", image)?;
        let &[height, width] = vectors.shape.as_slice() else {
            let what = "image needs the shape (height, width, 3), or a radiance";
            return Err(value_error(what));
        };
        let to_image = to_image.map_or(Ok(DMat3::IDENTITY), matrix)?;
        let rows = vectors.rows()?;
        #[allow(clippy::cast_possible_truncation, reason = "images are f32")]
        let pixels = (0..rows.len())
            .map(|i| rows.get(i).map(|x| x as f32))
            .collect();
        let mapping = SkyMapping::Equirectangular;
        let build = || SkyImage::new(mapping, [width, height], pixels, to_image, scale);
        let built = alone(py, build)?;
        let built = built.map_err(|e| value_error(format!("image: {e}")))?;
        Ok(Self {
            light: SkyEmission::Image(Arc::new(built)).into(),
            is_single: false,
            made: made!("environment"),
        })
    }

    /// The name of its shape.
    #[getter]
    fn kind(&self) -> &'static str {
        kind(&self.light)
    }

    /// The emitted power in W, the mean over its channels.
    #[getter]
    fn power(&self) -> f64 {
        self.light.power()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        // Take the arguments of the call that made the light.
        let Made(name, arguments, _) = &self.made;
        let options = PyDict::new(py);
        let each = arguments
            .iter()
            .map(|argument| argument.clone().into_bound_py_any(py));
        let mut all: Vec<_> = each.collect::<PyResult<_>>()?;
        // Add the image of a sky, which the light itself has, and the option of two sides.
        if let RustLight::Sky(sky) = &self.light
            && let SkyEmission::Image(image) = &sky.emission
        {
            let (_, [width, height], pixels, to_image, scale) = image.made_of();
            let pixels = pixels.as_flattened().to_vec();
            all.push(out(py, pixels, &[height, width, 3])?);
            options.set_item("scale", scale.to_array())?;
            options.set_item("to_image", to_image.transpose().to_cols_array_2d())?;
        }
        if self.light.emission().two_sided {
            options.set_item("two_sided", true)?;
        }
        reduced(py, &format!("Light.{name}"), all, options)
    }

    /// Return this light itself: lights cannot be changed, so that a copy would be equal.
    const fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// Return this light itself: lights cannot be changed, so that a copy would be equal.
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let radiance = self.light.emission().radiance;
        let radiance = match self.is_single {
            true => radiance.x.to_string(),
            false => crate::errors::shown(radiance.to_array()),
        };
        format!("<linelit.Light: {}, {radiance}>", self.kind())
    }
}

/// Returns the name of a light's shape, as Python shows it.
pub(crate) const fn kind(light: &RustLight) -> &'static str {
    match light {
        RustLight::Area(_) => "polygon",
        RustLight::Linear(_) => "line",
        RustLight::Sphere(_) => "sphere",
        RustLight::Disk(_) => "disk",
        RustLight::Cylinder(_) => "cylinder",
        RustLight::Point(_) => "point",
        RustLight::Distant(_) => "distant",
        RustLight::Sky(_) => "environment",
    }
}

/// Sets the emission of a polygonal light.
fn with_radiance(mut light: RustLight, radiance: DVec3, two_sided: bool) -> RustLight {
    if let RustLight::Area(area) = &mut light {
        area.emission.radiance = radiance;
        area.emission.two_sided = two_sided;
    }
    light
}

/// Reads the ends of a line or of an axis, which have to differ.
fn ends(start: &Bound<'_, PyAny>, end: &Bound<'_, PyAny>) -> PyResult<[DVec3; 2]> {
    let [start, end] = [place("start", start)?, place("end", end)?];
    match start == end {
        true => Err(value_error("start and end are in one place")),
        false => Ok([start, end]),
    }
}

/// Returns whether an argument has more than one axis.
fn is_image(given: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(given.hasattr("ndim")? && given.getattr("ndim")?.extract::<usize>()? > 1)
}

/// Reads a matrix, given by its rows.
fn matrix(given: &Bound<'_, PyAny>) -> PyResult<DMat3> {
    let vectors = Vectors::new("to_image", given)?;
    if vectors.shape != [3] {
        return Err(value_error("to_image needs the shape (3, 3)"));
    }
    let rows = vectors.rows()?;
    let [x, y, z] = [0, 1, 2].map(|i| DVec3::from(rows.get(i)));
    Ok(DMat3::from_cols(x, y, z).transpose())
}
