#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod double_double;
mod power;

pub use power::{exp, ln, pow};

/// The sine of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
///
/// ```
/// assert!((linelit_elementary::sin(0.5 * std::f64::consts::PI) - 1.0).abs() < 1e-15);
/// ```
#[must_use]
#[inline]
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// The cosine of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Returns the sine and the cosine of an angle in radians, bit-identical to [`sin`] and [`cos`];
/// NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// The tangent of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// The arc sine: the angle in radians, in [−π/2, π/2], whose sine is x; NaN outside of [−1, 1].
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn asin(x: f64) -> f64 {
    libm::asin(x)
}

/// The arc cosine: the angle in radians, in [0, π], whose cosine is x; NaN outside of [−1, 1].
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// The arc tangent: the angle in radians, in [−π/2, π/2], whose tangent is x.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// Returns the polar angle in radians, in [−π, π], of the point (x, y), measured from the x axis.
/// The sign of the angle is the sign of y, also for zeros.
///
/// **Error**: 1.5 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Returns e^x − 1, with a small relative error even where x is small and the result close to zero.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// 2^x, the power of two; exact for integers x.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn exp2(x: f64) -> f64 {
    libm::exp2(x)
}

/// Returns ln(1 + x), with a small relative error even where x is small and the result close to
/// zero; NaN below −1.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// The logarithm to base 2; NaN for negative numbers, −∞ for zero.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// The logarithm to base 10; NaN for negative numbers, −∞ for zero.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// The inverse hyperbolic tangent: the number whose hyperbolic tangent is x; NaN outside of [−1,
/// 1].
///
/// **Error**: 2 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atanh(x: f64) -> f64 {
    libm::atanh(x)
}

/// The cube root, also of negative numbers.
///
/// **Error**: half an ulp: correctly rounded. **Source**: libm.
#[must_use]
#[inline]
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// √(x² + y²), without overflow or underflow of the squares.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}
