//! The exchange between two convex polygons without obstruction: a contour integral by edges.

use linelit_elementary::{atan, exp, ln};
use linelit_geometry::{ConvexPolygon, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Computes `∫∫ cos θ₁ cos θ₂ / (π r²)` over two polygons, each of which is before the plane of the
/// other: the area of one times its view factor to the other; and a bound of the rounding error.
///
/// **Formula**: by Stokes' theorem (Sparrow 1963), `1/(2π) |∮∮ ln r dx₁·dx₂|` over both boundaries.
/// The integral along an edge of the second polygon has a closed form. The integral along an edge
/// of the first is computed by tanh-sinh quadrature, since edges may touch each other, in pieces
/// where edges pass each other closely.
pub(crate) fn exchange(first: &ConvexPolygon, second: &ConvexPolygon) -> (f64, f64) {
    let edges = |polygon: &ConvexPolygon| -> Vec<[DVec3; 2]> {
        let v = polygon.vertices();
        let next = v.iter().cycle().skip(1);
        // Clipping may leave two corners at the same position.
        let edges = v.iter().zip(next).map(|(a, b)| [*a, *b]);
        edges.filter(|[a, b]| a != b).collect()
    };
    // The unit of length is the largest distance, so that no logarithm is far from zero.
    let corners = || first.vertices().iter().chain(second.vertices());
    let middle = first.centroid();
    let unit = corners().fold(0.0_f64, |most, v| most.max(v.distance(middle)));
    // Sum over all pairs of edges, with the cosine between them.
    let (mut sum, mut size, mut error) = (0.0, 0.0, 0.0);
    for [a, b] in edges(first) {
        for [c, d] in edges(second) {
            let cosine = (b - a).normalize_or_zero().dot((d - c).normalize_or_zero());
            let (term, told) = edge_pair([a, b, c, d].map(|v| (v - middle) / unit));
            sum += cosine * term;
            size += (cosine * term).abs();
            error += cosine.abs() * told;
        }
    }
    let scale = unit * unit / TAU;
    (scale * sum.abs(), scale * (size * ROUNDING + error))
}

/// The relative rounding error of the integral of two edges by tanh-sinh quadrature.
const ROUNDING: f64 = 1e-14;

/// Computes `∫∫ ln r ds dt` over the edges from `a` to `b` and from `c` to `d`, and the error of
/// the quadrature.
fn edge_pair([a, b, c, d]: [DVec3; 4]) -> (f64, f64) {
    // Cut the first edge at the kinks of the integrand: where the first edge passes the ends of the
    // second, and where it passes the second most closely.
    let along = b - a;
    let square = along.length_squared();
    let (across, from) = (along.cross(d - c), (c - a).cross(d - c));
    let nearest = from.dot(across) / across.length_squared();
    let ends = [c, d].map(|end| (end - a).dot(along) / square);
    let mut cuts = vec![0.0, 1.0];
    for t in [ends[0], ends[1], nearest] {
        if t > 1e-12 && t < 1.0 - 1e-12 {
            cuts.push(t);
        }
    }
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|next, cut| *next - *cut <= 1e-12);
    // Integrate the pieces.
    let length = square.sqrt();
    let integral = |t: f64| along_edge(a + along * t, c, d);
    let pieces = cuts.windows(2);
    let pieces = pieces.map(|ends| halved(ends[0], ends[1], HALVINGS, &integral));
    let (value, error) = pieces.fold((0.0, 0.0), |sum, piece| (sum.0 + piece.0, sum.1 + piece.1));
    (length * value, length * error)
}

/// Computes `∫ ln r dt` from a point along the edge from `c` to `d`, in closed form.
fn along_edge(x: DVec3, c: DVec3, d: DVec3) -> f64 {
    let length = d.distance(c);
    let unit = (d - c) / length;
    let start = (c - x).dot(unit);
    let height = (c - x).cross(unit).length();
    let antiderivative = |u: f64| {
        let square = u * u + height * height;
        let logarithm = if square > 0.0 {
            0.5 * u * ln(square)
        } else {
            0.0
        };
        let angle = match height > 0.0 {
            true => height * atan(u / height),
            false => 0.0,
        };
        logarithm - u + angle
    };
    antiderivative(start + length) - antiderivative(start)
}

/// The largest number of halvings of a piece: a kink in the last piece is within `2⁻⁴⁰` of its
/// length.
const HALVINGS: u32 = 40;

/// Computes `∫ f` from `low` to `high`, and its error; halves the interval where two step sizes
/// differ by more than rounding.
fn halved(low: f64, high: f64, halvings: u32, f: &impl Fn(f64) -> f64) -> (f64, f64) {
    let (whole, error) = tanh_sinh(low, high, f);
    if error <= ROUNDING || halvings == 0 {
        return (whole, error);
    }
    let middle = 0.5 * (low + high);
    let [first, second] =
        [(low, middle), (middle, high)].map(|(low, high)| halved(low, high, halvings - 1, f));
    (first.0 + second.0, first.1 + second.1)
}

/// Computes `∫ f` from `low` to `high`, where `f` may have logarithmic singularities at both ends,
/// and the difference from the result with twice the step size.
fn tanh_sinh(low: f64, high: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    const STEP: f64 = 0.1;
    const NODES: i32 = 34;
    // Map the interval such that the integrand decays doubly exponentially towards both ends.
    let half = 0.5 * (high - low);
    let mut sums = [0.0; 2];
    for k in -NODES..=NODES {
        let t = STEP * f64::from(k);
        let (up, down) = (exp(t), exp(-t));
        let (sinh, cosh) = (FRAC_PI_2 * 0.5 * (up - down), 0.5 * (up + down));
        let (up, down) = (exp(sinh), exp(-sinh));
        // Compute the distance from the nearer end, without cancellation.
        let inner = 2.0 / (up + down);
        let weight = FRAC_PI_2 * cosh * inner * inner;
        let from_end = half * inner * if k > 0 { down } else { up };
        let x = if k > 0 {
            high - from_end
        } else {
            low + from_end
        };
        debug_assert!(low <= x && x <= high);
        sums[usize::from(k % 2 == 0)] += weight * f(x);
    }
    let [odd, even] = sums.map(|sum| STEP * half * sum);
    (odd + even, (odd - even).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(corners: &[[f64; 3]]) -> ConvexPolygon {
        ConvexPolygon::new(corners).unwrap()
    }

    #[test]
    fn catalogue() {
        // Howell C-11: equal squares at the distance of their side; C-14: squares with a common
        // edge; values to twelve digits from the closed forms.
        let low = polygon(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        let high = polygon(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]);
        let wall = polygon(&[[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]]);
        let (parallel, _) = exchange(&low, &high);
        assert!((parallel - 0.199_824_895_698_0).abs() < 1e-12, "{parallel}");
        let (adjacent, _) = exchange(&low, &wall);
        assert!((adjacent - 0.200_043_776_075).abs() < 1e-12, "{adjacent}");
        assert!((parallel + 4.0 * adjacent - 1.0).abs() < 1e-13);
        // From a smaller square: by reciprocity, the same in both directions.
        let small = polygon(&[[2., 3., 2.], [2., 3.5, 2.5], [2.5, 3.5, 2.5], [2.5, 3., 2.]]);
        let (there, back) = (exchange(&low, &small).0, exchange(&small, &low).0);
        assert!((there / back - 1.0).abs() < 1e-11, "{there} {back}");
    }

    #[test]
    fn edges_that_pass_each_other_closely() {
        // The exchange with a rotated square close above another is the sum of the exchanges with
        // its nine parts.
        let low = polygon(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        for height in [0.1, 1e-2, 1e-4, 1e-8] {
            let at = |x: f64, y: f64| [0.6 + 0.8 * x - 0.6 * y, 0.1 + 0.6 * x + 0.8 * y, height];
            let square = |x: f64, y: f64, side: f64| {
                let corners = [[x, y], [x, y + side], [x + side, y + side], [x + side, y]];
                exchange(&low, &polygon(&corners.map(|[x, y]| at(x, y))))
            };
            let (whole, mut told) = square(0.0, 0.0, 1.0);
            let mut sum = 0.0;
            for k in 0..9 {
                let [x, y] = [k % 3, k / 3].map(|k| f64::from(k) / 3.0);
                let (part, error) = square(x, y, 1.0 / 3.0);
                (sum, told) = (sum + part, told + error);
            }
            assert!(
                (whole - sum).abs() <= told && told < 1e-12,
                "{whole} {sum} {told}"
            );
        }
    }

    #[test]
    fn edges_at_right_angles_in_any_direction() {
        // Both ends of an edge are close to one point of the other, up to rounding.
        for k in 0..200 {
            let (sin, cos) = linelit_elementary::sin_cos(0.01 * f64::from(k));
            let turned = |[x, y, z]: [f64; 3]| {
                let (x, y) = (cos * x - sin * y, sin * x + cos * y);
                [x, cos * y - sin * z, sin * y + cos * z]
            };
            let floor = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
            let wall = [
                [0., 0.2, 0.1],
                [0., 0.7, 0.1],
                [0., 0.7, 0.9],
                [0., 0.2, 0.9],
            ];
            let found = exchange(&polygon(&floor.map(turned)), &polygon(&wall.map(turned)));
            let same = exchange(&polygon(&floor), &polygon(&wall));
            assert!(
                (found.0 - same.0).abs() <= found.1 + same.1,
                "{found:?} {same:?}"
            );
        }
    }
}
