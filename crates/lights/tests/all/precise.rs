//! This module computes solid angles and irradiance of polygons with 77 digits, for comparison.

use linelit_geometry::DVec3;
use linelit_testkit::precise::Precise;
use linelit_testkit::real::{self, Real as _};

type Vector = [Precise; 3];

/// The sum over edges of the angles at which they are seen, times what stands on them; the solid
/// angle by van Oosterom & Strackee.
pub(crate) fn precise_solid_angle(corners: &[DVec3]) -> f64 {
    let p: Vec<Vector> = corners.iter().map(|c| real::vector(c.to_array())).collect();
    let [a, b, c] = [0, 1, 2].map(|k| &p[k]);
    let [la, lb, lc] = [a, b, c].map(real::length);
    let det = real::dot(&real::cross(a, b), c);
    let denominator = la.clone() * lb.clone() * lc.clone()
        + real::dot(a, b) * lc
        + real::dot(b, c) * la
        + real::dot(c, a) * lb;
    let half = det.atan2(&denominator).to_f64().abs();
    2.0 * half
}

/// Lambert's sum over the part above the horizon, at x.
pub(crate) fn precise_irradiance(corners: &[DVec3], x: DVec3, n: DVec3) -> f64 {
    precise_irradiance_beyond(corners, x, n, DVec3::ZERO, 0.0)
}

/// [`precise_irradiance`] of the points p with `axis·(p − x) ≥ least`.
pub(crate) fn precise_irradiance_beyond(
    corners: &[DVec3],
    x: DVec3,
    n: DVec3,
    axis: DVec3,
    least: f64,
) -> f64 {
    let n: Vector = real::vector(n.to_array());
    let axis: Vector = real::vector(axis.to_array());
    let seen = |c: &DVec3| [0, 1, 2].map(|k| Precise::new(c[k]) - Precise::new(x[k]));
    let zero = Precise::new(0.0);
    let all: Vec<Vector> = corners.iter().map(seen).collect();
    let above = precise_clip(&all, |p| real::dot(&n, p));
    let above = precise_clip(&above, |p| real::dot(&axis, p) - Precise::new(least));
    if above.len() < 3 {
        return 0.0;
    }
    let mut sum = Precise::new(0.0);
    for (k, a) in above.iter().enumerate() {
        let b = &above[(k + 1) % above.len()];
        let x = real::cross(a, b);
        let length = real::length(&x);
        if length > zero {
            let angle = length.atan2(&real::dot(a, b));
            sum = sum + angle * real::dot(&x, &n) / length;
        }
    }
    0.5 * sum.to_f64().abs()
}

/// The part of a polygon where `side` is not negative.
fn precise_clip(p: &[Vector], side: impl Fn(&Vector) -> Precise) -> Vec<Vector> {
    let zero = Precise::new(0.0);
    let mut out: Vec<Vector> = Vec::new();
    for (k, a) in p.iter().enumerate() {
        let b = &p[(k + 1) % p.len()];
        let (ca, cb) = (side(a), side(b));
        if ca >= zero {
            out.push(a.clone());
        }
        if (ca > zero && cb < zero) || (ca < zero && cb > zero) {
            let t = ca.clone() / (ca - cb);
            out.push([0, 1, 2].map(|i| a[i].clone() + (b[i].clone() - a[i].clone()) * t.clone()));
        }
    }
    out
}
