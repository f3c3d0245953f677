//! This module holds the part of a segment above the horizon with its distances and angles, with
//! which every integral along a line begins.

use crate::exact::{area_vector, length};
use crate::horizon::{ClippedSegment, clip_segment};
use crate::special::lune;
use linelit_geometry::{DVec3, finite::power_of_two_over};
use std::f64::consts::PI;

/// The range of squared distances within which the plain formulas neither overflow nor underflow.
const SAFE: std::ops::Range<f64> = 1e-120..1e120;

/// The smallest length whose square has all its digits.
pub(crate) const LEAST_LENGTH: f64 = 1e-140;

/// The smallest distance, for corners near one, at which products of three distances do not
/// underflow.
pub(crate) const NEAREST: f64 = 1e-90;

/// A segment above the horizon, as seen from the shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// `n·p` at the ends, not negative.
    pub(crate) cosines: [f64; 2],
    /// The distances of the ends.
    pub(crate) radii: [f64; 2],
    /// The length after clipping.
    pub(crate) length: f64,
    /// The cosine of the angle δ that the segment subtends.
    pub(crate) cos: f64,
    /// The fraction of the segment that remains.
    pub(crate) fraction: f64,
    /// The ends before clipping.
    pub(crate) whole: [DVec3; 2],
    /// The power of two with which lengths were multiplied: 1 for scenes of human size.
    pub(crate) unit: f64,
}

impl Span {
    /// Clips to the horizon of `n`; `None` where no part is left, where the segment has no length,
    /// and where an end is the shading point itself.
    #[inline(always)]
    pub(crate) fn new(p0: DVec3, p1: DVec3, n: DVec3) -> Option<Self> {
        let (a, b) = (p0.length_squared(), p1.length_squared());
        if SAFE.contains(&a) && SAFE.contains(&b) {
            let clipped = clip_segment(p0, p1, n)?;
            let radii = [clipped.p0.length(), clipped.p1.length()];
            if radii[0].min(radii[1]) > LEAST_LENGTH {
                return Self::measured(clipped, radii, [p0, p1], 1.0);
            }
        }
        Self::rescaled(p0, p1, n)
    }

    /// Does what [`Self::new`] does, after scaling by a power of two.
    #[cold]
    #[inline(never)]
    fn rescaled(p0: DVec3, p1: DVec3, n: DVec3) -> Option<Self> {
        let unit = power_of_two_unit(p0.abs().max_element().max(p1.abs().max_element()))?;
        let whole = [p0 * unit, p1 * unit];
        Self::near_or_far(clip_segment(whole[0], whole[1], n)?, whole, unit)
    }

    /// Does what [`Self::measured`] does where squares of distances may have lost digits.
    fn near_or_far(left: ClippedSegment, whole: [DVec3; 2], unit: f64) -> Option<Self> {
        let scale = scale_of_ends([left.p0, left.p1])?;
        let whole = whole.map(|p| p * scale);
        let left = ClippedSegment {
            p0: left.p0 * scale,
            p1: left.p1 * scale,
            cosines: left.cosines.map(|c| c * scale),
            fraction: left.fraction,
        };
        let radii = [length(left.p0), length(left.p1)];
        Self::measured(left, radii, whole, unit * scale)
    }

    /// Measures a clipped segment whose distances have all digits.
    #[inline(always)]
    fn measured(
        clipped: ClippedSegment,
        radii: [f64; 2],
        whole: [DVec3; 2],
        unit: f64,
    ) -> Option<Self> {
        let (a, b) = (clipped.p0, clipped.p1);
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

    /// Takes the whole segment, without a horizon; its cosines are all one.
    #[inline(always)]
    pub(crate) fn unclipped(p0: DVec3, p1: DVec3) -> Option<Self> {
        let (a, b) = (p0.length_squared(), p1.length_squared());
        if SAFE.contains(&a) && SAFE.contains(&b) {
            let radii = [a.sqrt(), b.sqrt()];
            return Self::measured(Self::all([p0, p1]), radii, [p0, p1], 1.0);
        }
        Self::unclipped_rescaled(p0, p1)
    }

    /// Does what [`Self::unclipped`] does, after scaling by a power of two.
    #[cold]
    #[inline(never)]
    fn unclipped_rescaled(p0: DVec3, p1: DVec3) -> Option<Self> {
        let unit = power_of_two_unit(p0.abs().max_element().max(p1.abs().max_element()))?;
        let whole = [p0 * unit, p1 * unit];
        Self::near_or_far(Self::all(whole), whole, unit)
    }

    /// Returns the whole segment as if it had been clipped.
    fn all([p0, p1]: [DVec3; 2]) -> ClippedSegment {
        ClippedSegment {
            p0,
            p1,
            cosines: [1.0, 1.0],
            fraction: 1.0,
        }
    }

    /// Returns the normal of the plane through the shading point and the line, with the length |p0
    /// × p1| of the clipped ends. It is computed from the unclipped ends, whose cross product is
    /// exact.
    #[inline]
    pub(crate) fn area_vector(&self) -> DVec3 {
        area_vector(self.whole[0], self.whole[1]) * self.fraction
    }

    /// Returns sin δ, accurate relative to itself for δ → 0 and δ → π.
    #[inline]
    pub(crate) fn sine(&self) -> f64 {
        (length(self.area_vector()) / self.radii[0] / self.radii[1]).min(1.0)
    }

    /// Returns sin δ where the cosine is known to be negative; from the cosine where that is
    /// accurate.
    #[inline(always)]
    fn sine_of_obtuse(&self) -> f64 {
        if self.cos > -0.5 {
            ((1.0 - self.cos) * (1.0 + self.cos)).sqrt()
        } else {
            self.sine()
        }
    }

    /// Returns G = (δ − sin δ cos δ)/sin³ δ; `None` where the line passes through the shading
    /// point.
    #[inline(always)]
    pub(crate) fn lune(&self) -> Option<f64> {
        if self.cos >= 0.0 {
            return Some(lune(self.cos));
        }
        let sine = self.sine_of_obtuse();
        let cube = sine * sine * sine;
        (cube > 1e-290).then(|| PI / cube - lune(-self.cos))
    }

    /// Returns (c0/r0 + c1/r1)(r0 + r1)/sinᵏ δ for a line that passes so near to the shading point
    /// that [`Self::lune`] overflows. There G is π/sin³ δ, and π times this quotient for k = 3 is
    /// the sum of the weighted cosines. It is zero for a line through the shading point.
    #[cold]
    #[inline(never)]
    pub(crate) fn grazed(&self, k: i32) -> f64 {
        let [r0, r1] = self.radii;
        let [c0, c1] = self.cosines;
        let sine = self.sine();
        if sine <= 0.0 {
            return 0.0;
        }
        let sum = (c0 / r0 + c1 / r1) * (r0 + r1);
        // Divide one by one: the power may underflow where the quotient is finite.
        (0..k).fold(sum, |quotient, _| quotient / sine)
    }

    /// Returns c0 w0 + c1 w1 with the weights `w0 = 1 + G (r1/r0 − cos δ)` of the ends, each the
    /// positive integral of a hat function, so that nothing cancels.
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

/// Returns a corner of a light of about unit size. If it is so near to the shading point that
/// products of three distances would underflow, the result is [`near_one`] of it.
#[inline(always)]
pub(crate) fn not_too_near(p: DVec3) -> DVec3 {
    if p.abs().max_element() > NEAREST {
        p
    } else {
        near_one(p)
    }
}

/// Returns the point at about unit distance in the direction of p, for sums that depend on
/// directions only; zero for zero. The scale is a power of two, so that no digit is lost.
#[inline(always)]
pub(crate) fn near_one(p: DVec3) -> DVec3 {
    p * power_of_two_unit(p.abs().max_element()).unwrap_or(0.0)
}

/// Returns one, or, where both ends are near the shading point, the power of two that brings the
/// farther end to 2⁻²⁰, so that the whole segment from which they were cut does not overflow;
/// `None` for the shading point itself.
pub(crate) fn scale_of_ends([a, b]: [DVec3; 2]) -> Option<f64> {
    let size = a.abs().max(b.abs()).max_element();
    if size > 1e-6 {
        return Some(1.0);
    }
    Some(power_of_two_unit(size)? / 1_048_576.0)
}

/// Returns the power of two that brings `largest` near one; `None` for zero, infinity and NaN.
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
