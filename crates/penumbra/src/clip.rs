//! Directed edges in the light's plane: where they cross, and which part of one is on the light.

use super::orient::{Point, orient};

/// A directed edge; what is of interest lies right next to it on its right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub from: Point,
    pub to: Point,
    /// The square of its length, which is the position of its end; see [`End::at`].
    pub length: f64,
}

/// A place on an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// The position along the edge: 0 at its start, its length squared at its end.
    pub at: f64,
    /// The point itself: the same bits for both edges that cross there.
    pub point: Point,
}

/// A part of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub lo: End,
    pub hi: End,
    /// The origin of the lower end.
    pub start: Start,
}

/// The origin of the lower end of a part of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Start {
    /// The edge's own start.
    Own,
    /// A corner of what the edge was cut by, or a crossing, known to this much.
    Cut(f64),
}

/// A vertex and how far left of an edge it is.
type Side = (Point, f64);

/// The relation of two edges, each moved to its right by an infinitesimal in turn.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Meeting {
    /// The edges do not meet.
    Apart,
    /// The edges lie on one line.
    Aligned,
    /// The edges cross at a point.
    Crossing(Crossing),
}

/// A point where two edges cross.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub point: Point,
    /// Whether the first, moved, passes the second, and whether it comes to its left.
    pub first: Option<bool>,
    /// Whether the second, moved, passes the first, and whether it comes to its left.
    pub second: Option<bool>,
    /// Whether an end of one is on the line through the other.
    pub touching: bool,
}

impl Edge {
    pub(crate) fn new(from: Point, to: Point) -> Self {
        let mut out = Self {
            from,
            to,
            length: 0.0,
        };
        out.length = out.place(to);
        out
    }

    /// Returns the edge with its direction reversed.
    pub(crate) fn reversed(&self) -> Self {
        Self {
            from: self.to,
            to: self.from,
            length: self.length,
        }
    }

    /// The greater part of how far it runs, and no more than twice that.
    pub(super) fn extent(&self) -> f64 {
        (self.to[0] - self.from[0]).abs() + (self.to[1] - self.from[1]).abs()
    }

    #[inline]
    fn place(&self, p: Point) -> f64 {
        let d = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        d[0] * (p[0] - self.from[0]) + d[1] * (p[1] - self.from[1])
    }

    /// The whole edge.
    pub(crate) fn whole(&self) -> Span {
        let (at, point) = (0.0, self.from);
        let hi = End {
            at: self.length,
            point: self.to,
        };
        Span {
            lo: End { at, point },
            hi,
            start: Start::Own,
        }
    }

    /// A point on the edge; what rounding moves beyond its ends is put there. (Beyond them it would
    /// come before or after all else on the edge just as well: no decision hangs on it.)
    #[inline]
    pub(crate) fn end_at(&self, point: Point) -> End {
        let at = self.place(point).max(0.0).min(self.length);
        End { at, point }
    }

    /// The part that this edge shares with another on the same line that runs the same way.
    pub(crate) fn shared(&self, other: &Self) -> Option<Span> {
        let (whole, a, b) = (self.whole(), self.place(other.from), self.place(other.to));
        let lo = if a > 0.0 {
            self.end_at(other.from)
        } else {
            whole.lo
        };
        let hi = if b < whole.hi.at {
            self.end_at(other.to)
        } else {
            whole.hi
        };
        let start = Start::Own;
        (a < b && lo.at < hi.at).then_some(Span { lo, hi, start })
    }

    /// The part of the edge, moved to its right by nothing at all, that is inside of a convex
    /// polygon given counter-clockwise; none if it lies along one of the polygon's sides.
    ///
    /// Every decision is that of exact arithmetic on the given coordinates.
    pub(crate) fn within(&self, polygon: &[Point]) -> Option<Span> {
        let count = polygon.len();
        let side = |i: usize| (polygon[i], orient(self.from, self.to, polygon[i]));
        let mut before = side(count - 1);
        // Where the polygon's boundary crosses the line to its right and back to its left; points
        // on the line count as left.
        let (mut into, mut out) = (None, None);
        for i in 0..count {
            let here = side(i);
            if here.1 == 0.0 && before.1 == 0.0 {
                return None;
            }
            match (before.1 < 0.0, here.1 < 0.0) {
                (false, true) => into = Some((before, here)),
                (true, false) => out = Some((before, here)),
                _ => {}
            }
            before = here;
        }
        self.between(into?, out?)
    }

    /// The part between the side that is crossed `into` the polygon and the one `out` of it.
    fn between(&self, into: (Side, Side), out: (Side, Side)) -> Option<Span> {
        let whole = self.whole();
        let (lo, start) = {
            let ((c, side_c), (d, _)) = into;
            let ends = self.beside(c, d);
            if ends[0] <= 0.0 {
                (whole.lo, Start::Own)
            } else if ends[1] >= 0.0 {
                return None;
            } else {
                let point = if side_c == 0.0 {
                    c
                } else {
                    self.crossing(ends)
                };
                let start = Start::Cut(self.slack(&Self::new(c, d), ends));
                (self.end_at(point), start)
            }
        };
        let ((c, _), (d, side_d)) = out;
        let ends = self.beside(c, d);
        let hi = if ends[1] <= 0.0 {
            whole.hi
        } else if ends[0] >= 0.0 {
            return None;
        } else {
            self.end_at(if side_d == 0.0 {
                d
            } else {
                self.crossing(ends)
            })
        };
        (lo.at < hi.at).then_some(Span { lo, hi, start })
    }

    /// Returns how far the ends are to the right of the line from c to d, as seen from d: the
    /// polygon's sides are reversed where edges meet.
    fn beside(&self, c: Point, d: Point) -> [f64; 2] {
        [orient(d, c, self.from), orient(d, c, self.to)]
    }

    /// Returns the error bound along this edge of its crossing with another edge, whose ends are at
    /// `ends` beside the other: each of the two is wrong by less than 4 ε of its terms.
    fn slack(&self, other: &Self, ends: [f64; 2]) -> f64 {
        let size = |p: Point| p[0].abs() + p[1].abs();
        let far = size(self.from) + size(self.to) + 2.0 * size(other.from);
        4.0 * f64::EPSILON * far * other.extent() * self.extent() / (ends[0] - ends[1]).abs()
    }

    /// Whether rounding may move where two edges cross by more than `room` along either.
    #[inline]
    pub(super) fn crosses_loosely(&self, other: &Self, room: f64) -> bool {
        let size = |p: Point| p[0].abs() + p[1].abs();
        let far = size(self.from) + size(self.to) + size(other.from) + size(other.to);
        let run = |e: &Self| [e.to[0] - e.from[0], e.to[1] - e.from[1]];
        let (a, b) = (run(self), run(other));
        let turn = (a[0] * b[1] - a[1] * b[0]).abs();
        turn * room <= 4.0 * f64::EPSILON * far * other.extent() * self.extent()
    }

    /// Returns the proper crossing with another edge, which has its ends at `ends` beside it.
    #[inline]
    fn crossing(&self, [from, to]: [f64; 2]) -> Point {
        let t = from / (from - to);
        let run = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        [self.from[0] + run[0] * t, self.from[1] + run[1] * t]
    }

    /// Finds how two edges meet, exactly; both get one crossing, which is computed along this one.
    ///
    /// An edge that is moved to its right leaves the corners on its own line on its left. Its ends
    /// are moved inwards, by more than that: what touches them only is not passed.
    #[inline]
    pub(crate) fn meet(&self, other: &Self) -> Meeting {
        let c = orient(self.from, self.to, other.from);
        let d = orient(self.from, self.to, other.to);
        if (c > 0.0 && d > 0.0) || (c < 0.0 && d < 0.0) {
            return Meeting::Apart;
        }
        let a = orient(other.from, other.to, self.from);
        let b = orient(other.from, other.to, self.to);
        if c == 0.0 && d == 0.0 {
            return Meeting::Aligned;
        }
        if (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0) {
            return Meeting::Apart;
        }
        if c * d < 0.0 && a * b < 0.0 {
            return Meeting::Crossing(Crossing {
                point: self.crossing([a, b]),
                first: Some(c > 0.0),
                second: Some(a > 0.0),
                touching: false,
            });
        }
        let first = passes([c, d], [a, b]);
        let second = passes([a, b], [c, d]);
        let point = if c == 0.0 {
            other.from
        } else if d == 0.0 {
            other.to
        } else if a == 0.0 {
            self.from
        } else if b == 0.0 {
            self.to
        } else {
            self.crossing([a, b])
        };
        Meeting::Crossing(Crossing {
            point,
            first,
            second,
            touching: true,
        })
    }
}

/// Whether an edge that is moved to its right passes another, whose ends are at `other` left of it,
/// and whether it comes to the other's left; its own ends are at `own` left of the other.
fn passes(other: [f64; 2], own: [f64; 2]) -> Option<bool> {
    let right = [other[0] < 0.0, other[1] < 0.0];
    if right[0] == right[1] {
        return None;
    }
    // The other comes from the right to the left: this one then goes from its left to its right.
    let to_left = !right[0];
    // Moved inwards from an end on the other's line, this one is on the side it goes to from its
    // first end and on the side it comes from at its last. (No count hangs on the last: nothing
    // follows it on this edge, and what is touched hands nothing on.)
    let starts_left = own[0] > 0.0 || (own[0] == 0.0 && to_left);
    let ends_left = own[1] > 0.0 || (own[1] == 0.0 && !to_left);
    (starts_left != ends_left).then_some(to_left)
}
