//! What must be finite and in range, whatever rounding, overflow and input that is no number left.

use crate::DVec3;

/// The largest `f64` below one, where random numbers end.
pub const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Nothing below zero, nothing infinite, no NaN: zero for what is negative or no number, the
/// largest `f64` for what is above.
///
/// ```
/// use linelit_geometry::finite::nonnegative;
/// let all = [-1.0, f64::NAN, 2.0, f64::INFINITY].map(nonnegative);
/// assert_eq!(all, [0.0, 0.0, 2.0, f64::MAX]);
/// ```
#[inline(always)]
#[must_use]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub fn nonnegative(value: f64) -> f64 {
    value.max(0.0).min(f64::MAX)
}

/// [`nonnegative`] by component, as light in three channels has to be.
#[inline(always)]
#[must_use]
pub fn nonnegative_vector(value: DVec3) -> DVec3 {
    DVec3::new(
        nonnegative(value.x),
        nonnegative(value.y),
        nonnegative(value.z),
    )
}

/// The nearest number in [0, 1], NaN becoming 0.
///
/// ```
/// use linelit_geometry::finite::fraction;
/// assert_eq!([-1.0, f64::NAN, 0.5, 2.0].map(fraction), [0.0, 0.0, 0.5, 1.0]);
/// ```
#[inline(always)]
#[must_use]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub fn fraction(value: f64) -> f64 {
    value.max(0.0).min(1.0)
}
