//! The convex hull of two convex polygons: polygons outside of it cannot hide one of the two from
//! the other.

use linelit_geometry::{ConvexPolygon, DVec3};

/// The relative rounding error of a height over a plane, which is computed by products and sums of
/// coordinate differences. A blocker that extends into a hull by less than this does not count; it
/// hides a part of the same size, which is below the rounding of results, whereas a larger margin
/// would lose thin blockers.
const ROOM: f64 = 32.0 * f64::EPSILON;

/// The convex hull of two convex polygons.
#[derive(Clone, Debug)]
pub(crate) struct Hull {
    low: DVec3,
    high: DVec3,
    /// The unit normals of the hull's planes, which point inwards, each with the height of the
    /// plane along its normal.
    planes: Vec<(DVec3, f64)>,
    /// The height above a plane below which a point counts as on it.
    room: f64,
}

impl Hull {
    /// Creates the hull of two polygons, given by their corners, which are in their planes up to a
    /// tolerance.
    ///
    /// Each face of the hull contains an edge of one polygon and a corner of the other, or is one
    /// of the polygons. So all such planes are tried, and those with all corners on one side are
    /// kept.
    pub(crate) fn new(first: &[DVec3], second: &[DVec3], tolerance: f64) -> Self {
        let all = || first.iter().chain(second).copied();
        let start = first.first().copied().unwrap_or_default();
        let (low, high) = (all().fold(start, DVec3::min), all().fold(start, DVec3::max));
        let mut hull = Self {
            low,
            high,
            planes: Vec::with_capacity(16),
            room: tolerance.max(ROOM * low.abs().max(high.abs()).max_element()),
        };
        for (own, other) in [(first, second), (second, first)] {
            let edges = own.iter().zip(own.iter().cycle().skip(1));
            for (a, b) in edges {
                for c in other {
                    hull.add_if_outside((*b - *a).cross(*c - *a), *a, all());
                }
            }
            if let [a, b, .., c] = *own {
                hull.add_if_outside((b - a).cross(c - a), a, all());
            }
        }
        hull
    }

    /// Adds the plane through `origin` with this normal if all points are on one side of it, up to
    /// rounding, so that it bounds the hull.
    fn add_if_outside(
        &mut self,
        normal: DVec3,
        origin: DVec3,
        points: impl Iterator<Item = DVec3>,
    ) {
        let Some(normal) = normal.try_normalize() else {
            return;
        };
        // Find the points' heights; give up when there are points on both sides.
        let at = normal.dot(origin);
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for point in points {
            let height = normal.dot(point) - at;
            (low, high) = (low.min(height), high.max(height));
            if low < -self.room && high > self.room {
                return;
            }
        }
        // Orient the plane inwards, and add it unless it is there already.
        let plane = match (low >= -self.room, high <= self.room) {
            (true, false) => (normal, at),
            (false, true) => (-normal, -at),
            (true, true) | (false, false) => return,
        };
        let is_known = |(n, d): &(DVec3, f64)| {
            n.dot(plane.0) >= 1.0 - f64::EPSILON && (d - plane.1).abs() <= self.room
        };
        if !self.planes.iter().any(is_known) {
            self.planes.push(plane);
        }
    }

    /// Whether a box may overlap the hull.
    pub(crate) fn may_hold(&self, low: DVec3, high: DVec3) -> bool {
        let apart = high.cmplt(self.low) | low.cmpgt(self.high);
        !apart.any()
            && self.planes.iter().all(|(normal, at)| {
                // The corner farthest along the normal.
                let corner = DVec3::select(normal.cmpge(DVec3::ZERO), high, low);
                normal.dot(corner) > *at - self.room
            })
    }

    /// Whether a polygon overlaps the inside of the hull, or, with `or_touches`, touches its
    /// surface. `memory` is a buffer for the clipped polygon.
    pub(crate) fn meets(
        &self,
        polygon: &ConvexPolygon,
        or_touches: bool,
        memory: &mut [Vec<DVec3>; 2],
    ) -> bool {
        let room = if or_touches { -self.room } else { self.room };
        let mut is_cut = false;
        let [part, next] = memory;
        // Clip the polygon by each plane; the first cut copies it.
        for (normal, at) in &self.planes {
            let height = |p: &DVec3| normal.dot(*p) - at - room;
            let corners = if is_cut {
                part.as_slice()
            } else {
                polygon.vertices()
            };
            // End if nothing is inside of the plane; clip if only a part is.
            let inside = corners.iter().filter(|p| height(p) > 0.0).count();
            if inside == 0 {
                return false;
            }
            if inside < corners.len() {
                next.clear();
                for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                    let (from, to) = (height(p), height(q));
                    if from > 0.0 {
                        next.push(*p);
                    }
                    if (from > 0.0) != (to > 0.0) {
                        next.push(*p + (*q - *p) * (from / (from - to)));
                    }
                }
                std::mem::swap(part, next);
                is_cut = true;
            }
        }
        true
    }
}

/// Whether every segment between two polygons passes through a third polygon, the blocker, and both
/// are farther from its plane than a tolerance. It suffices to test the segments between corners.
pub(crate) fn hides_all(blocker: &ConvexPolygon, p: &[DVec3], q: &[DVec3], tolerance: f64) -> bool {
    let (n, v) = (blocker.normal(), blocker.vertices());
    let height = |x: &DVec3| n.dot(*x - v[0]);
    let passes = |a: &DVec3, b: &DVec3| {
        let (from, to) = (height(a), height(b));
        let x = *a + (*b - *a) * (from / (from - to));
        let edges = v.iter().zip(v.iter().cycle().skip(1));
        { edges }.all(|(c, d)| n.dot((*d - *c).cross(x - *c)) >= 0.0)
    };
    // One polygon has to be wholly on one side of the blocker, the other on the other side.
    let side = p.first().map_or(0.0, &height).signum();
    let all = p.iter().chain(q).map(|x| x.abs().max_element());
    let room = tolerance.max(ROOM * all.fold(0.0, f64::max));
    let is_off = |x: &DVec3, side: f64| height(x) * side > room;
    p.iter().all(|x| is_off(x, side))
        && q.iter().all(|x| is_off(x, -side))
        && p.iter().all(|a| q.iter().all(|b| passes(a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_reaches_into_a_hull_by_more_than_rounding_meets_it() {
        let square =
            |z: f64| [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, z));
        let mut low = square(0.0);
        let high = square(1.0);
        low.reverse();
        let hull = Hull::new(&low, &high, 0.0);
        let mut memory = [Vec::new(), Vec::new()];
        let mut meets = |hull: &Hull, depth: f64, or_touches: bool| {
            let corners = [[-1., 0.3], [depth, 0.3], [depth, 0.6], [-1., 0.6]];
            let fin = ConvexPolygon::new(&corners.map(|[x, z]| [x, 0.5, z])).unwrap();
            hull.meets(&fin, or_touches, &mut memory)
        };
        for depth in [1e-12, 1e-6, 0.5] {
            assert!(
                meets(&hull, depth, false) && !meets(&hull, -depth, true),
                "{depth}"
            );
        }
        // Touching it is rounding, or within the tolerance of its corners.
        for depth in [0.0, 1e-15, -1e-15] {
            assert!(
                !meets(&hull, depth, false) && meets(&hull, depth, true),
                "{depth}"
            );
        }
        let hull = Hull::new(&low, &high, 1e-9);
        assert!(!meets(&hull, 5e-10, false) && meets(&hull, 2e-9, false));
    }

    #[test]
    fn what_two_polygons_touch_does_not_hide_them() {
        let square = |z: f64, half: f64| {
            [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]]
                .map(|[x, y]| DVec3::new(half * x, half * y, z))
        };
        let plate = ConvexPolygon::new(&square(0.0, 3.0)).unwrap();
        let hides = |z: f64, tolerance: f64| {
            hides_all(&plate, &square(z, 1.0), &square(-1.0, 1.0), tolerance)
        };
        assert!(hides(1.0, 0.0) && hides(1e-12, 0.0) && hides(2e-9, 1e-9));
        assert!(!hides(0.0, 0.0) && !hides(1e-15, 0.0) && !hides(5e-10, 1e-9));
    }
}
