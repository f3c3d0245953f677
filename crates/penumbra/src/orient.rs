//! The exact predicate on which all decisions rest: on which side of a line a point is.

use linelit_geometry::predicates::{two_product, two_sum};

/// A point of the light's plane, in any affine coordinates.
pub type Point = [f64; 2];

/// The value of a determinant, as a fraction of its terms, below which it is computed again,
/// exactly. The rounding of the plain form is 4 ε of the terms (Shewchuk 1997, section 4.1); the
/// margin above that is for the digits that crossings of edges need.
const CLOSE: f64 = 1e-12;

/// Returns twice the signed area of the triangle a b c, which is positive if c is to the left of
/// the line from a to b.
///
/// The sign is the sign of the exact value, and the value has at least three correct digits; zero
/// is returned only for points that are exactly on one line. Coordinates have to be zero or between
/// 1e-60 and 1e60 in absolute value.
#[inline]
pub(crate) fn orient(a: Point, b: Point, c: Point) -> f64 {
    let left = (b[0] - a[0]) * (c[1] - a[1]);
    let right = (b[1] - a[1]) * (c[0] - a[0]);
    let plain = left - right;
    if plain.abs() > CLOSE * (left.abs() + right.abs()) {
        return plain;
    }
    // Handle two equal points first, which are frequent, since neighbours in a mesh share exactly
    // equal corners.
    #[allow(clippy::float_cmp, reason = "the very same point")]
    let shared = c == a || c == b || a == b;
    if shared {
        return 0.0;
    }
    exactly(a, b, c)
}

/// Computes the determinant as an exact sum of its six products, rounded only at the end.
#[cold]
#[inline(never)]
fn exactly(a: Point, b: Point, c: Point) -> f64 {
    let products = [
        (a[0], b[1]),
        (-a[0], c[1]),
        (b[0], c[1]),
        (-b[0], a[1]),
        (c[0], a[1]),
        (-c[0], b[1]),
    ];
    // Grow an expansion: parts that do not overlap, in ascending order of magnitude (Shewchuk 1997,
    // theorem 10).
    let mut parts = [0.0; 12];
    let mut count = 0;
    for (x, y) in products {
        let (high, low) = two_product(x, y);
        for term in [low, high] {
            let mut carry = term;
            for part in &mut parts[..count] {
                (carry, *part) = two_sum(carry, *part);
            }
            parts[count] = carry;
            count += 1;
        }
    }
    parts.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coordinates on a grid of 2⁻⁴⁰ below 2: the determinant needs 84 bits, which i128 holds.
    fn by_integers(p: [Point; 3]) -> i128 {
        #[allow(clippy::cast_possible_truncation, reason = "integers by construction")]
        let [a, b, c] = p.map(|v| v.map(|x| (x * 2f64.powi(40)) as i128));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    #[test]
    fn sign_is_exact() {
        let mut rng = linelit_testkit::cases::rng(1);
        let grid = |x: f64| (x * 2f64.powi(40)).round() / 2f64.powi(40);
        let mut zeros = 0;
        for case in 0..200_000 {
            let mut next = || grid(rng.in_range(-1.0, 1.0));
            let (a, b) = ([next(), next()], [next(), next()]);
            // Close to the line, at a few grid steps, or exactly on it.
            let t = grid(next()).abs();
            let step = f64::from(case % 5 - 2) * 2f64.powi(-40);
            let c = if case % 3 == 0 {
                [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])].map(grid)
            } else {
                [
                    grid(a[0] + t * (b[0] - a[0])),
                    grid(a[1] + t * (b[1] - a[1])) + step,
                ]
            };
            let want = by_integers([a, b, c]);
            let got = orient(a, b, c);
            zeros += u32::from(want == 0);
            assert_eq!(
                want.signum(),
                if got > 0.0 {
                    1
                } else if got < 0.0 {
                    -1
                } else {
                    0
                },
                "{a:?} {b:?} {c:?}"
            );
            #[allow(clippy::cast_precision_loss, reason = "an oracle to three digits")]
            let size = want as f64 * 2f64.powi(-80);
            assert!((got - size).abs() <= 1e-3 * size.abs(), "{got} {size}");
        }
        assert!(zeros > 1000, "{zeros} points on their lines");
    }
}
