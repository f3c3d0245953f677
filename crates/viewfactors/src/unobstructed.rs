//! The exchange between two convex polygons with nothing in between.

use linelit_elementary::{atan, exp, ln};
use linelit_geometry::{ConvexPolygon, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// `∫∫ cos θ₁ cos θ₂ / (π r²)` over two polygons, each of which lies before the plane of the other:
/// the area of one times its view factor to the other; and a bound of the rounding error.
///
/// **Formula**: by Stokes' theorem (Sparrow 1963) `1/(2π) |∮∮ ln r dx₁·dx₂|` over both boundaries.
/// The integral along an edge of the second is in closed form; that along an edge of the first is
/// by tanh-sinh quadrature, since edges may meet.
pub(crate) fn exchange(first: &ConvexPolygon, second: &ConvexPolygon) -> (f64, f64) {
    let edges = |polygon: &ConvexPolygon| -> Vec<[DVec3; 2]> {
        let v = polygon.vertices();
        let next = v.iter().cycle().skip(1);
        // Cuts may leave corners in one place.
        let edges = v.iter().zip(next).map(|(a, b)| [*a, *b]);
        edges.filter(|[a, b]| a != b).collect()
    };
    // The unit of length is the largest distance, so that no logarithm is far from zero.
    let corners = || first.vertices().iter().chain(second.vertices());
    let middle = first.centroid();
    let unit = corners().fold(0.0_f64, |most, v| most.max(v.distance(middle)));
    let (mut sum, mut size) = (0.0, 0.0);
    for [a, b] in edges(first) {
        for [c, d] in edges(second) {
            let cosine = (b - a).normalize_or_zero().dot((d - c).normalize_or_zero());
            let term = cosine * edge_pair([a, b, c, d].map(|v| (v - middle) / unit));
            sum += term;
            size += term.abs();
        }
    }
    let scale = unit * unit / TAU;
    (scale * sum.abs(), scale * size * ROUNDING)
}

/// The relative error of the integral of two edges: that of tanh-sinh quadrature with this step.
const ROUNDING: f64 = 1e-14;

/// `∫∫ ln r ds dt` over the edges from `a` to `b` and from `c` to `d`.
fn edge_pair([a, b, c, d]: [DVec3; 4]) -> f64 {
    // The integrand has kinks where the first edge passes the ends of the second.
    let along = b - a;
    let square = along.length_squared();
    let mut cuts = vec![0.0, 1.0];
    for end in [c, d] {
        let t = (end - a).dot(along) / square;
        if t > 1e-12 && t < 1.0 - 1e-12 {
            cuts.push(t);
        }
    }
    cuts.sort_by(f64::total_cmp);
    let length = square.sqrt();
    let pieces = cuts.windows(2);
    let integral = |t: f64| along_edge(a + along * t, c, d);
    length
        * pieces
            .map(|ends| tanh_sinh(ends[0], ends[1], integral))
            .sum::<f64>()
}

/// `∫ ln r dt` from a place along the edge from `c` to `d`, in closed form.
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

/// `∫ f` from `low` to `high`, where `f` may have logarithmic singularities at both ends.
fn tanh_sinh(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 0.1;
    const NODES: i32 = 34;
    let half = 0.5 * (high - low);
    let mut sum = 0.0;
    for k in -NODES..=NODES {
        let t = STEP * f64::from(k);
        let (up, down) = (exp(t), exp(-t));
        let (sinh, cosh) = (FRAC_PI_2 * 0.5 * (up - down), 0.5 * (up + down));
        let (up, down) = (exp(sinh), exp(-sinh));
        // The distance from the nearer end, without cancellation.
        let inner = 2.0 / (up + down);
        let weight = FRAC_PI_2 * cosh * inner * inner;
        let from_end = half * inner * if k > 0 { down } else { up };
        let x = if k > 0 {
            high - from_end
        } else {
            low + from_end
        };
        sum += weight * f(x);
    }
    STEP * half * sum
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
        // Of a smaller square, by reciprocity the same both ways.
        let small = polygon(&[[2., 3., 2.], [2., 3.5, 2.5], [2.5, 3.5, 2.5], [2.5, 3., 2.]]);
        let (there, back) = (exchange(&low, &small).0, exchange(&small, &low).0);
        assert!((there / back - 1.0).abs() < 1e-11, "{there} {back}");
    }
}
