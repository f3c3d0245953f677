//! The class `Reflection` of Python, and the functions that make reflections.

use crate::arrays::{Reals, shape_text};
use crate::errors::value_error;
use crate::light::{Argument, Made, direction, emitted, made, positive};
use crate::pickle::{Reduced, reduced};
use linelit::bsdf::microfacet::TrowbridgeReitz;
use linelit::bsdf::{
    Bsdf, Fresnel, Frostbite, Layers, Lobe, OrenNayar, Phong, Reflector, Substrate,
};
use linelit::geometry::DVec3;
use pyo3::IntoPyObjectExt as _;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// How a surface reflects light: a BSDF for light from the side of the normal.
///
/// Make one by `Lambert`, `OrenNayar`, `Phong`, `Metal`, `Plastic`, `Microfacet`, `Substrate` or
/// `Frostbite`; ``a + b`` is the sum of two. A colour is one number for all channels, or three
/// numbers. Reflections cannot be changed.
///
/// Examples
/// --------
/// >>> import linelit as ll
/// >>> ll.Lambert(0.5) + ll.Metal(eta=0.2, k=3.9, alpha=0.1)
/// <linelit.Reflection: lambert + metal>
#[pyclass(frozen, module = "linelit")]
pub(crate) struct Reflection {
    layers: Layers,
    /// Whether each colour of the reflection was given as one number for all channels.
    pub(crate) is_single: bool,
    name: String,
    origin: Origin,
}

/// How a reflection was made, for pickling: by a function, or as a sum of two.
enum Origin {
    Call(Made),
    Sum(Py<Reflection>, Py<Reflection>),
}

/// Reads the roughness α of microfacets: one number for all directions, or two numbers along and
/// across the tangent.
fn roughness(given: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    let numbers = Reals::new("alpha", given)?;
    let alpha = match (numbers.to_f64()?.as_slice(), numbers.shape()) {
        ([alpha], []) => [*alpha; 2],
        (&[along, across], [2]) => [along, across],
        _ => {
            let shape = shape_text(numbers.shape());
            let what = format!("alpha has the shape {shape}, and needs one number or two");
            return Err(value_error(what));
        }
    };
    for alpha in alpha {
        positive("alpha", alpha)?;
    }
    Ok(alpha)
}

/// Reads the tangent that two different numbers of roughness refer to; it is zero where the
/// roughness is the same in all directions and no tangent is given.
fn tangent(alpha: [f64; 2], given: Option<&Bound<'_, PyAny>>) -> PyResult<DVec3> {
    #[allow(clippy::float_cmp, reason = "any difference makes a direction")]
    match given {
        Some(given) => direction("tangent", given),
        None if alpha[0] == alpha[1] => Ok(DVec3::ZERO),
        None => Err(value_error("alpha has two numbers, which need a tangent")),
    }
}

impl Reflection {
    /// Makes a reflection of a diffuse colour and at most one lobe, which comes with its tangent.
    fn of(
        made: Made,
        is_single: bool,
        diffuse: DVec3,
        lobe: Option<(Lobe, DVec3)>,
    ) -> PyResult<Self> {
        let mut layers = Layers::new(lobe.map_or(DVec3::ZERO, |(_, tangent)| tangent));
        layers.add_diffuse(diffuse);
        if let Some((lobe, _)) = lobe
            && !layers.add(DVec3::ONE, lobe)
        {
            return Err(value_error("the reflection has too many lobes"));
        }
        Ok(Self {
            layers,
            is_single,
            name: made.0.to_owned(),
            origin: Origin::Call(made),
        })
    }

    /// Returns the reflection as a BSDF of the Rust library.
    pub(crate) fn bsdf(&self) -> Bsdf {
        self.layers.clone().into()
    }
}

#[pymethods]
impl Reflection {
    /// Make a diffuse reflection.
    ///
    /// Parameters
    /// ----------
    /// albedo : float or (3,) array
    ///     The fraction of the incident light that is reflected.
    #[staticmethod]
    fn lambert(albedo: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (albedo, is_single) = emitted("albedo", albedo)?;
        Self::of(made!("lambert", albedo), is_single, albedo, None)
    }

    /// Make a rough diffuse reflection by the model of Oren and Nayar.
    ///
    /// Parameters
    /// ----------
    /// albedo : float or (3,) array
    ///     The albedo of the facets.
    /// sigma : float
    ///     The standard deviation of the facets' slope angle, in degrees.
    #[staticmethod]
    fn oren_nayar(albedo: &Bound<'_, PyAny>, sigma: f64) -> PyResult<Self> {
        let (albedo, is_single) = emitted("albedo", albedo)?;
        if !(0.0..=90.0).contains(&sigma) {
            let what = format!("sigma is {sigma} degrees, and needs to be between 0 and 90");
            return Err(value_error(what));
        }
        let lobe = Lobe::OrenNayar(OrenNayar::new(albedo, sigma.to_radians()));
        let made = made!("oren_nayar", albedo, sigma);
        Self::of(made, is_single, DVec3::ZERO, Some((lobe, DVec3::ZERO)))
    }

    /// Make a diffuse reflection and a Phong lobe about the mirror direction.
    ///
    /// Parameters
    /// ----------
    /// diffuse : float or (3,) array
    ///     The albedo of the diffuse part.
    /// specular : float or (3,) array
    ///     The albedo of the lobe at normal incidence.
    /// exponent : float
    ///     The exponent of the cosine of the angle to the mirror direction, 0 or more.
    #[staticmethod]
    fn phong(
        diffuse: &Bound<'_, PyAny>,
        specular: &Bound<'_, PyAny>,
        exponent: f64,
    ) -> PyResult<Self> {
        let ((diffuse, one), (specular, other)) =
            (emitted("diffuse", diffuse)?, emitted("specular", specular)?);
        if !(exponent >= 0.0 && exponent.is_finite()) {
            let what = format!("exponent is {exponent}, and needs to be 0 or more");
            return Err(value_error(what));
        }
        let lobe = Lobe::Phong(Phong { specular, exponent });
        let made = made!("phong", diffuse, specular, exponent);
        Self::of(made, one && other, diffuse, Some((lobe, DVec3::ZERO)))
    }

    /// Make a rough conductor: microfacets of Trowbridge and Reitz (GGX) with the Fresnel
    /// reflectance of metal.
    ///
    /// Parameters
    /// ----------
    /// eta, k : float or (3,) array
    ///     The index of refraction and the absorption coefficient.
    /// alpha : float or (2,) array
    ///     The roughness α, along and across the tangent where it is two numbers.
    /// tangent : (3,) array, optional
    ///     The direction in the surface that two numbers of roughness refer to.
    #[staticmethod]
    #[pyo3(signature = (eta, k, alpha, *, tangent = None))]
    fn metal(
        eta: &Bound<'_, PyAny>,
        k: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
        tangent: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let ((eta, one), (k, other)) = (emitted("eta", eta)?, emitted("k", k)?);
        let alpha = roughness(alpha)?;
        let tangent = self::tangent(alpha, tangent)?;
        let lobe = Lobe::Reflector(Reflector {
            reflectance: DVec3::ONE,
            facets: TrowbridgeReitz::new(alpha),
            fresnel: Fresnel::Conductor { eta, k },
        });
        let made = made!("metal", eta, k, alpha).with("tangent", tangent);
        Self::of(made, one && other, DVec3::ZERO, Some((lobe, tangent)))
    }

    /// Make a diffuse reflection under a rough dielectric coat, like pbrt-v3's plastic: the diffuse
    /// part is not reduced by the light that the coat reflects.
    ///
    /// Parameters
    /// ----------
    /// diffuse, specular : float or (3,) array
    ///     The albedo of the diffuse part, and a factor of the coat's reflectance.
    /// alpha : float or (2,) array
    ///     The roughness α, along and across the tangent where it is two numbers.
    /// eta : float
    ///     The coat's index of refraction.
    /// tangent : (3,) array, optional
    ///     The direction in the surface that two numbers of roughness refer to.
    #[staticmethod]
    #[pyo3(signature = (diffuse, specular, alpha, *, eta = 1.5, tangent = None))]
    fn plastic(
        diffuse: &Bound<'_, PyAny>,
        specular: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
        eta: f64,
        tangent: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let ((diffuse, one), (reflectance, other)) =
            (emitted("diffuse", diffuse)?, emitted("specular", specular)?);
        let (alpha, eta) = (roughness(alpha)?, positive("eta", eta)?);
        let tangent = self::tangent(alpha, tangent)?;
        let lobe = Lobe::Reflector(Reflector {
            reflectance,
            facets: TrowbridgeReitz::new(alpha),
            fresnel: Fresnel::Dielectric { eta },
        });
        let made = made!("plastic", diffuse, reflectance, alpha).with("tangent", tangent);
        let made = made.with("eta", eta);
        Self::of(made, one && other, diffuse, Some((lobe, tangent)))
    }

    /// Make a rough reflector: microfacets of Trowbridge and Reitz (GGX) with Schlick's
    /// approximation of the Fresnel reflectance, which is `f0` at normal and 1 at grazing
    /// incidence.
    ///
    /// Parameters
    /// ----------
    /// f0 : float or (3,) array
    ///     The reflectance at normal incidence.
    /// alpha : float or (2,) array
    ///     The roughness α, along and across the tangent where it is two numbers.
    /// tangent : (3,) array, optional
    ///     The direction in the surface that two numbers of roughness refer to.
    #[staticmethod]
    #[pyo3(signature = (f0, alpha, *, tangent = None))]
    fn microfacet(
        f0: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
        tangent: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let ((f0, is_single), alpha) = (emitted("f0", f0)?, roughness(alpha)?);
        let tangent = self::tangent(alpha, tangent)?;
        let lobe = Lobe::Reflector(Reflector {
            reflectance: DVec3::ONE,
            facets: TrowbridgeReitz::new(alpha),
            fresnel: Fresnel::Schlick { f0, f90: 1.0 },
        });
        let made = made!("microfacet", f0, alpha).with("tangent", tangent);
        Self::of(made, is_single, DVec3::ZERO, Some((lobe, tangent)))
    }

    /// Make a diffuse base under a glossy coat by the model of Ashikhmin and Shirley, in which both
    /// share the energy: the base does not reflect what the coat has reflected.
    ///
    /// Parameters
    /// ----------
    /// diffuse, specular : float or (3,) array
    ///     The reflectance of the base, and of the coat at normal incidence.
    /// alpha : float or (2,) array
    ///     The roughness α, along and across the tangent where it is two numbers.
    /// tangent : (3,) array, optional
    ///     The direction in the surface that two numbers of roughness refer to.
    #[staticmethod]
    #[pyo3(signature = (diffuse, specular, alpha, *, tangent = None))]
    fn substrate(
        diffuse: &Bound<'_, PyAny>,
        specular: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
        tangent: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let ((diffuse, one), (specular, other)) =
            (emitted("diffuse", diffuse)?, emitted("specular", specular)?);
        let alpha = roughness(alpha)?;
        let tangent = self::tangent(alpha, tangent)?;
        let lobe = Lobe::Substrate(Substrate {
            diffuse,
            specular,
            facets: TrowbridgeReitz::new(alpha),
        });
        let made = made!("substrate", diffuse, specular, alpha).with("tangent", tangent);
        Self::of(made, one && other, DVec3::ZERO, Some((lobe, tangent)))
    }

    /// Make the standard material of the Frostbite engine, which Peters 2021 uses.
    ///
    /// Parameters
    /// ----------
    /// diffuse, f0 : float or (3,) array
    ///     The diffuse albedo, and the reflectance at normal incidence.
    /// roughness : float
    ///     The linear roughness, from 0 to 1; α is its square.
    #[staticmethod]
    fn frostbite(
        diffuse: &Bound<'_, PyAny>,
        f0: &Bound<'_, PyAny>,
        roughness: f64,
    ) -> PyResult<Self> {
        let ((diffuse, one), (f0, other)) = (emitted("diffuse", diffuse)?, emitted("f0", f0)?);
        if !(0.0..=1.0).contains(&roughness) {
            let what = format!("roughness is {roughness}, and needs to be between 0 and 1");
            return Err(value_error(what));
        }
        let lobe = Lobe::Frostbite(Frostbite::new(diffuse, f0, roughness));
        let made = made!("frostbite", diffuse, f0, roughness);
        Self::of(made, one && other, DVec3::ZERO, Some((lobe, DVec3::ZERO)))
    }

    /// Return the sum of two reflections.
    fn __add__<'py>(slf: &Bound<'py, Self>, other: &Bound<'py, Self>) -> PyResult<Self> {
        let (a, b) = (slf.get(), other.get());
        // Take the tangent of either; a reflection cannot have two different tangents.
        let mut layers = a.layers.clone();
        match [&a.layers, &b.layers].map(Layers::tangent) {
            [one, other] if one == other || other == DVec3::ZERO => {}
            [DVec3::ZERO, other] => layers.set_tangent(other),
            _ => return Err(value_error("the tangents of the reflections differ")),
        }
        // Add the lobes of the second.
        layers.add_diffuse(b.layers.diffuse());
        for (scale, lobe) in b.layers.lobes() {
            if !layers.add(scale, *lobe) {
                let most = Layers::MAX;
                let what = format!("the sum has more than {most} lobes in addition to Lambert");
                return Err(value_error(what));
            }
        }
        Ok(Self {
            layers,
            is_single: a.is_single && b.is_single,
            name: format!("{} + {}", a.name, b.name),
            origin: Origin::Sum(slf.clone().unbind(), other.clone().unbind()),
        })
    }

    /// Return the sum of two reflections; pickles call this function by its name.
    #[staticmethod]
    fn _sum<'py>(a: &Bound<'py, Self>, b: &Bound<'py, Self>) -> PyResult<Self> {
        Self::__add__(a, b)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        match &self.origin {
            Origin::Sum(a, b) => {
                let parts = [a, b].map(|part| part.bind(py).clone().into_any());
                reduced(py, "Reflection._sum", parts.into(), PyDict::new(py))
            }
            Origin::Call(made) => {
                // Convert the arguments by position and by name to Python's objects.
                let single = |argument: &Argument| match argument {
                    // Store colours that were given as one number as one number.
                    Argument::Vector([x, y, z]) if self.is_single && x == y && y == z => {
                        Argument::Number(*x)
                    }
                    other => other.clone(),
                };
                let each = made.1.iter().map(|a| single(a).into_bound_py_any(py));
                let options = PyDict::new(py);
                for (name, value) in &made.2 {
                    options.set_item(name, value.clone())?;
                }
                let all = each.collect::<PyResult<_>>()?;
                reduced(py, &format!("Reflection.{}", made.0), all, options)
            }
        }
    }

    fn __repr__(&self) -> String {
        format!("<linelit.Reflection: {}>", self.name)
    }
}

/// Reads an argument of reflections: one for all points, or one for each.
pub(crate) fn reflections<'py>(
    given: &Bound<'py, PyAny>,
    points: usize,
) -> PyResult<Vec<Bound<'py, Reflection>>> {
    let refused = |what: &Bound<'_, PyAny>| {
        let kind = what.get_type();
        PyTypeError::new_err(format!(
            "bsdf is {kind}, and needs a linelit.Reflection, or a list"
        ))
    };
    // Take one for all points.
    if let Ok(one) = given.cast::<Reflection>() {
        return Ok(vec![one.clone()]);
    }
    // Or one for each of them.
    let all = given.try_iter().map_err(|_| refused(given))?;
    let each = all.map(|one| {
        one?.cast_into::<Reflection>()
            .map_err(|e| refused(&e.into_inner()))
    });
    let each: Vec<_> = each.collect::<PyResult<_>>()?;
    match each.len() == points {
        true => Ok(each),
        false => Err(value_error(format!(
            "there are {} reflections for {points} points: each needs one",
            each.len()
        ))),
    }
}
