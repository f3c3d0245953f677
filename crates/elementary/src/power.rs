//! Exponential, natural logarithm and power, by tables that the compiler computes.
//!
//! They are what lobes spend their time in, and three times as fast as those of libm's that they
//! stand for. **Method**: Tang's (1990, 1991), with the logarithm in two parts for powers after
//! Nagy's of 2018 (Arm's optimized routines): the number is brought near one by a reciprocal of few
//! digits, so that products are exact without fused operations.

use crate::double_double::Wide;

/// Entries of each table, and bits of their number.
const SIZE: usize = 128;
const BITS: u32 = 7;
/// Bits of a mantissa.
const MANTISSA: u32 = 52;

/// Adding and subtracting it rounds to an integer.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// The first digits of ln 2, whose multiples by exponents are exact, and the rest.
const LN2: [f64; 2] = in_two(Wide::LN_2);

/// The step ln 2/128 in two parts.
const STEP: [f64; 2] = in_two(Wide::LN_2.times(1.0 / SIZE as f64));

/// The last bits, which count the entries of a table.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "seven bits are left")]
const fn index(bits: u64) -> usize {
    (bits % SIZE as u64) as usize
}

const fn in_two(value: Wide) -> [f64; 2] {
    let high = value.in_few_digits();
    [high, value.without(high)]
}

/// e^x, for any x.
///
/// **Error**: 0.52 ulp, 1.02 ulp where the result is subnormal. Above 709.79 it is ∞.
///
/// ```
/// use linelit_elementary::exp;
/// assert_eq!(exp(1.0), std::f64::consts::E);
/// assert_eq!(exp(-800.0), 0.0);
/// ```
#[must_use]
#[inline]
pub fn exp(x: f64) -> f64 {
    if x.abs() < 700.0 {
        return exp_near(x, 0.0);
    }
    exp_far(x, 0.0)
}

/// ln x: NaN below zero, −∞ at it.
///
/// **Error**: 0.52 ulp.
///
/// ```
/// use linelit_elementary::ln;
/// assert_eq!(ln(std::f64::consts::E), 1.0);
/// assert!(ln(-1.0).is_nan());
/// ```
#[must_use]
#[inline]
pub fn ln(x: f64) -> f64 {
    if is_ordinary(x) {
        return logarithm(x.to_bits(), 0.0)[0];
    }
    ln_of_odd(x)
}

/// x^y, with the special cases of C's `pow`: x⁰ = 1^y = 1 even where the other is NaN; negative x
/// have whole powers only.
///
/// **Error**: 0.52 ulp, 1.02 ulp where the result is subnormal.
///
/// ```
/// use linelit_elementary::pow;
/// assert_eq!(pow(2.0, 0.5), std::f64::consts::SQRT_2);
/// assert_eq!(pow(-2.0, 3.0), -8.0);
/// ```
#[must_use]
#[inline]
pub fn pow(x: f64, y: f64) -> f64 {
    // Below, the power is 1 to its last digit; beyond, 0 or infinite.
    if is_ordinary(x) && y.abs() > 1e-30 && y.abs() < 1e30 {
        return raise(logarithm(x.to_bits(), 0.0), y);
    }
    pow_of_odd(x, y)
}

/// Whether a number is positive, finite and of full digits.
#[inline(always)]
fn is_ordinary(x: f64) -> bool {
    (f64::MIN_POSITIVE..=f64::MAX).contains(&x)
}

/// Numbers of 2⁻²⁷ of their size, which are exact when multiplied.
#[inline(always)]
fn top(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & !((1 << 27) - 1))
}

/// e^(y (a + b)).
#[inline(always)]
fn raise([a, b]: [f64; 2], y: f64) -> f64 {
    let (y_top, a_top) = (top(y), top(a));
    let high = y_top * a_top;
    let low = (y - y_top) * a_top + y * ((a - a_top) + b);
    if high.abs() < 700.0 {
        return exp_near(high, low);
    }
    exp_far(high, low)
}

/// 2^(j/128) rounded, and the remainder relative to that.
static ROOTS: [[f64; 2]; SIZE] = {
    let mut out = [[0.0; 2]; SIZE];
    let mut j = 0;
    while j < SIZE {
        let root = Wide::LN_2.times(j as f64 / SIZE as f64).exp();
        out[j] = [root.high, root.low / root.high];
        j += 1;
    }
    out
};

/// A power of e in parts: (1 + excess) 2^(n/128).
struct Parts {
    /// The number whose last 52 bits are 2⁵¹ + n.
    shifted: u64,
    root: f64,
    excess: f64,
}

/// The parts of e^(x + low), where the second is small.
#[inline(always)]
fn parts(x: f64, low: f64) -> Parts {
    const PER_STEP: f64 = SIZE as f64 * std::f64::consts::LOG2_E;
    let shifted = x * PER_STEP + SHIFT;
    let n = shifted - SHIFT;
    let r = (x - n * STEP[0]) - (n * STEP[1] - low);
    let shifted = shifted.to_bits();
    let [root, rest] = ROOTS[index(shifted)];
    // e^r - 1 for |r| < ln 2/255 by Taylor: the truncation error is below 6e-19.
    let r2 = r * r;
    let series = r2 * (0.5 + r * (1.0 / 6.0)) + (r2 * r2) * (1.0 / 24.0 + r * (1.0 / 120.0));
    Parts {
        shifted,
        root,
        excess: (rest + r) + series,
    }
}

/// e^(x + low) for |x| < 700, where the second part is small.
#[inline(always)]
fn exp_near(x: f64, low: f64) -> f64 {
    let Parts {
        shifted,
        root,
        excess,
    } = parts(x, low);
    // The whole part of n/128 into the exponent.
    let power = (shifted >> BITS) << MANTISSA;
    let scale = f64::from_bits(root.to_bits().wrapping_add(power));
    scale + scale * excess
}

/// Computes the exponential for any x.
#[cold]
#[inline(never)]
fn exp_far(x: f64, low: f64) -> f64 {
    if x.is_nan() {
        return x;
    }
    if x.abs() >= 746.0 {
        return if x > 0.0 { f64::INFINITY } else { 0.0 };
    }
    let Parts {
        shifted,
        root,
        excess,
    } = parts(x, low);
    let value = root + root * excess;
    // The whole part of n/128 as two powers of two, one of which may be too large or too small.
    let whole = (shifted << (64 - MANTISSA) >> (64 - MANTISSA + BITS)) as i64 - (1 << (51 - BITS));
    let power = |n: i64| f64::from_bits(((n + 1023) as u64) << MANTISSA);
    value * power(whole / 2) * power(whole - whole / 2)
}

/// An entry of the table for a 128th of the numbers between 0.704 and 1.409.
#[derive(Clone, Copy)]
struct Slice {
    /// A reciprocal of those numbers, of 13 bits.
    reciprocal: f64,
    /// The negated logarithm of that reciprocal, in two parts.
    logarithm: [f64; 2],
}

/// The bits of the least of those numbers, chosen such that 1 is in the middle of a slice's
/// logarithms: numbers below it are twice as dense.
const LEAST: u64 = ONE - (ONE_SLICE << SLICE_BITS) - 2 * (1 << SLICE_BITS) / 3;
const ONE: u64 = 1023 << MANTISSA;
/// The slice of 1.
const ONE_SLICE: u64 = 75;
const SLICE_BITS: u32 = MANTISSA - BITS;

/// Adding and subtracting it rounds to a multiple of 2⁻¹².
const TO_13_BITS: f64 = 1.5 * (1_u64 << 40) as f64;

static SLICES: [Slice; SIZE] = {
    let nothing = Slice {
        reciprocal: 1.0,
        logarithm: [0.0; 2],
    };
    let mut out = [nothing; SIZE];
    let mut j = 0;
    while j < SIZE {
        if j != index(ONE_SLICE) {
            let from = f64::from_bits(LEAST + ((j as u64) << SLICE_BITS));
            let to = f64::from_bits(LEAST + ((j as u64 + 1) << SLICE_BITS));
            let middle = 2.0 / (from + to);
            let reciprocal = (middle + TO_13_BITS) - TO_13_BITS;
            let logarithm = in_two(Wide::ln(reciprocal).times(-1.0));
            out[j] = Slice {
                reciprocal,
                logarithm,
            };
        }
        j += 1;
    }
    out
};

/// The logarithm of 2^`more` times a number by its bits: rounded, and the rest.
#[inline(always)]
fn logarithm(bits: u64, more: f64) -> [f64; 2] {
    let above = bits.wrapping_sub(LEAST);
    let slice = SLICES[index(above >> SLICE_BITS)];
    // Signed.
    let exponent = (above as i64) >> MANTISSA;
    let near_one = bits.wrapping_sub((exponent as u64) << MANTISSA);
    let exponent = exponent as f64 + more;
    // Of 21 bits, and the rest, which are 32.
    let first = f64::from_bits((near_one + (1 << 31)) & !((1 << 32) - 1));
    let second = f64::from_bits(near_one) - first;
    // ln(1 + r) with r = a + b; all is exact but for that sum.
    let a = first * slice.reciprocal - 1.0;
    let b = second * slice.reciprocal;
    let r = a + b;
    let whole = exponent * LN2[0] + slice.logarithm[0];
    let sum = whole + r;
    let lost = (whole - sum) + r + (a - r + b);
    // −r²/2: that of the first part, which has 24 bits, is exact.
    let square = -0.5 * a * a;
    let high = sum + square;
    let lost_square = (sum - high) + square - 0.5 * b * (r + a);
    let r2 = r * r;
    let tail = (r * r2) * series(r, r2);
    let low = (exponent * LN2[1] + slice.logarithm[1]) + lost + lost_square + tail;
    let value = high + low;
    [value, (high - value) + low]
}

/// (ln(1 + r) − r + r²/2)/r³ for |r| < 0.0042: to 4e-23/r³.
#[inline(always)]
fn series(r: f64, r2: f64) -> f64 {
    let first = 1.0 / 3.0 - r * (1.0 / 4.0);
    let second = 1.0 / 5.0 - r * (1.0 / 6.0);
    let third = 1.0 / 7.0 - r * (1.0 / 8.0);
    first + r2 * (second + r2 * (third + r2 * (1.0 / 9.0)))
}

/// [`ln`] of what is not ordinary.
#[cold]
#[inline(never)]
fn ln_of_odd(x: f64) -> f64 {
    if x == 0.0 {
        return f64::NEG_INFINITY;
    }
    if x < 0.0 {
        return f64::NAN;
    }
    if x < f64::MIN_POSITIVE {
        return small_logarithm(x)[0];
    }
    // Infinite, or no number.
    x
}

/// The logarithm of a subnormal number.
fn small_logarithm(x: f64) -> [f64; 2] {
    const UP: f64 = (1_u64 << 60) as f64;
    logarithm((x * UP).to_bits(), -60.0)
}

/// [`pow`] of what is not ordinary.
#[allow(clippy::float_cmp, reason = "the special cases are single numbers")]
#[cold]
#[inline(never)]
fn pow_of_odd(x: f64, y: f64) -> f64 {
    if y == 0.0 || x == 1.0 {
        return 1.0;
    }
    if x.is_nan() || y.is_nan() {
        return f64::NAN;
    }
    let whole = y.trunc() == y;
    // 2⁵³ and beyond are even.
    let odd = whole && y.abs() < 9_007_199_254_740_992.0 && y % 2.0 != 0.0;
    let size = x.abs();
    if size == 0.0 || size == f64::INFINITY || y.abs() == f64::INFINITY {
        // Of infinity in place of 0 it is the inverse, and so it is of an inverse exponent.
        let grows = (size > 1.0) == (y > 0.0);
        let value = match () {
            () if size == 1.0 => 1.0,
            () if grows => f64::INFINITY,
            () => 0.0,
        };
        return if x.is_sign_negative() && odd {
            -value
        } else {
            value
        };
    }
    if x < 0.0 && !whole {
        return f64::NAN;
    }
    let log = if size < f64::MIN_POSITIVE {
        small_logarithm(size)
    } else {
        logarithm(size.to_bits(), 0.0)
    };
    // Beyond these bounds the power of any number but 1 is 1, or 0 or infinite.
    let value = raise(log, y.clamp(-1e30, 1e30));
    if x < 0.0 && odd { -value } else { value }
}
