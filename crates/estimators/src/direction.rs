//! The directions in which the lines of a light may run.

use crate::{EmissionTexture, LineBy, LineDirection, Lines, Query, Stream};
use linelit_elementary::atan2;
use linelit_geometry::ConvexPolygon;
use std::f64::consts::PI;

/// Directions that are compared.
pub(crate) const DIRECTIONS: usize = 4;

/// Directions to compare, in half turns from the first edge of a light: of a triangle those of its
/// edges, of a quadrilateral those of two edges and the diagonals, of any other light that of the
/// first edge and those at even angles to it.
///
/// Lines along an edge of a parallelogram all have one length, and what stands between is often
/// parallel to one of both; no edge of occluders that are aligned with the light is parallel to its
/// diagonals.
pub(crate) fn directions(light: &ConvexPolygon) -> [f64; DIRECTIONS] {
    let v = light.vertices();
    let axes = light.plane_frame().axes;
    let along = |from: usize, to: usize| {
        let way = v[to] - v[from];
        (atan2(axes.y.dot(way), axes.x.dot(way)) / PI).rem_euclid(1.0)
    };
    match v.len() {
        3 => [0.0, along(1, 2), along(2, 0), 0.0],
        4 => [0.0, along(1, 2), along(0, 2), along(1, 3)],
        _ => [0.0, 0.5, 0.25, 0.75],
    }
}

impl Lines {
    /// The direction of a family of lines in half turns from the light's first edge: by a random
    /// number in [0, 1), unless it is said or known which suits the light.
    pub(crate) fn fraction<R, T: EmissionTexture>(&self, query: &Query<'_, R, T>, u: f64) -> f64 {
        match self.direction {
            LineDirection::Fixed(fraction) => fraction,
            // Lines by texture run along its axes, in turn.
            LineDirection::Adaptive if self.measure() != LineBy::Texture => {
                query.light.occlusion.direction.unwrap_or(u)
            }
            LineDirection::Adaptive
            | LineDirection::Parallel
            | LineDirection::Spread(_)
            | LineDirection::UniformPerLine
            | LineDirection::Stratified
            | LineDirection::Origin => u,
        }
    }

    /// [`Lines::fraction`] of the only lines of a query.
    pub(crate) fn only_fraction<R, T: EmissionTexture>(&self, query: &Query<'_, R, T>) -> f64 {
        self.fraction(query, only_number(query))
    }
}

/// The random number that directs the only lines of a query.
pub(crate) fn only_number<R, T: EmissionTexture>(query: &Query<'_, R, T>) -> f64 {
    query.numbers.in_common(Stream::Orientation, 1).get_1d(0)
}
