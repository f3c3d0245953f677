//! A line of isotropic point lights, seen by a diffuse surface (Picott's linear light).
//!
//! See [`cylinder`](crate::cylinder) for the three models of a line side by side.

use crate::fast_path::{self, Point};
use crate::span::Span;
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;
use linelit_simd::One;

/// `∫ max(0, n·p)/|p|³ dt`: the irradiance for each unit of intensity per length, 1/length.
///
/// **Formula**: after clipping, with the symbols of [`ribbon`](crate::ribbon),
///
/// ```text
/// l (c0/r0 + c1/r1) / (r0 r1 (1 + cos δ)),      1 + cos δ = sin² δ/(1 − cos δ) for an obtuse δ
/// ```
///
/// No trigonometric function, no distance of the line, no cancellation.
///
/// **Domain**: as [`ribbon::irradiance`](crate::ribbon::irradiance).
///
/// **Error**: below 1e-13 relative (`docs/accuracy.md`).
///
/// **Source**: Picott 1992 (whose form divides by h and cancels); this form is the sum of the two
/// hat-function integrals of the segment.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// let e = linelit_shading::point_line::irradiance(
///     DVec3::new(-1e9, 0.0, 2.0), DVec3::new(1e9, 0.0, 2.0), DVec3::Z);
/// assert!((e - 1.0).abs() < 1e-8); // 2/h for an infinite line
/// ```
#[inline]
#[must_use]
pub fn irradiance(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let (a, b, up) = (p0.to_array(), p1.to_array(), n.to_array());
    let (value, held) = fast_path::point_line(One, a, b, up);
    if held { value } else { robust(a, b, up) }
}

/// [`irradiance`] for every other segment.
#[inline(always)]
pub(crate) fn robust(p0: Point, p1: Point, n: Point) -> f64 {
    let [p0, p1, n] = [p0, p1, n].map(DVec3::from_array);
    general(p0, p1, n)
}

#[inline(never)]
fn general(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some(span) = Span::new(p0, p1, n) else {
        return 0.0;
    };
    let [r0, r1] = span.radii;
    let [c0, c1] = span.cosines;
    let below = span.one_plus_cos();
    let ratio = if below > 1e-290 {
        (c0 / r0 + c1 / r1) / below
    } else {
        2.0 * span.grazed(2) / (r0 + r1)
    };
    nonnegative((span.length / r0 / r1) * ratio * span.unit)
}
