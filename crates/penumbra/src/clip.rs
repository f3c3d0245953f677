//! Directed edges in the light's plane: where two of them cross, and which part of one is on the
//! light. Decisions are exact; only the positions of crossings are rounded.

use super::orient::{Point, orient};

/// A directed edge; the searches are about the points right next to it on its right.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub from: Point,
    pub to: Point,
    /// The square of the edge's length, which is also the position of its end; see [`End::at`].
    pub length: f64,
}

/// A point on an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// The position along the edge: 0 at its start, and its length squared at its end.
    pub at: f64,
    /// The point itself, which is bit-identical for both edges that cross there.
    pub point: Point,
}

/// A part of an edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub lo: End,
    pub hi: End,
    /// How the lower end was determined.
    pub start: Start,
}

/// How the lower end of a part of an edge was determined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Start {
    /// The edge's own start.
    Own,
    /// A crossing with a side of the polygon by which the edge was clipped, or a corner of that
    /// polygon; with a bound of the rounding error of its position along the edge.
    Cut(f64),
}

/// A vertex, and its distance (times a factor) to the left of an edge.
type Side = (Point, f64);

/// How two edges meet, each of them in turn moved to its right by an infinitesimal.
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
    /// Whether the first edge, moved, passes the second: `None` if not, otherwise whether to its
    /// left.
    pub first: Option<bool>,
    /// Whether the second edge, moved, passes the first: `None` if not, otherwise whether to its
    /// left.
    pub second: Option<bool>,
    /// Whether an end of one edge is on the line through the other.
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

    /// Returns the edge's length along the axes (L₁ norm), which is between its length and √2 times
    /// its length.
    pub(super) fn extent(&self) -> f64 {
        (self.to[0] - self.from[0]).abs() + (self.to[1] - self.from[1]).abs()
    }

    /// Returns the position of a point along the edge, by its projection onto the edge's line.
    #[inline]
    fn place(&self, p: Point) -> f64 {
        let d = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        d[0] * (p[0] - self.from[0]) + d[1] * (p[1] - self.from[1])
    }

    /// Returns the whole edge as a part of itself.
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

    /// A point on the edge. If rounding moves it beyond an end, its position is set to that end.
    /// (Beyond the end it would also come before or after everything else on the edge, so no
    /// decision depends on this.)
    #[inline]
    pub(crate) fn end_at(&self, point: Point) -> End {
        let at = self.place(point).max(0.0).min(self.length);
        End { at, point }
    }

    /// Returns the part that this edge shares with another one on the same line and in the same
    /// direction; `None` if they share none.
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

    /// Returns the part of the edge, moved to its right by an infinitesimal, that is inside of a
    /// convex polygon given counter-clockwise; `None` if no part is, or if the edge runs along one
    /// of the polygon's sides.
    ///
    /// All decisions are those of exact arithmetic on the given coordinates.
    pub(crate) fn within(&self, polygon: &[Point]) -> Option<Span> {
        let count = polygon.len();
        let side = |i: usize| (polygon[i], orient(self.from, self.to, polygon[i]));
        let mut before = side(count - 1);
        // Find where the polygon's boundary crosses the edge's line to its right and back to its
        // left; points on the line count as left.
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

    /// Returns the part of the edge between two sides of the polygon: the side `into` through which
    /// the edge enters the polygon, and the side `out` through which it leaves.
    fn between(&self, into: (Side, Side), out: (Side, Side)) -> Option<Span> {
        // Find the lower end: the edge's own start if it is inside, otherwise the crossing with the
        // first side.
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
        // Find the upper end in the same way.
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

    /// Returns how far the edge's ends are to the right of the line from c to d, which is to the
    /// left as seen from d: where edges meet, the polygon's sides are reversed.
    fn beside(&self, c: Point, d: Point) -> [f64; 2] {
        [orient(d, c, self.from), orient(d, c, self.to)]
    }

    /// Returns an error bound, along this edge, of its crossing with another edge, from whose line
    /// its ends have the distances `ends` (times a factor). Each of these is wrong by less than 4 ε
    /// of its terms.
    fn slack(&self, other: &Self, ends: [f64; 2]) -> f64 {
        let size = |p: Point| p[0].abs() + p[1].abs();
        let far = size(self.from) + size(self.to) + 2.0 * size(other.from);
        4.0 * f64::EPSILON * far * other.extent() * self.extent() / (ends[0] - ends[1]).abs()
    }

    /// Whether rounding may move the crossing of two edges by more than `room` along either.
    #[inline]
    pub(super) fn crosses_loosely(&self, other: &Self, room: f64) -> bool {
        let size = |p: Point| p[0].abs() + p[1].abs();
        let far = size(self.from) + size(self.to) + size(other.from) + size(other.to);
        let run = |e: &Self| [e.to[0] - e.from[0], e.to[1] - e.from[1]];
        let (a, b) = (run(self), run(other));
        let turn = (a[0] * b[1] - a[1] * b[0]).abs();
        turn * room <= 4.0 * f64::EPSILON * far * other.extent() * self.extent()
    }

    /// Returns the proper crossing with another edge. `from` and `to` are the distances of this
    /// edge's ends from the line of the other (times a factor).
    #[inline]
    fn crossing(&self, [from, to]: [f64; 2]) -> Point {
        let t = from / (from - to);
        let run = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        [self.from[0] + run[0] * t, self.from[1] + run[1] * t]
    }

    /// Finds how two edges meet, by exact decisions. Both edges get the same crossing, which is
    /// computed along this edge.
    ///
    /// An edge that is moved to its right by an infinitesimal leaves corners on its own line on its
    /// left. Its ends are moved inwards by a larger infinitesimal, so that what only touches an end
    /// is not passed.
    #[inline]
    pub(crate) fn meet(&self, other: &Self) -> Meeting {
        // Reject edges of which one is on one side of the other.
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
        // A proper crossing: no end is on the other's line.
        if c * d < 0.0 && a * b < 0.0 {
            return Meeting::Crossing(Crossing {
                point: self.crossing([a, b]),
                first: Some(c > 0.0),
                second: Some(a > 0.0),
                touching: false,
            });
        }
        // An end is on the other's line: decide for the moved edges, and take the exact point where
        // there is one.
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

/// Whether an edge that is moved to its right by an infinitesimal passes another edge: `None` if it
/// does not; `Some(true)` if it passes from the right of the other to its left, `Some(false)` if
/// from left to right. `other` are the distances of the other's ends to the left of the moved edge,
/// `own` the distances of the moved edge's own ends to the left of the other.
fn passes(other: [f64; 2], own: [f64; 2]) -> Option<bool> {
    let right = [other[0] < 0.0, other[1] < 0.0];
    if right[0] == right[1] {
        return None;
    }
    // If the other runs from the right to the left, the moved edge passes from its left to its
    // right.
    let to_left = !right[0];
    // If an end is on the other's line, it is moved inwards: its first end is on the side to which
    // the edge goes, its last end on the side from which it comes. (No count depends on the last
    // end: nothing follows it on this edge, and a touched edge hands no count on.)
    let starts_left = own[0] > 0.0 || (own[0] == 0.0 && to_left);
    let ends_left = own[1] > 0.0 || (own[1] == 0.0 && !to_left);
    (starts_left != ends_left).then_some(to_left)
}
