//! This module holds the light that a convex polygon makes, and the polygon's properties as a
//! surface.

use super::shape::{Extent, Normals, Shape, ShapeLight, bounds_of, is_position, on_plane};
use crate::light::{Emission, height};
use linelit_geometry::{ConvexPolygon, DVec2, DVec3};

/// A convex planar polygon (triangle, quad, …) that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The shape; its normal is the emitting side.
    pub polygon: ConvexPolygon,
    /// The radiance that it emits, and from which sides.
    pub emission: Emission,
}

impl AreaLight {
    /// Whether the shading point `x` is on a side that emits, and not in the plane of the light.
    ///
    /// The light that a point in the plane receives is not determined: its limit is anything
    /// between zero and half of the sphere of directions, depending on the approach, and every
    /// technique would give a different value. It is therefore defined as zero. A point counts as
    /// in the plane if its height is at most `margin` times the distance or the light's size, where
    /// `margin` is raised to 10⁻¹² at least.
    #[must_use]
    #[inline]
    pub fn faces(&self, x: DVec3, margin: f64) -> bool {
        let (normal, corners) = (self.polygon.normal(), self.polygon.vertices());
        let size = (corners[2] - corners[0]).abs().max_element();
        self.emission
            .reaches(height(normal, corners[0], size, x, margin))
    }
}

impl ShapeLight for AreaLight {
    #[inline]
    fn emission(&self) -> Emission {
        self.emission
    }

    fn area(&self) -> f64 {
        self.polygon.area()
    }

    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.polygon.normal()
    }

    fn can_light(&self, x: DVec3, n: DVec3) -> bool {
        self.faces(x, 0.0) && self.polygon.may_rise_above(x, n)
    }

    fn middle(&self, _: DVec3) -> (DVec3, f64) {
        (self.polygon.centroid(), 1.0)
    }

    fn extent(&self) -> Extent {
        let (vertices, mean) = (self.polygon.vertices(), self.polygon.centroid());
        // The second moment of a triangle is 1/12 of the sum over its corners, which is a good
        // enough approximation for any polygon.
        let spread: f64 = vertices.iter().map(|v| (*v - mean).length_squared()).sum();
        Extent {
            bounds: bounds_of(vertices),
            mean,
            variance: spread / 12.0,
            normals: Normals::of_flat(self.polygon.normal(), self.emission.two_sided),
        }
    }

    fn is_valid(&self, largest: f64) -> bool {
        let mut vertices = self.polygon.vertices().iter();
        vertices.all(|v| is_position(*v, largest))
    }
}

impl Shape for ConvexPolygon {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.normal()
    }

    fn flat(&self) -> Option<DVec3> {
        Some(self.normal())
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let (vertices, n) = (self.vertices(), self.normal());
        // Meet the plane, and test the point against each edge.
        let hit = on_plane(vertices[0], n, x, direction)?;
        let next = vertices.iter().cycle().skip(1);
        let inside = |(a, b): (&DVec3, &DVec3)| n.dot((*b - *a).cross(hit - *a)) >= 0.0;
        vertices.iter().zip(next).all(inside).then_some(hit)
    }

    #[inline]
    fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        self.vertices().iter().any(|v| n.dot(*v - x) > 0.0)
    }

    /// The extents are measured along the first edge and across it.
    fn half_width(&self) -> f64 {
        let frame = self.plane_frame();
        let corners = self.vertices().iter().map(|v| frame.to_plane(*v));
        let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        0.5 * (high - low).min_element()
    }

    fn border(&self, point: DVec3, _: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        let vertices = self.vertices();
        let next = vertices.iter().cycle().skip(1);
        let factor = |(a, b): (&DVec3, &DVec3)| {
            let inwards = self.normal().cross((*b - *a).normalize_or_zero());
            edge(inwards.dot(point - *a))
        };
        vertices.iter().zip(next).map(factor).product()
    }
}
