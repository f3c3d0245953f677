//! [`PartOnDisk`]: the part of a region that is on the unit disk, for round lights.

use super::boundary::BoundaryEdge;
use super::orient::Point;
use linelit_elementary::{atan2, hypot, sin_cos};
use linelit_geometry::stop;
use std::f64::consts::{PI, TAU};

/// A piece of the boundary of a region's part on the unit disk; the part is on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiskEdge {
    /// A straight edge within the disk, from one point to another.
    Straight(Point, Point),
    /// An arc of the rim, counter-clockwise from one point to another, and whether it is longer
    /// than half of the rim.
    Arc(Point, Point, bool),
    /// The whole rim.
    Rim,
}

/// A crossing of a region's boundary with the rim of the disk.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// The angle of the crossing on the rim, from 0 to 2π.
    turn: f64,
    at: Point,
    /// Whether the boundary leaves the disk here, so that the rim is in the region from here on.
    leaves: bool,
}

/// Finds the part of a region that is on the unit disk. One value can be used for any number of
/// regions, and reuses its buffers.
///
/// ```
/// use linelit_penumbra::{BoundaryEdge, DiskEdge, PartOnDisk};
/// // All to the left of the line x = 0.
/// let corners = [[0.0, -2.0], [0.0, 2.0], [-2.0, 2.0], [-2.0, -2.0]];
/// let side = |i: usize| BoundaryEdge { from: corners[i], to: corners[(i + 1) % 4] };
/// let mut part = PartOnDisk::default();
/// let edges = part.of([0, 1, 2, 3].map(side));
/// let (low, high) = ([0.0, -1.0], [0.0, 1.0]);
/// assert_eq!(edges[0], DiskEdge::Straight(low, high));
/// assert!(matches!(edges[1], DiskEdge::Arc(from, to, _) if (from, to) == (high, low)));
/// ```
#[derive(Clone, Debug, Default)]
pub struct PartOnDisk {
    sides: Vec<BoundaryEdge>,
    crossings: Vec<Crossing>,
    edges: Vec<DiskEdge>,
}

impl PartOnDisk {
    /// Finds the boundary of a region's part on the unit disk. The region is given by its boundary:
    /// straight pieces with the region on their left.
    ///
    /// Edges are returned in no particular order. Where edges of the region's boundary have equal
    /// ends, the returned edges have exactly equal ends, too. Where the ends differ, because the
    /// region is not closed, the area that is left out or counted twice is no larger than the gap.
    pub fn of(&mut self, boundary: impl IntoIterator<Item = BoundaryEdge>) -> &[DiskEdge] {
        // Cut all sides at the rim. As many crossings have to leave the disk as enter it; otherwise
        // close the gaps first.
        self.sides.clear();
        self.sides.extend(boundary);
        self.cut_all();
        let leaving = self.crossings.iter().filter(|c| c.leaves).count();
        if 2 * leaving != self.crossings.len() {
            self.close();
            self.cut_all();
        }
        self.join();
        &self.edges
    }

    /// Closes a boundary with gaps, by a side from each end without a continuation to the nearest
    /// start.
    #[cold]
    #[allow(clippy::float_cmp, reason = "the very same point")]
    fn close(&mut self) {
        let mut starts: Vec<Point> = self.sides.iter().map(|side| side.from).collect();
        for i in 0..self.sides.len() {
            let from = self.sides[i].to;
            let square = |p: &Point| (p[0] - from[0]).powi(2) + (p[1] - from[1]).powi(2);
            let nearest =
                |a: &usize, b: &usize| square(&starts[*a]).total_cmp(&square(&starts[*b]));
            let Some(at) = (0..starts.len()).min_by(nearest) else {
                return;
            };
            let to = starts.swap_remove(at);
            if from != to {
                self.sides.push(BoundaryEdge { from, to });
            }
        }
    }

    fn cut_all(&mut self) {
        self.crossings.clear();
        self.edges.clear();
        for i in 0..self.sides.len() {
            self.cut(self.sides[i]);
        }
    }

    /// Collects the part of a boundary edge that is within the disk, and its crossings with the
    /// rim.
    fn cut(&mut self, BoundaryEdge { from, to }: BoundaryEdge) {
        let [from_in, to_in] = [from, to].map(|p| p[0] * p[0] + p[1] * p[1] <= 1.0);
        if from_in && to_in {
            self.edges.push(DiskEdge::Straight(from, to));
            return;
        }
        let d = [to[0] - from[0], to[1] - from[1]];
        let square = d[0] * d[0] + d[1] * d[1];
        // Compute the point nearest to the centre, and half the chord, in units of the side's
        // length.
        let nearest = -(from[0] * d[0] + from[1] * d[1]) / square;
        let offset = (from[0] * d[1] - from[1] * d[0]) / square.sqrt();
        let half = (((1.0 - offset) * (1.0 + offset)).max(0.0) / square).sqrt();
        let rim = |t: f64| {
            let [x, y] = [from[0] + d[0] * t, from[1] + d[1] * t];
            let r = hypot(x, y);
            [x / r, y / r]
        };
        let misses = half <= 0.0 || !(nearest > 0.0 && nearest < 1.0);
        if !from_in && !to_in && misses {
            return;
        }
        // Cut the side at the rim where its ends are outside.
        let start = if from_in {
            from
        } else {
            let at = rim((nearest - half).clamp(0.0, 1.0));
            self.cross(at, false);
            at
        };
        let end = if to_in {
            to
        } else {
            let at = rim((nearest + half).clamp(0.0, 1.0));
            self.cross(at, true);
            at
        };
        self.edges.push(DiskEdge::Straight(start, end));
    }

    fn cross(&mut self, at: Point, leaves: bool) {
        let turn = atan2(at[1], at[0]);
        let turn = if turn < 0.0 { turn + TAU } else { turn };
        self.crossings.push(Crossing { turn, at, leaves });
    }

    /// Collects the arcs of the rim that are in the region. If crossings coincide up to rounding,
    /// their order does not matter, since the arcs between them have no length.
    fn join(&mut self) {
        self.crossings.sort_by(|a, b| a.turn.total_cmp(&b.turn));
        let Some(last) = self.crossings.last() else {
            // The rim is in the region wholly or not at all. Test a point where sides are unlikely
            // to touch the rim.
            let (y, x) = sin_cos(1.0);
            if wind_around(&self.sides, [x, y]) {
                self.edges.push(DiskEdge::Rim);
            }
            return;
        };
        // Find the longest gap between crossings, and test its middle, where rounding cannot
        // decide.
        let (mut before, mut longest, mut first) = (last.turn - TAU, -1.0, 0);
        for (i, crossing) in self.crossings.iter().enumerate() {
            if crossing.turn - before > longest {
                (longest, first) = (crossing.turn - before, i);
            }
            before = crossing.turn;
        }
        let sides = &self.sides;
        let is_in = |turn: f64| {
            let (y, x) = sin_cos(turn);
            wind_around(sides, [x, y])
        };
        // From there go around, and collect arcs where the rim is in the region.
        let count = self.crossings.len();
        let mut depth = i32::from(is_in(self.crossings[first].turn - 0.5 * longest));
        for i in first..first + count {
            let (this, next) = (self.crossings[i % count], (i + 1) % count);
            stop::check();
            depth += if this.leaves { 1 } else { -1 };
            if depth > 0 {
                // The last arc goes around to the first crossing, even if there is only one.
                let around = if next == 0 { TAU } else { 0.0 };
                let next = self.crossings[next];
                let arc = DiskEdge::Arc(this.at, next.at, next.turn + around - this.turn > PI);
                self.edges.push(arc);
            }
        }
    }
}

/// Whether a region, given by its boundary, contains a point that is not on the boundary: whether
/// the boundary winds around the point.
fn wind_around(sides: &[BoundaryEdge], [x, y]: Point) -> bool {
    let mut turns = 0;
    for BoundaryEdge { from, to } in sides {
        if (from[1] > y) == (to[1] > y) {
            continue;
        }
        let left = (to[0] - from[0]) * (y - from[1]) - (x - from[0]) * (to[1] - from[1]);
        match to[1] > from[1] {
            true => turns += i32::from(left > 0.0),
            false => turns -= i32::from(left < 0.0),
        }
    }
    turns > 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Penumbra;
    use linelit_testkit::rng::SplitMix64;

    /// The area, by Green's theorem: for an arc, (y₁ − y₀ …)/2 is half its angle.
    fn area(edges: &[DiskEdge]) -> f64 {
        let of = |edge: &DiskEdge| match *edge {
            DiskEdge::Straight(a, b) => 0.5 * (a[0] * b[1] - a[1] * b[0]),
            DiskEdge::Arc(a, b, is_long) => {
                let turn = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
                let wraps = turn < -1e-9 || (turn < 1e-9 && is_long);
                0.5 * if wraps { turn + TAU } else { turn }
            }
            DiskEdge::Rim => PI,
        };
        edges.iter().map(of).sum()
    }

    /// A polygon around the disk.
    const AROUND: [Point; 4] = [[-1.1, -1.2], [1.2, -1.1], [1.1, 1.2], [-1.2, 1.1]];

    /// The visible area of the disk behind triangles.
    fn visible(triangles: &[[Point; 3]]) -> f64 {
        let mut penumbra = Penumbra::default();
        let boundary = penumbra.boundary(&AROUND, triangles.iter().copied());
        let mut part = PartOnDisk::default();
        area(part.of(boundary.iter().copied()))
    }

    /// Computes the area by strips, and the visible length of each strip by sorting; the number of
    /// strips is the square root of the reciprocal of the error at the rim.
    fn by_strips(triangles: &[[Point; 3]]) -> f64 {
        const STRIPS: i32 = 4000;
        let strip = |k| {
            let x = (f64::from(k) + 0.5) * 2.0 / f64::from(STRIPS) - 1.0;
            let half = (1.0 - x * x).sqrt();
            let chord = |t: &[Point; 3]| {
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for i in 0..3 {
                    let (a, b) = (t[i], t[(i + 1) % 3]);
                    if (a[0] <= x) != (b[0] <= x) {
                        let y = a[1] + (b[1] - a[1]) * ((x - a[0]) / (b[0] - a[0]));
                        (low, high) = (low.min(y), high.max(y));
                    }
                }
                (low < high).then_some((low, high))
            };
            let mut hidden: Vec<(f64, f64)> = triangles.iter().filter_map(chord).collect();
            hidden.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (mut reached, mut length) = (-half, 0.0);
            for (from, to) in hidden {
                length += (from.min(half) - reached).max(0.0);
                reached = reached.max(to);
            }
            length + (half - reached).max(0.0)
        };
        (0..STRIPS).map(strip).sum::<f64>() * 2.0 / f64::from(STRIPS)
    }

    /// Random triangles, small and large, some of which leave the whole disk visible, or nothing.
    #[test]
    fn areas_are_those_of_strips() {
        let mut rng = SplitMix64::new(20);
        let (mut rims, mut none) = (0, 0);
        for case in 0..200 {
            let size = [0.3, 1.0, 3.0][case % 3];
            let triangles: Vec<[Point; 3]> = (0..=case % 5)
                .map(|_| {
                    let [x, y] = [(); 2].map(|()| rng.in_range(-1.2, 1.2));
                    [(); 3]
                        .map(|()| [(); 2].map(|()| size * rng.in_range(-1.0, 1.0)))
                        .map(|[u, v]| [x + u, y + v])
                })
                .collect();
            let (got, want) = (visible(&triangles), by_strips(&triangles));
            assert!((got - want).abs() < 2e-3, "{got} for {want}: {triangles:?}");
            rims += i32::from((want - PI).abs() < 1e-3);
            none += i32::from(want == 0.0);
        }
        assert!(rims > 2 && none > 1, "{rims} {none}");
    }

    /// Corners and edges on the rim, edges that touch it, and triangles of a mesh that share a
    /// corner or an edge there: halves and quarters of the disk, and what is left of them.
    #[test]
    fn what_meets_on_the_rim_is_no_special_case() {
        let far = 3.0;
        let quarter = [[0.0, 0.0], [far, 0.0], [0.0, far]];
        let cases: [(&[[Point; 3]], f64); 7] = [
            (&[quarter], 0.75 * PI),
            // Corners on the rim.
            (&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]], PI - 0.5),
            // Two triangles that share an edge across the rim.
            (&[quarter, [[0.0, 0.0], [far, 0.0], [0.0, -far]]], 0.5 * PI),
            // Two triangles that share a corner on the rim.
            (
                &[
                    [[1.0, 0.0], [far, far], [0.0, far]],
                    [[1.0, 0.0], [far, -far], [0.0, -far]],
                ],
                visible(&[[[1.0, 0.0], [far, far], [0.0, far]]]) * 2.0 - PI,
            ),
            // Triangles that touch the rim from outside, and around the disk from inside.
            (&[[[1.0, -far], [1.0, far], [far, 0.0]]], PI),
            (&[[[-8.0, -1.0], [8.0, -1.0], [0.0, 9.0]]], 0.0),
            (&[[[-8.0, -1.0], [8.0, -1.0], [0.0, -9.0]]], PI),
        ];
        for (triangles, want) in cases {
            let got = visible(triangles);
            assert!((got - want).abs() < 1e-7, "{got} for {want}: {triangles:?}");
        }
    }

    /// The sides of a polygon.
    fn sides(corners: &[Point]) -> Vec<BoundaryEdge> {
        let next = corners.iter().cycle().skip(1);
        let side = |(&from, &to)| BoundaryEdge { from, to };
        corners.iter().zip(next).map(side).collect()
    }

    /// The half-plane at least this far from the centre in the direction of an angle, and the
    /// direction of its straight side.
    fn half_plane(turn: f64, offset: f64) -> ([Point; 4], [Point; 2]) {
        let (s, c) = turn.sin_cos();
        let at = |along: f64, out: f64| [s * along + c * out, c.mul_add(-along, s * out)];
        let corners = [(-4.0, offset), (4.0, offset), (4.0, 8.0), (-4.0, 8.0)];
        (
            corners.map(|(along, out)| at(along, out)),
            [[s, -c], [c, s]],
        )
    }

    /// The part of the disk beyond a chord, from almost the whole disk to almost nothing. Its ends
    /// are half a chord from the chord's middle, its area is acos h − h √(1 − h²), and its arc is
    /// more than half of the rim if it contains the centre.
    #[test]
    fn what_is_beyond_a_chord_is_a_segment_of_the_disk() {
        for case in 0..200 {
            let (turn, offset) = (0.37 * f64::from(case), f64::from(case - 100) / 101.0);
            let (corners, [along, out]) = half_plane(turn, offset);
            let half = ((1.0 - offset) * (1.0 + offset)).sqrt();
            // Corners are 9 from the centre at most, so that the offset is known to 2 ε times
            // that, and half a chord to as much over itself.
            let rounding = 32.0 * f64::EPSILON / half;
            let mut part = PartOnDisk::default();
            let &[DiskEdge::Straight(a, b), DiskEdge::Arc(from, to, is_long)] =
                part.of(sides(&corners))
            else {
                panic!("a chord and an arc of {turn} {offset}");
            };
            assert_eq!((b, a, offset < 0.0), (from, to, is_long), "{turn} {offset}");
            for (end, sign) in [(a, -half), (b, half)] {
                for k in 0..2 {
                    let want = offset * out[k] + sign * along[k];
                    assert!((end[k] - want).abs() < rounding, "{turn} {offset}: {end:?}");
                }
            }
            let want = offset.acos() - offset * half;
            let got = area(part.of(sides(&corners)));
            assert!((got - want).abs() < 4.0 * rounding, "{got} for {want}");
        }
    }

    /// A wedge that has no width up to rounding leaves everything but its area: an arc from its one
    /// end on the rim around to the other.
    #[test]
    fn a_slit_leaves_the_disk() {
        for case in 0..60 {
            let width = 0.1_f64.powi(10 + case % 8);
            let (s, c) = (0.21 * f64::from(case)).sin_cos();
            let [tip, right, left] = [[0.0, 0.0], [2.0, -width], [2.0, width]]
                .map(|[x, y]: Point| [c * x - s * y, s * x + c * y]);
            let got = visible(&[[tip, right, left]]);
            // Two radii with the angle of the width, each known to rounding.
            let want = PI - 0.5 * width;
            assert!((got - want).abs() < 1e-14, "{got} for {want}: {width:e}");
        }
    }

    /// If a boundary has a gap, on the rim, close to it or anywhere, or passes there twice, the
    /// area changes by no more than the gap.
    #[test]
    fn a_gap_costs_no_more_than_itself() {
        let mut rng = SplitMix64::new(21);
        let mut on_rim = 0;
        for case in 0..2000 {
            let (turn, offset) = (rng.in_range(0.0, TAU), rng.in_range(-0.95, 0.95));
            let (mut corners, _) = half_plane(turn, offset);
            if case % 2 == 1 {
                // A wedge whose tip is on the disk.
                let mid = |k: usize| 0.5 * (corners[0][k] + corners[1][k]);
                corners[0] = [mid(0), mid(1)];
            }
            let whole = sides(&corners);
            let gap = 0.1_f64.powf(rng.in_range(2.0, 17.0)) * [1.0, -1.0][case / 2 % 2];
            // Close to where the side leaves the disk, or anywhere along it.
            let BoundaryEdge { from, to } = whole[0];
            let mut part = PartOnDisk::default();
            let rim = part.of(whole.iter().copied()).iter().find_map(|e| match e {
                DiskEdge::Straight(_, end) => Some(*end),
                _ => None,
            });
            let length = hypot(to[0] - from[0], to[1] - from[1]);
            let at = match rim {
                Some([x, y]) if case % 3 > 0 => {
                    hypot(x - from[0], y - from[1]) + rng.in_range(-1.0, 1.0) * gap
                }
                _ => rng.in_range(0.0, length),
            };
            let place = |d: f64| [0, 1].map(|k| from[k] + (to[k] - from[k]) * (d / length));
            let mut torn = whole.clone();
            torn[0].to = place(at);
            let (from, to) = (place(at + gap), whole[0].to);
            torn.push(BoundaryEdge { from, to });
            let [torn, want] = [torn, whole].map(|s| area(part.of(s)));
            on_rim += i32::from(part.sides.len() == 4);
            assert!(
                (torn - want).abs() < 2.0 * gap.abs() + 1e-13,
                "{case}: {torn} for {want}, {gap:e}"
            );
        }
        assert!(on_rim > 0);
    }
}
