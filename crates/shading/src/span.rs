//! What every integral along a line needs to know of a segment above the horizon.

use crate::exact::{area_vector, length};
use crate::horizon::{ClippedSegment, clip_segment};
use crate::special::lune;
use linelit_geometry::{DVec3, finite::power_of_two_over};
use std::f64::consts::PI;

/// Squared distances within which the plain formulas neither overflow nor underflow.
const SAFE: std::ops::Range<f64> = 1e-120..1e120;

/// A segment above the horizon, with its ends seen from the shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// `n·p` at the ends, not negative.
    pub(crate) cosines: [f64; 2],
    /// Distances of the ends.
    pub(crate) radii: [f64; 2],
    /// Length after clipping.
    pub(crate) length: f64,
    /// Cosine of the angle δ that the segment subtends.
    pub(crate) cos: f64,
    /// What is left of the segment.
    pub(crate) fraction: f64,
    /// The ends before clipping.
    pub(crate) whole: [DVec3; 2],
    /// Lengths were multiplied by this (a power of two, 1 for scenes of human size).
    pub(crate) unit: f64,
}

impl Span {
    /// Clips to the horizon of `n`; `None` where nothing is left, where the segment has no length
    /// and where an end is the shading point itself.
    #[inline(always)]
    pub(crate) fn new(p0: DVec3, p1: DVec3, n: DVec3) -> Option<Self> {
        let (a, b) = (p0.length_squared(), p1.length_squared());
        if SAFE.contains(&a) && SAFE.contains(&b) {
            Self::clipped(p0, p1, n, 1.0)
        } else {
            Self::rescaled(p0, p1, n)
        }
    }

    #[cold]
    #[inline(never)]
    fn rescaled(p0: DVec3, p1: DVec3, n: DVec3) -> Option<Self> {
        let unit = power_of_two_unit(p0.abs().max_element().max(p1.abs().max_element()))?;
        Self::clipped(p0 * unit, p1 * unit, n, unit)
    }

    #[inline(always)]
    fn clipped(p0: DVec3, p1: DVec3, n: DVec3, unit: f64) -> Option<Self> {
        Self::measured(clip_segment(p0, p1, n)?, [p0, p1], unit)
    }

    #[inline(always)]
    fn measured(clipped: ClippedSegment, whole: [DVec3; 2], unit: f64) -> Option<Self> {
        let (a, b) = (clipped.p0, clipped.p1);
        let radii = [a.length(), b.length()];
        let span = length(whole[1] - whole[0]) * clipped.fraction;
        let product = radii[0] * radii[1];
        if !(product > 0.0 && span > 0.0) {
            return None;
        }
        Some(Self {
            cosines: clipped.cosines,
            radii,
            length: span,
            cos: (a.dot(b) / product).clamp(-1.0, 1.0),
            fraction: clipped.fraction,
            whole,
            unit,
        })
    }

    /// The whole segment, without a horizon; its cosines are all one.
    pub(crate) fn unclipped(p0: DVec3, p1: DVec3) -> Option<Self> {
        let (a, b) = (p0.length_squared(), p1.length_squared());
        let unit = if SAFE.contains(&a) && SAFE.contains(&b) {
            1.0
        } else {
            power_of_two_unit(p0.abs().max_element().max(p1.abs().max_element()))?
        };
        let whole = ClippedSegment {
            p0: p0 * unit,
            p1: p1 * unit,
            cosines: [1.0, 1.0],
            fraction: 1.0,
        };
        Self::measured(whole, [whole.p0, whole.p1], unit)
    }

    /// The normal of the plane of the shading point and the line, |p0 × p1| of the clipped ends
    /// long: from the unclipped ends, whose cross product is exact.
    #[inline]
    pub(crate) fn area_vector(&self) -> DVec3 {
        area_vector(self.whole[0], self.whole[1]) * self.fraction
    }

    /// sin δ, accurate relative to itself for δ → 0 and δ → π.
    #[inline]
    pub(crate) fn sine(&self) -> f64 {
        (length(self.area_vector()) / self.radii[0] / self.radii[1]).min(1.0)
    }

    /// sin δ where the cosine is known to be negative: from it where that is accurate.
    #[inline(always)]
    fn sine_of_obtuse(&self) -> f64 {
        if self.cos > -0.5 {
            ((1.0 - self.cos) * (1.0 + self.cos)).sqrt()
        } else {
            self.sine()
        }
    }

    /// G = (δ − sin δ cos δ)/sin³ δ; `None` where the line passes through the shading point.
    #[inline(always)]
    pub(crate) fn lune(&self) -> Option<f64> {
        if self.cos >= 0.0 {
            return Some(lune(self.cos));
        }
        let sine = self.sine_of_obtuse();
        let cube = sine * sine * sine;
        (cube > 1e-290).then(|| PI / cube - lune(-self.cos))
    }

    /// 1 + cos δ, accurate relative to itself for δ → π.
    #[inline(always)]
    pub(crate) fn one_plus_cos(&self) -> f64 {
        if self.cos > -0.5 {
            1.0 + self.cos
        } else {
            let sine = self.sine();
            sine * sine / (1.0 - self.cos)
        }
    }

    /// c0 w0 + c1 w1 with the weights `w0 = 1 + G (r1/r0 − cos δ)` of the ends, each the positive
    /// integral of a hat function: nothing cancels.
    #[inline(always)]
    pub(crate) fn weighted_cosines(&self, g: f64) -> f64 {
        let [r0, r1] = self.radii;
        let [c0, c1] = self.cosines;
        let ratio = r1 / r0;
        let w0 = 1.0 + g * (ratio - self.cos);
        let w1 = 1.0 + g * (r0 / r1 - self.cos);
        c0 * w0 + c1 * w1
    }
}

/// The power of two that brings `largest` near one; `None` for zero, infinity and NaN.
pub(crate) fn power_of_two_unit(largest: f64) -> Option<f64> {
    (largest > 0.0 && largest.is_finite()).then(|| power_of_two_over(largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_a_power_of_two_near_the_inverse() {
        for x in [1.0, 3.7, 1e-200, 1e200, 1e300, 1e-300] {
            let unit = power_of_two_unit(x).unwrap();
            assert!((1.0..2.0).contains(&(unit * x)), "{x} {unit}");
        }
        assert!(power_of_two_unit(0.0).is_none());
        assert!(power_of_two_unit(f64::NAN).is_none());
    }
}
