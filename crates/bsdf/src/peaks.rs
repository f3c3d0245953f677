//! This module finds the positions along a segment at which a reflection is largest or has a kink,
//! so that quadrature can split the integral there.

use crate::Layers;
use crate::microfacet::TrowbridgeReitz;
use linelit_geometry::{DVec2, DVec3, Segment};

/// The number of Newton steps towards the smallest slope: each squares the error, which is below a
/// tenth at first.
const STEPS: usize = 5;

/// The largest number of peaks and kinks: four for each lobe that fits into [`Layers`].
const MOST: usize = 4 * Layers::MAX;

/// The positions at which an integral is split about a peak, in widths: a tail like x⁻⁴ holds 1e-2
/// of the peak's integral beyond 4, 1e-5 beyond 32, and 3e-8 beyond 256.
const KNOTS: [f64; 7] = [-256.0, -32.0, -4.0, 0.0, 4.0, 32.0, 256.0];

/// Positions on a segment, as fractions of it, at which an integrand is much larger than elsewhere
/// or has a kink.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// The positions and their widths; the width of a kink is zero.
    at: [(f64, f64); MOST],
    count: usize,
}

impl Peaks {
    /// Adds a peak, with the distance at which it has fallen to about a third; both are fractions
    /// of the segment. A peak that is already known, and peaks after the 32nd, are left out.
    pub fn add(&mut self, t: f64, width: f64) {
        let is_known = |(other, w): &(f64, f64)| (t - other).abs() < 0.125 * width.min(*w);
        let known = self.at[..self.count].iter().any(is_known);
        if width > 0.0 && !known {
            self.push(t, width);
        }
    }

    /// Adds a position at which the derivative jumps, such as the end of a `max`, as a fraction of
    /// the segment. Kinks after the 32nd are left out.
    pub fn add_kink(&mut self, t: f64) {
        self.push(t, 0.0);
    }

    fn push(&mut self, t: f64, width: f64) {
        if t.is_finite() && self.count < MOST {
            self.at[self.count] = (t, width);
            self.count += 1;
        }
    }

    /// Adds the peak and the kink of max(0, axis·ω)ᵏ, where ω is the direction to a point of the
    /// segment.
    pub fn add_power(&mut self, line: &Segment, axis: DVec3, k: f64) {
        let t = nearest(line, axis);
        let p = line.at(t);
        // The direction changes by dω/dt = |p × e|/|p|².
        let turn = p.cross(line.vector()).length() / p.length_squared();
        self.add(t, 1.0 / ((k + 1.0).sqrt() * turn));
        self.add_kink(crossing(line, axis));
    }

    /// Returns the fractions at which an integral along the segment should be split, in order, so
    /// that each part is smooth on its own scale; the last is one.
    pub fn knots(&self) -> impl Iterator<Item = f64> {
        let mut knots = [1.0; MOST * KNOTS.len() + 1];
        let mut count = 0;
        for (t, width) in &self.at[..self.count] {
            let around: &[f64] = if *width > 0.0 { &KNOTS } else { &[0.0] };
            // A peak as wide as the segment needs no split.
            let inside = |knot: &f64| *knot > 0.0 && *knot < 1.0 && *width < 0.5;
            for knot in around.iter().map(|k| t + k * width).filter(inside) {
                knots[count] = knot;
                count += 1;
            }
        }
        knots[..count].sort_unstable_by(f64::total_cmp);
        knots.into_iter().take(count + 1)
    }
}

/// Returns the point of a segment whose direction is closest to an axis: the maximum of axis·p/|p|,
/// which has one stationary point on the line. It is a fraction, clamped to the segment.
pub(crate) fn nearest(line: &Segment, axis: DVec3) -> f64 {
    let (p, e) = (line.p0, line.vector());
    let (ap, ae, pe) = (axis.dot(p), axis.dot(e), p.dot(e));
    let t = (ae * p.length_squared() - ap * pe) / (ap * e.length_squared() - ae * pe);
    if (0.0..=1.0).contains(&t) && axis.dot(line.at(t)) > 0.0 {
        t
    } else {
        let cosine = |p: DVec3| axis.dot(p.normalize_or_zero());
        f64::from(u8::from(cosine(line.p1) > cosine(line.p0)))
    }
}

/// Adds the points of a segment, in the local frame, at which the half vector with ω_o has the
/// smallest slope in units of α. There D is largest; for anisotropic facets there are up to three
/// such points.
pub(crate) fn ridges(line: &Segment, wo: DVec3, facets: TrowbridgeReitz, peaks: &mut Peaks) {
    let alpha = DVec2::from(facets.alpha());
    let mirrored = DVec3::new(-wo.x, -wo.y, wo.z);
    add_descended(line, wo, alpha, nearest(line, mirrored), peaks);
    if !facets.is_isotropic() {
        let narrow = if alpha.x < alpha.y {
            DVec3::X
        } else {
            DVec3::Y
        };
        for t in level(line, wo, narrow) {
            add_descended(line, wo, alpha, t, peaks);
        }
    }
}

/// Returns the fraction of a segment at which it crosses the plane through the origin with a
/// normal.
pub(crate) fn crossing(line: &Segment, normal: DVec3) -> f64 {
    -normal.dot(line.p0) / normal.dot(line.vector())
}

/// Returns the points of a segment whose half vector with ω_o is perpendicular to an axis: axis·p =
/// −(axis·ω_o) |p|. They are computed as the roots of the square of this equation, which also
/// include the points that are seen at the same angle from the axis as ω_o.
pub(crate) fn level(line: &Segment, wo: DVec3, axis: DVec3) -> impl Iterator<Item = f64> {
    let (p, e, w) = (line.p0, line.vector(), axis.dot(wo));
    let (ap, ae) = (axis.dot(p), axis.dot(e));
    let a = ae * ae - w * w * e.length_squared();
    let half_b = ap * ae - w * w * p.dot(e);
    let c = ap * ap - w * w * p.length_squared();
    let root = (half_b * half_b - a * c).max(0.0).sqrt();
    let sum = -(half_b + root.copysign(half_b));
    [sum / a, c / sum].into_iter().filter(|t| t.is_finite())
}

/// Adds the stationary point of the slope in units of α that the Gauss–Newton method finds from a
/// start.
fn add_descended(line: &Segment, wo: DVec3, alpha: DVec2, start: f64, peaks: &mut Peaks) {
    let (e, mut t, mut width) = (line.vector(), start.clamp(0.0, 1.0), 0.0);
    for _ in 0..STEPS {
        let p = line.at(t);
        let (distance, along) = (p.length(), p.dot(e) / p.length());
        let (h, change) = (p + wo * distance, e + wo * along);
        let slope = h.truncate() / alpha / h.z;
        let turn = (change.truncate() / alpha - slope * change.z) / h.z;
        let step = slope.dot(turn) / turn.length_squared();
        // D falls off where the slope is beyond α, or beyond the smallest slope if that is larger.
        width = (1.0 + slope.length_squared()).sqrt() / turn.length();
        if !step.is_finite() {
            break;
        }
        t = (t - step).clamp(0.0, 1.0);
    }
    peaks.add(t, width);
}
