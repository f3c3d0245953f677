//! This module integrates a spherical Gaussian exp(λ(ω·ξ − 1)) along a line, with the cosines of
//! receiver and emitter.
//!
//! There is no elementary closed form (the integral is an incomplete Bessel function even without
//! the cosines). It is therefore computed by quadrature of bounded cost, in a window about the peak
//! as in [`phong`](crate::phong).

use crate::fan::Fan;
use crate::gauss::{NODE, NODES, WEIGHT};
use crate::span::NEAREST;
use linelit_elementary::{asin, atan2, exp, hypot, sin};
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;
use std::f64::consts::{FRAC_PI_2, PI};

/// The depth at which a window ends: the lobe there is below e⁻⁴⁰ of its peak.
const DEPTH: f64 = 40.0;

/// Returns `∫ max(0, n·p) exp(λ(ω·ξ − 1))/|p|⁴ dt` along a ribbon, with ω = p/|p|, in 1/length².
///
/// **Formula**: with ρ the length of ξ's part in the plane of the line and u the angle from it,
/// λ(ω·ξ − 1) = λ(ρ − 1) − 2λρ sin²(u/2).
///
/// **Domain**: λ ≥ 0, |ξ| = 1. **Error**: 1e-12 relative for λ ≤ 1e4, ε λ beyond.
/// **Source**: Wang et al. 2009 for the lobe; the windowing is our own.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::{ribbon, spherical_gaussian};
/// let (p0, p1) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let flat = spherical_gaussian::ribbon(p0, p1, DVec3::Z, DVec3::X, 0.0);
/// assert!((flat / ribbon::line_integral(p0, p1, DVec3::Z) - 1.0).abs() < 1e-14);
/// ```
#[must_use]
pub fn ribbon(p0: DVec3, p1: DVec3, n: DVec3, xi: DVec3, lambda: f64) -> f64 {
    tapered(p0, p1, n, xi, lambda, [1.0; 2])
}

/// Computes [`ribbon`] for a width that changes linearly between the given widths at the ends: see
/// [`ribbon::tapered`](crate::ribbon::tapered).
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::spherical_gaussian as sg;
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// let even = sg::ribbon(p0, p1, DVec3::Z, DVec3::Z, 8.0);
/// let thin = sg::tapered(p0, p1, DVec3::Z, DVec3::Z, 8.0, [0.0, 1.0]);
/// assert!((thin / even - 0.5).abs() < 1e-14);
/// ```
#[must_use]
pub fn tapered(p0: DVec3, p1: DVec3, n: DVec3, xi: DVec3, lambda: f64, widths: [f64; 2]) -> f64 {
    integrate([p0, p1, n, xi], lambda, widths, |fan| fan.unit * fan.unit)
}

/// Integrates over a thin cylinder, for each unit of radiance × radius, in 1/length.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::{cylinder, spherical_gaussian as sg};
/// let (p0, p1) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0));
/// // A sharpness of zero leaves the irradiance.
/// let flat = sg::cylinder(p0, p1, DVec3::Z, DVec3::Z, 0.0);
/// assert!((flat / cylinder::irradiance(p0, p1, DVec3::Z) - 1.0).abs() < 1e-13);
/// ```
#[must_use]
pub fn cylinder(p0: DVec3, p1: DVec3, n: DVec3, xi: DVec3, lambda: f64) -> f64 {
    integrate([p0, p1, n, xi], lambda, [1.0; 2], |fan| {
        let reach = fan.reach();
        if reach > 0.0 {
            2.0 * fan.sine / reach * fan.unit
        } else {
            0.0
        }
    })
}

/// Integrates over the fan of a segment; `scale` is the factor of the model.
fn integrate(
    [p0, p1, n, xi]: [DVec3; 4],
    lambda: f64,
    widths: [f64; 2],
    scale: impl Fn(&Fan<2>) -> f64,
) -> f64 {
    let fan = Fan::new(p0, p1, &[n, DVec3::ZERO], Some(widths));
    let Some(fan) = fan.filter(|_| lambda >= 0.0) else {
        return 0.0;
    };
    let start = fan.ends[0] / fan.radii[0];
    let first = xi.dot(start);
    let cosines = [fan.cosine(0, 0), fan.cosine(0, 1)];
    // Multiply by the distance first where the square of its inverse would overflow.
    let scale = scale(&fan);
    let [inner, scale] = if scale > NEAREST {
        [1.0, scale]
    } else {
        [scale, 1.0]
    };
    let [w0, w1] = fan.values[1].map(|w| w / fan.unit);
    let closeness = [w0 * inner / fan.radii[0], w1 * inner / fan.radii[1]];
    // A segment that points at the shading point is seen in one direction.
    if fan.sine <= 0.0 {
        let flat = fan.reach() * cosines[0] * (0.5 * (closeness[0] + closeness[1]));
        return nonnegative(flat * exp(lambda * (first - 1.0)) * scale);
    }
    // Find the lobe's centre on the arc, and the height of its peak.
    let rise = fan.slope(xi, 0);
    let (centre, rho) = (atan2(rise, first), hypot(first, rise));
    let off = xi.dot(fan.normal);
    // For a unit axis ρ − 1 is −off²/(1 + ρ).
    let peak = -lambda * off * off / (1.0 + rho);
    let strength = 2.0 * lambda * rho;
    // The exponent is proportional to sin² of half the angle to the centre.
    let depth = |v: f64| sin(0.5 * (v - centre)).powi(2);
    let sides = sides(centre, fan.angle, depth(0.0) <= depth(fan.angle));
    let highest = sides
        .iter()
        .fold(1.0f64, |low, side| low.min(depth(side.0)));
    let value = |v: f64| {
        let fall = exp(-strength * (depth(v) - highest));
        fan.cosine_at(cosines, v) * fan.cosine_at(closeness, v) * fall
    };
    // Integrate each side within its window.
    let mut sum = 0.0;
    for (start, width, sign) in sides {
        let width = width.min(window(strength, depth(start)));
        let pieces = pieces(width, start - centre);
        let step = width / f64::from(pieces);
        for piece in 0..pieces {
            let from = f64::from(piece) * step;
            let node = |i: usize| WEIGHT[i] * value(start + sign * (from + step * NODE[i]));
            sum += step * (0..NODES).map(node).sum::<f64>();
        }
    }
    let log = peak - strength * highest;
    // Multiply the power in two halves: it may underflow where the result does not.
    let half = exp(0.5 * log);
    nonnegative(fan.reach() / fan.sine * sum * half * scale * half)
}

/// Returns the number of rules for a side: a slope falls like an exponential, which needs more
/// nodes than a peak.
fn pieces(width: f64, from_centre: f64) -> u32 {
    if width > FRAC_PI_2 || from_centre.abs() > 0.0 {
        2
    } else {
        1
    }
}

/// Divides the arc [0, δ] into two pieces (start, width, direction), in each of which the lobe
/// falls from its start. They lie about the lobe's centre, or run from both ends towards its
/// antipode, or one piece runs over the whole arc from the higher end.
fn sides(centre: f64, angle: f64, first_is_higher: bool) -> [(f64, f64, f64); 2] {
    if centre > 0.0 && centre < angle {
        return [(centre, angle - centre, 1.0), (centre, centre, -1.0)];
    }
    let antipode = if centre <= 0.0 {
        centre + PI
    } else {
        centre - PI
    };
    if antipode > 0.0 && antipode < angle {
        return [(0.0, antipode, 1.0), (angle, angle - antipode, -1.0)];
    }
    if first_is_higher {
        [(0.0, angle, 1.0), (0.0, 0.0, -1.0)]
    } else {
        [(angle, angle, -1.0), (angle, 0.0, 1.0)]
    }
}

/// Returns the angle from the highest point of a piece within which the lobe is above e⁻⁴⁰ of it.
fn window(strength: f64, highest: f64) -> f64 {
    let end = highest + DEPTH / strength;
    if !(end < 1.0) {
        return PI;
    }
    // Compute sin² of half the angle at the end, and the difference of two arcsines without
    // cancellation.
    let (a, b) = (end.sqrt(), highest.sqrt());
    let (ca, cb) = ((1.0 - end).sqrt(), (1.0 - highest).sqrt());
    let sine = (DEPTH / strength) / (a * cb + ca * b);
    2.0 * asin(sine.clamp(0.0, 1.0))
}
