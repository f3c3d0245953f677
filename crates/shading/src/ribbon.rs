//! This module integrates over a ribbon, a line of an area light, as a diffuse surface receives it.
//!
//! The area light is cut into parallel strips of width dw. Each strip is flat, emits to the side of
//! the light's normal m, and is so thin that only its length matters. **Symbols**: the shading
//! point is the origin; n is the shading normal, of unit length (results are proportional to it);
//! p(t) are the points of the segment, and t the length from p0; rᵢ = |pᵢ|; cᵢ = n·pᵢ; l is the
//! segment's length; δ the angle between its ends; L the radiance.

use crate::exact::dot;
use crate::fast_path::{self, Point};
use crate::span::Span;
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;
use linelit_simd::One;
use std::f64::consts::PI;

/// Returns `∫ max(0, n·p)/|p|⁴ dt` along the segment from `p0` to `p1`, relative to the shading
/// point.
///
/// **Measure and units**: the input is in length, the result in 1/length². To be an irradiance for
/// each unit of radiance and width, it has to be multiplied by the height of the shading point
/// above the light's plane, `−m·p` (the same along the whole line: [`emitter`], which is 0 behind a
/// one-sided light).
///
/// **Formula**: after clipping to the horizon,
///
/// ```text
/// I = l/(2 r0² r1²) · [ c0 (1 + G (r1/r0 − cos δ)) + c1 (1 + G (r0/r1 − cos δ)) ]
/// G = (δ − sin δ cos δ)/sin³ δ
/// ```
///
/// Both factors of the cosines are positive, so that nothing cancels. G is an analytic function of
/// cos δ down to a right angle (for an obtuse δ, G = π/sin³ δ − G(π − δ)). Neither the distance h
/// of the line nor the angle is needed, so that the line may point at the shading point.
///
/// **Domain**: any finite segment. A segment without length, or one through the shading point
/// (where the integral diverges), gives 0; results that overflow give the bounds of `f64`.
///
/// **Error**: below 1e-13 relative, also at grazing incidence (`docs/accuracy.md`).
///
/// **Source**: Billen & Dutré 2016, eqs. 17–20. Eq. 20 as printed lacks a factor and swaps two
/// symbols; corrected, it still cancels. The form above is a rearrangement of our own.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::ribbon::{self, Sides};
/// // A line of a light that faces down, one and a half above the point.
/// let (p0, p1, down) = (DVec3::new(-1.0, 0.0, 1.5), DVec3::new(1.0, 0.0, 1.5), -DVec3::Z);
/// let height = ribbon::emitter(p0, p1, down, Sides::One);
/// let irradiance = height * ribbon::line_integral(p0, p1, DVec3::Z);
/// assert_eq!(height, 1.5);
/// assert!((irradiance - 0.699_694_043_390_686).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn line_integral(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let (a, b, up) = (p0.to_array(), p1.to_array(), n.to_array());
    let (value, held) = fast_path::ribbon(One, a, b, up);
    if held { value } else { robust(a, b, up) }
}

/// Computes [`line_integral`] for segments outside the fast path.
#[inline(always)]
pub(crate) fn robust(p0: Point, p1: Point, n: Point) -> f64 {
    let [p0, p1, n] = [p0, p1, n].map(DVec3::from_array);
    general(p0, p1, n)
}

/// Computes [`line_integral`] from the part of the segment above the horizon.
#[inline(never)]
fn general(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some(span) = Span::new(p0, p1, n) else {
        return 0.0;
    };
    let product = span.radii[0] * span.radii[1];
    let sum = match span.lune() {
        Some(g) => span.weighted_cosines(g),
        None => PI * span.grazed(3),
    };
    let value = 0.5 * (span.length / product) * (sum / product);
    nonnegative(value * span.unit * span.unit)
}

/// Returns `∫ max(0, n·p) w(p)/|p|⁴ dt` along a ribbon whose width w changes linearly from
/// `widths[0]` at `p0` to `widths[1]` at `p1`, neither negative. Such a ribbon is a piece of a thin
/// triangle, where lines meet in a point of the light. With both widths one it is
/// [`line_integral`], to rounding.
///
/// **Formula**: with the symbols of [`line_integral`], after clipping to the horizon,
///
/// ```text
/// I = l/(2 r0² r1²) · [ G (c0 w0 r1/r0 + c1 w1 r0/r1) + (1 − G cos δ) (c0 w1 + c1 w0) ]
/// ```
///
/// Here 1 − G cos δ is 1/3 for δ → 0, and larger elsewhere. (Over the angle v from p0, n·p and w
/// are each sums of the values at the ends times sin v or sin (δ − v): these are integrals of
/// products of two sines.)
///
/// **Domain**: any finite segment; 0 if the line passes the shading point nearer than 1e-96 of the
/// distance of its ends.
///
/// **Error**: below 1e-13 relative.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::ribbon;
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 1.5), DVec3::new(1.0, 0.0, 1.5));
/// let even = ribbon::line_integral(p0, p1, DVec3::Z);
/// // A thin triangle has half the area, and looks the same from either end.
/// let thin = ribbon::tapered(p0, p1, DVec3::Z, [0.0, 1.0]);
/// assert!((thin / even - 0.5).abs() < 1e-15);
/// ```
#[must_use]
pub fn tapered(p0: DVec3, p1: DVec3, n: DVec3, widths: [f64; 2]) -> f64 {
    let Some(span) = Span::new(p0, p1, n) else {
        return 0.0;
    };
    let Some(g) = span.lune() else {
        return 0.0;
    };
    let ([r0, r1], [c0, c1]) = (span.radii, span.cosines);
    // Interpolate the width where the horizon cuts an end, at most one; nothing cancels.
    let [mut w0, mut w1] = widths;
    let heights = span.whole.map(|p| dot(n, p));
    let [h0, h1] = heights.map(f64::abs);
    let on_horizon = (w0 * h1 + w1 * h0) / (h0 + h1);
    if heights[0] < 0.0 {
        w0 = on_horizon;
    } else if heights[1] < 0.0 {
        w1 = on_horizon;
    }
    let own = c0 * w0 * (r1 / r0) + c1 * w1 * (r0 / r1);
    let sum = g * own + (1.0 - g * span.cos) * (c0 * w1 + c1 * w0);
    let product = r0 * r1;
    let value = 0.5 * (span.length / product) * (sum / product);
    nonnegative(value * span.unit * span.unit)
}

/// The sides of a ribbon that emit light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The side to which its normal points.
    One,
    /// Both of its sides.
    Both,
}

/// Returns the emitter's factor `−m·p`: the distance of the shading point from the light's plane,
/// on the side to which its normal m points; 0 behind a one-sided light.
///
/// **Error**: 8 ε relative for the given p; it is computed at the nearer end.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::ribbon::{Sides, emitter};
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// assert_eq!(emitter(p0, p1, -DVec3::Z, Sides::One), 2.0);
/// assert_eq!(emitter(p0, p1, DVec3::Z, Sides::One), 0.0);
/// ```
#[inline]
#[must_use]
pub fn emitter(p0: DVec3, p1: DVec3, m: DVec3, sides: Sides) -> f64 {
    let near = if p0.length_squared() <= p1.length_squared() {
        p0
    } else {
        p1
    };
    let height = -dot(m, near);
    nonnegative(match sides {
        Sides::One => height,
        Sides::Both => height.abs(),
    })
}

/// Returns the radiance that a diffuse surface of albedo k_d reflects, for each unit of the
/// ribbon's radiance and width: `(k_d/π) (−m·p) ∫ max(0, n·p)/|p|⁴ dt`, in 1/length.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::ribbon::{Sides, reflected};
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let radiance = reflected(p0, p1, DVec3::Z, -DVec3::Z, Sides::One, 0.5);
/// assert!(radiance > 0.0);
/// ```
#[inline]
#[must_use]
pub fn reflected(p0: DVec3, p1: DVec3, n: DVec3, m: DVec3, sides: Sides, albedo: f64) -> f64 {
    let height = emitter(p0, p1, m, sides);
    if height > 0.0 {
        nonnegative(albedo * std::f64::consts::FRAC_1_PI * height * line_integral(p0, p1, n))
    } else {
        0.0
    }
}
