//! This module clips a segment to a half-space whose plane passes through the shading point: the
//! horizon of a surface, or of a lobe.

use crate::exact::dot;
use crate::span::power_of_two_unit;
use linelit_geometry::double::{self, Double};
use linelit_geometry::{DVec3, predicates};

/// A segment relative to the shading point, clipped to `k·p ≥ 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClippedSegment {
    /// The start of the part above the horizon.
    pub p0: DVec3,
    /// The end of the part above the horizon.
    pub p1: DVec3,
    /// `k·p0` and `k·p1`: not negative, and exactly zero at an end that was clipped.
    pub cosines: [f64; 2],
    /// The fraction of the segment's length above the horizon. It is a quotient of sums of terms
    /// with one sign, so that its relative error is small even for a sliver.
    pub fraction: f64,
}

/// Clips the segment to the half-space `k·p ≥ 0`. `None` if no part of it has `k·p > 0`, and if
/// numbers overflow.
///
/// **Formula**: with `c = k·p` at the ends, the crossing is `Q = (p0 c1 − p1 c0)/(c1 − c0)`. Where
/// the line passes so near the shading point that this cancels, it is
/// `Q = (k × (p0 × p1))/(k·(p1 − p0))` in twice the working precision.
///
/// **Error**: relative, 2 ε for the cosines, also at grazing incidence, and 50 ε for |Q|, however
/// near to the shading point.
///
/// **Domain**: finite ends; coordinates between 1e-140 and 1e140 in magnitude, or zero.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::horizon::clip_segment;
/// let clipped = clip_segment(DVec3::new(1.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 3.0), DVec3::Z);
/// assert_eq!(clipped.unwrap().p0.z, 0.0);
/// assert!(clip_segment(-DVec3::Z, -DVec3::Z + DVec3::X, DVec3::Z).is_none());
/// ```
#[inline]
#[must_use]
pub fn clip_segment(p0: DVec3, p1: DVec3, k: DVec3) -> Option<ClippedSegment> {
    let (c0, c1) = (dot(k, p0), dot(k, p1));
    // Compare with the largest number, not with infinity: the compiler would test the sum's bits.
    if c0 >= 0.0 && c1 >= 0.0 && c0 + c1 > 0.0 && c0 + c1 <= f64::MAX {
        return Some(ClippedSegment {
            p0,
            p1,
            cosines: [c0, c1],
            fraction: 1.0,
        });
    }
    cut(p0, p1, k, c0, c1)
}

/// Clips a segment of which an end is below the horizon, for [`clip_segment`].
#[inline(never)]
fn cut(p0: DVec3, p1: DVec3, k: DVec3, c0: f64, c1: f64) -> Option<ClippedSegment> {
    if !(c0 > 0.0 || c1 > 0.0) || c0.is_nan() || c1.is_nan() {
        return None;
    }
    let q = crossing(p0, p1, k, c0, c1);
    // The signs differ, so this difference adds magnitudes.
    let span = c1 - c0;
    if !(q.is_finite() && span.is_finite()) || (c0 >= 0.0 && c1 >= 0.0) {
        return None;
    }
    Some(if c0 < 0.0 {
        ClippedSegment {
            p0: q,
            p1,
            cosines: [0.0, c1],
            fraction: c1 / span,
        }
    } else {
        ClippedSegment {
            p0,
            p1: q,
            cosines: [c0, 0.0],
            fraction: -c0 / span,
        }
    })
}

/// Returns the point of the line through `p0` and `p1` in the plane `k·p = 0`, for cosines of
/// different signs.
pub(crate) fn crossing(p0: DVec3, p1: DVec3, k: DVec3, c0: f64, c1: f64) -> DVec3 {
    let span = c1 - c0;
    let (a, b) = (p0 * (c1 / span), p1 * (-c0 / span));
    let sum = a + b;
    let squares = a.length_squared() + b.length_squared();
    // A cancellation by less than a factor of 8 costs 3 of 53 bits.
    if 64.0 * sum.length_squared() > squares {
        return sum;
    }
    if (1e-180..1e180).contains(&squares) {
        across(p0, p1, k) / span
    } else {
        extreme_crossing(p0, p1, k, span)
    }
}

/// Computes [`crossing`] where products of coordinates may overflow or underflow.
#[cold]
#[inline(never)]
fn extreme_crossing(p0: DVec3, p1: DVec3, k: DVec3, span: f64) -> DVec3 {
    let unit = power_of_two_unit(p0.abs().max(p1.abs()).max_element()).unwrap_or(0.0);
    across(p0 * unit, p1 * unit, k) / (span * unit) / unit
}

/// Returns k × (p0 × p1), computed in twice the working precision.
fn across(p0: DVec3, p1: DVec3, k: DVec3) -> DVec3 {
    let across = double::cross_of(p0, p1);
    let rest = DVec3::from(across.map(Double::lo));
    predicates::cross(k, double::rounded(across)) + k.cross(rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::{
        assert_close, precise::Precise, real::Real, real::vector, rng::SplitMix64,
    };

    /// Lines that pass the shading point at 1 to 1e-14 of their length.
    #[test]
    fn crossing_is_accurate_relative_to_itself() {
        let mut rng = SplitMix64::new(7);
        for case in 0..2000 {
            let random = |rng: &mut SplitMix64| DVec3::from_array(rng.unit_vector());
            let (p0, k) = (random(&mut rng), random(&mut rng));
            let near = 10f64.powf(rng.in_range(-14.0, 0.0));
            let p1 = random(&mut rng) * near - p0 * rng.in_range(0.1, 3.0);
            let Some(clipped) = clip_segment(p0, p1, k) else {
                continue;
            };
            if clipped.fraction > 0.999_999 {
                continue;
            }
            let q = if clipped.cosines[0] > 0.0 {
                clipped.p1
            } else {
                clipped.p0
            };
            let [a, b, n] = [p0, p1, k].map(|v| vector::<Precise>(v.to_array()));
            let c = |v: &[Precise; 3]| linelit_testkit::real::dot(&n, v);
            let (c0, c1) = (c(&a), c(&b));
            let exact = [0, 1, 2].map(|i| {
                ((a[i].clone() * c1.clone() - b[i].clone() * c0.clone())
                    / (c1.clone() - c0.clone()))
                .to_f64()
            });
            let want = DVec3::from_array(exact);
            let error = (q - want).length() / want.length();
            // 8 (cancellation) times 4 roundings, and the cosines' own 2 eps, times two.
            assert_close!(
                error,
                0.0,
                50.0 * f64::EPSILON,
                "case {case}, near {near:e}"
            );
        }
    }
}
