//! Triangles of polygons with very many corners, in time n log n.
//!
//! A line sweeps over the corners from left to right; the interior that it meets falls into regions
//! between two edges, each bounded by chains that are monotone in x (de Berg et al., *Computational
//! Geometry*, chapter 3, both passes in one). Libraries were tried first: `earcut` takes 45 s for a
//! star of 200,000 corners, the constrained Delaunay triangulation of `spade` 10 s for one of
//! 50,000 that is deep. All is decided in integers, exactly; a polygon that crosses itself shows in
//! the sum of areas.

use linelit_geometry::DVec2;
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// A corner on the grid.
type Point = [i64; 2];

/// Steps of the grid along the longer side of the polygon: coordinates of f32 lie on it.
const STEPS: f64 = (1_u64 << 40) as f64;

/// The triangles of a simple polygon whose interior lies to the left of its edges, as indices of
/// corners, counter-clockwise; `None` if it crosses itself.
pub(crate) fn triangulate(corners: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let points = on_grid(corners)?;
    let n = points.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_unstable_by_key(|i| (points[*i], *i));
    let mut sweep = Sweep {
        points: &points,
        below: BTreeMap::new(),
        triangles: Vec::with_capacity(n.saturating_sub(2)),
    };
    for v in order {
        sweep.event(v)?;
    }
    let area = |t: &[usize; 3]| turn(points[t[0]], points[t[1]], points[t[2]]);
    let whole: i128 = (0..n)
        .map(|i| turn([0, 0], points[i], points[(i + 1) % n]))
        .sum();
    let positive = sweep.triangles.iter().all(|t| area(t) >= 0);
    let sum: i128 = sweep.triangles.iter().map(area).sum();
    (positive && sum == whole && sweep.below.is_empty()).then_some(sweep.triangles)
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "at most the number of steps"
)]
fn on_grid(corners: &[DVec2]) -> Option<Vec<Point>> {
    let lo = corners.iter().copied().reduce(DVec2::min)?;
    let hi = corners.iter().copied().reduce(DVec2::max)?;
    let scale = STEPS / (hi - lo).max_element();
    scale.is_finite().then(|| {
        let step = |v: f64| (v * scale).round() as i64;
        let place = |p: &DVec2| [step(p.x - lo.x), step(p.y - lo.y)];
        corners.iter().map(place).collect()
    })
}

/// Twice the signed area of a triangle.
fn turn(a: Point, b: Point, c: Point) -> i128 {
    let side = |p: Point| [i128::from(p[0] - a[0]), i128::from(p[1] - a[1])];
    let ([bx, by], [cx, cy]) = (side(b), side(c));
    bx * cy - by * cx
}

/// An edge with the interior above it, or a point to look for: then both ends are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Edge {
    left: Point,
    right: Point,
    /// Its first corner; `usize::MAX` of a point.
    id: usize,
}

impl Edge {
    /// Where another that begins no further left lies: above this (`Less`) or below it.
    fn order(&self, later: &Self) -> Ordering {
        let side = |p: Point| 0.cmp(&turn(self.left, self.right, p));
        side(later.left).then_with(|| side(later.right))
    }
}

impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        let vertical = if self.left <= other.left {
            self.order(other)
        } else {
            other.order(self).reverse()
        };
        vertical.then_with(|| self.id.cmp(&other.id))
    }
}

impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The side of a region that a corner lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Lower,
    Upper,
}

/// The corners of a region that still lack triangles: a chain on one side, but for its first.
#[derive(Debug)]
struct Chain {
    stack: Vec<usize>,
    side: Side,
}

/// The interior above an edge: one chain, or two that met in a corner and part at the next.
#[derive(Debug)]
struct Region {
    chain: Chain,
    /// The upper one of two.
    upper: Option<Chain>,
}

struct Sweep<'a> {
    points: &'a [Point],
    /// The regions that the line meets, by the edge below each.
    below: BTreeMap<Edge, Region>,
    triangles: Vec<[usize; 3]>,
}

impl Sweep<'_> {
    /// The edge from corner `i` to the next, which goes right.
    fn edge(&self, i: usize) -> Edge {
        Edge {
            left: self.points[i],
            right: self.points[(i + 1) % self.points.len()],
            id: i,
        }
    }

    /// The edge of the region that a corner lies in or above.
    fn under(&self, v: usize) -> Option<Edge> {
        let point = Edge {
            left: self.points[v],
            right: self.points[v],
            id: usize::MAX,
        };
        self.below.range(..point).next_back().map(|(edge, _)| *edge)
    }

    /// Carries the line over a corner; `None` where that makes no sense.
    fn event(&mut self, v: usize) -> Option<()> {
        let n = self.points.len();
        let (before, after) = ((v + n - 1) % n, (v + 1) % n);
        let is_left = |i: usize| (self.points[i], i) < (self.points[v], v);
        let convex = || turn(self.points[before], self.points[v], self.points[after]) > 0;
        match (is_left(before), is_left(after)) {
            (false, false) if convex() => self.open(v, Chain::new(v)),
            (false, false) => self.split(v)?,
            (true, true) if convex() => {
                let region = self.below.remove(&self.edge(before))?;
                self.close(region.chain, v);
                if let Some(upper) = region.upper {
                    self.close(upper, v);
                }
            }
            (true, true) => self.merge(before, v)?,
            (true, false) => {
                let region = self.below.remove(&self.edge(before))?;
                let chain = self.on_lower(region, v);
                self.open(v, chain);
            }
            (false, true) => {
                let edge = self.under(v)?;
                let region = self.below.remove(&edge)?;
                let chain = self.on_upper(region, v);
                self.below.insert(edge, Region::new(chain));
            }
        }
        Some(())
    }

    /// A region above the edge that leaves a corner.
    fn open(&mut self, v: usize, chain: Chain) {
        self.below.insert(self.edge(v), Region::new(chain));
    }

    /// The chain that goes on when a corner is met at the lower end of a region.
    fn on_lower(&mut self, region: Region, v: usize) -> Chain {
        let mut chain = match region.upper {
            Some(upper) => {
                self.close(region.chain, v);
                upper
            }
            None => region.chain,
        };
        self.push(&mut chain, v, Side::Lower);
        chain
    }

    /// The same at its upper end.
    fn on_upper(&mut self, region: Region, v: usize) -> Chain {
        if let Some(upper) = region.upper {
            self.close(upper, v);
        }
        let mut chain = region.chain;
        self.push(&mut chain, v, Side::Upper);
        chain
    }

    /// A corner that parts a region in two.
    fn split(&mut self, v: usize) -> Option<()> {
        let edge = self.under(v)?;
        let region = self.below.remove(&edge)?;
        let (mut lower, mut upper) = match region.upper {
            Some(upper) => (region.chain, upper),
            // The last corner is seen from both parts.
            None => {
                let last = Chain::new(*region.chain.stack.last()?);
                match region.chain.side {
                    Side::Lower => (last, region.chain),
                    Side::Upper => (region.chain, last),
                }
            }
        };
        self.push(&mut lower, v, Side::Upper);
        self.push(&mut upper, v, Side::Lower);
        self.below.insert(edge, Region::new(lower));
        self.open(v, upper);
        Some(())
    }

    /// A corner in which two regions meet: the edge between them ends here.
    fn merge(&mut self, before: usize, v: usize) -> Option<()> {
        let above = self.below.remove(&self.edge(before))?;
        let edge = self.under(v)?;
        let below = self.below.remove(&edge)?;
        let chain = self.on_upper(below, v);
        let upper = Some(self.on_lower(above, v));
        self.below.insert(edge, Region { chain, upper });
        Some(())
    }

    /// Adds a corner to a chain, and cuts off the triangles that it sees.
    fn push(&mut self, chain: &mut Chain, v: usize, side: Side) {
        let stack = &mut chain.stack;
        if stack.len() > 1 && side == chain.side {
            while let [.., a, b] = **stack {
                let area = turn(self.points[a], self.points[b], self.points[v]);
                match (side, area.signum()) {
                    (Side::Lower, 1) => self.triangles.push([a, b, v]),
                    (Side::Upper, -1) => self.triangles.push([a, v, b]),
                    (Side::Lower | Side::Upper, _) => break,
                }
                stack.pop();
            }
        } else if stack.len() > 1 {
            for pair in stack.windows(2) {
                self.triangles.push(match side {
                    Side::Upper => [pair[0], pair[1], v],
                    Side::Lower => [pair[0], v, pair[1]],
                });
            }
            let last = stack.len() - 1;
            stack.drain(..last);
        }
        stack.push(v);
        chain.side = side;
    }

    /// Ends a chain with its last corner, which sees all others.
    fn close(&mut self, mut chain: Chain, v: usize) {
        let other = match chain.side {
            Side::Lower => Side::Upper,
            Side::Upper => Side::Lower,
        };
        self.push(&mut chain, v, other);
    }
}

impl Chain {
    fn new(v: usize) -> Self {
        Self {
            stack: vec![v],
            side: Side::Lower,
        }
    }
}

impl Region {
    const fn new(chain: Chain) -> Self {
        Self { chain, upper: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn ring(n: u32, radius: impl Fn(u32) -> f64) -> Vec<DVec2> {
        let corner = |k| radius(k) * DVec2::from_angle(f64::from(k) * TAU / f64::from(n));
        (0..n).map(corner).collect()
    }

    /// That areas and sides are right, the function itself has seen to; so nothing overlaps.
    fn is_cut(polygon: &[DVec2]) -> bool {
        triangulate(polygon).is_some_and(|t| t.len() == polygon.len() - 2)
    }

    /// A plate with teeth on its upper side.
    fn comb(teeth: u32) -> Vec<DVec2> {
        let top = (0..2 * teeth + 1).rev();
        let width = f64::from(2 * teeth);
        [DVec2::new(0.0, -1.0), DVec2::new(width, -1.0)]
            .into_iter()
            .chain(top.map(|k| DVec2::new(f64::from(k), width * f64::from(k % 2))))
            .collect()
    }

    #[test]
    fn polygons_that_other_ways_are_slow_at() {
        for (name, polygon) in [
            ("circle", ring(50_000, |_| 1.0)),
            ("star", ring(50_000, |k| if k % 2 == 0 { 1.0 } else { 1.1 })),
            (
                "deep star",
                ring(50_000, |k| if k % 2 == 0 { 0.01 } else { 1.01 }),
            ),
            ("comb", comb(25_000)),
            (
                "standing comb",
                comb(25_000).iter().map(|p| p.perp()).collect(),
            ),
        ] {
            assert!(is_cut(&polygon), "{name}");
        }
    }

    #[test]
    fn spirals_and_corners_on_a_line() {
        let arm = |k: u32, out: f64| {
            let a = f64::from(k) * 0.01;
            (1.0 + a + out) * DVec2::from_angle(a)
        };
        let there = (0..5000).map(|k| arm(k, 1.0));
        let back = (0..5000).rev().map(|k| arm(k, 0.0));
        assert!(is_cut(&there.chain(back).collect::<Vec<_>>()));
        let square = [
            (0, 0),
            (1, 0),
            (2, 0),
            (2, 1),
            (2, 2),
            (1, 2),
            (0, 2),
            (0, 1),
        ];
        let square = square.map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)));
        assert!(is_cut(&square));
    }

    #[test]
    fn polygons_that_cross_themselves_are_refused() {
        let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.1)];
        assert!(triangulate(&bow.map(|(x, y)| DVec2::new(x, y))).is_none());
        // Pentagram: all corners turn left.
        let star: Vec<DVec2> = (0..5_u8)
            .map(|k| DVec2::from_angle(f64::from(k) * 2.0 * TAU / 5.0))
            .collect();
        assert!(triangulate(&star).is_none());
    }

    proptest! {
        #[test]
        fn stars_are_cut(radii in prop::collection::vec(0.01..10.0_f64, 3..200), turned in 0.0..TAU) {
            let n = u32::try_from(radii.len()).unwrap();
            let star = ring(n, |k| radii[k as usize]);
            let turn = DVec2::from_angle(turned);
            // With three or four corners the centre need not lie inside.
            prop_assume!(n > 4);
            prop_assert!(is_cut(&star.iter().map(|p| p.rotate(turn)).collect::<Vec<_>>()));
        }

        #[test]
        fn any_polygon_ends(corners in prop::collection::vec((0..9_u8, 0..9_u8), 0..40)) {
            let corners: Vec<DVec2> = corners
                .iter()
                .map(|(x, y)| DVec2::new(f64::from(*x), f64::from(*y)))
                .collect();
            let _ = triangulate(&corners);
        }
    }
}
