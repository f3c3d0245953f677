//! [`Triangle`]: a triangle in space, with its area, normal and nearest points.

use crate::{DVec3, predicates};

/// A triangle, counter-clockwise about its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// The three corners.
    pub vertices: [DVec3; 3],
}

impl Triangle {
    /// Creates the triangle with the given corners.
    #[inline]
    #[must_use]
    pub const fn new(a: DVec3, b: DVec3, c: DVec3) -> Self {
        Self {
            vertices: [a, b, c],
        }
    }

    /// Returns twice the area as a vector along the normal, `(b − a) × (c − a)`. Given the rounded
    /// edges, each component has a small relative error of its own, however small it is.
    #[must_use]
    pub fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.vertices;
        predicates::cross(b - a, c - a)
    }

    /// Returns the point of the triangle, edges and corners included, that is nearest to `p`, with
    /// an error of a few ε of the sizes involved.
    ///
    /// The signs of the projections of `p` on the edges at each corner decide whether the nearest
    /// point is a corner, on an edge or inside (Ericson 2005, section 5.1.5). For a degenerate
    /// triangle the result is one of its points.
    #[must_use]
    pub fn nearest(&self, p: DVec3) -> DVec3 {
        let [a, b, c] = self.vertices;
        let (ab, ac) = (b - a, c - a);
        let along = |from: DVec3| (ab.dot(p - from), ac.dot(p - from));
        let [(b0, c0), (b1, c1), (b2, c2)] = [along(a), along(b), along(c)];
        let on_edge = |from: DVec3, edge: DVec3| {
            let square = edge.length_squared();
            let t = if square > 0.0 {
                (edge.dot(p - from) / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            from + edge * t
        };
        // Compute the barycentric weights of the foot of the perpendicular from p to the plane; if
        // all are positive, the foot is inside the triangle.
        let (wa, wb, wc) = (b1 * c2 - b2 * c1, b2 * c0 - b0 * c2, b0 * c1 - b1 * c0);
        let sum = wa + wb + wc;
        if wa > 0.0 && wb > 0.0 && wc > 0.0 && sum < f64::INFINITY {
            return a + ab * (wb / sum) + ac * (wc / sum);
        }
        // Otherwise the nearest point is on an edge.
        let edges = [on_edge(a, ab), on_edge(b, c - b), on_edge(c, a - c)];
        let nearer = |x: DVec3, y: DVec3| {
            if p.distance_squared(y) < p.distance_squared(x) {
                y
            } else {
                x
            }
        };
        nearer(nearer(edges[0], edges[1]), edges[2])
    }

    /// The unit normal by the right-hand rule; zero for a degenerate triangle.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        predicates::normalize(self.area_vector()).unwrap_or(DVec3::ZERO)
    }

    /// The area in squared scene units. It is accurate for edges of lengths from 1e-140 to 1e140,
    /// whose products neither overflow nor underflow in `f64`.
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

    /// The mean of the corners.
    #[must_use]
    pub fn centroid(&self) -> DVec3 {
        let [a, b, c] = self.vertices;
        a + ((b - a) + (c - a)) / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-2.0..2.0f64).prop_map(DVec3::from)
    }

    proptest! {
        /// Nearest points are on the triangle, no farther than any point of a fine grid on it, and
        /// no nearer than the grid is fine.
        #[test]
        fn the_nearest_point_is_the_nearest(a in vector(), b in vector(), c in vector(), p in vector()) {
            let triangle = Triangle::new(a, b, c);
            let nearest = triangle.nearest(p);
            let grid = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| [i, j].map(|k| f64::from(k) / 40.0)));
            let least = grid.map(|[s, t]| triangle.at(s, t).distance(p)).fold(f64::INFINITY, f64::min);
            let found = nearest.distance(p);
            let side = [b - a, c - a, c - b].map(DVec3::length).into_iter().fold(0.0, f64::max);
            prop_assert!(found <= least + 1e-12 && found >= least - side / 40.0, "{found} {least}");
        }
    }
}
