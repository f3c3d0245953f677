//! Triangles in the plane of a flat light: its own, and those that it is mounted in.
//!
//! A lamp is often a part of the mesh, or lies in a ceiling. Vertices are rounded to `f32`, so that
//! such a triangle may be in front of the light by a rounding and hide all of it. Its own triangles
//! are found here and excluded; where others are that close, the margin near the light is wide.
//! Elsewhere it is narrow, and what touches the light hides it up to where it touches.

use linelit_geometry::{ConvexPolygon, DVec3, Margins, Triangle};
use linelit_visibility::Occluders;
use std::ops::Range;

/// The rounding of heights by that of vertices to `f32`, relative to their largest coordinate: √3
/// times 2⁻²⁴ for a triangle's corner, as much for a corner of the light, and rounded up.
const ROUNDING: f64 = 4.0 / (1 << 24) as f64;

/// The rounding of heights in `f64`, relative to the largest coordinate: some ten operations on two
/// corners and a normal of unit length, with a factor of three to spare.
const EXACT: f64 = 64.0 * f64::EPSILON;

/// The part of the smaller area that two polygons have in common if they overlap by more than
/// rounding: clipping leaves slivers of neighbours as wide as the rounding, which is far less than
/// a thousandth of any light's width that `f32` resolves.
const OVERLAP: f64 = 1e-3;

/// The triangles of a flat light among the occluders, and the margins that it needs: `own` if that
/// names any, else the triangles that lie in the light if their numbers follow each other.
pub(crate) fn own_triangles(
    occluders: &Occluders,
    light: &ConvexPolygon,
    own: Range<u32>,
) -> (Range<u32>, Margins) {
    // Find the distances that are rounding. Vertices that were given as `f32` were rounded by the
    // caller, relative to zero; others here, relative to the origin.
    let (corners, n) = (light.vertices(), light.normal());
    let base = match occluders.rounding().displacement > 0.0 {
        true => occluders.origin(),
        false => DVec3::ZERO,
    };
    let largest = |points: &[DVec3], base: DVec3| {
        let each = points.iter().map(|p| (*p - base).abs().max_element());
        each.fold(0.0, f64::max)
    };
    let of_light = largest(corners, base);
    let rounding_of = |points: &[DVec3]| ROUNDING * of_light.max(largest(points, base));
    let exact = EXACT * largest(corners, DVec3::ZERO);
    // Look at the triangles whose boxes meet the light and its plane.
    let (low, high) = corners
        .iter()
        .fold((corners[0], corners[0]), |(low, high), p| {
            (low.min(*p), high.max(*p))
        });
    let height = |p: DVec3| n.dot(p - corners[0]);
    let may_hold = |l: DVec3, h: DVec3| {
        let rounding = rounding_of(&[l, h]);
        let is_apart = h.cmplt(low - rounding) | l.cmpgt(high + rounding);
        let half = 0.5 * (h - l).dot(n.abs());
        !is_apart.any() && height(0.5 * (l + h)).abs() <= half + rounding
    };
    let (mut inside, mut close) = (Vec::new(), Vec::new());
    occluders.any_triangle(may_hold, |number, triangle| {
        let rounding = rounding_of(&triangle.vertices);
        if let Some(part) = Coplanar::of(&triangle, light, rounding) {
            if part.is_inside {
                inside.push(number);
            }
            if part.height > exact {
                close.push(number);
            }
        }
        false
    });
    // Take those that lie in the light for its own.
    inside.sort_unstable();
    inside.dedup();
    let own = match (inside.first(), inside.last()) {
        (Some(first), Some(last))
            if own.is_empty() && (last - first) as usize + 1 == inside.len() =>
        {
            *first..last + 1
        }
        _ => own,
    };
    let margins = match close.iter().all(|number| own.contains(number)) {
        true => Margins::ROUNDING,
        false => Margins::DEFAULT,
    };
    (own, margins)
}

/// A triangle that lies on a light, up to the rounding of its corners.
struct Coplanar {
    /// Whether no corner is outside of the light.
    is_inside: bool,
    /// The largest distance from the light's plane of the part over the light.
    height: f64,
}

impl Coplanar {
    /// `None` where the part of the triangle over the light is rounding, or leaves its plane.
    fn of(triangle: &Triangle, light: &ConvexPolygon, rounding: f64) -> Option<Self> {
        let (corners, n) = (light.vertices(), light.normal());
        let height = |p: &DVec3| n.dot(*p - corners[0]).abs();
        let whole = ConvexPolygon::triangle(
            triangle.vertices[0],
            triangle.vertices[1],
            triangle.vertices[2],
        )
        .ok()?;
        // Cut off the parts outside each edge of the light.
        let mut over = whole;
        let mut is_inside = true;
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let inwards = n.cross(*b - *a).normalize_or_zero();
            is_inside &= triangle
                .vertices
                .iter()
                .all(|p| inwards.dot(*p - *a) >= -rounding);
            over = over.clip(*a, inwards)?;
        }
        // Take what is left if it is more than rounding, and no higher than that.
        let highest = over.vertices().iter().map(height).fold(0.0, f64::max);
        let overlaps = over.area() > OVERLAP * whole.area().min(light.area());
        (overlaps && highest <= rounding).then_some(Self {
            is_inside,
            height: highest,
        })
    }
}
