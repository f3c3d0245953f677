//! This module evaluates the closed forms naively as they are printed (with their errata
//! corrected), for comparison with the crate's own forms.

use linelit_geometry::DVec3;
use std::f64::consts::PI;

/// Clipping by interpolation; cosines by plain dot products.
fn clip(p0: DVec3, p1: DVec3, n: DVec3) -> Option<(DVec3, DVec3)> {
    let (a, b) = (n.dot(p0), n.dot(p1));
    if a <= 0.0 && b <= 0.0 {
        return None;
    }
    let q = p0 + (p1 - p0) * (a / (a - b));
    Some(if a < 0.0 {
        (q, p1)
    } else if b < 0.0 {
        (p0, q)
    } else {
        (p0, p1)
    })
}

/// Billen & Dutré 2016, eq. 20.
pub(crate) fn ribbon(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some((p0, p1)) = clip(p0, p1, n) else {
        return 0.0;
    };
    let l = (p1 - p0).length();
    let d = (p1 - p0) / l;
    let (a, b, c, e) = (p0.dot(n), d.dot(n), p0.dot(p0), p0.dot(d));
    let h2 = c - e * e;
    let h = h2.sqrt();
    (a - b * e) / (2.0 * h * h2) * (((e + l) / h).atan() - (e / h).atan())
        + l * (b * c * (e + l) + a * (c - e * l - 2.0 * e * e))
            / (2.0 * c * h2 * (l * l + 2.0 * e * l + c))
}

/// Peters 2021, eqs. 2 and 3.
pub(crate) fn cylinder(p0: DVec3, p1: DVec3, n: DVec3) -> f64 {
    let Some((p0, p1)) = clip(p0, p1, n) else {
        return 0.0;
    };
    let s = (p1 - p0).normalize();
    let q2 = p0.dot(p0) - s.dot(p0) * s.dot(p0);
    let q = q2.sqrt();
    let (ns, nt) = (n.dot(s), (n.dot(p0) - n.dot(s) * s.dot(p0)) / q);
    let f = |w: f64| {
        let w = w.clamp(-1.0, 1.0);
        ns * w * w + nt * ((1.0 - w * w).sqrt() * w + w.asin())
    };
    (f(s.dot(p1) / p1.length()) - f(s.dot(p0) / p0.length())) / q
}

/// Lambert's sum with arc cosines.
pub(crate) fn polygon(vertices: &[DVec3], n: DVec3) -> f64 {
    let mut above = Vec::new();
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let (ca, cb) = (n.dot(a), n.dot(b));
        if ca >= 0.0 {
            above.push(a);
        }
        if (ca > 0.0 && cb < 0.0) || (ca < 0.0 && cb > 0.0) {
            above.push(a + (b - a) * (ca / (ca - cb)));
        }
    }
    let edge = |(i, a): (usize, &DVec3)| {
        let b = above[(i + 1) % above.len()];
        let angle = (a.dot(b) / (a.length() * b.length()))
            .clamp(-1.0, 1.0)
            .acos();
        angle * a.cross(b).normalize_or_zero().dot(n)
    };
    (0.5 * above.iter().enumerate().map(edge).sum::<f64>()).abs()
}

/// The solid angle as the sum of the angles between the edges' planes.
pub(crate) fn solid_angle(vertices: &[DVec3]) -> f64 {
    let count = vertices.len();
    let normal = |i: usize| {
        vertices[i % count]
            .cross(vertices[(i + 1) % count])
            .normalize_or_zero()
    };
    let angle = |i: usize| (-normal(i).dot(normal(i + 1))).clamp(-1.0, 1.0).acos();
    let sides = u32::try_from(count).expect("a few");
    (0..count).map(angle).sum::<f64>() - f64::from(sides - 2) * PI
}

/// ∫ cosᵏ du between two angles by the recursion.
fn powers(u0: f64, u1: f64, top: u32) -> f64 {
    let (mut sum, mut k) = if top.is_multiple_of(2) {
        (u1 - u0, 0)
    } else {
        (u1.sin() - u0.sin(), 1)
    };
    while k < top {
        k += 2;
        let edge = power(u1, k - 1) * u1.sin() - power(u0, k - 1) * u0.sin();
        sum = (edge + f64::from(k - 1) * sum) / f64::from(k);
    }
    sum
}

fn power(u: f64, k: u32) -> f64 {
    u.cos().powi(i32::try_from(k).expect("small"))
}

/// Billen & Dutré 2016, eq. 24 with its recursion (integer exponents), for the ribbon without its
/// emitter's height, and the thin cylinder.
pub(crate) fn phong(p0: DVec3, p1: DVec3, n: DVec3, r: DVec3, k: u32) -> [f64; 2] {
    let Some((p0, p1)) = clip(p0, p1, n) else {
        return [0.0; 2];
    };
    let Some((p0, p1)) = clip(p0, p1, r) else {
        return [0.0; 2];
    };
    let y = (p1 - p0).normalize();
    let q = p0 - y * p0.dot(y);
    let h = q.length();
    let x = q / h;
    let polar = |v: DVec3| {
        let (a, b) = (v.dot(x), v.dot(y));
        (b.atan2(a), a.hypot(b))
    };
    let ((tn, sn), (tr, sr)) = (polar(n), polar(r));
    let (u0, u1) = (p0.dot(y).atan2(h) - tr, p1.dot(y).atan2(h) - tr);
    // The emitter's cosine is cos(theta): alpha for the receiver, beta for the emitter.
    let (alpha, beta) = (tr - tn, tr);
    let drop = |k: u32| (power(u1, k) - power(u0, k)) / f64::from(k);
    let sum = (alpha + beta).cos() * powers(u0, u1, k + 2)
        + alpha.sin() * beta.sin() * powers(u0, u1, k)
        + (alpha + beta).sin() * drop(k + 2);
    let scale = sn * sr.powi(i32::try_from(k).expect("small"));
    [scale * sum / (h * h), 2.0 * scale * sum / h]
}

/// The solid angle of a thin cylinder for each unit of radius, by the sines at its ends.
pub(crate) fn cylinder_solid_angle(p0: DVec3, p1: DVec3) -> f64 {
    let s = (p1 - p0).normalize();
    let (a, b) = (p0.dot(s), p1.dot(s));
    let h = (p0.dot(p0) - a * a).sqrt();
    2.0 / h * (b / p1.length() - a / p0.length())
}
