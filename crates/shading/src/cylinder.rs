//! This module integrates over a thin cylinder, the linear light of Nishita and Peters, as a
//! diffuse surface receives it.
//!
//! # Two models of a line of light
//!
//! | model | what it is | integrand over the angle φ along the line | unit of strength |
//! |---|---|---|---|
//! | [`ribbon`](crate::ribbon) (Billen & Dutré) | a flat strip with a normal m | cos φ (n·ω) · (−m·q)/h² | radiance × width |
//! | cylinder (Nishita, Peters) | the surface of a cylinder of radius R → 0 | 2 cos φ (n·ω)/h | radiance × radius |
//!
//! Here φ is measured from q, the point of the line nearest to the shading point, and h = |q|. The
//! cylinder is a ribbon of width 2R that always faces the shading point. A finite cylinder differs
//! from the limit by the order of R/h; its caps are ignored.

use crate::fast_path::{self, Point};
use crate::span::Span;
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;
use linelit_simd::One;
use std::f64::consts::PI;

/// Returns the irradiance of a linear light for each unit of radiance × radius, in 1/length: its
/// projected solid angle for each unit of radius.
///
/// **Formula**: `2 h ∫ max(0, n·p)/|p|⁴ dt`, that is, after clipping,
///
/// ```text
/// sin δ/(r0 r1) · [ c0 (1 + G (r1/r0 − cos δ)) + c1 (1 + G (r0/r1 − cos δ)) ]
/// ```
///
/// with the symbols of [`ribbon`](crate::ribbon); sin δ comes from an exact cross product where the
/// line points at the shading point.
///
/// **Domain**: the domain of [`ribbon::line_integral`](crate::ribbon::line_integral).
///
/// **Error**: below 1e-13 relative (`docs/accuracy.md`).
///
/// **Source**: Nishita et al. 1985; Peters 2021, eqs. 1–3, whose `F(ω₁) − F(ω₀)` cancels.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// let e = linelit_shading::cylinder::irradiance(
///     DVec3::new(-1e9, 0.0, 2.0), DVec3::new(1e9, 0.0, 2.0), DVec3::Z);
/// assert!((e - std::f64::consts::FRAC_PI_2).abs() < 1e-8); // π/h for an infinite line
/// ```
#[inline]
#[must_use]
pub fn irradiance(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let (a, b, up) = (p0.to_array(), p1.to_array(), n.to_array());
    let (value, held) = fast_path::cylinder(One, a, b, up);
    if held { value } else { robust(a, b, up) }
}

/// Computes [`irradiance`] for segments outside the fast path.
#[inline(always)]
pub(crate) fn robust(p0: Point, p1: Point, n: Point) -> f64 {
    let [p0, p1, n] = [p0, p1, n].map(DVec3::from_array);
    general(p0, p1, n)
}

/// Computes [`irradiance`] from the part of the segment above the horizon.
#[inline(never)]
fn general(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some(span) = Span::new(p0, p1, n) else {
        return 0.0;
    };
    let [r0, r1] = span.radii;
    let value = match span.lune() {
        Some(g) => span.sine() * (span.weighted_cosines(g) / r0 / r1),
        None => PI * (span.grazed(2) / r0 / r1),
    };
    nonnegative(value * span.unit)
}

/// Returns the solid angle of the whole segment for each unit of radius, in 1/length, without a
/// horizon.
///
/// **Formula**: `(2/h)(sin φ₁ − sin φ₀) = 2 sin δ (1/r0 + 1/r1)/(1 + cos δ)`, with
/// `1 + cos δ = sin² δ/(1 − cos δ)` where δ is obtuse.
///
/// **Domain**: any finite segment; a line through the shading point gives 0 (it diverges there).
///
/// **Error**: below 1e-13 relative. **Source**: Peters 2021, eq. 1, rearranged.
///
/// ```
/// // Seen from its middle plane, two away: 2 sin φ₁ / h with tan φ₁ = 1/2.
/// use linelit_shading::geometry::DVec3;
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let each = linelit_shading::cylinder::solid_angle(p0, p1);
/// assert!((each - 2.0 / 5_f64.sqrt()).abs() < 1e-15);
/// ```
#[inline]
#[must_use]
pub fn solid_angle(p0: DVec3, p1: DVec3) -> f64 {
    let Some(span) = Span::unclipped(p0, p1) else {
        return 0.0;
    };
    let [r0, r1] = span.radii;
    let sine = span.sine();
    let inverse = 1.0 / r0 + 1.0 / r1;
    let value = if span.cos > -0.5 {
        2.0 * sine * inverse / (1.0 + span.cos)
    } else if sine > 0.0 {
        2.0 * inverse * (1.0 - span.cos) / sine
    } else {
        0.0
    };
    nonnegative(value * span.unit)
}
