//! Statistics of errors: metrics of pictures, and orders of convergence with their confidence
//! intervals.

pub mod metrics;
pub mod slopes;
pub mod student;

use linelit_elementary::{exp, ln};

/// The value up to which an x or a y of a point counts as rounding ([`least`]): squared errors and
/// times this small are zero in effect, and have no useful logarithm.
const NOTHING: f64 = 1e-18;

/// Returns the least y that a curve of points reaches at an x of this or less, or `None` if the
/// curve stays above this x.
///
/// For a curve of error (x) against time (y), it is the time at which the error falls to x. Where x
/// falls and y rises from one point to the next, the curve runs along the straight line in
/// logarithms; elsewhere only the points count. No line is drawn towards a point that is only
/// rounding: there the point's own y counts.
///
/// ```text
/// error │ ●
///       │   ╲
///     x ├─────╲
///       │     :╲
///       │     :  ●
///       └─────┴──────── time
///         the least y
/// ```
pub(crate) fn least(curve: impl IntoIterator<Item = [f64; 2]>, x: f64) -> Option<f64> {
    let mut least: Option<f64> = None;
    let mut before: Option<[f64; 2]> = None;
    let between = |a: [f64; 2], b: [f64; 2]| {
        let ([x0, y0], [x1, y1]) = (a.map(ln), b.map(ln));
        exp(y0 + (y1 - y0) * (ln(x) - x0) / (x1 - x0))
    };
    for point in curve {
        let from = before.filter(|from| from[0] > x && from[1] < point[1]);
        let reached = match from {
            _ if point[0] > x => None,
            Some(from) if point[0] > NOTHING && from[1] > NOTHING => Some(between(from, point)),
            _ => Some(point[1]),
        };
        least = [least, reached].into_iter().flatten().reduce(f64::min);
        before = Some(point);
    }
    least
}

/// Returns a standard normal deviate (Box & Muller 1958).
#[cfg(test)]
pub(crate) fn normal(random: &mut impl rand::RngExt) -> f64 {
    let (a, b): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}
