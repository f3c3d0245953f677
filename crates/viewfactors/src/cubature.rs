//! Adaptive integration over a convex polygon.

use linelit_geometry::{ConvexPolygon, DVec3};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// An integral, and its error as the rule tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Integral {
    pub value: f64,
    pub error: f64,
}

/// A quadrangle, the image of a square under a bilinear map; a triangle where two corners are one.
pub(crate) type Corners = [DVec3; 4];

/// A quadrangle with what the rule makes of both functions.
#[derive(Clone, Copy, Debug)]
struct Cell {
    corners: Corners,
    sums: [Integral; 2],
    /// For each function, whether it differs more along the second axis of the square.
    is_upright: [bool; 2],
    /// The function whose error counts, and the number among all cells.
    key: (usize, usize),
}

impl Cell {
    fn rank(&self) -> (f64, usize) {
        (self.sums[self.key.0].error, self.key.1)
    }
}

impl PartialEq for Cell {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cell {}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cell {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b) = (self.rank(), other.rank());
        a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))
    }
}

/// The weights of Genz and Malik's rule of degree 7 on [−1, 1]² for its five orbits, with those of a
/// rule of degree 5 by the same points.
const WEIGHTS: [[f64; 2]; 5] = [
    [-3816.0 / 19683.0, -971.0 / 729.0],
    [980.0 / 6561.0, 245.0 / 486.0],
    [1020.0 / 19683.0, 65.0 / 1458.0],
    [200.0 / 19683.0, 25.0 / 729.0],
    [6859.0 / 78732.0, 0.0],
];
/// The weights of the first four orbits and the corners in a sum that is zero for all polynomials of
/// degree 5: it tells where a function is not smooth at a corner, as where polygons touch.
const AT_CORNERS: [f64; 5] = [
    -0.133_126_115_579_259_24,
    0.038_562_946_771_884_77,
    -0.000_786_998_713_711_934_1,
    -0.024_494_418_963_358_026,
    0.02,
];
/// The places of the orbits after the first, √(9/70), √(9/10) and √(9/19), and those near the
/// corners, which have no weight in either rule.
const NEAR: f64 = 0.358_568_582_800_318_1;
const FAR: f64 = 0.948_683_298_050_513_8;
const DIAGONAL: f64 = 0.688_247_201_611_685_3;
const CORNER: f64 = 0.998;
/// The places of all points after the middle, four of an orbit after another.
const PLACES: [[[f64; 2]; 4]; 5] = [
    [[-NEAR, 0.0], [NEAR, 0.0], [0.0, -NEAR], [0.0, NEAR]],
    [[-FAR, 0.0], [FAR, 0.0], [0.0, -FAR], [0.0, FAR]],
    diagonals(FAR),
    diagonals(DIAGONAL),
    diagonals(CORNER),
];

const fn diagonals(r: f64) -> [[f64; 2]; 4] {
    [[-r, -r], [r, -r], [r, r], [-r, r]]
}

/// The integrals of two functions that are not negative over a polygon, until the error of one of
/// both is below its tolerance: the quadrangle with the largest error is halved, until then or until
/// there are `most`. The function is the one whose error is smaller at first, and so is the answer.
///
/// The error of a quadrangle is the larger of two differences: between rules of degree 7 and 5; and
/// half of that between the quadrangle it was cut from and both halves. Where one corner has or
/// lacks a part unlike all points, it is a quarter of that part. To it comes `unseen`: a bound of
/// what lies between the points. Rules agree by chance now and then: unless a function is `smooth`,
/// every quadrangle is halved once where it is not zero.
pub(crate) fn integrate(
    polygon: &ConvexPolygon,
    tolerance: f64,
    most: usize,
    is_smooth: bool,
    mut f: impl FnMut(DVec3) -> [f64; 2],
    unseen: impl Fn(&Corners) -> f64,
) -> (usize, Integral) {
    let mut cell = |corners| {
        let mut cell = evaluate(corners, &mut f);
        let missed = unseen(&corners);
        for (sum, is_upright) in cell.sums.iter_mut().zip(&mut cell.is_upright) {
            if missed > sum.error {
                *is_upright = is_longer_upright(&corners);
            }
            sum.error += missed;
        }
        cell
    };
    let mut cells: Vec<Cell> = quadrangles(polygon).map(&mut cell).collect();
    let total = |k: usize| cells.iter().map(|c| c.sums[k].error).sum::<f64>();
    let k = usize::from(total(1) < total(0));
    for (number, cell) in cells.iter_mut().enumerate() {
        cell.key = (k, number);
        let sum = &mut cell.sums[k];
        if !is_smooth && (sum.value, sum.error) != (0.0, 0.0) {
            sum.error = sum.error.max(f64::MAX.sqrt());
        }
    }
    let mut error = cells.iter().map(|c| c.sums[k].error).sum::<f64>();
    let mut cells = BinaryHeap::from(cells);
    while error > tolerance && cells.len() < most {
        let Some(whole) = cells.pop() else { break };
        let mut halves = halves(&whole.corners, whole.is_upright[k]).map(&mut cell);
        for j in 0..2 {
            let sum = halves[0].sums[j].value + halves[1].sums[j].value;
            let differs = 0.5 * (sum - whole.sums[j].value).abs();
            for half in &mut halves {
                half.sums[j].error = half.sums[j].error.max(differs);
            }
        }
        let before = error;
        error -= whole.sums[k].error;
        for mut half in halves {
            half.key = (k, cells.len());
            error += half.sums[k].error;
            cells.push(half);
        }
        if error <= tolerance || before > 1e6 * error {
            // Differences of sums are rounded: the sum itself decides.
            error = cells.iter().map(|c| c.sums[k].error).sum();
        }
    }
    let value = cells.iter().map(|c| c.sums[k].value).sum();
    (k, Integral { value, error })
}

/// The integrals over a quadrangle and their errors.
fn evaluate(corners: Corners, f: &mut impl FnMut(DVec3) -> [f64; 2]) -> Cell {
    let [a, b, c, d] = corners;
    let middle = 0.25 * (a + b + c + d);
    let (u, v) = (0.25 * (b + c - a - d), 0.25 * (c + d - a - b));
    let twist = 0.25 * (a + c - b - d);
    // The functions at a place, and the area there.
    let mut at = |[s, t]: [f64; 2]| {
        let area = (u + twist * t).cross(v + twist * s).length();
        (f(middle + u * s + v * t + twist * (s * t)), area)
    };
    let center = at([0.0; 2]);
    let points = PLACES.map(|orbit| orbit.map(&mut at));
    let one = |k: usize| {
        let value = |(found, area): ([f64; 2], f64)| found[k] * area;
        let center = value(center);
        let values = points.map(|orbit| orbit.map(value));
        let [near, far, outer, diagonal, ends] = values.map(|orbit| orbit.iter().sum::<f64>());
        let rule = |weights: [f64; 5], sums: [f64; 5]| {
            4.0 * weights
                .iter()
                .zip(sums)
                .map(|(w, sum)| w * sum)
                .sum::<f64>()
        };
        let sums = [center, near, far, outer, diagonal];
        let [value, low] = [0, 1].map(|j| rule(WEIGHTS.map(|w| w[j]), sums));
        let bent = rule(AT_CORNERS, [center, near, far, outer, ends]);
        // A part that one corner alone has, or lacks.
        let inner = || std::iter::once(center).chain(values[..4].iter().flatten().copied());
        let (most, least) = (
            inner().fold(0.0, f64::max),
            inner().fold(f64::INFINITY, f64::min),
        );
        let missed = match (most > 0.0, least > 0.0) {
            (false, _) => values[4].iter().copied().fold(0.0, f64::max),
            (true, true) if values[4].contains(&0.0) => least,
            (true, _) => 0.0,
        };
        // The fourth difference along each axis; alike, the longer side is halved.
        let bend = |axis: usize| {
            let second = |orbit: usize| {
                let ends: [f64; 4] = values[orbit];
                ends[2 * axis] + ends[2 * axis + 1] - 2.0 * center
            };
            (second(0) - second(1) / 7.0).abs()
        };
        let (across, up) = (bend(0), bend(1));
        let is_upright = match (across - up).abs() > 1e-3 * (across + up) {
            true => up > across,
            false => is_longer_upright(&corners),
        };
        let error = (value - low).abs().max(bent.abs()).max(missed);
        (Integral { value, error }, is_upright)
    };
    let both = [one(0), one(1)];
    Cell {
        corners,
        sums: both.map(|(sum, _)| sum),
        is_upright: both.map(|(_, is_upright)| is_upright),
        key: (0, 0),
    }
}

/// Whether a quadrangle is longer along the second axis of its square.
fn is_longer_upright(&[a, b, c, d]: &Corners) -> bool {
    (c + d - a - b).length_squared() > (b + c - a - d).length_squared()
}

/// A polygon in quadrangles with a corner in common.
fn quadrangles(polygon: &ConvexPolygon) -> impl Iterator<Item = Corners> {
    let v = polygon.vertices();
    (1..v.len() - 1)
        .step_by(2)
        .map(move |k| [v[0], v[k], v[k + 1], v[(k + 2) % v.len()]])
}

/// The halves of a quadrangle, cut across the first axis of its square, or the second.
fn halves(&[a, b, c, d]: &Corners, is_upright: bool) -> [Corners; 2] {
    let middle = |p: DVec3, q: DVec3| 0.5 * (p + q);
    if is_upright {
        let (l, r) = (middle(a, d), middle(b, c));
        [[a, b, r, l], [l, r, c, d]]
    } else {
        let (low, high) = (middle(a, b), middle(d, c));
        [[a, low, high, d], [low, b, c, high]]
    }
}
