//! The two precisions of the kernels, and the little vector algebra that they need.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};
use linelit_geometry::predicates;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`. Sealed.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next number.
    const EPSILON: Self;
    /// Halley steps at most in the inversion of the projected solid angle.
    const STEPS: u32;
    /// A step smaller than this fraction of the distance to the nearer end leaves an error below the precision, because
    /// convergence is cubic: the cube root of EPSILON/4.
    const CLOSE: Self;

    /// The nearest number.
    fn from_f64(x: f64) -> Self;
    /// The same number.
    fn to_f64(self) -> f64;
    /// √x.
    fn sqrt(self) -> Self;
    /// |x|.
    fn abs(self) -> Self;
    /// sin and cos.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the point (x, self).
    fn atan2(self, x: Self) -> Self;
    /// Arc tangent.
    fn atan(self) -> Self;
    /// `a·b − c·d`, accurate relative to the result.
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self;
    /// `(x − sin x)/x³` from y = x², for |x| ≤ 2.
    fn sine_remainder(y: Self) -> Self;
    /// `sin(x)/x` and `cos x` from y = x², for |x| ≤ ½.
    fn sine_and_cosine(y: Self) -> (Self, Self);
    /// The dot product; in `f32` accumulated in `f64` and rounded once.
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self;
    /// The dot product in twice the precision, rounded once.
    fn accurate_dot(a: [Self; 3], b: [Self; 3]) -> Self;

    /// The larger of two; `other` if `self` is NaN.
    #[inline]
    #[must_use]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of two; `other` if `self` is NaN.
    #[inline]
    #[must_use]
    fn at_most(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// Whether the number is positive and finite.
    #[inline]
    fn is_usable(self) -> bool {
        self > Self::ZERO && self.to_f64() < f64::INFINITY
    }
}

/// The coefficients ±1/(2k + first)! of the sine's (first = 1) or cosine's (0) Taylor series in x², and with first = 3
/// those of what the sine leaves.
const fn taylor(first: u32) -> [f64; 12] {
    let mut out = [0.0; 12];
    let (mut n, mut term) = (1, 1.0);
    while n <= first {
        term /= n as f64;
        n += 1;
    }
    let mut k = 0;
    while k < 12 {
        out[k] = term;
        term /= -(n as f64) * (n as f64 + 1.0);
        n += 2;
        k += 1;
    }
    out
}

#[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
const fn narrow(c: [f64; 12]) -> [f32; 12] {
    let mut out = [0.0; 12];
    let mut k = 0;
    while k < 12 {
        out[k] = c[k] as f32;
        k += 1;
    }
    out
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f64::EPSILON;
    const STEPS: u32 = 6;
    const CLOSE: Self = 3.8e-6;

    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        self.sin_cos()
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        self.atan2(x)
    }
    #[inline]
    fn atan(self) -> Self {
        self.atan()
    }
    #[inline]
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        predicates::diff_of_products(a, b, c, d)
    }
    #[inline]
    fn sine_remainder(y: Self) -> Self {
        const C: [f64; 12] = taylor(3);
        let z = y * y;
        let even = C[0] + z * (C[2] + z * (C[4] + z * (C[6] + z * (C[8] + z * C[10]))));
        let odd = C[1] + z * (C[3] + z * (C[5] + z * (C[7] + z * (C[9] + z * C[11]))));
        even + y * odd
    }
    #[inline]
    fn sine_and_cosine(y: Self) -> (Self, Self) {
        const S: [f64; 12] = taylor(1);
        const C: [f64; 12] = taylor(0);
        let z = y * y;
        let sum = |c: &[f64; 12]| {
            let even = c[0] + z * (c[2] + z * (c[4] + z * c[6]));
            let odd = c[1] + z * (c[3] + z * (c[5] + z * c[7]));
            even + y * odd
        };
        (sum(&S), sum(&C))
    }
    #[inline]
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }
    #[inline]
    fn accurate_dot(a: [Self; 3], b: [Self; 3]) -> Self {
        predicates::dot(a.into(), b.into())
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f32::EPSILON;
    const STEPS: u32 = 4;
    const CLOSE: Self = 3.1e-3;

    #[inline]
    #[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
    fn from_f64(x: f64) -> Self {
        x as Self
    }
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        self.sin_cos()
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        self.atan2(x)
    }
    #[inline]
    fn atan(self) -> Self {
        self.atan()
    }
    /// Products of two `f32` are exact in `f64`.
    #[inline]
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        Self::from_f64(f64::from(a) * f64::from(b) - f64::from(c) * f64::from(d))
    }
    #[inline]
    fn sine_remainder(y: Self) -> Self {
        const C: [f32; 12] = narrow(taylor(3));
        let z = y * y;
        let even = C[0] + z * (C[2] + z * (C[4] + z * C[6]));
        let odd = C[1] + z * (C[3] + z * C[5]);
        even + y * odd
    }
    #[inline]
    fn sine_and_cosine(y: Self) -> (Self, Self) {
        const S: [f32; 12] = narrow(taylor(1));
        const C: [f32; 12] = narrow(taylor(0));
        let sum = |c: &[f32; 12]| c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * c[4])));
        (sum(&S), sum(&C))
    }
    #[inline]
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        let product = |i: usize| f64::from(a[i]) * f64::from(b[i]);
        Self::from_f64(product(0) + product(1) + product(2))
    }
    #[inline]
    fn accurate_dot(a: [Self; 3], b: [Self; 3]) -> Self {
        Self::dot(a, b)
    }
}

pub(crate) type V3<T> = [T; 3];

#[inline]
pub(crate) fn add<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(crate) fn sub<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
pub(crate) fn scale<T: Real>(a: V3<T>, s: T) -> V3<T> {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline]
pub(crate) fn dot<T: Real>(a: V3<T>, b: V3<T>) -> T {
    T::dot(a, b)
}

#[inline]
pub(crate) fn length<T: Real>(a: V3<T>) -> T {
    dot(a, a).sqrt()
}

/// The cross product, each component accurate relative to itself.
#[inline]
pub(crate) fn cross<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    let d = T::diff_of_products;
    [
        d(a[1], b[2], a[2], b[1]),
        d(a[2], b[0], a[0], b[2]),
        d(a[0], b[1], a[1], b[0]),
    ]
}

/// The cross product for vectors that are far from parallel.
#[inline]
pub(crate) fn plain_cross<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// (sin, cos) of a small step: Taylor sums for |x| < ½, where they are shorter than the library's reduction and table.
#[inline]
pub(crate) fn small_sin_cos<T: Real>(x: T) -> (T, T) {
    if x.abs() > T::from_f64(0.5) {
        return x.sin_cos();
    }
    let (s, c) = T::sine_and_cosine(x * x);
    (x * s, c)
}

/// (sin, cos) of a sum of angles.
#[inline]
pub(crate) fn rotate<T: Real>(a: (T, T), b: (T, T)) -> (T, T) {
    (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0)
}
