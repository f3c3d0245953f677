//! Projections of triangles onto the light's plane, called images here, and the tests whether one
//! of them contains a point next to an edge.

use super::settled;
use crate::bins::Bounds;
use crate::clip::Edge;
use crate::orient::{Point, orient};

/// The projection of a triangle onto the light's plane, turned counter-clockwise, with its bounding
/// box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Image {
    pub(super) corners: [Point; 3],
    pub(super) bounds: Bounds,
}

impl Image {
    /// Creates the image of a triangle with these projected corners; `None` if it has no area, and
    /// so hides nothing.
    pub(super) fn new(corners: [Point; 3]) -> Option<Self> {
        let [a, b, c] = [
            settled(corners[0]),
            settled(corners[1]),
            settled(corners[2]),
        ];
        let turn = orient(a, b, c);
        let corners = if turn > 0.0 { [a, b, c] } else { [a, c, b] };
        let bounds = Bounds::of(corners);
        (turn != 0.0).then_some(Self { corners, bounds })
    }

    fn sides(&self) -> [(Point, Point); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }

    /// Whether a rounded point of an edge, moved to the edge's right by an infinitesimal, is inside
    /// the image; `None` if the point is closer than `room` to a side of the image, so that
    /// rounding may decide.
    #[allow(clippy::float_cmp, reason = "the very same edge")]
    pub(super) fn holds_on(&self, point: Point, edge: &Edge, room: f64) -> Option<bool> {
        let mut close = false;
        for (c, d) in self.sides() {
            let (height, room) = (height(c, d, point), room * length(c, d));
            if height < -room || (c == edge.from && d == edge.to) {
                return Some(false);
            }
            let own = c == edge.to && d == edge.from;
            close |= height <= room && !own;
        }
        (!close).then_some(true)
    }

    /// Whether the start of an edge is inside the image, if it is moved along the edge by an
    /// infinitesimal, and then to the edge's right by a much smaller one. The decision is exact.
    #[inline(never)]
    pub(super) fn holds_start(&self, edge: &Edge) -> bool {
        self.sides().into_iter().all(|(c, d)| {
            // The position itself decides; if it is on a side, the move along the edge does, and
            // then the move to the right.
            let side = orient(c, d, edge.from);
            if side != 0.0 {
                return side > 0.0;
            }
            let along = orient(c, d, edge.to);
            if along != 0.0 {
                return along > 0.0;
            }
            // On one line, the right of the edge is the left of a side that runs in the opposite
            // direction.
            (d[0] - c[0]) * (edge.to[0] - edge.from[0])
                + (d[1] - c[1]) * (edge.to[1] - edge.from[1])
                < 0.0
        })
    }
}

/// Returns the distance of a point to the left of the line from c to d, times |d − c|, with
/// rounding errors.
fn height(c: Point, d: Point, p: Point) -> f64 {
    (d[0] - c[0]) * (p[1] - c[1]) - (d[1] - c[1]) * (p[0] - c[0])
}

/// Returns the length from c to d along the axes (L₁ norm).
fn length(c: Point, d: Point) -> f64 {
    (d[0] - c[0]).abs() + (d[1] - c[1]).abs()
}
