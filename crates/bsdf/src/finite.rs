//! What rounding, overflow and input that is no number leave of values that must be finite.

use linelit_geometry::DVec3;

/// Nothing below zero, nothing infinite, no NaN.
#[inline(always)]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub(crate) fn settle(value: f64) -> f64 {
    value.max(0.0).min(f64::MAX)
}

/// [`settle`] by component.
#[inline(always)]
pub(crate) fn settled(value: DVec3) -> DVec3 {
    DVec3::new(settle(value.x), settle(value.y), settle(value.z))
}

/// Into [0, 1], NaN becoming 0.
#[inline(always)]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub(crate) fn fraction(value: f64) -> f64 {
    value.max(0.0).min(1.0)
}
