#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]
#![cfg_attr(not(test), warn(clippy::disallowed_types, clippy::disallowed_macros))]
#![cfg_attr(not(test), warn(clippy::panic, clippy::unreachable))]

mod double_double;
mod power;

pub use power::{exp, ln, pow};

/// sin x of an angle in radians; NaN for ±∞.
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

/// cos x of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// sin x and cos x of an angle in radians, the bits of [`sin`] and [`cos`]; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// tan x of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// The angle in radians, in [−π/2, π/2], whose sine is x; NaN beyond [−1, 1].
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn asin(x: f64) -> f64 {
    libm::asin(x)
}

/// The angle in radians, in [0, π], whose cosine is x; NaN beyond [−1, 1].
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// The angle in radians, in [−π/2, π/2], whose tangent is x.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// The angle in radians, in [−π, π], of the point (x, y) about the origin, measured from the x
/// axis; its sign is that of y, of zeros, too.
///
/// **Error**: 1.5 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// e^x − 1, relatively accurate for small x.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// 2^x; exact for whole x.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn exp2(x: f64) -> f64 {
    libm::exp2(x)
}

/// ln(1 + x), relatively accurate for small x; NaN below −1.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// The logarithm to the base 2: NaN below zero, −∞ at it.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// The logarithm to the base 10: NaN below zero, −∞ at it.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// The number whose hyperbolic tangent is x; NaN beyond [−1, 1].
///
/// **Error**: 2 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atanh(x: f64) -> f64 {
    libm::atanh(x)
}

/// The cube root, of negative numbers, too.
///
/// **Error**: half an ulp: correctly rounded. **Source**: libm.
#[must_use]
#[inline]
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// √(x² + y²) without over- or underflow of the squares.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}
