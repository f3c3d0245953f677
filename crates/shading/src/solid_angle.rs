//! Solid angles: of triangles, rectangles, convex polygons and spheres.

use crate::exact::{determinant, dot, length};
use crate::span::{not_too_near, power_of_two_unit};
use linelit_elementary::{acos, atan, atan2};
use linelit_geometry::double::{self, Double};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{DVec3, predicates};
use std::f64::consts::PI;

/// The solid angle of a triangle, 0 to 2π sr, either way round. Vertices are relative to the
/// shading point.
///
/// **Formula**: `2 atan2(|det(a, b, c)|, |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)`, with the
/// determinant formed from the differences of the vertices, `a·((b − a) × (c − a))`.
///
/// **Error**: below 1e-13 relative, however small or far the triangle, also seen edge-on or near an
/// edge.
///
/// **Source**: Van Oosterom & Strackee 1983.
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// let octant = linelit_shading::solid_angle::triangle(DVec3::X, DVec3::Y, DVec3::Z);
/// assert!((octant - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
/// ```
#[must_use]
pub fn triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
    let Some(unit) = power_of_two_unit(largest) else {
        return 0.0;
    };
    nonnegative(scaled([a * unit, b * unit, c * unit]).abs())
}

/// [`signed`] of corners near one in magnitude, some of which may be as near to the shading point
/// as numbers go: their distance does not matter, and products of three would be below the range.
fn scaled(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(not_too_near);
    signed(a, b, c)
}

/// The solid angle of a convex polygon, 0 to 2π sr, either way round; vertices relative to the
/// shading point. Fewer than three give 0.
///
/// **Formula**: the sum of [`triangle`] over a fan, all of one sign. **Error**: as there.
#[must_use]
pub fn polygon(vertices: &[DVec3]) -> f64 {
    let largest = vertices
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f64::max);
    let Some(unit) = power_of_two_unit(largest) else {
        return 0.0;
    };
    let fan = |pair: &[DVec3]| scaled([vertices[0] * unit, pair[0] * unit, pair[1] * unit]);
    nonnegative(
        vertices
            .get(1..)
            .map_or(0.0, |rest| rest.windows(2).map(fan).sum::<f64>())
            .abs(),
    )
}

/// The solid angle of the rectangle (or parallelogram) with corner `o` and sides `u` and `v`.
///
/// **Formula**: two triangles: unlike the classical sum of four angles minus 2π, which loses all
/// digits far away, both are accurate. **Error**: as [`triangle`].
#[must_use]
pub fn parallelogram(o: DVec3, u: DVec3, v: DVec3) -> f64 {
    polygon(&[o, o + u, o + u + v, o + v])
}

/// 1 − cos θ of the half angle θ under which a sphere of radius `radius` is seen from the distance
/// `distance` of its centre; 1 − cos θ = 2 from within.
///
/// **Formula**: `s²/(1 + √(1 − s²))` with s = radius/distance and
/// `1 − s² = (distance − radius)(distance + radius)/distance²`: for a far sphere the plain
/// difference loses everything.
///
/// **Error**: 6 ε.
#[must_use]
pub fn sphere_versine(distance: f64, radius: f64) -> f64 {
    if distance <= radius {
        return if radius > 0.0 { 2.0 } else { 0.0 };
    }
    let s = radius / distance;
    let cosine = (((distance - radius) / distance) * (1.0 + s)).sqrt();
    nonnegative(s * s / (1.0 + cosine))
}

/// The solid angle of a sphere with its centre at `centre`: `2π(1 − cos θ)`, 4π from within.
#[must_use]
pub fn sphere(centre: DVec3, radius: f64) -> f64 {
    2.0 * PI * sphere_versine(length(centre), radius)
}

/// The solid angle of a cap of directions within the half angle θ, from its versine 1 − cos θ,
/// which is brought into [0, 2] (NaN to 0).
#[must_use]
#[allow(
    clippy::manual_clamp,
    reason = "clamp would let NaN through; max replaces it by zero"
)]
pub fn cap(versine: f64) -> f64 {
    2.0 * PI * versine.max(0.0).min(2.0)
}

/// The projected solid angle `∫ max(0, n·ω) dω` of a sphere for a unit normal n, from without; π
/// from within.
///
/// **Formula**: π s² cos β while the sphere is wholly above the horizon (β the angle of the centre
/// with n, s = sin θ = radius/distance, c = cos θ); where the horizon cuts it, with x = c/s,
/// y = −x cot β and u = sin β √(1 − y²)/x,
///
/// ```text
/// s² (acos y · cos β + u) + (atan u − u)
/// ```
///
/// with atan u − u by its series where u is small; printed as
/// s² [acos y cos β − x sin β √(1 − y²)] + atan u, whose last terms cancel far away. c² comes from
/// |centre|² − radius² in twice the working precision: near the sphere the rounded distance would
/// decide.
///
/// **Error**: 1e-13 of π s² (not relative where only a sliver is above the horizon).
///
/// **Source**: Snyder 1996, "Area Light Sources for Real-Time Graphics", eq. 5 ff.
#[must_use]
pub fn sphere_projected(centre: DVec3, radius: f64, n: DVec3) -> f64 {
    let largest = centre.abs().max_element().max(radius);
    let Some(unit) = power_of_two_unit(largest) else {
        return 0.0;
    };
    let (centre, radius) = (centre * unit, radius * unit);
    let gap = excess(centre, radius);
    if gap <= 0.0 {
        return if radius > 0.0 { PI } else { 0.0 };
    }
    let square = centre.length_squared();
    let distance = square.sqrt();
    let s2 = radius * radius / square;
    let cos_beta = dot(n, centre) / distance;
    let s = radius / distance;
    if cos_beta >= s {
        return nonnegative(PI * s2 * cos_beta);
    }
    if cos_beta <= -s {
        return 0.0;
    }
    let sin_beta = predicates::cross(n, centre).length() / distance;
    let x = gap.sqrt() / radius;
    let y = (-x * cos_beta / sin_beta).clamp(-1.0, 1.0);
    let u = sin_beta * ((1.0 - y) * (1.0 + y)).sqrt() / x;
    let rest = if u < 0.25 {
        atan_excess(u) + s2 * u
    } else {
        atan(u) - u * (gap / square)
    };
    nonnegative(s2 * (acos(y) * cos_beta) + rest)
}

/// |centre|² − radius², to 2 ε of itself or nearly.
fn excess(centre: DVec3, radius: f64) -> f64 {
    (double::dot_of(centre, centre) - Double::product(radius, radius)).hi()
}

/// atan u − u for |u| ≤ 1/4: 13 terms of its series, to 1e-17 of u³.
fn atan_excess(u: f64) -> f64 {
    let square = u * u;
    let mut sum = 0.0;
    for k in (1..14).rev() {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        sum = sum * square + sign / (2.0 * f64::from(k) + 1.0);
    }
    sum * square * u
}

/// The signed solid angle: positive where a, b, c turn counter-clockwise about det > 0.
fn signed(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let det = volume(a, b, c);
    let (ra, rb, rc) = (a.length(), b.length(), c.length());
    // 30 ε² is what of no volume may be left.
    if det.abs() <= 1e-30 * ra * rb * rc && on_one_line(a, b, c) {
        return 0.0;
    }
    let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
    let opposite = [
        ab < -0.9 * ra * rb,
        bc < -0.9 * rb * rc,
        ca < -0.9 * rc * ra,
    ];
    let below = match opposite {
        [true, _, true] => return lune(a, b, c, det),
        [true, true, _] => return lune(b, c, a, det),
        [_, true, true] => return lune(c, a, b, det),
        [true, ..] => obtuse([a, b, c], [ra, rb, rc], ab),
        [_, true, _] => obtuse([b, c, a], [rb, rc, ra], bc),
        [.., true] => obtuse([c, a, b], [rc, ra, rb], ca),
        [false, false, false] => ra * rb * rc + ab * rc + bc * ra + ca * rb,
    };
    2.0 * atan2(det, below)
}

/// Whether the shading point is on the line of all three: nothing is seen, though it be between
/// them.
#[cold]
fn on_one_line(a: DVec3, b: DVec3, c: DVec3) -> bool {
    predicates::cross(a, b) == DVec3::ZERO && predicates::cross(a, c) == DVec3::ZERO
}

/// The solid angle where a is nearly opposite both b and c: with the small triangle of them and −a
/// it fills the space between the planes through a, which is twice their angle.
fn lune(a: DVec3, b: DVec3, c: DVec3, det: f64) -> f64 {
    let (left, right) = (predicates::cross(a, b), predicates::cross(a, c));
    let angle = atan2(a.length() * det, dot(left, right));
    2.0 * angle + signed(-a, b, c)
}

/// |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b| where a and b are nearly opposite, that is, near
/// an edge: |a||b| + a·b = |X|²/(|a||b| − a·b) and b|a| + a|b| = X × (a|b| − b|a|)/(|a||b| − a·b)
/// with X = a × b, so that nothing cancels.
fn obtuse([a, b, c]: [DVec3; 3], [ra, rb, rc]: [f64; 3], ab: f64) -> f64 {
    let x = predicates::cross(a, b);
    let span = ra * rb - ab;
    let bisector = x.cross(a * rb - b * ra);
    (x.length_squared() * rc + predicates::dot(c, bisector)) / span
}

/// det(a, b, c), accurate relative to itself.
pub(crate) fn volume(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    let normal = predicates::cross(u, v);
    let value = predicates::dot(normal, a);
    // Rounded differences move the vertices by ε: harmless unless the triangle is edge-on or a
    // sliver.
    let (across, sides) = (
        normal.length_squared(),
        u.length_squared() * v.length_squared(),
    );
    if value * value > 1e-4 * a.length_squared() * across && across > 1e-4 * sides {
        value
    } else {
        determinant(a, b, c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;

    #[test]
    fn edge_on_and_degenerate() {
        let (a, b, c) = (DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0));
        assert_close!(
            triangle(a, b, c),
            0.0,
            0.0,
            "in the plane of the shading point"
        );
        assert_close!(triangle(a, a, c), 0.0, 0.0, "no area");
        assert_close!(polygon(&[a, b]), 0.0, 0.0, "no polygon");
    }

    #[test]
    fn spheres() {
        assert_close!(sphere(DVec3::Z * 2.0, 3.0), 4.0 * PI, 0.0, "within");
        let want = PI * 1e-16;
        assert_close!(
            sphere(DVec3::Z, 1e-8),
            want,
            rel = 8.0 * f64::EPSILON,
            "far: pi s^2"
        );
        // Half of the sphere below the horizon, from symmetry of the integral over the sphere:
        // the two halves of a sphere cut by its own centre plane add up as seen by n and -n.
        let e = sphere_projected(DVec3::X, 0.5, DVec3::Z);
        let quadrature = half_sphere(0.5);
        assert_close!(e, quadrature, rel = 1e-12, "quadrature to 1e-13");
    }

    /// ∫ over a cap around X of max(0, z): ∫∫ sin² θ |cos φ|₊ = 2 ∫ sin² θ dθ.
    fn half_sphere(s: f64) -> f64 {
        let theta = s.asin();
        theta - theta.sin() * theta.cos()
    }
}
