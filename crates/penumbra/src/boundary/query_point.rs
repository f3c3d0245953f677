//! The choice of a point next to a stretch (a part of a side between two crossings), at which the
//! caller is asked whether any layer of a surface hides it.
//!
//! The layers over the point have to be those right of the stretch, so no other side may be between
//! the two:
//!
//! ```text
//!    lo ──────────────┬───────────────────► hi      the stretch
//!                     │ aside
//!      ╲              ●
//!       ╲                   another side
//!        ╲________________________________
//! ```
//!
//! A few points are tried, from far to close, and at different positions along the stretch.

use super::Penumbra;
use super::stretches::Stretch;
use crate::bins::Bounds;
use crate::clip::Edge;
use crate::orient::{Point, orient};

/// The positions that are tried, along a stretch and to its right, as fractions of the stretch's
/// length.
const ALONG: [f64; 5] = [0.5, 0.47, 0.59, 0.38, 0.67];
const ASIDE: [f64; 5] = [0.25, 0.02, 1e-3, 3e-5, 1e-6];

/// A generous bound of the rounding error of a computed point on a stretch, in units of the light.
const ROUNDING: f64 = 1e-14;

/// The largest number of other stretches of a group next to which query points are tried.
const TRIES: usize = 16;

impl Penumbra {
    /// Returns a point to the right of a stretch with no side in between, at least `least` away
    /// from the stretch; or such a point next to another stretch that is surely hidden by as many
    /// layers. `None` if no such point is found.
    pub(super) fn query_point(&self, stretch: &Stretch, least: f64) -> Option<Point> {
        let is_alike = |other: &&Stretch| {
            let (own, count) = (stretch.layers, other.layers);
            let is_same = count.unknown == own.unknown && count.plus == own.plus;
            is_same && other.lo.at < other.hi.at
        };
        let others = || self.stretches.all().iter().filter(is_alike).take(TRIES);
        self.point_right_of(stretch, least)
            .or_else(|| others().find_map(|other| self.point_right_of(other, least)))
    }

    /// Returns a point to the right of this stretch, at least `least` away from it, with no side in
    /// between; `None` if none of the positions that are tried is such a point.
    fn point_right_of(&self, stretch: &Stretch, least: f64) -> Option<Point> {
        let Stretch { side, lo, hi, .. } = stretch;
        let (length, side) = (stretch.length(), side.get());
        let own = &self.sides[side].edge;
        // Find the unit vector to the right of the side.
        let run = [0, 1].map(|k| own.to[k] - own.from[k]);
        let size = (run[0] * run[0] + run[1] * run[1]).sqrt();
        let right = [run[1] / size, -run[0] / size];
        // Try points, the farthest first.
        ALONG.iter().zip(ASIDE).find_map(|(along, aside)| {
            let aside = aside * length;
            let at = |aside: f64| {
                [0, 1].map(|k| {
                    let on_side = lo.point[k] + along * (hi.point[k] - lo.point[k]);
                    on_side + aside * right[k]
                })
            };
            // Points on the side are rounded, so begin one rounding error to its left, to miss no
            // side between the two.
            let (from, to) = (at(-ROUNDING * self.unit), at(aside));
            let is_free = aside > least && self.is_free(from, to, side, own);
            is_free.then_some(to)
        })
    }

    /// Whether no side is between two points; the first is on the side with index `own`, or a
    /// rounding error to its left.
    #[allow(clippy::float_cmp, reason = "on the very same line")]
    fn is_free(&self, from: Point, to: Point, own: usize, edge: &Edge) -> bool {
        let bounds = Bounds::of([from, to]);
        self.sides_near.near(&bounds, 0).all(|j| {
            if j == own || !self.boxes[j].meets(&bounds) {
                return true;
            }
            let other = &self.sides[j].edge;
            let other_from =
                |a: Point, b: Point| [orient(a, b, other.from), orient(a, b, other.to)];
            let are_on_one_side = |[a, b]: [f64; 2]| (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0);
            let ends = [from, to].map(|p| orient(other.from, other.to, p));
            // Another side on the line of this one is where the segment begins, and does not
            // separate the points.
            are_on_one_side(other_from(from, to))
                || are_on_one_side(ends)
                || other_from(edge.from, edge.to) == [0.0; 2]
        })
    }
}
