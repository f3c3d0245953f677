//! The two precisions of the kernels, and the little vector algebra that they need.
#![allow(clippy::disallowed_types, reason = "one of the two precisions")]

use crate::linear::trig::{ARC_TANGENT, taylor};
use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};
use linelit_elementary::single;
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
    /// Steps at most in the inversion of the projected solid angle.
    const STEPS: u32;
    /// A step smaller than this fraction of the distance to the nearer end leaves an error below
    /// the precision, because convergence is of fourth order: at most the fourth root of EPSILON/4.
    const CLOSE: Self;

    /// The same number.
    fn to_f64(self) -> f64;
    /// Whether rounded products are worth trying in a cross product.
    const PLAIN_CROSS: bool;

    /// The nearest number.
    fn from_f64(x: f64) -> Self;
    /// A length below which the digits of [`Real::length`] go: where squares are below the normal
    /// numbers by less than their precision, and the rounding of `f32`s themselves.
    const LEAST: Self;

    /// The largest finite number.
    const MAX: Self;

    /// √x.
    #[must_use]
    fn sqrt(self) -> Self;
    /// The length of a vector; squares are sums of `f64`, in `f32`, too.
    fn length(a: [Self; 3]) -> Self;
    /// |x|.
    #[must_use]
    fn abs(self) -> Self;
    /// `atan(x)/x` from y = x², for |x| ≤ 1: numerator and denominator.
    fn arc_tangent(y: Self) -> [Self; 2];
    /// `(x − sin x)/x³` from y = x², for |x| ≤ 1.
    #[must_use]
    fn sine_remainder(y: Self) -> Self;
    /// `sin(x)/x` and `cos x` from y = x², for |x| ≤ ½.
    fn sine_and_cosine(y: Self) -> (Self, Self);
    /// sin and cos.
    fn sin_cos(self) -> (Self, Self);
    /// The angle of the point (x, self).
    fn atan2(self, x: Self) -> Self;
    /// `a·b − c·d`, accurate relative to the result.
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self;
    /// Where the line p0 p1 crosses the horizon n·p = 0, from more digits than the precision has:
    /// of ends as they are given, with the heights c0 and c1 of opposite signs.
    fn on_horizon(ends: [[Self; 3]; 2], n: [Self; 3]) -> [Self; 3];
    /// The dot product; in `f32` accumulated in `f64` and rounded once.
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self;
    /// The dot product in twice the precision, rounded once.
    fn accurate_dot(a: [Self; 3], b: [Self; 3]) -> Self;

    /// The larger of two; `other` if `self` is NaN.
    #[inline(always)]
    #[must_use]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The smaller of two; `other` if `self` is NaN.
    #[inline(always)]
    #[must_use]
    fn at_most(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    /// Whether the number is positive and finite.
    #[inline]
    fn is_usable(self) -> bool {
        self > Self::ZERO && self <= Self::MAX
    }

    /// Whether the number is positive, and its square has been a number of full digits.
    #[inline]
    fn has_square(self) -> bool {
        self > Self::LEAST && self <= Self::MAX
    }

    /// The nearest number in [0, 1]; 0 for NaN.
    #[inline(always)]
    #[must_use]
    fn unit(self) -> Self {
        self.at_least(Self::ZERO).at_most(Self::ONE)
    }
}

#[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
const fn narrow(c: [f64; 8]) -> [f32; 8] {
    let mut out = [0.0; 8];
    let mut k = 0;
    while k < 8 {
        out[k] = c[k] as f32;
        k += 1;
    }
    out
}

/// A polynomial of degree 7.
#[inline(always)]
fn eight(c: &[f64; 8], y: f64) -> f64 {
    let z = y * y;
    let low = (c[0] + y * c[1]) + z * (c[2] + y * c[3]);
    let high = (c[4] + y * c[5]) + z * (c[6] + y * c[7]);
    low + (z * z) * high
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f64::EPSILON;
    const STEPS: u32 = 6;
    const LEAST: Self = 1e-145;
    const MAX: Self = f64::MAX;
    const CLOSE: Self = 5e-5;
    const PLAIN_CROSS: bool = true;

    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn arc_tangent(y: Self) -> [Self; 2] {
        let (z, w) = (y * y, (y * y) * (y * y));
        let sum = |c: &[Self; 7]| {
            let low = (c[0] + y * c[1]) + z * (c[2] + y * c[3]);
            low + w * ((c[4] + y * c[5]) + z * c[6])
        };
        [sum(&ARC_TANGENT[0]), sum(&ARC_TANGENT[1])]
    }
    #[inline(always)]
    fn sine_remainder(y: Self) -> Self {
        // The next term is 1/19!, 6e-17 of the sum.
        eight(const { &taylor(3) }, y)
    }
    #[inline(always)]
    fn sine_and_cosine(y: Self) -> (Self, Self) {
        // The next terms are below 2^-16/17! and 2^-16/16!.
        (
            eight(const { &taylor(1) }, y),
            eight(const { &taylor(0) }, y),
        )
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        linelit_elementary::sin_cos(self)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        linelit_elementary::atan2(self, x)
    }
    #[inline]
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        predicates::diff_of_products(a, b, c, d)
    }
    #[inline]
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }
    #[inline]
    fn length(a: [Self; 3]) -> Self {
        Self::dot(a, a).sqrt()
    }
    #[cold]
    #[inline(never)]
    fn on_horizon([p0, p1]: [[Self; 3]; 2], n: [Self; 3]) -> [Self; 3] {
        // (n × (p0 × p1))/(n·(p1 − p0)) with the inner product in twice the precision: two parts by
        // component.
        let part = |i: usize, j: usize| {
            let (p, ep) = predicates::two_product(p0[i], p1[j]);
            let (q, eq) = predicates::two_product(p0[j], p1[i]);
            let (s, es) = predicates::two_sum(p, -q);
            (s, es + (ep - eq))
        };
        let x = [part(1, 2), part(2, 0), part(0, 1)];
        let span = predicates::dot(n.into(), p1.into()) - predicates::dot(n.into(), p0.into());
        let component = |i: usize, j: usize| {
            let high = predicates::diff_of_products(n[i], x[j].0, n[j], x[i].0);
            (high + (n[i] * x[j].1 - n[j] * x[i].1)) / span
        };
        [component(1, 2), component(2, 0), component(0, 1)]
    }
    #[inline(never)]
    fn accurate_dot(a: [Self; 3], b: [Self; 3]) -> Self {
        predicates::dot(a.into(), b.into())
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = f32::EPSILON;
    const STEPS: u32 = 4;
    const LEAST: Self = 1e-37;
    const MAX: Self = f32::MAX;
    const CLOSE: Self = 9e-3;
    /// In `f64` they are exact and cheap.
    const PLAIN_CROSS: bool = false;

    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounding is the point")]
    fn from_f64(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn arc_tangent(y: Self) -> [Self; 2] {
        // As [`ARC_TANGENT`], to 3e-9.
        const C: [[f32; 4]; 2] = [
            [1.0, 1.116_260_3, 0.277_986_62, 0.008_414_574],
            [1.0, 1.449_593_3, 0.561_189_3, 0.048_381],
        ];
        let sum = |c: &[Self; 4]| (c[0] + y * c[1]) + (y * y) * (c[2] + y * c[3]);
        [sum(&C[0]), sum(&C[1])]
    }
    #[inline(always)]
    fn sine_remainder(y: Self) -> Self {
        // The next term is 1/13!, 1e-9 of the sum.
        const C: [f32; 8] = narrow(taylor(3));
        C[0] + y * (C[1] + y * (C[2] + y * (C[3] + y * C[4])))
    }
    #[inline(always)]
    fn sine_and_cosine(y: Self) -> (Self, Self) {
        const S: [f32; 8] = narrow(taylor(1));
        const C: [f32; 8] = narrow(taylor(0));
        let sum = |c: &[f32; 8]| c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * c[4])));
        (sum(&S), sum(&C))
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        single::sin_cos(self)
    }
    #[inline]
    fn atan2(self, x: Self) -> Self {
        single::atan2(self, x)
    }
    /// Products of two `f32` are exact in `f64`.
    #[inline]
    fn diff_of_products(a: Self, b: Self, c: Self, d: Self) -> Self {
        Self::from_f64(f64::from(a) * f64::from(b) - f64::from(c) * f64::from(d))
    }
    #[inline]
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        let product = |i: usize| f64::from(a[i]) * f64::from(b[i]);
        Self::from_f64(product(0) + product(1) + product(2))
    }
    #[inline]
    fn length(a: [Self; 3]) -> Self {
        let [x, y, z] = a.map(f64::from);
        let square = x * x + y * y + z * z;
        // The narrow root costs half of the wide one.
        let narrow = Self::from_f64(square);
        if narrow > Self::LEAST && narrow <= Self::MAX {
            narrow.sqrt()
        } else {
            Self::from_f64(square.sqrt())
        }
    }
    #[cold]
    #[inline(never)]
    fn on_horizon([p0, p1]: [[Self; 3]; 2], n: [Self; 3]) -> [Self; 3] {
        let [p, q, n] = [p0, p1, n].map(|v| v.map(f64::from));
        let height = |v: [f64; 3]| n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        let (c0, c1) = (height(p), height(q));
        let way = c0 / (c0 - c1);
        [0, 1, 2].map(|k| Self::from_f64(p[k] + (q[k] - p[k]) * way))
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
    T::length(a)
}

/// The cross product: its length and direction to a few ε, each component accurate relative to
/// itself where the vectors are nearly parallel.
#[inline(always)]
pub(crate) fn cross<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    let plain = plain_cross(a, b);
    if !T::PLAIN_CROSS {
        return accurate_cross(a, b);
    }
    // More than 30° apart the plain products round to 4 ε of the length.
    if dot(plain, plain) > T::from_f64(0.25) * (dot(a, a) * dot(b, b)) {
        return plain;
    }
    nearly_parallel_cross(a, b)
}

#[inline(never)]
fn nearly_parallel_cross<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    accurate_cross(a, b)
}

#[inline(always)]
fn accurate_cross<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
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
