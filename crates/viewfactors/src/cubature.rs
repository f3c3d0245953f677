//! Adaptive integration over a convex polygon.

use linelit_geometry::{ConvexPolygon, DVec3};

/// An integral, and its error as the rule tells it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Integral {
    pub value: f64,
    pub error: f64,
}

/// A triangle with what the rule makes of it.
#[derive(Clone, Copy, Debug)]
struct Cell {
    corners: [DVec3; 3],
    value: f64,
    error: f64,
}

/// Barycentric coordinates and weights of Radon's rule of degree 5: the middle, and two orbits of
/// three points (a, a, 1 − 2a).
const ORBITS: [[f64; 2]; 2] = [
    [0.101_286_507_323_456_3, 0.125_939_180_544_827_1],
    [0.470_142_064_105_115_1, 0.132_394_152_788_506_2],
];
const MIDDLE: f64 = 0.225;
/// Places near the corners, which have no weight.
const CORNER: f64 = 1e-3;
/// The weight of each point of the first orbit in a rule of degree 2 by it and the middle:
/// 1/(12 (1 − 3a)²).
const EMBEDDED: f64 = 1.0 / (12.0 * (1.0 - 3.0 * ORBITS[0][0]) * (1.0 - 3.0 * ORBITS[0][0]));

/// `∫ f` over a polygon, the first of two parts that are not negative, to a tolerance, by halving
/// the triangles with the largest errors until the sum of all is below it, or `most` triangles are
/// reached.
///
/// The error of a triangle is the larger of two differences: between a rule of degree 5 and one of
/// degree 2 by four of the same points, which is more than the error of the former where `f` is
/// smooth; and half of that between the triangle it was cut from and both halves, which tells where
/// `f` is not. Every triangle is cut once, therefore. Where one corner has or lacks a part unlike
/// all points, it is a third of that part. To it comes `unseen`: a bound of what lies between the
/// points.
pub(crate) fn integrate(
    polygon: &ConvexPolygon,
    tolerance: f64,
    most: usize,
    mut f: impl FnMut(DVec3) -> [f64; 2],
    unseen: impl Fn(&[DVec3; 3]) -> f64,
) -> Integral {
    let v = polygon.vertices();
    let mut cell = |corners: [DVec3; 3]| {
        let [a, b, c] = corners;
        let area = 0.5 * (b - a).cross(c - a).length();
        let middle = f((a + b + c) / 3.0);
        let (mut sums, mut missed) = ([0.0; 2], 0.0_f64);
        let (mut most, mut least) = (middle, middle);
        let mut ends = [[[0.0; 2]; 2]; 3];
        for ((p, q, r), ends) in [(a, b, c), (b, c, a), (c, a, b)].into_iter().zip(&mut ends) {
            let mut at = |near: f64| f(p * (1.0 - 2.0 * near) + (q + r) * near);
            let points = ORBITS.map(|[near, _]| at(near));
            for (sum, parts) in sums.iter_mut().zip(points) {
                *sum += parts[0];
                most = [0, 1].map(|k| parts[k].max(most[k]));
                least = [0, 1].map(|k| parts[k].min(least[k]));
            }
            *ends = [at(CORNER), points[0]];
        }
        for [corner, near] in ends {
            for k in 0..2 {
                // A part that the corner alone has, or lacks.
                if most[k] == 0.0 {
                    missed = missed.max(corner[k] / 3.0);
                } else if least[k] > 0.0 && corner[k] == 0.0 {
                    missed = missed.max(near[k] / 3.0);
                }
            }
        }
        let value = MIDDLE * middle[0] + ORBITS[0][1] * sums[0] + ORBITS[1][1] * sums[1];
        let low = (1.0 - 3.0 * EMBEDDED) * middle[0] + EMBEDDED * sums[0];
        let differs = (value - low).abs().max(missed);
        Cell {
            corners,
            value: area * value,
            error: area * differs + unseen(&corners),
        }
    };
    let mut bad: Vec<Cell> = v[1..]
        .windows(2)
        .map(|pair| cell([v[0], pair[0], pair[1]]))
        .collect();
    let (mut cells, mut error) = (Vec::new(), f64::INFINITY);
    while !bad.is_empty() && bad.len() + cells.len() < most {
        for whole in bad {
            let mut halves = halves(whole.corners).map(&mut cell);
            let differs = 0.5 * (halves[0].value + halves[1].value - whole.value).abs();
            for half in &mut halves {
                half.error = half.error.max(differs);
            }
            cells.extend(halves);
        }
        error = cells.iter().map(|c| c.error).sum();
        // The next pass halves all triangles whose error is more than their share.
        let share = 0.5 * tolerance / cells.len() as f64;
        let is_good = |c: &Cell| c.error <= share || error <= tolerance;
        (cells, bad) = cells.into_iter().partition(is_good);
    }
    cells.extend(bad);
    Integral {
        value: cells.iter().map(|c| c.value).sum(),
        error,
    }
}

/// The halves of a triangle, cut across its longest side.
fn halves([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let sides = [(a, b, c), (b, c, a), (c, a, b)];
    let longest = sides.into_iter().max_by(|x, y| {
        let length = |s: &(DVec3, DVec3, DVec3)| s.0.distance_squared(s.1);
        length(x).total_cmp(&length(y))
    });
    let (p, q, r) = longest.unwrap_or((a, b, c));
    let middle = 0.5 * (p + q);
    [[p, middle, r], [middle, q, r]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_degree_five_are_exact_and_kinks_are_told() {
        let square = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        let square = ConvexPolygon::new(&square).unwrap();
        let fifth = |p: DVec3| [p.x.powi(3) * p.y.powi(2), 1.0];
        let found = integrate(&square, f64::INFINITY, 100, fifth, |_| 0.0);
        assert!((found.value - 1.0 / 12.0).abs() < 1e-15 && found.error > 1e-4);
        // The rule inside has degree 2.
        let second = integrate(
            &square,
            f64::INFINITY,
            100,
            |p| [p.x * p.y + p.y * p.y, 1.0],
            |_| 0.0,
        );
        assert!(second.error < 1e-15, "{}", second.error);
        for tolerance in [1e-3, 1e-5] {
            let kink = |p: DVec3| [(p.x + 0.3 * p.y - 0.55).max(0.0), 1.0];
            let found = integrate(&square, tolerance, 1_000_000, kink, |_| 0.0);
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
}
