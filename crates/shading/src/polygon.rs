//! A whole polygon, seen by a diffuse surface.

use linelit_geometry::{DVec3, MAX_VERTICES, predicates::cross};

const CAPACITY: usize = MAX_VERTICES + 10;

/// `∫ max(0, n·ω) dω` over the polygon: the irradiance for each unit of radiance.
///
/// `vertices` are relative to the shading point, in either order; at most 24.
///
/// **Formula**: Lambert's sum over the edges, ½ Σ Θᵢ (vᵢ × vᵢ₊₁)·n/|vᵢ × vᵢ₊₁|, after clipping to
/// the horizon. A polygon smaller than half its distance takes the centred form, in which the
/// parts that cancel have been taken out by hand.
///
/// **Error**: 1e-13 relative, times distance over height above the light's plane where the light is
/// seen edge-on.
///
/// **Source**: Lambert 1760; clipping after Baum, Rushmeier & Winget 1989.
#[must_use]
pub fn irradiance(vertices: &[DVec3], n: DVec3) -> f64 {
    let mut clipped = [DVec3::ZERO; CAPACITY];
    let count = clip(vertices, n, &mut clipped);
    if count < 3 {
        return 0.0;
    }
    let polygon = &clipped[..count];
    let value = if is_small(polygon) { centred(polygon, n) } else { plain(polygon, n) };
    if value.is_finite() { value.abs() } else { 0.0 }
}

/// Clips to `n·p ≥ 0`; the crossing is accurate relative to itself (see [`crate::horizon`]).
fn clip(vertices: &[DVec3], n: DVec3, out: &mut [DVec3; CAPACITY]) -> usize {
    let mut count = 0;
    let mut push = |p: DVec3| {
        if count < CAPACITY {
            out[count] = p;
            count += 1;
        }
    };
    for (i, &a) in vertices.iter().enumerate() {
        let b = vertices[(i + 1) % vertices.len()];
        let (ca, cb) = (n.dot(a), n.dot(b));
        if ca >= 0.0 {
            push(a);
        }
        if (ca > 0.0 && cb < 0.0) || (ca < 0.0 && cb > 0.0) {
            push(cross(n, cross(a, b)) / (cb - ca));
        }
    }
    count
}

fn is_small(polygon: &[DVec3]) -> bool {
    let first = polygon[0];
    let reach = polygon.iter().map(|p| (*p - first).length_squared()).fold(0.0, f64::max);
    reach < 0.25 * first.length_squared()
}

fn plain(polygon: &[DVec3], n: DVec3) -> f64 {
    let edge = |(i, &a): (usize, &DVec3)| {
        let b = polygon[(i + 1) % polygon.len()];
        let x = cross(a, b);
        let length = x.length();
        if length > 0.0 { length.atan2(a.dot(b)) * (x.dot(n) / length) } else { 0.0 }
    };
    0.5 * polygon.iter().enumerate().map(edge).sum::<f64>()
}

/// Θ/sin Θ − 1 from sin² Θ and cos Θ.
fn excess(sine_squared: f64, cosine: f64) -> f64 {
    if cosine > 0.0 && sine_squared < 0.25 {
        // Σ binom(2k, k)/4ᵏ/(2k + 1) sin²ᵏ Θ, summed from its small end.
        let mut sum = 0.0;
        for k in (1..=26u32).rev() {
            let x = f64::from(k);
            let ratio = (2.0 * x - 1.0) * (2.0 * x - 1.0) / (2.0 * x * (2.0 * x + 1.0));
            sum = sine_squared * ratio * (1.0 + sum);
        }
        return sum;
    }
    let sine = sine_squared.sqrt();
    sine.atan2(cosine) / sine - 1.0
}

fn centred(polygon: &[DVec3], n: DVec3) -> f64 {
    let origin = polygon[0];
    let radius = origin.length();
    let mut direct = 0.0;
    let mut lever = DVec3::ZERO;
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ea, eb) = (a - origin, b - origin);
        let (ra, rb) = (a.length(), b.length());
        let grow = |e: DVec3, r: f64| (2.0 * origin.dot(e) + e.dot(e)) / (r + radius);
        let (da, db) = (grow(ea, ra), grow(eb, rb));
        let product = ra * rb;
        let sine_squared = cross(a, b).length_squared() / (product * product);
        let excess = excess(sine_squared, a.dot(b) / product);
        let weight = (excess + 1.0) / product;
        let change = excess / product
            - (radius * (da + db) + da * db) / (radius * radius * product);
        direct += weight * cross(ea, eb).dot(n);
        lever += (eb - ea) * change;
    }
    0.5 * (direct + n.dot(origin.cross(lever)))
}
