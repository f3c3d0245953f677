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
pub fn fraction(value: f64) -> f64 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < 1.0 { value } else { 1.0 }
}

/// The nearest number in [0, 1), NaN becoming 0: for random numbers that an inversion gives back.
///
/// ```
/// use linelit_geometry::finite::{BELOW_ONE, below_one};
/// assert_eq!([-1.0, f64::NAN, 0.5, 2.0].map(below_one), [0.0, 0.0, 0.5, BELOW_ONE]);
/// ```
#[inline(always)]
#[must_use]
pub fn below_one(value: f64) -> f64 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < BELOW_ONE { value } else { BELOW_ONE }
}

/// A power of two that takes a number > 0 to [1, 2), or as far as 2^±1000 does: a factor that
/// changes no bit of what does not depend on scale, so that squares and products are numbers.
///
/// ```
/// use linelit_geometry::finite::power_of_two_over;
/// assert_eq!([0.75, 3.0, 5e-324].map(power_of_two_over), [2.0, 0.5, 2f64.powi(1000)]);
/// ```
#[inline]
#[must_use]
pub fn power_of_two_over(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52) & 0x7FF;
    f64::from_bits(2046_u64.saturating_sub(exponent).clamp(23, 2023) << 52)
}
