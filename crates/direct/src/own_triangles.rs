//! This module finds the triangles in the plane of a flat light: the light's own, and those of a
//! surface that it is mounted in.
//!
//! A lamp is often a part of the mesh, or lies in a ceiling. Vertices are rounded to `f32`, so that
//! such a triangle may be in front of the light by a rounding error and hide all of it. The light's
//! own triangles are found here, and then excluded from its occluders. If other triangles are that
//! close to its plane, the margin near the light is made wide, and they hide nothing. Otherwise it
//! is narrow, and an object that touches the light hides it up to where they touch.

use linelit_geometry::{ConvexPolygon, DVec3, Margins, Triangle};
use linelit_visibility::Occluders;
use std::ops::Range;

/// The error of heights above a plane that comes from rounding vertices to `f32`, relative to their
/// largest coordinate: √3 times 2⁻²⁴ for a corner of the triangle, as much for a corner of the
/// light, and rounded up.
const ROUNDING: f64 = 4.0 / (1 << 24) as f64;

/// The rounding error of heights in `f64`, relative to the largest coordinate: some ten operations
/// on two corners and a unit normal, with a safety factor of three.
const EXACT: f64 = 64.0 * f64::EPSILON;

/// Two polygons overlap by more than rounding if they have more than this fraction of the smaller
/// area in common. Clipping leaves slivers of neighbours that are as wide as the rounding, which is
/// far less than a thousandth of any light's width that `f32` resolves.
const OVERLAP: f64 = 1e-3;

/// Returns the own triangles of a flat light, and the margins that it needs. Its own triangles are
/// `own`, unless that is empty; then they are the triangles within the light, if their numbers are
/// consecutive.
pub(crate) fn own_triangles(
    occluders: &Occluders,
    light: &ConvexPolygon,
    own: Range<u32>,
) -> (Range<u32>, Margins) {
    // Find which distances are within rounding. If vertices were given as `f32`, the caller has
    // rounded them, relative to zero; otherwise they were rounded here, relative to the origin.
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
    // Test the triangles whose boxes overlap the box of the light and its plane.
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
    // Take the triangles within the light as its own.
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
    // Widen the margin if other triangles are so close to the plane.
    let margins = match close.iter().all(|number| own.contains(number)) {
        true => Margins::ROUNDING,
        false => Margins::DEFAULT,
    };
    (own, margins)
}

/// A triangle that lies on a light, up to the rounding of its corners.
struct Coplanar {
    /// Whether no corner is outside the light.
    is_inside: bool,
    /// The largest distance from the light's plane of the part that overlaps the light.
    height: f64,
}

impl Coplanar {
    /// Clips a triangle to the prism over a light. `None` if what remains is within rounding, or is
    /// farther from the light's plane than that.
    fn of(triangle: &Triangle, light: &ConvexPolygon, rounding: f64) -> Option<Self> {
        let (corners, n) = (light.vertices(), light.normal());
        let height = |p: &DVec3| n.dot(*p - corners[0]).abs();
        let whole = ConvexPolygon::triangle(
            triangle.vertices[0],
            triangle.vertices[1],
            triangle.vertices[2],
        )
        .ok()?;
        // Clip the triangle to the planes through the light's edges.
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
        // Accept what remains if its area is more than rounding and its height is not.
        let highest = over.vertices().iter().map(height).fold(0.0, f64::max);
        let overlaps = over.area() > OVERLAP * whole.area().min(light.area());
        (overlaps && highest <= rounding).then_some(Self {
            is_inside,
            height: highest,
        })
    }
}
