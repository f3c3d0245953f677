//! Where along a segment a reflection is largest or has a kink: where quadrature has to look.

use crate::Layers;
use crate::microfacet::TrowbridgeReitz;
use linelit_geometry::{DVec2, DVec3, Segment};

/// Steps towards the least slope: each squares the error, which is below a tenth at first.
const STEPS: usize = 5;

/// Four of each lobe that fits into [`Layers`].
const MOST: usize = 4 * Layers::MAX;

/// The places where an integral is split about a peak, in widths: a tail like x⁻⁴ holds 1e-2 of the
/// peak's integral past 4, 1e-5 past 32, 3e-8 past 256.
const KNOTS: [f64; 7] = [-256.0, -32.0, -4.0, 0.0, 4.0, 32.0, 256.0];

/// Places on a segment, as fractions of it, where an integrand is much larger than elsewhere or has
/// a kink.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// The places and their widths; those of kinks are zero.
    at: [(f64, f64); MOST],
    count: usize,
}

impl Peaks {
    /// Adds one, with the distance at which it has fallen to about a third; both as fractions of
    /// the segment. Peaks that are known, and those past the 32nd, are left out.
    pub fn add(&mut self, t: f64, width: f64) {
        let is_known = |(other, w): &(f64, f64)| (t - other).abs() < 0.125 * width.min(*w);
        let known = self.at[..self.count].iter().any(is_known);
        if width > 0.0 && !known {
            self.push(t, width);
        }
    }

    /// Adds a place where the derivative jumps, such as the end of a `max`, as a fraction of the
    /// segment. Kinks past the 32nd are left out.
    pub fn add_kink(&mut self, t: f64) {
        self.push(t, 0.0);
    }

    fn push(&mut self, t: f64, width: f64) {
        if t.is_finite() && self.count < MOST {
            self.at[self.count] = (t, width);
            self.count += 1;
        }
    }

    /// Adds the peak and the kink of max(0, axis·ω)ᵏ, ω the direction to a point of the segment.
    pub fn add_power(&mut self, line: &Segment, axis: DVec3, k: f64) {
        let t = nearest(line, axis);
        let p = line.at(t);
        // dω/dt = |p × e|/|p|².
        let turn = p.cross(line.vector()).length() / p.length_squared();
        self.add(t, 1.0 / ((k + 1.0).sqrt() * turn));
        self.add_kink(crossing(line, axis));
    }

    /// The fractions at which to split an integral along the segment, in order, so that each part
    /// is smooth on its own scale; the last is one.
    pub fn knots(&self) -> impl Iterator<Item = f64> {
        let mut knots = [1.0; MOST * KNOTS.len() + 1];
        let mut count = 0;
        for (t, width) in &self.at[..self.count] {
            let around: &[f64] = if *width > 0.0 { &KNOTS } else { &[0.0] };
            // What is as wide as the segment needs none.
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

/// The point of a segment that is seen the nearest to a direction: the largest of axis·p/|p|, which
/// has one stationary point on the line. As a fraction, kept within the segment.
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

/// Adds the points of a segment, in the local frame, where the half vector with ω_o has the least
/// slope in units of α: the largest D, of anisotropic facets at up to three places.
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

/// The fraction of a segment at which it crosses the plane of a normal through the origin.
pub(crate) fn crossing(line: &Segment, normal: DVec3) -> f64 {
    -normal.dot(line.p0) / normal.dot(line.vector())
}

/// The points of a segment whose half vector with ω_o has no part along an axis:
/// axis·p = −(axis·ω_o) |p|, of whose square these are the roots, and so the points that are seen
/// as far from the axis as ω_o.
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

/// Adds the stationary point of the slope in units of α that Gauss and Newton find from a start.
fn add_descended(line: &Segment, wo: DVec3, alpha: DVec2, start: f64, peaks: &mut Peaks) {
    let (e, mut t, mut width) = (line.vector(), start.clamp(0.0, 1.0), 0.0);
    for _ in 0..STEPS {
        let p = line.at(t);
        let (distance, along) = (p.length(), p.dot(e) / p.length());
        let (h, change) = (p + wo * distance, e + wo * along);
        let slope = h.truncate() / alpha / h.z;
        let turn = (change.truncate() / alpha - slope * change.z) / h.z;
        let step = slope.dot(turn) / turn.length_squared();
        // D falls where the slope leaves α, or the least slope if that is larger.
        width = (1.0 + slope.length_squared()).sqrt() / turn.length();
        if !step.is_finite() {
            break;
        }
        t = (t - step).clamp(0.0, 1.0);
    }
    peaks.add(t, width);
}
