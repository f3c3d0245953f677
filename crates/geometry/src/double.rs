//! Double-double numbers, for computations in which `f64` loses too many digits: unevaluated sums
//! of two `f64`, with 31 digits.
//!
//! ```
//! use linelit_geometry::double::{Double, cross_of, dot, vector};
//! use linelit_geometry::DVec3;
//! // Of 1 + 2⁻⁶⁰ the rest is kept.
//! let sum = Double::from(1.0) + Double::from(2f64.powi(-60));
//! assert_eq!((sum - Double::from(1.0)).hi(), 2f64.powi(-60));
//! // A vector across two others that are nearly parallel: its product with one of them is zero.
//! let (a, b) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.1, 0.2, 0.3 + 1e-16));
//! assert!(dot(cross_of(a, b), vector(a)).hi().abs() < 1e-32);
//! ```

use crate::DVec3;
use crate::predicates::{two_product, two_sum};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number hi + lo with |lo| ≤ ε|hi|. Sums, products and ratios have errors of 4 ε² ≈ 2e-31 of
/// their terms.
///
/// **Domain**: the domain of [`two_product`]. **Source**: Hida, Li & Bailey 2001.
#[derive(Clone, Copy, Debug)]
pub struct Double {
    hi: f64,
    lo: f64,
}

impl Double {
    pub(crate) const ZERO: Self = Self { hi: 0.0, lo: 0.0 };

    /// The product a · b, exactly.
    #[inline]
    #[must_use]
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = two_product(a, b);
        Self { hi, lo }
    }

    /// The difference a − b, exactly.
    #[inline]
    #[must_use]
    pub fn difference(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, -b);
        Self { hi, lo }
    }

    /// Returns a·b − c·d, with an error of 2 ε² of the two products.
    #[inline]
    #[must_use]
    pub fn diff_of_products(a: f64, b: f64, c: f64, d: f64) -> Self {
        let (p, ep) = two_product(a, b);
        let (q, eq) = two_product(c, d);
        let (s, es) = two_sum(p, -q);
        let (hi, lo) = two_sum(s, es + (ep - eq));
        Self { hi, lo }
    }

    /// Returns the number rounded to `f64`, which is its high part.
    #[inline]
    #[must_use]
    pub const fn hi(self) -> f64 {
        self.hi
    }

    /// Returns the low part: the difference of the number and its high part.
    #[inline]
    #[must_use]
    pub const fn lo(self) -> f64 {
        self.lo
    }
}

impl From<f64> for Double {
    #[inline]
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Neg for Double {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Add for Double {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (s, es) = two_sum(self.hi, other.hi);
        let (t, et) = two_sum(self.lo, other.lo);
        let (s, es) = two_sum(s, es + t);
        let (hi, lo) = two_sum(s, es + et);
        Self { hi, lo }
    }
}

impl Sub for Double {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let (p, e) = two_product(self.hi, other.hi);
        let (hi, lo) = two_sum(p, e + (self.hi * other.lo + self.lo * other.hi));
        Self { hi, lo }
    }
}

impl Div for Double {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let q = self.hi / other.hi;
        let rest = self - other * Self::from(q);
        let (hi, lo) = two_sum(q, rest.hi / other.hi);
        Self { hi, lo }
    }
}

/// A point or vector of double-double coordinates, in the plane (N = 2) or in space.
pub type Doubles<const N: usize> = [Double; N];

/// Converts a vector of `f64`, exactly.
#[inline]
#[must_use]
pub fn vector(v: DVec3) -> Doubles<3> {
    v.to_array().map(Double::from)
}

/// Rounds a vector to `f64`.
#[inline]
#[must_use]
pub fn rounded(v: Doubles<3>) -> DVec3 {
    v.map(Double::hi).into()
}

/// The difference p − q, exactly.
#[inline]
#[must_use]
pub fn difference(p: DVec3, q: DVec3) -> Doubles<3> {
    [0, 1, 2].map(|k| Double::difference(p[k], q[k]))
}

/// The dot product of two vectors of `f64`, with an error of 10 ε² of its terms.
#[inline]
#[must_use]
pub fn dot_of(a: DVec3, b: DVec3) -> Double {
    let (p0, e0) = two_product(a.x, b.x);
    let (p1, e1) = two_product(a.y, b.y);
    let (p2, e2) = two_product(a.z, b.z);
    let (s1, r1) = two_sum(p0, p1);
    let (s2, r2) = two_sum(s1, p2);
    let (hi, lo) = two_sum(s2, ((e0 + e1) + e2) + (r1 + r2));
    Double { hi, lo }
}

/// The cross product of two vectors of `f64`, with an error of 2 ε² of its terms.
#[inline]
#[must_use]
pub fn cross_of(a: DVec3, b: DVec3) -> Doubles<3> {
    [
        Double::diff_of_products(a.y, b.z, a.z, b.y),
        Double::diff_of_products(a.z, b.x, a.x, b.z),
        Double::diff_of_products(a.x, b.y, a.y, b.x),
    ]
}

/// The dot product of two vectors.
#[inline]
#[must_use]
pub fn dot<const N: usize>(a: Doubles<N>, b: Doubles<N>) -> Double {
    (0..N).fold(Double::ZERO, |sum, k| sum + a[k] * b[k])
}

/// The cross product of two vectors.
#[inline]
#[must_use]
pub fn cross(a: Doubles<3>, b: Doubles<3>) -> Doubles<3> {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

/// a + b t, for vectors a and b.
pub(crate) fn along<const N: usize>(a: Doubles<N>, b: Doubles<N>, t: Double) -> Doubles<N> {
    std::array::from_fn(|k| a[k] + b[k] * t)
}

/// a − b, for vectors.
pub(crate) fn minus<const N: usize>(a: Doubles<N>, b: Doubles<N>) -> Doubles<N> {
    std::array::from_fn(|k| a[k] - b[k])
}

/// The third component of the cross product of two vectors in the plane.
pub(crate) fn turn(a: Doubles<2>, b: Doubles<2>) -> Double {
    a[0] * b[1] - a[1] * b[0]
}
