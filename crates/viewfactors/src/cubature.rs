//! Adaptive integration of two functions at once over a convex polygon, with an error estimate: the
//! cubature behind view factors past blockers.
//!
//! The polygon is divided into quadrangles, each the image of a square under a bilinear map. A rule
//! of degree 7 with 17 points, and 4 more near the corners, evaluates each quadrangle; differences
//! to rules of lower degrees by the same points estimate its error. The quadrangle with the largest
//! error is halved along the axis on which the function changes more, until the sum of all errors
//! is below the tolerance.

use linelit_geometry::{ConvexPolygon, DVec3, stop};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The value of an integral, and the estimate of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Integral {
    pub value: f64,
    pub error: f64,
}

/// The corners of a quadrangle, the image of a square under a bilinear map; a triangle if two
/// corners coincide.
pub(crate) type Corners = [DVec3; 4];

/// Two nonnegative functions to be integrated at once, with data that narrow down their evaluation
/// in a part of the polygon, such as which blockers matter there.
pub(crate) trait Integrand {
    /// The data about both functions in one quadrangle.
    type Known;
    /// Returns the data for a quadrangle, given the data for a larger quadrangle around it.
    fn narrow(&mut self, corners: &Corners, around: &Self::Known) -> Self::Known;
    /// Returns the values of both functions at the point `x` of a quadrangle with these data.
    fn at(&mut self, x: DVec3, known: &Self::Known) -> [f64; 2];
    /// Returns a bound of the part of the integral over a quadrangle that the points of the rule
    /// may miss.
    fn unseen(&self, corners: &Corners, known: &Self::Known) -> f64;
}

/// A quadrangle with the integrals of both functions over it.
#[derive(Clone, Debug)]
struct Cell<K> {
    corners: Corners,
    known: K,
    sums: [Integral; 2],
    /// For each function, whether it changes more along the second axis of the square than along
    /// the first.
    is_upright: [bool; 2],
    /// The index of the function whose error determines the order of the cells, and a number by
    /// which cells of equal error are ordered: the number of cells when this one was added.
    key: (usize, usize),
}

impl<K> Cell<K> {
    // Cells are ordered by error, and cells of equal error by the number in their key.
    fn rank(&self) -> (f64, usize) {
        (self.sums[self.key.0].error, self.key.1)
    }
}

impl<K> PartialEq for Cell<K> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<K> Eq for Cell<K> {}

impl<K> PartialOrd for Cell<K> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<K> Ord for Cell<K> {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b) = (self.rank(), other.rank());
        a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))
    }
}

/// The weights of Genz and Malik's rule of degree 7 on [−1, 1]², one for each of its five orbits of
/// points, and the weights of a rule of degree 5 by the same points.
const WEIGHTS: [[f64; 2]; 5] = [
    [-3816.0 / 19683.0, -971.0 / 729.0],
    [980.0 / 6561.0, 245.0 / 486.0],
    [1020.0 / 19683.0, 65.0 / 1458.0],
    [200.0 / 19683.0, 25.0 / 729.0],
    [6859.0 / 78732.0, 0.0],
];
/// The factor from the differences of rules to the error estimate of a quadrangle.
const SAFETY: f64 = 2.0;
/// The weights of the first four orbits and of the points near the corners in a sum that is zero
/// for all polynomials of degree 5. A large sum means that the function is not smooth at a corner,
/// as where polygons touch.
const AT_CORNERS: [f64; 5] = [
    -0.133_126_115_579_259_24,
    0.038_562_946_771_884_77,
    -0.000_786_998_913_711_934_1,
    -0.024_494_418_963_358_026,
    0.02,
];
/// The coordinates of the orbits after the first, √(9/70), √(9/10) and √(9/19), and of the points
/// near the corners, which have no weight in either rule.
const NEAR: f64 = 0.358_568_582_800_318_1;
const FAR: f64 = 0.948_683_298_050_513_8;
const DIAGONAL: f64 = 0.688_247_201_611_685_3;
const CORNER: f64 = 0.998;
/// The positions of all points of the rule except the centre: five orbits of four points each.
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

/// Integrates two nonnegative functions over a polygon until the error of one of them is below the
/// tolerance, or until there are `most` quadrangles. Returns the index of the function with the
/// smaller error at first, which alone is refined, and its integral. The quadrangle with the
/// largest error is halved in each step.
///
/// The error of a quadrangle is the largest of these differences: between the rules of degree 7 and
/// 5; between these and rules of degree 3 where they show that the function is not smooth; and half
/// of that between the quadrangle it was cut from and both halves. Where a corner alone has a
/// nonzero value, or alone has zero, the error is at least a quarter of that corner's part. The
/// bound of what the rule's points may miss is added. Rules agree by chance now and then, so unless
/// the functions are smooth (`is_smooth`), every quadrangle where they are not zero is halved at
/// least once.
pub(crate) fn integrate<I: Integrand>(
    polygon: &ConvexPolygon,
    tolerance: f64,
    most: usize,
    is_smooth: bool,
    integrand: &mut I,
    known: &I::Known,
) -> (usize, Integral) {
    // Evaluates one quadrangle. Where the bound of what is missed exceeds the error, the longer
    // side is halved.
    let mut cell = |corners, around: &I::Known| {
        let known = integrand.narrow(&corners, around);
        let missed = integrand.unseen(&corners, &known);
        let mut cell = evaluate(corners, integrand, known);
        for (sum, is_upright) in cell.sums.iter_mut().zip(&mut cell.is_upright) {
            if missed > sum.error {
                *is_upright = is_longer_upright(&corners);
            }
            sum.error += missed;
        }
        cell
    };
    // Evaluate the first quadrangles, and choose the function with the smaller error.
    let quadrangles = quadrangles(polygon);
    let mut cells: Vec<Cell<I::Known>> = quadrangles.map(|corners| cell(corners, known)).collect();
    let total = |k: usize| cells.iter().map(|c| c.sums[k].error).sum::<f64>();
    let k = usize::from(total(1) < total(0));
    for (number, cell) in cells.iter_mut().enumerate() {
        cell.key = (k, number);
        let sum = &mut cell.sums[k];
        if !is_smooth && (sum.value, sum.error) != (0.0, 0.0) {
            sum.error = sum.error.max(f64::MAX.sqrt());
        }
    }
    // Halve the quadrangle with the largest error until the sum of errors is below the tolerance.
    let mut error = cells.iter().map(|c| c.sums[k].error).sum::<f64>();
    let mut cells = BinaryHeap::from(cells);
    while error > tolerance && cells.len() < most {
        stop::check();
        let Some(whole) = cells.pop() else { break };
        let halves = halves(&whole.corners, whole.is_upright[k]);
        let mut halves = halves.map(|corners| cell(corners, &whole.known));
        // If the halves differ from the whole, their errors are at least half of the difference.
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
            // Subtraction has accumulated rounding errors, so the sum is computed again.
            error = cells.iter().map(|c| c.sums[k].error).sum();
        }
    }
    let value = cells.iter().map(|c| c.sums[k].value).sum();
    (k, Integral { value, error })
}

/// Evaluates the rules for a quadrangle: returns a cell with the integrals of both functions, and
/// their errors.
fn evaluate<I: Integrand>(corners: Corners, integrand: &mut I, known: I::Known) -> Cell<I::Known> {
    // The bilinear map from the square: the middle, the vectors along the axes, and the twist.
    let [a, b, c, d] = corners;
    let [middle, u, v, twist] =
        [a + b + c + d, b + c - a - d, c + d - a - b, a + c - b - d].map(|sum| 0.25 * sum);
    // Evaluates the functions at a point of the square, and the area element there.
    let mut at = |[s, t]: [f64; 2]| {
        let area = (u + twist * t).cross(v + twist * s).length();
        let x = middle + u * s + v * t + twist * (s * t);
        (integrand.at(x, &known), area)
    };
    let center = at([0.0; 2]);
    let points = PLACES.map(|orbit| orbit.map(&mut at));
    let one = |k: usize| {
        let value = |(found, area): ([f64; 2], f64)| found[k] * area;
        // Sum up each orbit, and apply both rules and the test of the corners.
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
        // Find a value that one corner alone has or lacks.
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
        // Compute the fourth difference along each axis, to halve the axis with the larger one; if
        // they are alike, the longer side.
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
        let third = 2.0 * third_degree(value, center, [near, far, outer, diagonal]);
        // At kinks, rules agree by chance: twice the difference exceeds all but one error in a
        // thousand.
        let differs = (value - low).abs().max(bent.abs()).max(third);
        let error = (SAFETY * differs).max(missed);
        (Integral { value, error }, is_upright)
    };
    let [(first, upright), (second, other_upright)] = [one(0), one(1)];
    Cell {
        corners,
        known,
        sums: [first, second],
        is_upright: [upright, other_upright],
        key: (0, 0),
    }
}

/// Returns an error estimate from rules of degree 3, each of the centre and one orbit: where a
/// function is smooth, the error of degree 5 is about the power 3/2 of theirs, as fractions of the
/// integral.
fn third_degree(value: f64, center: f64, orbits: [f64; 4]) -> f64 {
    let squares = [
        2.0 * NEAR * NEAR,
        2.0 * FAR * FAR,
        4.0 * FAR * FAR,
        4.0 * DIAGONAL * DIAGONAL,
    ];
    let differs = orbits.iter().zip(squares).map(|(sum, square)| {
        // The weight for which the rule integrates x² exactly.
        let weight = 1.0 / (3.0 * square);
        (4.0 * ((1.0 - 4.0 * weight) * center + weight * sum) - value).abs()
    });
    let most = differs.fold(0.0, f64::max);
    let relative = most / value.abs().max(most).max(f64::MIN_POSITIVE);
    most * relative.sqrt()
}

/// Whether a quadrangle is longer along the second axis of its square.
fn is_longer_upright(&[a, b, c, d]: &Corners) -> bool {
    (c + d - a - b).length_squared() > (b + c - a - d).length_squared()
}

/// Returns the points of the rule in all quadrangles of a polygon; in each quadrangle, the points
/// near corners and far from the centre come first.
pub(crate) fn places(polygon: &ConvexPolygon) -> impl Iterator<Item = DVec3> {
    quadrangles(polygon).flat_map(|[a, b, c, d]| {
        let around = PLACES.iter().rev().flatten().copied();
        around.chain([[0.0; 2]]).map(move |[s, t]| {
            let low = (a * (1.0 - s) + b * (1.0 + s)) * (1.0 - t);
            0.25 * (low + (d * (1.0 - s) + c * (1.0 + s)) * (1.0 + t))
        })
    })
}

/// Divides a polygon into quadrangles that share a corner.
fn quadrangles(polygon: &ConvexPolygon) -> impl Iterator<Item = Corners> {
    let v = polygon.vertices();
    (1..v.len() - 1)
        .step_by(2)
        .map(move |k| [v[0], v[k], v[k + 1], v[(k + 2) % v.len()]])
}

/// Returns the two halves of a quadrangle, divided across the first axis of its square, or across
/// the second if `is_upright`.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// An integrand of one function, about which nothing is known.
    struct Function<F>(F);

    impl<F: Fn(DVec3) -> f64> Integrand for Function<F> {
        type Known = ();

        fn narrow(&mut self, _: &Corners, (): &()) {}

        fn at(&mut self, x: DVec3, (): &()) -> [f64; 2] {
            [self.0(x); 2]
        }

        fn unseen(&self, _: &Corners, (): &()) -> f64 {
            0.0
        }
    }

    fn integral(corners: &[[f64; 3]], tolerance: f64, f: impl Fn(DVec3) -> f64) -> Integral {
        let polygon = ConvexPolygon::new(corners).unwrap();
        integrate(&polygon, tolerance, 1_000_000, true, &mut Function(f), &()).1
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    #[test]
    fn polynomials_are_exact() {
        let seventh = |p: DVec3| p.x.powi(4) * p.y.powi(3);
        let found = integral(&SQUARE, f64::INFINITY, seventh);
        assert!(
            (found.value - 0.05).abs() < 1e-15 && found.error > 1e-4,
            "{found:?}"
        );
        // The rules that the error estimate compares have degrees 5 and 3.
        let third = |p: DVec3| p.x * p.y.powi(2);
        let found = integral(&SQUARE, f64::INFINITY, third);
        assert!(
            (found.value - 1.0 / 6.0).abs() < 1e-15 && found.error < 1e-15,
            "{found:?}"
        );
        // On triangles the map doubles the degree and adds one: ∫ x² y = 2! / 5!.
        let found = integral(&[SQUARE[0], SQUARE[1], SQUARE[3]], f64::INFINITY, |p| {
            p.x.powi(2) * p.y
        });
        assert!((found.value - 1.0 / 60.0).abs() < 1e-15, "{found:?}");
        // A pentagon is a quadrangle and a triangle.
        let roof = [
            SQUARE[0],
            SQUARE[1],
            [1., 2., 0.],
            [0.5, 3., 0.],
            [0., 2., 0.],
        ];
        let found = integral(&roof, f64::INFINITY, |p| p.y);
        assert!(
            (found.value - (2.0 + 0.5 * (2.0 + 1.0 / 3.0))).abs() < 1e-14,
            "{found:?}"
        );
    }

    #[test]
    fn kinks_are_told() {
        for tolerance in [1e-3, 1e-6] {
            let kink = |p: DVec3| (p.x + 0.3 * p.y - 0.55).max(0.0);
            let found = integral(&SQUARE, tolerance, kink);
            // ∫ (x + 0.3 y − 0.55)₊ in closed form: cubes of the corners' heights.
            let cube = |h: f64| h.max(0.0).powi(3) / (6.0 * 0.3);
            let exact = cube(0.75) - cube(-0.25) - cube(0.45) + cube(-0.55);
            let error = (found.value - exact).abs();
            assert!(
                error <= found.error && found.error <= tolerance,
                "{error} {found:?}"
            );
        }
    }

    #[test]
    fn what_one_corner_alone_has_or_lacks_is_told() {
        // There are strips along two sides of the square that no other point of the rule is in.
        let is_in = |p: DVec3| {
            let strip = |s: f64, t: f64| s > 0.976 && t > 0.003;
            strip(p.x, p.y) || strip(p.y, p.x)
        };
        let area = 2.0 * 0.024 * 0.997 - 0.024 * 0.024;
        for is_there in [true, false] {
            let f = |p: DVec3| f64::from(u8::from(is_in(p) == is_there));
            let found = integral(&SQUARE, f64::INFINITY, f);
            let exact = if is_there { area } else { 1.0 - area };
            assert!(
                (found.value - exact).abs() <= found.error,
                "{found:?} {exact}"
            );
        }
    }

    #[test]
    fn what_is_high_at_a_corner_alone_is_told() {
        // Of 1 + 10 exp(−k (x + y)), all points except those near the corner see only the constant.
        for k in [150.0, 300.0, 600.0] {
            let steep = |p: DVec3| 1.0 + 10.0 * linelit_elementary::exp(-k * (p.x + p.y));
            let found = integral(&SQUARE, f64::INFINITY, steep);
            let exact = 1.0 + 10.0 / (k * k);
            let off = (found.value - exact).abs();
            assert!(off > 1e-5 && off <= found.error, "{off} {found:?}");
        }
    }
}
