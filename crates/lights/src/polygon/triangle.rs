//! The solid angle of a triangle in either precision.

use crate::linear::precision::{Real, V3, cross, dot, length, sub};

/// The solid angle in sr that the triangle of three points relative to the shading point subtends;
/// 0 if it is degenerate, or if the shading point is in its plane.
///
/// **Formula**: Ω = 2 atan2(D τ, P + τ (a·t)) with (a, b) the side of the largest angle, `P = 1 +
/// a·b`, τ the tangent of half the side bc, t the tangent at b towards c, and D the determinant
/// over sin bc. The determinant is taken from the edges, so it is exact to rounding however small
/// the triangle is; van Oosterom & Strackee's denominator with unit vectors loses 3e-5 of Ω in
/// `f32` at Ω = 1e-5.
///
/// **Domain**: distances and their products by two whose squares `f64` holds with its digits,
/// 1e-145 to 1e154, and in `f32` themselves, 1e-37 to 1e38; zero beyond.
///
/// **Error**: a few ε (1 + r/z) of Ω, with the distance r and the distance z from the plane, for Ω
/// from the underflow threshold to 2π. In `f32` the 99th percentile over triangles of Ω = 1e-9 … 1
/// is below 1e-5 (tested).
///
/// ```
/// use linelit_lights::triangle_solid_angle;
/// let octant = triangle_solid_angle([[2.0_f32, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.5]]);
/// assert!((octant - std::f32::consts::FRAC_PI_2).abs() < 4.0 * f32::EPSILON);
/// ```
#[must_use]
pub fn triangle_solid_angle<T: Real>(v: [[T; 3]; 3]) -> T {
    let r = v.map(length);
    let edge = |i: usize| sub(v[(i + 1) % 3], v[i]);
    let cosine = |i: usize| dot(v[i], v[(i + 1) % 3]) / (r[i] * r[(i + 1) % 3]);
    let c = [cosine(0), cosine(1), cosine(2)];
    let i = if c[0] <= c[1] && c[0] <= c[2] {
        0
    } else if c[1] <= c[2] {
        1
    } else {
        2
    };
    let (a, b) = (i, (i + 1) % 3);
    let normal = cross(edge(0), edge(1));
    let det = T::accurate_dot(normal, v[0]).abs();
    let (long, next) = (cross(v[a], edge(a)), cross(v[b], edge(b)));
    let (sine, product) = (length(next), r[b] * r[(b + 1) % 3]);
    let tau = half_tangent(sine, dot(v[b], v[(b + 1) % 3]), product);
    let towards: V3<T> = long.map(|x| -x);
    let at = dot(towards, next) / (r[a] * r[b] * sine);
    let p = one_plus_cosine(length(long), dot(v[a], v[b]), r[a] * r[b]);
    let held = r.iter().all(|r| r.has_square()) && sine.has_square() && product.has_square();
    let half = (det / (r[a] * sine) * tau).atan2(p + at * tau);
    if held && half > T::ZERO {
        half + half
    } else {
        T::ZERO
    }
}

fn half_tangent<T: Real>(sine: T, dot: T, product: T) -> T {
    if dot >= T::ZERO {
        sine / (product + dot)
    } else {
        (product - dot) / sine
    }
}

fn one_plus_cosine<T: Real>(sine: T, dot: T, product: T) -> T {
    if dot >= T::ZERO {
        T::ONE + dot / product
    } else {
        (sine / product) * (sine / (product - dot))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::rng::SplitMix64;

    /// Triangles of a given size class: relative errors of the `f32` form against the `f64` form of
    /// the same vertices.
    fn errors(size: f64, quad: bool) -> Vec<f64> {
        let mut rng = SplitMix64::new(29);
        let mut out = Vec::new();
        while out.len() < 20_000 {
            let mut v = || [0, 1, 2].map(|_| rng.in_range(-1.0, 1.0));
            let (center, a, b) = (v(), v(), v());
            let at = |s: f64, t: f64| {
                [0, 1, 2].map(|k| f32::from_f64(center[k] + size * (s * a[k] + t * b[k])))
            };
            let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
            let both = |c: [[f32; 3]; 3]| {
                let wide = c.map(|p| p.map(f64::from));
                (
                    f64::from(triangle_solid_angle(c)),
                    triangle_solid_angle(wide),
                )
            };
            let (mut got, mut want) = both([corners[0], corners[1], corners[2]]);
            if quad {
                let (g, w) = both([corners[0], corners[2], corners[3]]);
                (got, want) = (got + g, want + w);
            }
            if want > 1e-9 {
                out.push((got / want - 1.0).abs());
            }
        }
        out.sort_by(f64::total_cmp);
        out
    }

    #[test]
    fn single_precision_keeps_five_digits() {
        for size in [1.0, 1e-1, 1e-2, 1e-3, 1e-4] {
            for quad in [false, true] {
                let e = errors(size, quad);
                let at99 = e[e.len() * 99 / 100];
                assert!(at99 <= 1e-5, "size {size} quad {quad}: {at99:e}");
            }
        }
    }

    #[test]
    fn degenerate_triangles_have_none() {
        let p = [1.0, 2.0, 3.0];
        let zero = |t: [[f64; 3]; 3]| triangle_solid_angle(t).abs() < f64::MIN_POSITIVE;
        assert!(zero([p, p, p]));
        assert!(zero([p, [2.0, 4.0, 6.0], [3.0, 6.0, 9.0]]));
        assert!(zero([[0.0; 3], p, [1.0, 0.0, 0.0]]));
        assert!(zero([[f64::NAN, 0.0, 0.0], p, [1.0, 0.0, 0.0]]));
    }
}
