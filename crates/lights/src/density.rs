//! This module holds [`Pdf`], a probability density that carries its measure in its type.
//!
//! A density per square metre and a density per steradian are both just numbers, and mixing them up
//! is the most common bug in light sampling code. Here each measure is a type and there is one
//! conversion function per pair.

use core::fmt;
use core::marker::PhantomData;

mod sealed {
    pub trait Sealed {}
}

/// A measure that a density can refer to. Sealed: implemented for the marker types of this module
/// only.
pub trait Measure: sealed::Sealed + Copy + PartialOrd + fmt::Debug + 'static {
    /// The unit of a density in this measure, e.g. `"1/m²"`.
    const UNIT: &'static str;
}

macro_rules! measure {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
        pub enum $name {}
        impl sealed::Sealed for $name {}
        impl Measure for $name {
            const UNIT: &'static str = $unit;
        }
    };
}

measure!(
    /// The surface area of the light, dA; densities are in 1/m².
    Area,
    "1/m²"
);
measure!(
    /// The solid angle at the shading point, dω; densities are in 1/sr.
    SolidAngle,
    "1/sr"
);
measure!(
    /// The offset of a line sample across the light, du; densities are in 1/m.
    Offset,
    "1/m"
);
measure!(
    /// The length along a segment (a line sample or a linear light), dt; densities are in 1/m.
    Length,
    "1/m"
);
measure!(
    /// Solid angle per radius of a linear light (a cylinder whose radius R goes to zero), dω/R;
    /// densities in m/sr.
    ///
    /// This is what Peters 2021, §3.1 calls the density in solid angle measure *times radius*.
    ThinSolidAngle,
    "m/sr"
);

/// A probability density with respect to the measure `M`, never negative.
///
/// The value 0 means "cannot be sampled" (degenerate input). [`Pdf::new`] maps infinities and NaN
/// to 0, so that an estimator has one thing to check: [`Pdf::is_positive`].
///
/// ```
/// use linelit_lights::{Area, Pdf};
/// let uniform = Pdf::<Area>::new(1.0 / 4.0); // a light of 4 m²
/// // 5 m away, its normal at 120° to the direction towards it.
/// let seen = uniform.to_solid_angle(25.0, -0.5);
/// assert_eq!(seen.value(), 0.25 * 25.0 / 0.5);
/// ```
#[derive(Clone, Copy, PartialEq, PartialOrd)]
pub struct Pdf<M: Measure>(f64, PhantomData<M>);

impl<M: Measure> Default for Pdf<M> {
    fn default() -> Self {
        Self::ZERO
    }
}
impl<M: Measure> fmt::Debug for Pdf<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} {}", self.0, M::UNIT)
    }
}

impl<M: Measure> Pdf<M> {
    /// The density zero, for samples that cannot be drawn.
    pub const ZERO: Self = Self(0.0, PhantomData);

    /// Makes a density from a number; negative, infinite and NaN values become 0.
    #[inline(always)]
    #[must_use]
    pub fn new(value: f64) -> Self {
        // Compare with the largest number: `is_finite` would test the bits, in a dozen
        // instructions.
        let usable = value > 0.0 && value <= f64::MAX;
        Self(if usable { value } else { 0.0 }, PhantomData)
    }

    /// Returns the density as a number, in the unit of the measure.
    #[must_use]
    pub const fn value(self) -> f64 {
        self.0
    }

    /// Whether an estimator may divide by this density.
    #[must_use]
    pub fn is_positive(self) -> bool {
        self.0 > 0.0
    }

    /// Returns the density of a sample of this technique if the technique is chosen with
    /// probability `p`, as one of several lights or parts of a light: this density times `p`.
    #[must_use]
    pub fn scaled(self, p: f64) -> Self {
        Self::new(self.0 * p)
    }
}

/// A measure of points on a surface as a shading point sees them: surface area or solid angle.
pub trait SurfaceMeasure: Measure {
    /// Whether a density of this measure depends neither on the distance of the shading point nor
    /// on the cosine at the light.
    const IS_LOCAL: bool;

    /// Converts a density to the measure of solid angle at the shading point: see
    /// [`Pdf::<Area>::to_solid_angle`].
    fn to_solid_angle(pdf: Pdf<Self>, distance_squared: f64, cos_light: f64) -> Pdf<SolidAngle>;
}

impl SurfaceMeasure for Area {
    const IS_LOCAL: bool = true;

    #[inline]
    fn to_solid_angle(pdf: Pdf<Self>, distance_squared: f64, cos_light: f64) -> Pdf<SolidAngle> {
        pdf.to_solid_angle(distance_squared, cos_light)
    }
}

impl SurfaceMeasure for SolidAngle {
    const IS_LOCAL: bool = false;

    #[inline]
    fn to_solid_angle(pdf: Pdf<Self>, _: f64, _: f64) -> Pdf<SolidAngle> {
        pdf
    }
}

impl Pdf<Area> {
    /// Converts a density per area to a density per solid angle: `p_ω = p_A r²/|cos θ'|`. Here
    /// `distance_squared` is r², and `cos_light` is cos θ', the cosine between the light's normal
    /// and the direction, whose sign does not matter. The result is 0 where the light is seen
    /// edge-on.
    #[must_use]
    pub fn to_solid_angle(self, distance_squared: f64, cos_light: f64) -> Pdf<SolidAngle> {
        Pdf::new(self.0 * distance_squared / cos_light.abs())
    }
}

impl Pdf<SolidAngle> {
    /// Converts a density per solid angle to a density per area: `p_A = p_ω |cos θ'|/r²`. This is
    /// the inverse of [`Pdf::<Area>::to_solid_angle`].
    #[must_use]
    pub fn to_area(self, distance_squared: f64, cos_light: f64) -> Pdf<Area> {
        Pdf::new(self.0 * cos_light.abs() / distance_squared)
    }
}

impl Pdf<Offset> {
    /// Returns the joint density per area of a line at this density and a point at density `along`
    /// on it: `p_A = p_u p_t`.
    ///
    /// Offset and length are orthogonal coordinates on the light, so du dt = dA (Billen & Dutré
    /// 2016, eq. 4).
    #[must_use]
    pub fn joint(self, along: Pdf<Length>) -> Pdf<Area> {
        Pdf::new(self.0 * along.0)
    }
}

impl Pdf<Length> {
    /// Converts a density per length along a linear light to thin solid angle. With dω/R = 2h/r³ dt
    /// it is `p = p_t r³/(2h)`, where r is the distance of the point and h, `line_distance`, is the
    /// distance of the infinite line. See Peters 2021, §3.1.
    #[must_use]
    pub fn to_thin_solid_angle(self, distance: f64, line_distance: f64) -> Pdf<ThinSolidAngle> {
        Pdf::new(self.0 * (distance * distance) * (distance / (2.0 * line_distance)))
    }
}

impl Pdf<ThinSolidAngle> {
    /// Converts a density per thin solid angle to a density per length along the linear light: `p_t
    /// = p 2h/r³`.
    #[must_use]
    pub fn to_length(self, distance: f64, line_distance: f64) -> Pdf<Length> {
        Pdf::new(self.0 * 2.0 * (line_distance / distance) / (distance * distance))
    }
}
