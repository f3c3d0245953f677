//! This module integrates Phong lobes and generalised cosine lobes along a line.
//!
//! **Conventions**: the modified Phong BRDF is f = k_s (k + 2)/(2π) max(0, R·ω)ᵏ with R the mirror
//! direction of the viewer. Its albedo is k_s at normal incidence and less elsewhere, since the
//! part of the lobe below the horizon is lost. A factor (k + 1)/(2π) would normalise the lobe
//! *without* the receiver's cosine; it is not used here. A generalised cosine lobe (Lafortune et
//! al. 1997) f = c max(0, ω·(C ω_o))ᵏ is the same integral with the axis C ω_o, whose length is
//! free.
//!
//! **Symbols**: n is the shading normal, R the axis of the lobe, and k its exponent, any real
//! number ≥ 0; the others are defined in [`ribbon`](crate::ribbon). max(0, x)⁰ is one for x > 0 and
//! zero elsewhere, which is the limit for k → 0: a lobe with the exponent zero ends at its horizon
//! like all others.
//!
//! **Method** of all integrals here: the integral over the angle along the line is taken in t =
//! tan(x/2), where x is measured from the direction in which the lobe is highest. It has two panels
//! of 24 Gauss–Legendre nodes, which are cut where the lobe has fallen below e⁻⁴⁰ of its peak, so
//! that the cost does not depend on k. Powers are exp(−2k atanh q) with q = t(t + τ)/(1 − τt),
//! relative to the peak. The logarithm of the peak is computed from its difference to one; hence
//! the error does not grow like ε k.
//!
//! **Domain**: any input. A line through the shading point gives 0, and so does input that is not
//! finite.
//!
//! **Error**: below 1e-11 relative at any exponent from 0 to 1e5, also deep in the tails, down to
//! results of 1e-280 (`docs/accuracy.md`).
//!
//! **Source**: Billen & Dutré 2016, eqs. 9–16 and 21–24 (with errata: eqs. 14 and 21 lack the
//! constants, eq. 24 prints one line twice), whose recursion costs O(k), needs an integer and loses
//! the tails.

use crate::fan::Fan;
use crate::fast_lobe;
use crate::fast_path::Point;
use crate::lobe::integrate;
use crate::span::NEAREST;
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;
use std::f64::consts::PI;

/// The smallest length of a line whose length follows from its rounded ends, at about unit
/// distance, with a relative error of 1e-12.
const LONG: f64 = 1e-3;

/// Returns (k + 2)/(2π), the factor of the modified Phong BRDF.
///
/// ```
/// let factor = linelit_shading::phong::normalisation(0.0);
/// assert!((factor - std::f64::consts::FRAC_1_PI).abs() < 1e-15);
/// ```
#[must_use]
pub fn normalisation(k: f64) -> f64 {
    nonnegative((k + 2.0) / (2.0 * PI))
}

/// Returns `∫ max(0, n·p) max(0, R·p)ᵏ/|p|^(4+k) dt` along a ribbon, in 1/length².
///
/// Times [`emitter`](crate::ribbon::emitter) and [`normalisation`] this is the radiance for each
/// unit of k_s, radiance and width.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::{phong, ribbon};
/// let (p0, p1) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let diffuse = phong::ribbon(p0, p1, DVec3::Z, DVec3::Z, 0.0); // exponent 0
/// assert!((diffuse / ribbon::line_integral(p0, p1, DVec3::Z) - 1.0).abs() < 1e-14);
/// ```
#[inline]
#[must_use]
pub fn ribbon(p0: DVec3, p1: DVec3, n: DVec3, axis: DVec3, k: f64) -> f64 {
    let (a, b, up, lobe) = (p0.to_array(), p1.to_array(), n.to_array(), axis.to_array());
    if let Some(segment) = fast_lobe::measure(a, b, up, lobe, k) {
        return nonnegative(segment.integrate(k) * segment.inverse_distance());
    }
    robust([a, b, up, lobe], k, |fan, axis| {
        // The cosine at the emitter divided by its height is 1/|p|: at the points themselves this
        // is one.
        integrate(&fan.with_constant(1.0), axis, k) * fan.unit * fan.unit
    })
}

/// Computes [`ribbon`] for a line whose ends are rounded, from n·p and axis·p at the exact ends
/// (not negative) and the exact length.
pub(crate) fn ribbon_by_heights(
    ends: [DVec3; 2],
    heights: [[f64; 2]; 2],
    length: f64,
    [n, axis]: [DVec3; 2],
    k: f64,
) -> f64 {
    // High above the horizons, the rounded ends of a long line are accurate enough.
    let points = [ends[0], ends[1], n, axis].map(|v| v.to_array());
    let fast = || fast_lobe::measure(points[0], points[1], points[2], points[3], k);
    if let Some(segment) = (length > LONG).then(fast).flatten() {
        return nonnegative(segment.integrate(k) * segment.inverse_distance());
    }
    Fan::rounded(ends, heights, length).map_or(0.0, |fan| {
        nonnegative(integrate(&fan.with_constant(1.0), axis, k) * fan.unit * fan.unit)
    })
}

/// Returns `∫ max(0, n·p) w(p) max(0, R·p)ᵏ/|p|^(4+k) dt` along a ribbon whose width w changes
/// linearly between the given widths at its ends: see [`ribbon::tapered`](crate::ribbon::tapered).
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong;
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let even = phong::ribbon(p0, p1, DVec3::Z, DVec3::Z, 8.0);
/// let thin = phong::tapered(p0, p1, DVec3::Z, DVec3::Z, 8.0, [0.0, 1.0]);
/// assert!((thin / even - 0.5).abs() < 1e-14);
/// ```
#[must_use]
pub fn tapered(p0: DVec3, p1: DVec3, n: DVec3, axis: DVec3, k: f64, widths: [f64; 2]) -> f64 {
    // Divided by |p|, a width changes like the cosine of an emitter.
    let fan = Fan::new(p0, p1, &[n, DVec3::ZERO, axis], Some(widths)).filter(|_| k >= 0.0);
    fan.map_or(0.0, |fan| nonnegative(integrate(&fan, axis, k) * fan.unit))
}

/// Returns `2 h ∫ max(0, n·p) max(0, R·p)ᵏ/|p|^(4+k) dt` along a thin cylinder, in 1/length, for
/// each unit of radiance × radius. See [`cylinder`](crate::cylinder).
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::{cylinder, phong};
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// // With the exponent zero, it is the irradiance.
/// let flat = phong::cylinder(p0, p1, DVec3::Z, DVec3::X + DVec3::Z, 0.0);
/// assert!((flat / cylinder::irradiance(p0, p1, DVec3::Z) - 1.0).abs() < 1e-13);
/// ```
#[inline]
#[must_use]
pub fn cylinder(p0: DVec3, p1: DVec3, n: DVec3, axis: DVec3, k: f64) -> f64 {
    let (a, b, up, lobe) = (p0.to_array(), p1.to_array(), n.to_array(), axis.to_array());
    if let Some(segment) = fast_lobe::measure(a, b, up, lobe, k) {
        return nonnegative(2.0 * segment.integrate(k));
    }
    robust([a, b, up, lobe], k, |fan, axis| {
        let twice_distance = 2.0 * fan.sine / fan.reach();
        // Multiply before the integral where the square of the inverse would overflow.
        let [before, after] = if twice_distance > NEAREST {
            [1.0, twice_distance]
        } else {
            [twice_distance, 1.0]
        };
        integrate(&fan.with_constant(before), axis, k) * after * fan.unit
    })
}

/// Applies `of` to the segment's fan and the axis; 0 if there is no fan.
#[inline(never)]
fn robust(points: [Point; 4], k: f64, of: impl FnOnce(&Fan<2>, DVec3) -> f64) -> f64 {
    let [p0, p1, n, axis] = points.map(DVec3::from_array);
    let Some(fan) = Fan::new(p0, p1, &[n, axis], None).filter(|_| k >= 0.0) else {
        return 0.0;
    };
    nonnegative(of(&fan, axis))
}

/// Returns `∫ max(0, n·p) max(0, m·p) max(0, R·p)ᵏ/|p|^(4+k) dt` for any vector m, in 1/length: a
/// ribbon whose emission falls with the cosine to m, which need not be perpendicular to the line.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::phong;
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// // The line is two above the point, where the cosine to −z is two over the distance.
/// let with_cosine = phong::half_space(p0, p1, DVec3::Z, DVec3::Z, DVec3::Z, 3.0);
/// let ribbon = phong::ribbon(p0, p1, DVec3::Z, DVec3::Z, 3.0);
/// assert!((with_cosine / (2.0 * ribbon) - 1.0).abs() < 1e-13);
/// ```
#[must_use]
pub fn half_space(p0: DVec3, p1: DVec3, n: DVec3, m: DVec3, axis: DVec3, k: f64) -> f64 {
    let Some(fan) = Fan::new(p0, p1, &[n, m, axis], None).filter(|_| k >= 0.0) else {
        return 0.0;
    };
    nonnegative(integrate(&fan, axis, k) * fan.unit)
}
