//! Triangles.

use crate::{DVec3, predicates};

/// A triangle, counter-clockwise about its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The three corners.
    pub vertices: [DVec3; 3],
}

impl Triangle {
    /// The triangle with the given corners.
    #[inline]
    #[must_use]
    pub const fn new(a: DVec3, b: DVec3, c: DVec3) -> Self {
        Self {
            vertices: [a, b, c],
        }
    }

    /// `(b − a) × (c − a)`: twice the area, along the normal; each component accurate relative to
    /// itself given the rounded edges.
    #[must_use]
    pub fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.vertices;
        predicates::cross(b - a, c - a)
    }

    /// Unit normal by the right-hand rule; zero for a degenerate triangle.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        predicates::normalize(self.area_vector()).unwrap_or(DVec3::ZERO)
    }

    /// Area in squared scene units; right for edges from 1e-140 to 1e140, whose products `f64`
    /// holds with all their digits.
    #[must_use]
    pub fn area(&self) -> f64 {
        0.5 * predicates::length(self.area_vector())
    }

    /// The point with barycentric coordinates `(1 − b1 − b2, b1, b2)`.
    #[must_use]
    pub fn at(&self, b1: f64, b2: f64) -> DVec3 {
        let [a, b, c] = self.vertices;
        a + (b - a) * b1 + (c - a) * b2
    }

    /// Mean of the corners.
    #[must_use]
    pub fn centroid(&self) -> DVec3 {
        let [a, b, c] = self.vertices;
        a + ((b - a) + (c - a)) / 3.0
    }
}
