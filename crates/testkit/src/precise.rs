//! Real numbers of 77 digits (256 bits), or of any other number of bits, for the few cases that
//! must be beyond doubt.
//!
//! They are a thin wrapper of `dashu-float`: correctly rounded arithmetic at a number of bits,
//! exact conversion from `f64`, decimal text in and out. They are about 10⁴ times slower than
//! `f64`; [`crate::dd`] is faster.

use crate::real::Real;
use dashu_float::round::mode::HalfEven;
use dashu_float::{DBig, FBig};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::str::FromStr;

/// A real number rounded to 256 bits after each operation: 77 decimal digits.
pub type Precise = Wide<256>;

type Big = FBig<HalfEven, 2>;

/// A real number rounded to `BITS` bits after each operation.
///
/// ```
/// use linelit_testkit::{precise::Precise, real::Real};
/// let root = Precise::new(2.0).sqrt();
/// assert!((root.clone() * root - Precise::new(2.0)).abs().to_f64() < 1e-76);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Wide<const BITS: usize>(Big);

impl<const BITS: usize> Wide<BITS> {
    /// Reads the number of a decimal text, such as `"2.05e-60462"`, which may be far beyond the
    /// range of `f64`.
    ///
    /// # Errors
    /// The text and the reason, if it is not a number.
    pub fn parse(text: &str) -> Result<Self, String> {
        let decimal = DBig::from_str(text).map_err(|e| format!("{text:?}: {e}"))?;
        Ok(Self(
            decimal
                .with_base_and_precision::<2>(BITS)
                .value()
                .with_rounding(),
        ))
    }

    /// Returns |got − self| / max(|self|, scale) as `f64`: the scaled error of a computed `got`.
    pub fn scaled_error(&self, got: f64, scale: f64) -> f64 {
        let size = self.abs().to_f64().max(scale);
        if !got.is_finite() {
            return f64::INFINITY;
        }
        let difference = (Self::new(got) - self.clone()).abs().to_f64();
        if difference == 0.0 {
            0.0
        } else {
            difference / size
        }
    }
}

impl<const BITS: usize> Real for Wide<BITS> {
    /// # Panics
    /// If `x` is NaN or infinite.
    fn new(x: f64) -> Self {
        let exact = Big::try_from(x).expect("a finite number");
        Self(exact.with_precision(BITS).value())
    }
    fn to_f64(&self) -> f64 {
        self.0.to_f64().value()
    }
    fn sqrt(&self) -> Self {
        Self(self.0.sqrt())
    }
    fn sin(&self) -> Self {
        Self(self.0.sin())
    }
    fn cos(&self) -> Self {
        Self(self.0.cos())
    }
    fn atan2(&self, x: &Self) -> Self {
        Self(self.0.atan2(&x.0))
    }
    fn exp(&self) -> Self {
        Self(self.0.exp())
    }
    fn ln(&self) -> Self {
        Self(self.0.ln())
    }
    fn pi() -> Self {
        Self(Big::pi(BITS))
    }
}

impl<const BITS: usize> Add for Wide<BITS> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl<const BITS: usize> Sub for Wide<BITS> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl<const BITS: usize> Mul for Wide<BITS> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl<const BITS: usize> Div for Wide<BITS> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl<const BITS: usize> Neg for Wide<BITS> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl<const BITS: usize> PartialOrd for Wide<BITS> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.partial_cmp(&other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 60 digits each, from the literature (OEIS A000796, A001113, A002162, A002193).
    #[test]
    fn sixty_digits() {
        let cases = [
            (
                Precise::pi(),
                "3.14159265358979323846264338327950288419716939937510582097494",
            ),
            (
                Precise::new(1.0).exp(),
                "2.71828182845904523536028747135266249775724709369995957496696",
            ),
            (
                Precise::new(2.0).ln(),
                "0.693147180559945309417232121458176568075500134360255254120680",
            ),
            (
                Precise::new(2.0).sqrt(),
                "1.41421356237309504880168872420969807856967187537694807317667",
            ),
            (
                Precise::new(1.0).atan2(&Precise::new(-1.0)) / Precise::new(0.75),
                "3.14159265358979323846264338327950288419716939937510582097494",
            ),
            (
                Precise::new(0.5).asin() * Precise::new(6.0),
                "3.14159265358979323846264338327950288419716939937510582097494",
            ),
        ];
        for (got, want) in cases {
            let difference = (got - Precise::parse(want).unwrap()).abs().to_f64();
            assert!(difference < 1e-58, "{want}: off by {difference:e}");
        }
    }

    #[test]
    fn pythagoras_and_cancellation() {
        let x = Precise::new(1.234_567);
        let one = x.sin().powi(2) + x.cos().powi(2);
        assert!((one - Precise::new(1.0)).abs().to_f64() < 1e-75);
        let tiny = (Precise::new(1.0) + Precise::new(1e-50)) - Precise::new(1.0);
        assert!((tiny.to_f64() / 1e-50 - 1.0).abs() < 1e-15);
        assert_eq!((x.clone() - x).to_f64().to_bits(), 0);
    }

    #[test]
    fn text_and_zero() {
        assert!(Precise::parse("2.05e-60462").unwrap() > Precise::new(0.0));
        assert!(Precise::parse("0.0").unwrap().to_f64().abs() < f64::MIN_POSITIVE);
        assert!(Precise::parse("-1.5").unwrap() == Precise::new(-1.5));
        assert!(Precise::parse("one").is_err());
        assert!(Precise::new(0.0).sqrt().to_f64().abs() < f64::MIN_POSITIVE);
        assert!(
            (Precise::new(0.0) * Precise::new(3.0) + Precise::new(0.1))
                .to_f64()
                .to_bits()
                == 0.1_f64.to_bits()
        );
    }

    #[test]
    fn scaled_error_counts_epsilons() {
        let third = Precise::new(1.0) / Precise::new(3.0);
        assert!(third.scaled_error(1.0 / 3.0, 0.0) < 0.5 * f64::EPSILON);
        assert!(third.scaled_error(0.3, 0.0) > 0.09);
        assert!(third.scaled_error(f64::NAN, 0.0).is_infinite());
    }
}
