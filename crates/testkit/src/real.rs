//! A trait for the numbers in which an oracle may be written: `f64`, [`Dd`](crate::dd::Dd),
//! [`Precise`](crate::precise::Precise).
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A type of real numbers with the functions that light integrals need.
///
/// Write the oracle once, generically, and run it fast (double-double) over a million cases and
/// precisely (≥ 60 digits) over a few.
///
/// ```
/// use linelit_testkit::{dd::Dd, precise::Precise, real::Real};
/// fn hypotenuse<R: Real>(a: f64, b: f64) -> f64 {
///     let (a, b) = (R::new(a), R::new(b));
///     (a.clone() * a + b.clone() * b).sqrt().to_f64()
/// }
/// assert_eq!(hypotenuse::<Dd>(3.0, 4.0), 5.0);
/// assert_eq!(hypotenuse::<Precise>(3.0, 4.0), 5.0);
/// ```
pub trait Real:
    Clone
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Returns exactly this number (finite).
    fn new(x: f64) -> Self;
    /// Rounds to the nearest `f64`.
    fn to_f64(&self) -> f64;
    /// Returns √x, for x ≥ 0.
    fn sqrt(&self) -> Self;
    /// Returns sin x, for x in radians.
    fn sin(&self) -> Self;
    /// Returns cos x, for x in radians.
    fn cos(&self) -> Self;
    /// Returns the angle of (x, y) = (`x`, `self`) in (−π, π].
    fn atan2(&self, x: &Self) -> Self;
    /// Returns eˣ.
    fn exp(&self) -> Self;
    /// Returns ln x, for x > 0.
    fn ln(&self) -> Self;
    /// Returns π.
    fn pi() -> Self;

    /// Returns arcsin x = atan2(x, √((1−x)(1+x))), for |x| ≤ 1.
    fn asin(&self) -> Self {
        let one = Self::new(1.0);
        self.atan2(&((one.clone() - self.clone()) * (one + self.clone())).sqrt())
    }

    /// Returns arccos x = atan2(√((1−x)(1+x)), x), for |x| ≤ 1.
    fn acos(&self) -> Self {
        let one = Self::new(1.0);
        ((one.clone() - self.clone()) * (one + self.clone()))
            .sqrt()
            .atan2(self)
    }

    /// Returns |x|.
    fn abs(&self) -> Self {
        if *self < Self::new(0.0) {
            -self.clone()
        } else {
            self.clone()
        }
    }

    /// Returns xⁿ by repeated squaring.
    fn powi(&self, n: u32) -> Self {
        let (mut result, mut base, mut rest) = (Self::new(1.0), self.clone(), n);
        while rest > 0 {
            if rest & 1 == 1 {
                result = result * base.clone();
            }
            rest >>= 1;
            if rest > 0 {
                base = base.clone() * base;
            }
        }
        result
    }
}

impl Real for f64 {
    fn new(x: f64) -> Self {
        x
    }
    fn to_f64(&self) -> f64 {
        *self
    }
    fn sqrt(&self) -> Self {
        Self::sqrt(*self)
    }
    fn sin(&self) -> Self {
        Self::sin(*self)
    }
    fn cos(&self) -> Self {
        Self::cos(*self)
    }
    fn atan2(&self, x: &Self) -> Self {
        Self::atan2(*self, *x)
    }
    fn exp(&self) -> Self {
        Self::exp(*self)
    }
    fn ln(&self) -> Self {
        Self::ln(*self)
    }
    fn pi() -> Self {
        std::f64::consts::PI
    }
}

/// Returns the dot product of two vectors.
pub fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0].clone() * b[0].clone() + a[1].clone() * b[1].clone() + a[2].clone() * b[2].clone()
}

/// Returns the cross product of two vectors.
pub fn cross<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    let minor = |i: usize, j: usize| a[i].clone() * b[j].clone() - a[j].clone() * b[i].clone();
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Returns the difference of two vectors.
pub fn sub<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [0, 1, 2].map(|i| a[i].clone() - b[i].clone())
}

/// Returns the length of a vector.
pub fn length<R: Real>(a: &[R; 3]) -> R {
    dot(a, a).sqrt()
}

/// Returns a vector of exact `f64` inputs.
pub fn vector<R: Real>(v: [f64; 3]) -> [R; 3] {
    v.map(R::new)
}
