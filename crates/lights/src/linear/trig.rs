//! Angles with their sines and cosines, by polynomials: short for what is small, without calls, and
//! the same bits on every machine.

use crate::linear::precision::Real;

/// The coefficients ±1/(2k + first)! of the sine's (first = 1) or cosine's (0) Taylor series in x²,
/// and with first = 3 those of what the sine leaves.
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

/// Numerator and denominator in x² of the quotient for atan(x)/x on |x| ≤ 1 that interpolates at
/// Chebyshev's points, found in 60 digits: relative error 5e-17.
pub(crate) const ARC_TANGENT: [[f64; 7]; 2] = [
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
pub(crate) struct Angle<T> {
    pub v: T,
    pub s: T,
    pub c: T,
}

/// Twice the angle whose tangent is a/b, a ≥ 0, b ≥ 0, not both zero, and its sine and cosine: [0,
/// π]. Relatively accurate to a few ε, the sine too; two divisions and no branch.
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

/// Sine and cosine of k/2.
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

/// (sin, cos) of a step, |x| ≤ π: Taylor sums, about a multiple of ½ where it is large.
#[inline]
pub(crate) fn step_sin_cos<T: Real>(x: T) -> (T, T) {
    if x.abs() <= T::from_f64(0.5) {
        let (s, c) = T::sine_and_cosine(x * x);
        return (x * s, c);
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between 0 and 7"
    )]
    let (k, half) = {
        let k = ((2.0 * x.abs().to_f64()).round() as usize).min(7);
        (k, T::from_f64(0.5 * k as f64))
    };
    let rest = x.abs() - half;
    let (s, c) = T::sine_and_cosine(rest * rest);
    let (s, c) = rotate(
        (T::from_f64(HALVES[k].0), T::from_f64(HALVES[k].1)),
        (rest * s, c),
    );
    (if x > T::ZERO { s } else { -s }, c)
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
