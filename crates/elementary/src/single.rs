//! The same of single precision.
#![allow(clippy::disallowed_types, reason = "one of the two precisions")]

/// sin x and cos x of an angle in radians; NaN for ±∞.
///
/// **Error**: 1 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}

/// The angle in [−π, π] of the point (x, y) about the origin, measured from the x axis; its sign is
/// that of y, of zeros, too.
///
/// **Error**: 1.5 ulp. **Source**: libm.
#[must_use]
#[inline]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}
