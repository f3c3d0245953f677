//! Angles with their sines and cosines, by polynomials: short for what is small, without branches, and the same bits on
//! every machine.

use crate::real::Real;

/// The coefficients ±1/(2k + first)! of the sine's (first = 1) or cosine's (0) Taylor series in x², and with
/// first = 3 those of what the sine leaves.
pub(crate) const fn taylor(first: u32) -> [f64; 8] {
    let mut out = [0.0; 8];
    let (mut n, mut term) = (1, 1.0);
    while n <= first {
        term /= n as f64;
        n += 1;
    }
    let mut k = 0;
    while k < 8 {
        out[k] = term;
        term /= -(n as f64) * (n as f64 + 1.0);
        n += 2;
        k += 1;
    }
    out
}

/// Numerator and denominator in x² of the quotient for atan(x)/x on |x| ≤ 1 that interpolates at Chebyshev's points, found
/// in 60 digits: relative error 5e-17.
pub(crate) const ARC_TANGENT: [[f64; 7]; 2] = [
    [
        1.0,
        2.481_724_209_061_851,
        2.234_915_476_501_942_3,
        0.888_660_069_119_356,
        0.150_858_549_007_864_7,
        0.008_671_322_302_831_24,
        7.270_489_172_902_097_e-0_5,
    ],
    [
        1.0,
        2.815_057_542_395_167_4,
        2.973_267_990_634_671_5,
        1.459_595_033_684_855_8,
        0.333_776_595_464_565_73,
        0.030_888_667_775_341_615,
        0.000_755_333_999_987_682_1,
    ],
];

/// An angle with its sine and cosine.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Angle<T> {
    pub v: T,
    pub s: T,
    pub c: T,
}

/// Twice the angle whose tangent is a/b, a ≥ 0, b ≥ 0, not both zero, and its sine and cosine: [0, π]. Relatively accurate
/// to a few ε, the sine too; two divisions and no branch.
#[inline(always)]
pub(crate) fn double_angle<T: Real>(a: T, b: T) -> Angle<T> {
    let one = T::from_f64(1.0);
    let r = a.at_most(b) / a.at_least(b);
    let y = r * r;
    let [p, q] = T::arc_tangent(y);
    let z = one + y;
    let w = one / (z * q);
    let (v, s) = ((r + r) * p * (z * w), (r + r) * (q * w));
    let c = (one - y) * (q * w);
    let pi = T::from_f64(core::f64::consts::PI);
    Angle {
        v: if a > b { pi - v } else { v },
        s,
        c: if a > b { -c } else { c },
    }
}

/// (sin, cos) of a sum of angles.
#[inline(always)]
pub(crate) fn rotate<T: Real>(a: (T, T), b: (T, T)) -> (T, T) {
    (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0)
}

/// (sin, cos) of a step: Taylor sums for |x| < ½, where they are shorter than the library's reduction and table.
#[inline]
pub(crate) fn small_sin_cos<T: Real>(x: T) -> (T, T) {
    if x.abs() > T::from_f64(0.5) {
        return x.sin_cos();
    }
    let (s, c) = T::sine_and_cosine(x * x);
    (x * s, c)
}
