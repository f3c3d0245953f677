//! Limits for numbers that must be finite and in range, no matter what rounding, overflow or NaN in
//! the input have made of them.

use crate::DVec3;

/// The largest `f64` below one, the upper limit of random numbers.
pub const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Limits a number to [0, largest `f64`]; NaN becomes zero.
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

/// Applies [`nonnegative`] to each component, as for light in three channels.
#[inline(always)]
#[must_use]
pub fn nonnegative_vector(value: DVec3) -> DVec3 {
    DVec3::new(
        nonnegative(value.x),
        nonnegative(value.y),
        nonnegative(value.z),
    )
}

/// Limits a number to [0, 1]; NaN becomes 0.
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

/// Limits a number to [0, 1); NaN becomes 0. For random numbers that are recovered by an inversion.
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

/// Returns the power of two by which a positive number has to be multiplied to be in [1, 2),
/// limited to 2^±1000. Scaling all lengths by this power keeps squares and products from overflow
/// and underflow, and does not change a bit of results that do not depend on scale.
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
