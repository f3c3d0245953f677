//! A ribbon: the line of an area light, seen by a diffuse surface.

use crate::horizon::clip_segment;
use linelit_geometry::{DVec3, predicates::cross};

/// Below this sine of the subtended angle the series takes over.
const SERIES_SINE: f64 = 0.5;

/// Coefficients binom(2k, k)/4ᵏ/(k + 3/2) of the series in sin²δ: 26 terms reach 2⁻⁵³ at 1/4.
const SERIES: [f64; 26] = series_coefficients();

const fn series_coefficients() -> [f64; 26] {
    let mut out = [0.0; 26];
    let mut binomial = 1.0;
    let mut k = 0;
    while k < 26 {
        #[allow(clippy::cast_precision_loss, reason = "small integers")]
        let x = k as f64;
        out[k] = binomial / (x + 1.5);
        binomial *= (2.0 * x + 1.0) / (2.0 * x + 2.0);
        k += 1;
    }
    out
}

/// `∫ max(0, n·p)/|p|⁴ dt` along the segment from `p0` to `p1`, relative to the shading point.
///
/// **Measure and units**: length in, 1/length² out. Times the emitter's distance `−m·q` (the same
/// all along the line) it is the irradiance for each unit of radiance and ribbon width.
///
/// **Formula**: `(l/(r₀r₁)) (c₀ + c₁)/(2 r₀r₁) + a K`, with the cosines `c = n·p` of the ends,
/// their distances r, and `a = n·q` for the point q of the line nearest to the shading point;
/// K = (δ − sin δ cos δ)/(2h³) by a series where δ is small, which needs no division by h.
///
/// **Domain**: any finite segment; clipped to the horizon. A segment through the shading point,
/// where the integral diverges, gives 0.
///
/// **Error**: 5e-14 relative at worst.
///
/// **Source**: Billen & Dutré 2016, eqs. 17–20; eq. 20 as printed lacks a factor and mixes up two
/// symbols, and cancels. This form does not.
#[must_use]
pub fn irradiance(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some(clipped) = clip_segment(p0, p1, n) else {
        return 0.0;
    };
    let edge = p1 - p0;
    let length = edge.length();
    if length <= 0.0 {
        return 0.0;
    }
    let normal = cross(p0, p1);
    let area = normal.length();
    let a = normal.dot(cross(n, edge)) / (length * length);
    let h = area / length;
    let (r0, r1) = (clipped.p0.length(), clipped.p1.length());
    let [c0, c1] = clipped.cosines;
    let reach = length * clipped.fraction / r0 / r1;
    let first = reach * ((c0 + c1) / (2.0 * r0 * r1));
    let kernel = kernel(area * clipped.fraction, clipped.p0.dot(clipped.p1), r0 * r1, h, reach);
    let value = first + a * kernel;
    if value.is_finite() { value.max(0.0) } else { 0.0 }
}

/// K = (δ − sin δ cos δ)/(2h³) for the angle δ between the ends.
fn kernel(area: f64, dot: f64, product: f64, h: f64, reach: f64) -> f64 {
    let sine = area / product;
    if dot <= 0.0 || sine >= SERIES_SINE {
        let delta = area.atan2(dot);
        return (delta - sine * (dot / product)) / (2.0 * h * h * h);
    }
    let y = sine * sine;
    let series = SERIES.iter().rev().fold(0.0, |sum, c| sum * y + c);
    0.5 * series * reach * reach * reach
}
