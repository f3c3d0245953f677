//! This module computes the solid angles of triangles and of convex polygons.

use crate::exact::{determinant, dot};
use crate::span::{not_too_near, power_of_two_unit};
use linelit_elementary::atan2;
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{DVec3, predicates};

/// Returns the solid angle of a triangle, 0 to 2π sr, in either order. Vertices are relative to the
/// shading point.
///
/// **Formula**: `2 atan2(|det(a, b, c)|, |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)`, with the
/// determinant formed from the differences of the vertices, `a·((b − a) × (c − a))`.
///
/// **Error**: below 1e-13 relative, however small or distant the triangle is, also if it is seen
/// edge-on or near an edge.
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

/// Computes [`signed`] for corners of about unit magnitude, some of which may be so near to the
/// shading point that products of three distances would underflow; their distance does not matter.
fn scaled(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(not_too_near);
    signed(a, b, c)
}

/// Returns the solid angle of a convex polygon, 0 to 2π sr, in either order; vertices are relative
/// to the shading point. Fewer than three vertices give 0.
///
/// **Formula**: the sum of [`triangle`] over a fan, whose terms have one sign. **Error**: the error
/// of [`triangle`].
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::solid_angle;
/// // A side of a cube, from its middle: a sixth of all directions.
/// let side = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]];
/// let angle = solid_angle::polygon(&side.map(DVec3::from));
/// assert!((angle - std::f64::consts::PI * 2.0 / 3.0).abs() < 1e-14);
/// ```
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

/// Returns the solid angle with a sign: positive where det(a, b, c) > 0.
fn signed(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let det = volume(a, b, c);
    let (ra, rb, rc) = (a.length(), b.length(), c.length());
    // Rounding may leave 30 ε² of a determinant that is zero.
    if det.abs() <= 1e-30 * ra * rb * rc && on_one_line(a, b, c) {
        return 0.0;
    }
    let (ab, bc, ca) = (a.dot(b), b.dot(c), c.dot(a));
    // Use a form that does not cancel where corners are nearly opposite.
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

/// Whether the shading point is on the line of all three corners: the solid angle is then zero,
/// even if the point is between them.
#[cold]
fn on_one_line(a: DVec3, b: DVec3, c: DVec3) -> bool {
    predicates::cross(a, b) == DVec3::ZERO && predicates::cross(a, c) == DVec3::ZERO
}

/// Returns the solid angle where a is nearly opposite to both b and c. Together with the small
/// triangle (−a, b, c) it fills the space between the two planes through a, which is twice their
/// angle.
fn lune(a: DVec3, b: DVec3, c: DVec3, det: f64) -> f64 {
    let (left, right) = (predicates::cross(a, b), predicates::cross(a, c));
    let angle = atan2(a.length() * det, dot(left, right));
    2.0 * angle + signed(-a, b, c)
}

/// Returns |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b| where a and b are nearly opposite, that is,
/// the shading point is near an edge. With X = a × b, |a||b| + a·b = |X|²/(|a||b| − a·b) and b|a| +
/// a|b| = X × (a|b| − b|a|)/(|a||b| − a·b), so that nothing cancels.
fn obtuse([a, b, c]: [DVec3; 3], [ra, rb, rc]: [f64; 3], ab: f64) -> f64 {
    let x = predicates::cross(a, b);
    let span = ra * rb - ab;
    let bisector = x.cross(a * rb - b * ra);
    (x.length_squared() * rc + predicates::dot(c, bisector)) / span
}

/// Returns det(a, b, c), accurate relative to itself.
pub(crate) fn volume(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    let normal = predicates::cross(u, v);
    let value = predicates::dot(normal, a);
    // Rounded differences move the vertices by ε, which is harmless unless the triangle is edge-on
    // or a sliver.
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
