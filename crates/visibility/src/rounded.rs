//! Conversion of vertices of any type to what the hierarchy stores: `f32` relative to an origin.

use crate::pool;
use linelit_geometry::{DVec3, Rounding, Vector3, origin_of_box};
use std::borrow::Cow;

/// Vertices in `f32` relative to an origin, and how far rounding moved them.
pub(crate) struct Rounded<'a> {
    pub(crate) positions: Cow<'a, [[f32; 3]]>,
    pub(crate) origin: DVec3,
    pub(crate) rounding: Rounding,
}

/// The number of triangles or vertices that one parallel task handles.
const AT_ONCE: usize = 1 << 14;

/// The largest number of triangles in the sample whose sides determine the median length of a side.
const MEASURED: usize = 1 << 12;

impl<'a> Rounded<'a> {
    /// Rounds the vertices to `f32` relative to an origin; vertices that are `f32` already are
    /// borrowed as they are. The origin is computed from the bounding box of the vertices that
    /// triangles use ([`origin_of_box`]).
    pub(crate) fn new<V: Vector3 + Copy + Sync>(
        positions: &'a [V],
        triangles: &[[u32; 3]],
    ) -> Self {
        if let Some(singles) = V::singles(positions) {
            return Self {
                positions: Cow::Borrowed(singles),
                origin: DVec3::ZERO,
                rounding: Rounding::default(),
            };
        }
        // Find the origin.
        let used = |t: &[u32; 3]| corners(positions, t);
        let boxes = pool::stretches(triangles.len(), AT_ONCE, &|range| {
            let all = triangles[range].iter().filter_map(used).flatten();
            all.fold(EMPTY, |[low, high], p| [low.min(p), high.max(p)])
        });
        let boxes = boxes.into_iter();
        let [low, high] = boxes.fold(EMPTY, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let origin = origin_of_box(low, high);
        // Round all vertices, and measure by how much that moves those that triangles use.
        let round = |p: DVec3| (p - origin).as_vec3();
        let singles = pool::collect(positions.len(), AT_ONCE, &|k| {
            round(positions[k].dvec3()).to_array()
        });
        let moved = |p: DVec3| round(p).as_dvec3().distance(p - origin);
        let moved = pool::stretches(triangles.len(), AT_ONCE, &|range| {
            let all = triangles[range].iter().filter_map(used).flatten();
            all.map(moved).fold(0.0, f64::max)
        });
        let displacement = moved.into_iter().fold(0.0, f64::max);
        // Compare the displacement with the sides of a sample of triangles.
        let every = triangles.len().div_ceil(MEASURED).max(1);
        let measured = triangles.iter().step_by(every).filter_map(used);
        let sides = measured.flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]);
        Self {
            positions: Cow::Owned(singles),
            origin,
            rounding: Rounding::new(displacement, &mut sides.collect::<Vec<_>>()),
        }
    }
}

/// The bounding box of no points, as its lowest and highest corner.
const EMPTY: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// Returns the corners of a triangle before rounding; `None` if the triangle can hide nothing.
fn corners<V: Vector3 + Copy>(positions: &[V], triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
    let [a, b, c] = triangle.map(|k| positions.get(k as usize).map(|v| v.dvec3()));
    let t = [a?, b?, c?];
    let is_used = t.iter().all(|v| v.is_finite()) && t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    is_used.then_some(t)
}
