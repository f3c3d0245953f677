//! Double-double arithmetic: about 31 digits, fast enough to check a million cases.
//!
//! A [`Dd`] is an unevaluated sum hi + lo with |lo| ≤ ulp(hi)/2. Relative errors (measured against
//! 77-digit evaluation in the tests): + − × ÷ √ below 2⁻¹⁰⁰; sin, cos, atan2, asin, exp, ln below
//! 2⁻⁹⁵ of the result for arguments of moderate size, absolute near the zeros of sin and cos other
//! than 0.
//!
//! Domain: components between about 1e-140 and 1e140 (products of the low parts must not underflow,
//! Dekker's split must not overflow). Source: Dekker (1971); Hida, Li, Bailey, "Library for
//! Double-Double and Quad-Double Arithmetic" (2007); Joldes, Muller, Popescu, "Tight and rigorous
//! error bounds for basic building blocks of double-word arithmetic" (2017).
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use crate::real::Real;
use std::cmp::Ordering;
use std::f64::consts;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::LazyLock;

/// A double-double number hi + lo.
///
/// ```
/// use linelit_testkit::dd::Dd;
/// let third = Dd::from(1.0) / Dd::from(3.0);
/// assert!((third * Dd::from(3.0) - Dd::from(1.0)).hi().abs() < 1e-31);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dd {
    hi: f64,
    lo: f64,
}

/// π/2 in three parts, 159 bits together.
const HALF_PI: [f64; 3] = [
    consts::FRAC_PI_2,
    6.123_233_995_736_766e-17,
    -1.497_384_904_859_169_8e-33,
];

/// 1/n! for n below 30.
static INVERSE_FACTORIALS: LazyLock<[Dd; 30]> = LazyLock::new(|| {
    let mut inverse = [Dd::ONE; 30];
    for n in 1..30 {
        inverse[n] = inverse[n - 1] / Dd::from(n as f64);
    }
    inverse
});

/// 1/(2k + 1) for k below 15.
static INVERSE_ODD: LazyLock<[Dd; 15]> =
    LazyLock::new(|| std::array::from_fn(|k| Dd::ONE / Dd::from(2.0 * k as f64 + 1.0)));

impl Dd {
    /// Zero.
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    /// The number one.
    pub const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    /// π to 106 bits.
    pub const PI: Self = Self {
        hi: consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };
    /// ln 2 to 106 bits.
    pub const LN_2: Self = Self {
        hi: consts::LN_2,
        lo: 2.319_046_813_846_299_6e-17,
    };

    /// Returns a + b exactly (barring overflow), by Knuth's TwoSum: `shadow` is the part of b that
    /// the rounded sum contains, and the two differences are what rounding took from a and from b.
    pub fn sum(a: f64, b: f64) -> Self {
        let hi = a + b;
        let shadow = hi - a;
        Self {
            hi,
            lo: (a - (hi - shadow)) + (b - shadow),
        }
    }

    /// Returns a · b exactly (barring over- and underflow), by Dekker's split, which needs no fused
    /// operation.
    pub fn product(a: f64, b: f64) -> Self {
        let (a1, a0) = split(a);
        let (b1, b0) = split(b);
        let hi = a * b;
        Self {
            hi,
            lo: ((a1 * b1 - hi) + a1 * b0 + a0 * b1) + a0 * b0,
        }
    }

    /// Returns the leading part: the number rounded to `f64`.
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// Returns the trailing part.
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// Returns hi + lo normalized, for |hi| ≥ |lo|.
    fn fast_sum(hi: f64, lo: f64) -> Self {
        let sum = hi + lo;
        Self {
            hi: sum,
            lo: lo - (sum - hi),
        }
    }

    /// Multiplies by a power of two, exactly.
    fn scaled(self, power_of_two: f64) -> Self {
        Self {
            hi: self.hi * power_of_two,
            lo: self.lo * power_of_two,
        }
    }

    /// Returns |x|.
    pub fn abs(self) -> Self {
        if self.hi < 0.0 { -self } else { self }
    }

    /// Returns √x, by one Newton step from the rounded root; NaN for x < 0.
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return if self.hi == 0.0 {
                Self::ZERO
            } else {
                Self {
                    hi: f64::NAN,
                    lo: 0.0,
                }
            };
        }
        let root = self.hi.sqrt();
        let rest = self - Self::product(root, root);
        Self::fast_sum(root, rest.hi / (2.0 * root))
    }

    /// Returns (sin x, cos x), for |x| up to about 10⁶ (reduction by 159 bits of π/2).
    pub fn sin_cos(self) -> (Self, Self) {
        // Subtract multiples of π/2, and sum the series of what remains.
        let quarter = (self.hi / consts::FRAC_PI_2).round();
        let mut r = self;
        if quarter != 0.0 {
            for part in HALF_PI {
                r = r - Self::product(quarter, part);
            }
        }
        let (s, c) = (r.sin_series(), r.cos_series());
        // Rotate by the quarter turns.
        match quarter.rem_euclid(4.0) {
            0.0 => (s, c),
            1.0 => (c, -s),
            2.0 => (-s, -c),
            _ => (-c, s),
        }
    }

    /// Taylor series of sin on |x| ≤ π/4.
    fn sin_series(self) -> Self {
        self * Self::alternating(self * self, 1)
    }

    /// Taylor series of cos on |x| ≤ π/4.
    fn cos_series(self) -> Self {
        Self::alternating(self * self, 0)
    }

    /// Returns Σₖ (−y)ᵏ/(2k + first)!, by Horner's method from term 14 (for |y| ≤ π²/16 the next
    /// term is below 2⁻¹¹⁰).
    fn alternating(y: Self, first: usize) -> Self {
        let inverse = &*INVERSE_FACTORIALS;
        let horner = |sum: Self, k: usize| inverse[2 * k + first] - sum * y;
        (0..14).rev().fold(inverse[28 + first], horner)
    }

    /// Returns sin x; see [`Dd::sin_cos`].
    pub fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Returns cos x; see [`Dd::sin_cos`].
    pub fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Returns the angle of the point (x, y) = (`x`, `self`) in (−π, π]; atan2(0, 0) = 0.
    ///
    /// The `f64` angle θ is corrected once by the sine of the remaining angle, (y cos θ − x sin
    /// θ)/r, which converges cubically.
    pub fn atan2(self, x: Self) -> Self {
        if self.hi == 0.0 {
            return if x.hi < 0.0 { Self::PI } else { Self::ZERO };
        }
        if self.hi < 0.0 {
            return -(-self).atan2(x);
        }
        if x.hi < 0.0 {
            // Near π, a small y would be lost in the f64 start value: use the supplement.
            return Self::PI - self.atan2(-x);
        }
        let start = self.hi.atan2(x.hi);
        let (sin, cos) = Self::from(start).sin_cos();
        let rest = (self * cos - x * sin) / (self * sin + x * cos);
        Self::from(start) + rest
    }

    /// Returns arcsin x for |x| ≤ 1.
    pub fn asin(self) -> Self {
        self.atan2(((Self::ONE - self) * (Self::ONE + self)).sqrt())
    }

    /// Returns arccos x for |x| ≤ 1.
    pub fn acos(self) -> Self {
        ((Self::ONE - self) * (Self::ONE + self)).sqrt().atan2(self)
    }

    /// Returns eˣ: reduction by ln 2 and 2⁻⁸, Taylor series of eˣ − 1, eight doublings. It is zero
    /// below −745 and infinite above 710.
    pub fn exp(self) -> Self {
        if self.hi > 709.7 || self.hi < -745.0 {
            return Self {
                hi: if self.hi > 0.0 { f64::INFINITY } else { 0.0 },
                lo: 0.0,
            };
        }
        // Reduce the argument.
        let binary = (self.hi / consts::LN_2).round();
        let r = (self - Self::LN_2 * Self::from(binary)).scaled(1.0 / 256.0);
        // r| ≤ 0.00136: the term of r¹² is below 2⁻¹³⁰.
        let inverse = &*INVERSE_FACTORIALS;
        let sum = (1..11)
            .rev()
            .fold(inverse[11], |sum, k| inverse[k] + sum * r);
        // Double eight times: e²ʳ − 1 = 2(eʳ − 1) + (eʳ − 1)².
        let mut less_one = sum * r;
        for _ in 0..8 {
            less_one = less_one.scaled(2.0) + less_one * less_one;
        }
        // Scale by the power of two in two steps, as 2^1024 is not a number.
        let half = (0.5 * binary).floor();
        (Self::ONE + less_one)
            .scaled(half.exp2())
            .scaled((binary - half).exp2())
    }

    /// Returns ln x for x > 0, near 1 by the series of artanh, elsewhere by one Halley step from
    /// the `f64` logarithm.
    pub fn ln(self) -> Self {
        if self.hi <= 0.0 {
            return Self {
                hi: if self.hi == 0.0 {
                    f64::NEG_INFINITY
                } else {
                    f64::NAN
                },
                lo: 0.0,
            };
        }
        if (self.hi - 1.0).abs() < 0.1 {
            // ln x = 2 artanh((x − 1)/(x + 1)) = 2 (s + s³/3 + s⁵/5 + …).
            let s = (self - Self::ONE) / (self + Self::ONE);
            let y = s * s;
            let sum = (0..15)
                .rev()
                .fold(Self::ZERO, |sum, k| INVERSE_ODD[k] + sum * y);
            return (s * sum).scaled(2.0);
        }
        let start = Self::from(self.hi.ln());
        let e = start.exp();
        start + ((self - e) / (self + e)).scaled(2.0)
    }
}

/// Splits a number into 26 + 27 bits (Dekker).
fn split(a: f64) -> (f64, f64) {
    const FACTOR: f64 = 134_217_729.0; // 2^27 + 1
    let c = FACTOR * a;
    let high = c - (c - a);
    (high, a - high)
}

impl From<f64> for Dd {
    fn from(x: f64) -> Self {
        Self { hi: x, lo: 0.0 }
    }
}

impl Neg for Dd {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Add for Dd {
    type Output = Self;
    /// Joldes et al., algorithm 6 (AccurateDWPlusDW): relative error ≤ 3·2⁻¹⁰⁶, also under
    /// cancellation.
    fn add(self, other: Self) -> Self {
        let high = Self::sum(self.hi, other.hi);
        let low = Self::sum(self.lo, other.lo);
        let first = Self::fast_sum(high.hi, high.lo + low.hi);
        Self::fast_sum(first.hi, low.lo + first.lo)
    }
}

impl Sub for Dd {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Dd {
    type Output = Self;
    /// Joldes et al., algorithm 10 (DWTimesDW1): relative error ≤ 5·2⁻¹⁰⁶.
    fn mul(self, other: Self) -> Self {
        let high = Self::product(self.hi, other.hi);
        Self::fast_sum(high.hi, high.lo + (self.hi * other.lo + self.lo * other.hi))
    }
}

impl Div for Dd {
    type Output = Self;
    /// Long division with three quotient digits (Hida et al., §2.3).
    fn div(self, other: Self) -> Self {
        let first = self.hi / other.hi;
        if !first.is_finite() || first == 0.0 {
            return Self::from(first);
        }
        let rest = self - other * Self::from(first);
        let second = rest.hi / other.hi;
        let rest = rest - other * Self::from(second);
        let third = rest.hi / other.hi;
        Self::fast_sum(first, second) + Self::from(third)
    }
}

impl PartialOrd for Dd {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.hi.partial_cmp(&other.hi)? {
            Ordering::Equal => self.lo.partial_cmp(&other.lo),
            order => Some(order),
        }
    }
}

impl Real for Dd {
    fn new(x: f64) -> Self {
        Self::from(x)
    }
    fn to_f64(&self) -> f64 {
        self.hi
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
        Self::PI
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::precise::Precise;
    use crate::rng::SplitMix64;

    fn precise(x: Dd) -> Precise {
        Precise::new(x.hi) + Precise::new(x.lo)
    }

    /// |got − want| / scale as a power of two.
    fn error(got: Dd, want: &Precise, scale: &Precise) -> f64 {
        ((precise(got) - want.clone()).abs() / scale.abs()).to_f64()
    }

    fn random(rng: &mut SplitMix64, low: f64, high: f64) -> Dd {
        Dd::fast_sum(
            rng.in_range(low, high),
            rng.in_range(-1.0, 1.0) * 1e-17 * low.abs().max(1e-3),
        )
    }

    #[test]
    fn arithmetic_to_100_bits() {
        let mut rng = SplitMix64::new(1);
        for _ in 0..500 {
            let (a, b) = (random(&mut rng, -9.0, 9.0), random(&mut rng, 1e-3, 1e3));
            let (pa, pb) = (precise(a), precise(b));
            let bound = 2f64.powi(-100);
            for (got, want) in [
                (a + b, pa.clone() + pb.clone()),
                (a - b, pa.clone() - pb.clone()),
                (a * b, pa.clone() * pb.clone()),
                (a / b, pa.clone() / pb.clone()),
                (b.sqrt(), pb.sqrt()),
            ] {
                assert!(error(got, &want, &want) < bound, "{a:?} {b:?}: {got:?}");
            }
        }
    }

    #[test]
    fn functions_to_95_bits() {
        let mut rng = SplitMix64::new(2);
        let bound = 2f64.powi(-95);
        let one = Precise::new(1.0);
        for i in 0..300 {
            let spread = 10f64.powi(i % 7 - 4);
            let x = random(&mut rng, -spread, spread);
            let p = precise(x);
            assert!(
                error(x.sin(), &p.sin(), &p.sin()) < bound.max(1e-31 * spread),
                "sin {x:?}"
            );
            assert!(error(x.cos(), &p.cos(), &one) < bound, "cos {x:?}");
            if spread < 200.0 {
                assert!(
                    error(x.exp(), &p.exp(), &p.exp()) < bound * spread.max(1.0),
                    "exp {x:?}"
                );
            }
            let y = random(&mut rng, -1.0, 1.0);
            let q = precise(y);
            assert!(
                error(x.atan2(y), &p.atan2(&q), &p.atan2(&q)) < bound,
                "atan2 {x:?} {y:?}"
            );
            assert!(error(y.asin(), &q.asin(), &q.asin()) < bound, "asin {y:?}");
            assert!(error(y.acos(), &q.acos(), &q.acos()) < bound, "acos {y:?}");
            let positive = Dd::ONE + x.abs();
            let want = precise(positive).ln();
            assert!(
                error(positive.ln(), &want, &want) < bound,
                "ln {positive:?}"
            );
        }
        // Small numbers, where the f64 logarithm starts far from zero.
        let tiny = Dd::from(1e-100);
        assert!(error(tiny.ln(), &Precise::new(1e-100).ln(), &one) < bound * 230.0);
    }

    #[test]
    fn quadrants_and_degenerate_values() {
        assert_eq!(Dd::ZERO.atan2(Dd::from(-1.0)), Dd::PI);
        assert_eq!(Dd::ZERO.atan2(Dd::ONE), Dd::ZERO);
        assert!(
            (Dd::from(-1.0).atan2(Dd::from(-1.0)) + Dd::PI * Dd::from(0.75))
                .abs()
                .hi
                < 1e-31
        );
        assert_eq!(Dd::ZERO.sqrt(), Dd::ZERO);
        assert!(Dd::from(-1.0).sqrt().hi.is_nan());
        assert_eq!(Dd::from(-800.0).exp(), Dd::ZERO);
        assert!(Dd::sum(1.0, 1e-30) > Dd::ONE);
    }
}
