//! This module holds the fan of triangles of a convex polygon, and finds the triangle of a point.
//!
//! All triangles share the first vertex. The random number that chooses a triangle is rescaled, and
//! then chooses the point on that triangle's outer edge, so that the map from random numbers to the
//! polygon is continuous over the whole fan.

use linelit_geometry::{ConvexPolygon, DVec3, predicates};
use linelit_simd::Lanes;

/// A vector in each lane, stored by coordinates.
pub(crate) type Vector<L> = [<L as Lanes>::D; 3];

/// A point of a fan triangle (a, b, c): `q = b + lambda (c − b)` lies on the outer edge, and the
/// point is `a + kappa (q − a)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FanPoint {
    pub(crate) triangle: usize,
    pub(crate) lambda: f64,
    pub(crate) kappa: f64,
}

/// Returns the three vertices of a triangle of the fan.
pub(crate) fn triangle(vertices: &[DVec3], i: usize) -> [DVec3; 3] {
    [vertices[0], vertices[i + 1], vertices[i + 2]]
}

/// Returns the triangle of the fan that contains a point of the polygon, and the point's
/// coordinates λ and κ in it ([`FanPoint`]). `None` where the point lies outside the polygon by
/// more than the rounding of its coordinates (64 ε of the largest coordinate, which moves λ and κ
/// by as much relative to the polygon's size).
pub(crate) fn locate(polygon: &ConvexPolygon, point: DVec3) -> Option<FanPoint> {
    let v = polygon.vertices();
    let p = point - v[0];
    let side = |i: usize| predicates::cross(v[i] - v[0], p).dot(polygon.normal());
    let slack = {
        let extent = polygon.diameter();
        let largest = point.abs().max_element().max(v[0].abs().max_element());
        64.0 * f64::EPSILON * (largest + extent) * extent
    };
    let last = v.len() - 2;
    let mut i = 0;
    // Find the triangle between the fan's rays i + 1 and i + 2.
    while i + 1 < last && side(i + 2) > 0.0 {
        i += 1;
    }
    let [a, b, c] = triangle(v, i);
    // Its barycentric weights, times twice its area, are the sides on which the point lies.
    let twice_area = predicates::cross(b - a, c - a).dot(polygon.normal());
    let (wb, wc) = (-side(i + 2), side(i + 1));
    let inside = wb >= -slack && wc >= -slack && wb + wc <= twice_area + slack;
    if !(inside && slack < f64::INFINITY) {
        return None;
    }
    let (wb, wc) = (wb.max(0.0), wc.max(0.0));
    let sum = wb + wc;
    if twice_area <= 0.0 {
        return None;
    }
    Some(FanPoint {
        triangle: i,
        lambda: if sum > 0.0 { wc / sum } else { 0.0 },
        kappa: (sum / twice_area).min(1.0),
    })
}

/// Returns the point of a fan triangle in each lane.
#[inline(always)]
pub(crate) fn place<L: Lanes>([a, b, c]: [Vector<L>; 3], lambda: L::D, kappa: L::D) -> Vector<L> {
    let edge = [c[0] - b[0], c[1] - b[1], c[2] - b[2]];
    let q = along::<L>(&b, &edge, lambda);
    along::<L>(&a, &[q[0] - a[0], q[1] - a[1], q[2] - a[2]], kappa)
}

/// Returns a + b t.
#[inline(always)]
pub(crate) fn along<L: Lanes>(a: &Vector<L>, b: &Vector<L>, t: L::D) -> Vector<L> {
    [a[0] + b[0] * t, a[1] + b[1] * t, a[2] + b[2] * t]
}

/// Returns a vector that is the same in all lanes.
#[inline(always)]
pub(crate) fn splat<L: Lanes>(l: L, v: DVec3) -> Vector<L> {
    [l.dsplat(v.x), l.dsplat(v.y), l.dsplat(v.z)]
}

/// Returns `b` in the lanes of `m`, and `a` in the others.
#[inline(always)]
pub(crate) fn select<L: Lanes>(l: L, m: L::M, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [
        l.select(m, a[0], b[0]),
        l.select(m, a[1], b[1]),
        l.select(m, a[2], b[2]),
    ]
}
