//! This module holds the arithmetic of the kernels for lines: minima and maxima that replace NaN,
//! accurate cross products, and angles with their sines and cosines. The functions are polynomials
//! without calls or branches, short where arguments are small, and have the same bits on every
//! machine.

use linelit_geometry::{DVec3, predicates};

/// The largest number of steps in the inversion of the projected solid angle.
pub(crate) const STEPS: u32 = 6;
/// The length of a step of the inversion, as a fraction of the distance to the nearer end of the
/// line, below which it is the last step. Such a step leaves an error below the precision, because
/// convergence is of fourth order and this number is at most the fourth root of ε/4.
pub(crate) const CLOSE: f64 = 5e-5;
/// The smallest length in scene units that the techniques accept: the square of a smaller length
/// would be subnormal and lose digits.
pub(crate) const LEAST: f64 = 1e-145;

/// Comparisons that are false for NaN.
pub(crate) trait Bounds: Copy {
    /// Returns the larger of two numbers, or `other` if `self` is NaN.
    #[must_use]
    fn at_least(self, other: Self) -> Self;
    /// Returns the smaller of two numbers, or `other` if `self` is NaN.
    #[must_use]
    fn at_most(self, other: Self) -> Self;
    /// Whether the number is positive and finite.
    fn is_usable(self) -> bool;
    /// Whether the number, which is the root of a square, is finite, and at least [`LEAST`], so
    /// that its square did not underflow.
    fn has_square(self) -> bool;
}

impl Bounds for f64 {
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline]
    fn is_usable(self) -> bool {
        self > 0.0 && self <= Self::MAX
    }
    #[inline]
    fn has_square(self) -> bool {
        self > LEAST && self <= Self::MAX
    }
}

/// Returns the cross product. Its length and direction are accurate to a few ε; where the vectors
/// are nearly parallel, each component has a small relative error.
#[inline(always)]
pub(crate) fn cross(a: DVec3, b: DVec3) -> DVec3 {
    let plain = a.cross(b);
    // If the vectors are more than 30° apart, the plain products round to 4 ε of the length.
    if plain.dot(plain) > 0.25 * (a.dot(a) * b.dot(b)) {
        return plain;
    }
    nearly_parallel_cross(a, b)
}

#[inline(never)]
fn nearly_parallel_cross(a: DVec3, b: DVec3) -> DVec3 {
    predicates::cross(a, b)
}

/// Returns the point where the line p0 p1 crosses the horizon n·p = 0, computed in twice the
/// precision. The heights of the ends must have opposite signs.
#[cold]
#[inline(never)]
pub(crate) fn on_horizon_by_more_digits([p0, p1]: [DVec3; 2], n: DVec3) -> DVec3 {
    // Compute (n × (p0 × p1))/(n·(p1 − p0)) with the inner cross product in twice the precision, as
    // two parts of each component.
    let part = |i: usize, j: usize| {
        let (p, ep) = predicates::two_product(p0[i], p1[j]);
        let (q, eq) = predicates::two_product(p0[j], p1[i]);
        let (s, es) = predicates::two_sum(p, -q);
        (s, es + (ep - eq))
    };
    let x = [part(1, 2), part(2, 0), part(0, 1)];
    let span = predicates::dot(n, p1) - predicates::dot(n, p0);
    let component = |i: usize, j: usize| {
        let high = predicates::diff_of_products(n[i], x[j].0, n[j], x[i].0);
        (high + (n[i] * x[j].1 - n[j] * x[i].1)) / span
    };
    DVec3::new(component(1, 2), component(2, 0), component(0, 1))
}

/// Returns the coefficients ±1/(2k + first)! of a Taylor series in x²: of the sine for `first` = 1,
/// of the cosine for 0, and of (x − sin x)/x³ for 3.
const fn taylor(first: u32) -> [f64; 8] {
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

/// Returns the value of a polynomial of degree 7.
#[inline(always)]
fn eight(c: &[f64; 8], y: f64) -> f64 {
    let z = y * y;
    let low = (c[0] + y * c[1]) + z * (c[2] + y * c[3]);
    let high = (c[4] + y * c[5]) + z * (c[6] + y * c[7]);
    low + (z * z) * high
}

/// Returns `(x − sin x)/x³` from y = x², for |x| ≤ 1: the next term is 1/19!, 6e-17 of the sum.
#[inline(always)]
pub(crate) fn sine_remainder(y: f64) -> f64 {
    eight(const { &taylor(3) }, y)
}

/// Returns `sin(x)/x` and `cos x` from y = x², for |x| ≤ ½: the next terms are below 2^-16/17! and
/// 2^-16/16!.
#[inline(always)]
pub(crate) fn sine_and_cosine(y: f64) -> (f64, f64) {
    (
        eight(const { &taylor(1) }, y),
        eight(const { &taylor(0) }, y),
    )
}

/// The numerator and the denominator, as polynomials in x², of a quotient for atan(x)/x on |x| ≤ 1.
/// It interpolates at Chebyshev's points and was found with 60 digits; its relative error is 5e-17.
const ARC_TANGENT: [[f64; 7]; 2] = [
    [
        1.0,
        2.481_724_209_061_851,
        2.234_915_476_501_942_3,
        0.888_660_069_119_356,
        0.150_858_549_007_864_7,
        0.008_671_322_302_831_24,
        7.270_489_172_902_097e-5,
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
pub(crate) struct Angle {
    pub v: f64,
    pub s: f64,
    pub c: f64,
}

/// Returns twice the angle whose tangent is a/b, in [0, π], with its sine and cosine, for a ≥ 0 and
/// b ≥ 0 that are not both zero. The angle and its sine have relative errors of a few ε; there are
/// two divisions and no branches.
#[inline(always)]
pub(crate) fn double_angle(a: f64, b: f64) -> Angle {
    let r = a.at_most(b) / a.at_least(b);
    let y = r * r;
    let (z2, z4) = (y * y, (y * y) * (y * y));
    let sum = |c: &[f64; 7]| {
        let low = (c[0] + y * c[1]) + z2 * (c[2] + y * c[3]);
        low + z4 * ((c[4] + y * c[5]) + z2 * c[6])
    };
    let [p, q] = [sum(&ARC_TANGENT[0]), sum(&ARC_TANGENT[1])];
    let z = 1.0 + y;
    let w = 1.0 / (z * q);
    let (v, s) = ((r + r) * p * (z * w), (r + r) * (q * w));
    let c = (1.0 - y) * (q * w);
    Angle {
        v: if a > b { core::f64::consts::PI - v } else { v },
        s,
        c: if a > b { -c } else { c },
    }
}

/// Returns (sin, cos) of the sum of two angles.
#[inline(always)]
pub(crate) fn rotate(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    (a.0 * b.1 + a.1 * b.0, a.1 * b.1 - a.0 * b.0)
}
/// The sine and the cosine of k/2.
const HALVES: [(f64, f64); 8] = [
    (0.0, 1.0),
    (0.479_425_538_604_203, 0.877_582_561_890_372_8),
    (0.841_470_984_807_896_5, 0.540_302_305_868_139_8),
    (0.997_494_986_604_054_4, 0.070_737_201_667_702_9),
    (0.909_297_426_825_681_7, -0.416_146_836_547_142_4),
    (0.598_472_144_103_956_5, -0.801_143_615_546_933_7),
    (0.141_120_008_059_867_2, -0.989_992_496_600_445_4),
    (-0.350_783_227_689_619_84, -0.936_456_687_290_796_3),
];

/// Returns (sin, cos) of a step, |x| ≤ π, by Taylor sums; large steps are expanded about a multiple
/// of ½.
#[inline]
pub(crate) fn step_sin_cos(x: f64) -> (f64, f64) {
    if x.abs() <= 0.5 {
        let (s, c) = sine_and_cosine(x * x);
        return (x * s, c);
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between 0 and 7"
    )]
    let (k, half) = {
        let k = ((2.0 * x.abs()).round() as usize).min(7);
        (k, 0.5 * k as f64)
    };
    let rest = x.abs() - half;
    let (s, c) = sine_and_cosine(rest * rest);
    let (s, c) = rotate((HALVES[k].0, HALVES[k].1), (rest * s, c));
    (if x > 0.0 { s } else { -s }, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative errors to 6 ε: ten operations, half of which can add up.
    #[test]
    fn angles_are_those_of_the_library() {
        let close = |a: f64, b: f64| (a - b).abs() <= 6.0 * f64::EPSILON * b.abs();
        for i in 0..20_000 {
            // tan from 1e-10 to 1e10.
            let t = 10_f64.powf(f64::from(i) / 1000.0 - 10.0);
            let at = double_angle(t, 1.0);
            let v = 2.0 * t.atan();
            assert!(close(at.v, v), "{t} {} {v}", at.v);
            assert!(close(at.s, 2.0 * t / (1.0 + t * t)), "{t}");
            // Absolutely: the cosine has a zero.
            assert!((at.c - v.cos()).abs() < 4.0 * f64::EPSILON, "{t}");
            let x = f64::from(i - 10_000) * 3.14e-4;
            let (s, c) = step_sin_cos(x);
            assert!((s - x.sin()).abs() < 2.0 * f64::EPSILON, "{x} {s}");
            assert!((c - x.cos()).abs() < 2.0 * f64::EPSILON, "{x} {c}");
        }
        assert_eq!(double_angle(0.0_f64, 1.0).v.to_bits(), 0);
        assert!((double_angle(1.0, 0.0).v - core::f64::consts::PI).abs() < 1e-15);
    }
}
