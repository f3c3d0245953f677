//! Which part of a directed edge lies in a convex polygon, seen from just right of the edge.

use super::orient::{Point, orient};

/// A directed edge; what is of interest lies on its right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub from: Point,
    pub to: Point,
}

/// An end of a part of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// The place along the edge: 0 at its start, its length squared at its end.
    pub at: f64,
    /// The point itself: the same bits for both edges that cross there.
    pub point: Point,
}

/// A part of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub lo: End,
    pub hi: End,
}

/// How an edge's line passes a polygon.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Passing {
    /// Not through its interior.
    Beside,
    /// Along one of its sides, with the polygon on the left: between these corners.
    Along(Point, Point),
    /// Through its interior: the part of the edge that is in the polygon, if any, and whether the
    /// edge's line holds one of the sides, with the polygon on the right.
    Through(Option<Span>, bool),
}

impl Edge {
    fn place(&self, p: Point) -> f64 {
        let d = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        d[0] * (p[0] - self.from[0]) + d[1] * (p[1] - self.from[1])
    }

    /// The whole edge.
    pub(crate) fn whole(&self) -> Span {
        let start = End {
            at: 0.0,
            point: self.from,
        };
        Span {
            lo: start,
            hi: self.end_at(self.to),
        }
    }

    fn end_at(&self, point: Point) -> End {
        let at = self.place(point);
        End { at, point }
    }

    /// The part between two points of the edge's line.
    pub(crate) fn between(&self, a: Point, b: Point) -> Option<Span> {
        let whole = self.whole();
        let (a, b) = (self.end_at(a), self.end_at(b));
        let (a, b) = if a.at <= b.at { (a, b) } else { (b, a) };
        let lo = if a.at > whole.lo.at { a } else { whole.lo };
        let hi = if b.at < whole.hi.at { b } else { whole.hi };
        (lo.at < hi.at).then_some(Span { lo, hi })
    }

    /// The part of the edge, moved to its right by nothing at all, that is inside of a convex
    /// polygon given counter-clockwise.
    ///
    /// Every decision is that of exact arithmetic on the given coordinates. Points on the edge's
    /// line count as left of it, so that a polygon that touches the edge from the right contains
    /// the moved edge and one that touches it from the left does not.
    #[inline]
    pub(crate) fn pass(&self, polygon: &[Point]) -> Passing {
        let count = polygon.len();
        let side = |i: usize| orient(self.from, self.to, polygon[i]);
        let last = side(count - 1);
        let mut before = (polygon[count - 1], last);
        // Where the polygon's boundary crosses the line to its right and back to its left.
        let (mut into, mut out) = (None, None);
        let mut along = None;
        for (i, &corner) in polygon.iter().enumerate() {
            let here = if i + 1 == count { last } else { side(i) };
            if here == 0.0 && before.1 == 0.0 {
                along = Some((before.0, corner));
            }
            match (before.1 < 0.0, here < 0.0) {
                (false, true) => into = Some((before, (corner, here))),
                (true, false) => out = Some((before, (corner, here))),
                _ => {}
            }
            before = (corner, here);
        }
        let (Some(into), Some(out)) = (into, out) else {
            return along.map_or(Passing::Beside, |(a, b)| Passing::Along(a, b));
        };
        Passing::Through(self.inside(into, out), along.is_some())
    }

    /// The part between the side that is crossed `into` the polygon and the one `out` of it.
    fn inside(
        &self,
        into: ((Point, f64), (Point, f64)),
        out: ((Point, f64), (Point, f64)),
    ) -> Option<Span> {
        let whole = self.whole();
        let ((c, side_c), (d, _)) = into;
        let lo = if orient(c, d, self.from) >= 0.0 {
            whole.lo
        } else if orient(c, d, self.to) <= 0.0 {
            return None;
        } else {
            self.crossing(c, d, side_c == 0.0, c, whole.hi.at)
        };
        let ((c, _), (d, side_d)) = out;
        let hi = if orient(c, d, self.to) >= 0.0 {
            whole.hi
        } else if orient(c, d, self.from) <= 0.0 {
            return None;
        } else {
            self.crossing(c, d, side_d == 0.0, d, whole.hi.at)
        };
        (lo.at < hi.at).then_some(Span { lo, hi })
    }

    /// Where the edge crosses the side from `c` to `d`: at the corner `left` if that is on the
    /// edge's line.
    fn crossing(&self, c: Point, d: Point, on_line: bool, left: Point, length: f64) -> End {
        let point = if on_line {
            left
        } else {
            crossing([self.from, self.to], [c, d])
        };
        End {
            at: self.place(point).clamp(0.0, length),
            point,
        }
    }
}

/// Where two segments that properly cross do so: the same bits whichever comes first and
/// whichever way they run.
fn crossing(e: [Point; 2], f: [Point; 2]) -> Point {
    let sorted = |[a, b]: [Point; 2]| if a <= b { [a, b] } else { [b, a] };
    let (e, f) = (sorted(e), sorted(f));
    let ([a, b], [c, d]) = if e <= f { (e, f) } else { (f, e) };
    let (from, to) = (orient(c, d, a), orient(c, d, b));
    let t = from / (from - to);
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}
