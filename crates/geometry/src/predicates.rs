//! Products, differences, lengths and unit vectors without cancellation, overflow or underflow: the
//! numerical foundation of the closed forms.
//!
//! The subtraction in `a·b − c·d` can lose every digit. Carrying along the rounding errors of both
//! products ([Dekker 1971]'s exact product, used as in Kahan's algorithm) makes the relative error
//! of the result about one unit in the last place, however small the result is. Cross products
//! computed this way keep the closed forms of the workspace accurate for short, distant and nearly
//! collinear lines.
//!
//! Exact products are computed by splitting and not by a fused multiply–add, since without hardware
//! support known at compile time the latter is a slow library call.
//!
//! [Dekker 1971]: https://doi.org/10.1007/BF01397083

use crate::DVec3;

/// `2²⁷ + 1`: multiplication by it splits a 53-bit significand into two halves.
const SPLITTER: f64 = 134_217_729.0;

/// Splits `a` into a high and a low half; products of halves are exact.
#[inline]
fn split(a: f64) -> (f64, f64) {
    let c = SPLITTER * a;
    let hi = c - (c - a);
    (hi, a - hi)
}

/// The product `a·b` and its rounding error: `a·b = p + e` exactly.
///
/// **Domain**: |a|, |b| < 2⁹⁹⁶ and |a·b| > 2⁻⁹⁶⁹ or zero; outside, the error term is lost or the
/// result is not finite. **Source**: Dekker 1971.
#[inline]
#[must_use]
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (ah, al) = split(a);
    let (bh, bl) = split(b);
    let e = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    (p, e)
}

/// The sum `a + b` and its rounding error: `a + b = s + e` exactly (Knuth's two-sum).
#[inline]
#[must_use]
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let t = s - a;
    (s, (a - (s - t)) + (b - t))
}

/// Returns `a·b − c·d` with a small relative error, even where the two products cancel.
///
/// **Error**: at most 2 ulp of the result within the domain of [`two_product`].
///
/// ```
/// use linelit_geometry::predicates::diff_of_products;
/// let (a, b) = (1.0 + f64::EPSILON, 1.0 - f64::EPSILON);
/// assert_eq!(a * b - 1.0 * 1.0, 0.0); // every digit lost
/// assert_eq!(diff_of_products(a, b, 1.0, 1.0), -f64::EPSILON * f64::EPSILON);
/// ```
#[inline(always)]
#[must_use]
pub fn diff_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (p, ep) = two_product(a, b);
    let (q, eq) = two_product(c, d);
    let (s, es) = two_sum(p, -q);
    s + (es + (ep - eq))
}

/// Returns `a·b + c·d` with a small relative error, even where the two products cancel; see
/// [`diff_of_products`].
#[inline]
#[must_use]
pub fn sum_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    diff_of_products(a, b, -c, d)
}

/// Returns the cross product, each component of which has a relative error of at most 2 ulp.
///
/// The plain cross product is only accurate relative to |a||b|, which is worthless for nearly
/// parallel vectors.
#[inline(always)]
#[must_use]
pub fn cross(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::new(
        diff_of_products(a.y, b.z, a.z, b.y),
        diff_of_products(a.z, b.x, a.x, b.z),
        diff_of_products(a.x, b.y, a.y, b.x),
    )
}

/// The determinant `det(a, b, c) = (a × b)·c` of three vectors.
///
/// **Error**: 4 ε Σ|(a × b)ᵢ cᵢ|: the cross product is accurate by component, the last sum is
/// compensated.
#[inline]
#[must_use]
pub fn determinant(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    dot(cross(a, b), c)
}

/// The dot product in twice the working precision, rounded once.
///
/// **Error**: 1 ulp of the result plus 10 ε² Σ|aᵢ bᵢ|. **Source**: Ogita, Rump & Oishi 2005,
/// algorithm Dot2.
#[inline]
#[must_use]
pub fn dot(a: DVec3, b: DVec3) -> f64 {
    let (p0, e0) = two_product(a.x, b.x);
    let (p1, e1) = two_product(a.y, b.y);
    let (p2, e2) = two_product(a.z, b.z);
    let (s1, r1) = two_sum(p0, p1);
    let (s2, r2) = two_sum(s1, p2);
    s2 + (((e0 + e1) + e2) + (r1 + r2))
}

/// The length of a vector of any finite size.
///
/// `DVec3::length` squares the coordinates, which underflows for lengths below 1e-162 and overflows
/// above 1e154. Where the squares are within the range of normal numbers, this function returns the
/// same bits and costs two comparisons more.
///
/// **Error**: 2 ulp. The result is ∞ or NaN only if a coordinate is, or if the length itself
/// overflows.
///
/// ```
/// use linelit_geometry::{DVec3, predicates::length};
/// assert_eq!(length(DVec3::new(3e-200, 0.0, 4e-200)), 5e-200);
/// ```
#[inline]
#[must_use]
pub fn length(v: DVec3) -> f64 {
    let square = v.length_squared();
    if squares_are_safe(square) {
        square.sqrt()
    } else {
        scaled_length(v)
    }
}

/// The unit vector along `v`, for vectors of any finite length; `None` for zero and if a coordinate
/// is not finite.
///
/// The bits are the same as with glam's `try_normalize` wherever the squares of the coordinates are
/// within the range of normal numbers. **Error**: 2 ulp in each coordinate.
#[inline]
#[must_use]
pub fn normalize(v: DVec3) -> Option<DVec3> {
    let square = v.length_squared();
    if squares_are_safe(square) {
        return Some(v * (1.0 / square.sqrt()));
    }
    scaled_normalize(v)
}

#[cold]
#[inline(never)]
fn scaled_normalize(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    if !(largest > 0.0 && v.is_finite()) {
        return None;
    }
    let unit = v / largest;
    Some(unit / unit.length())
}

/// Returns the greatest [`length`] of some vectors, with one square root for all of them; zero if
/// there are no vectors.
#[inline]
pub(crate) fn longest(vectors: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let squares = vectors.clone().map(DVec3::length_squared);
    let square = squares.fold(
        0.0,
        |most, square| if square > most { square } else { most },
    );
    if squares_are_safe(square) {
        square.sqrt()
    } else {
        vectors.map(length).fold(0.0, f64::max)
    }
}

/// Whether a sum of three squares is accurate although squares may underflow: a square that
/// underflows is below 1e-308, which is negligible next to 1e-270.
#[inline]
fn squares_are_safe(sum: f64) -> bool {
    sum > 1e-270 && sum < f64::INFINITY
}

#[cold]
fn scaled_length(v: DVec3) -> f64 {
    let largest = v.abs().max_element();
    if largest > 0.0 && v.is_finite() {
        (v / largest).length() * largest
    } else {
        v.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// `a·b − c·d` for integers that fit exactly, as an oracle.
    fn exact(a: i64, b: i64, c: i64, d: i64) -> f64 {
        #[allow(
            clippy::cast_precision_loss,
            reason = "one rounding is what the oracle allows"
        )]
        let value = (i128::from(a) * i128::from(b) - i128::from(c) * i128::from(d)) as f64;
        value
    }

    proptest! {
        /// 53-bit integers times each other need 106 bits: i128 holds them exactly.
        #[test]
        fn difference_of_products_is_accurate_relative_to_itself(
            a in -(1i64 << 53)..(1i64 << 53),
            b in -(1i64 << 53)..(1i64 << 53),
            nudge in -4i64..5,
            near in any::<bool>(),
            c in -(1i64 << 53)..(1i64 << 53),
            d in -(1i64 << 53)..(1i64 << 53),
        ) {
            // In half of the cases, almost everything cancels.
            let (c, d) = if near { (a + nudge, b - nudge) } else { (c, d) };
            #[allow(clippy::cast_precision_loss, reason = "below 2^53 + 4: exact or even")]
            let got = {
                let f = |v: i64| v as f64;
                prop_assume!([a, b, c, d].iter().all(|&v| f(v).abs() <= 9_007_199_254_740_992.0));
                diff_of_products(f(a), f(b), f(c), f(d))
            };
            let want = exact(a, b, c, d);
            prop_assert!((got - want).abs() <= 2.0 * f64::EPSILON * want.abs(), "{got} {want}");
        }

        #[test]
        fn cross_is_orthogonal_to_nearly_parallel_vectors(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in 0.5..1.0f64,
            dx in -1.0..1.0f64, dy in -1.0..1.0f64, e in 1e-14..1e-3f64,
        ) {
            let a = DVec3::new(x, y, z);
            let b = DVec3::new(x + e * dx, y + e * dy, z);
            let n = cross(a, b);
            // Componentwise relative accuracy: 2 ulp each, so the residual of the dot product is
            // bounded by 3 eps times the sum of magnitudes (dot itself adds nothing).
            let scale = (n * a).abs().element_sum();
            prop_assert!(dot(n, a).abs() <= 3.0 * f64::EPSILON * scale);
        }
    }

    #[test]
    fn dot_survives_total_cancellation() {
        let a = DVec3::new(1e16, 1.0, -1e16);
        let b = DVec3::new(1.0, 1.0, 1.0);
        assert_eq!(dot(a, b).to_bits(), 1.0f64.to_bits());
    }
}
