//! What of a region lies on a disk.

use super::boundary::BoundaryEdge;
use super::orient::Point;
use linelit_elementary::{atan2, hypot, sin_cos};
use linelit_geometry::stop;
use std::f64::consts::{PI, TAU};

/// A piece of the boundary of a region's part on the unit disk; the region lies on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DiskEdge {
    /// A straight piece within the disk.
    Straight(Point, Point),
    /// An arc of the rim, counter-clockwise from one point to another; whether it is more than half
    /// of the rim.
    Arc(Point, Point, bool),
    /// The whole rim.
    Rim,
}

/// A crossing of a region's boundary with the rim.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// The turn, from 0 to 2π.
    turn: f64,
    at: Point,
    /// Whether it leaves the disk: the region holds the rim from here on.
    leaves: bool,
}

/// Finds the part of a region that is on the unit disk; one value, kept, serves any number of
/// regions with the same buffers.
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
    /// The boundary of a region's part on the unit disk, of the region's boundary, straight pieces
    /// with the region on their left.
    ///
    /// Edges come in no particular order. Where pieces of the region's boundary have the same ends,
    /// so have edges, to the bit; where they do not, as of a region that is not closed, what is
    /// left out or held twice is no larger than the gap.
    pub fn of(&mut self, boundary: impl IntoIterator<Item = BoundaryEdge>) -> &[DiskEdge] {
        self.sides.clear();
        self.sides.extend(boundary);
        self.crossings.clear();
        self.edges.clear();
        for i in 0..self.sides.len() {
            self.cut(self.sides[i]);
        }
        self.join();
        &self.edges
    }

    /// Takes what of a side is within the disk, and where it crosses the rim.
    fn cut(&mut self, BoundaryEdge { from, to }: BoundaryEdge) {
        let [from_in, to_in] = [from, to].map(|p| p[0] * p[0] + p[1] * p[1] <= 1.0);
        if from_in && to_in {
            self.edges.push(DiskEdge::Straight(from, to));
            return;
        }
        let d = [to[0] - from[0], to[1] - from[1]];
        let square = d[0] * d[0] + d[1] * d[1];
        // The place nearest to the centre, and half the chord, in lengths of the side.
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

    /// Takes the arcs that are in the region. Where it crosses the rim at the same place to
    /// rounding, in whichever order, what lies between has no length.
    fn join(&mut self) {
        self.crossings.sort_by(|a, b| a.turn.total_cmp(&b.turn));
        let Some(last) = self.crossings.last() else {
            // Not where what touches the rim is likely to.
            let (y, x) = sin_cos(1.0);
            if wind_around(&self.sides, [x, y]) {
                self.edges.push(DiskEdge::Rim);
            }
            return;
        };
        // From the middle of the longest gap on, where rounding cannot tell otherwise.
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
        let count = self.crossings.len();
        let leaving = self.crossings.iter().filter(|c| c.leaves).count();
        let mut depth = i32::from(is_in(self.crossings[first].turn - 0.5 * longest));
        for i in first..first + count {
            let this = self.crossings[i % count];
            let next = self.crossings[(i + 1) % count];
            stop::check();
            let turn = (next.turn - this.turn).rem_euclid(TAU);
            depth += if this.leaves { 1 } else { -1 };
            // Sides that do not join do not add up.
            let inside = if 2 * leaving == count {
                depth > 0
            } else {
                is_in(this.turn + 0.5 * turn)
            };
            if inside {
                let arc = DiskEdge::Arc(this.at, next.at, turn > PI);
                self.edges.push(arc);
            }
        }
    }
}

/// Whether a region has a point that its boundary does not pass: how often the boundary winds
/// around it.
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

    /// The area, by Green's theorem: of an arc, (y₁ − y₀ …)/2 is half its turn.
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

    /// Returns the area by strips, the visible length of each found by sorting: their number is the
    /// root of the error's inverse at the rim.
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

    /// Random triangles, small and large; those that all of the disk is behind or before.
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

    /// Corners and edges on the rim, edges that touch it, and triangles of a mesh that meet there:
    /// halves and quarters of the disk and what is left of them.
    #[test]
    fn what_meets_on_the_rim_is_no_special_case() {
        let far = 3.0;
        let quarter = [[0.0, 0.0], [far, 0.0], [0.0, far]];
        let cases: [(&[[Point; 3]], f64); 7] = [
            (&[quarter], 0.75 * PI),
            // Corners on the rim.
            (&[[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]], PI - 0.5),
            // Two that share an edge across it.
            (&[quarter, [[0.0, 0.0], [far, 0.0], [0.0, -far]]], 0.5 * PI),
            // Two that meet in a corner on it.
            (
                &[
                    [[1.0, 0.0], [far, far], [0.0, far]],
                    [[1.0, 0.0], [far, -far], [0.0, -far]],
                ],
                visible(&[[[1.0, 0.0], [far, far], [0.0, far]]]) * 2.0 - PI,
            ),
            // Touches from outside, from inside around.
            (&[[[1.0, -far], [1.0, far], [far, 0.0]]], PI),
            (&[[[-8.0, -1.0], [8.0, -1.0], [0.0, 9.0]]], 0.0),
            (&[[[-8.0, -1.0], [8.0, -1.0], [0.0, -9.0]]], PI),
        ];
        for (triangles, want) in cases {
            let got = visible(triangles);
            assert!((got - want).abs() < 1e-7, "{got} for {want}: {triangles:?}");
        }
    }
}
