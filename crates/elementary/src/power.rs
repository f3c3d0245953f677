//! The exponential, the natural logarithm and the power, by tables that the compiler computes.
//!
//! Reflection lobes spend most of their time in these functions, which are three times as fast as
//! libm's and replace them. **Method**: Tang's (1990, 1991), with the logarithm in two parts for
//! powers as in Nagy's of 2018 (Arm's optimized routines). An exponential is split as e^x =
//! 2^(n/128) e^r, with 2^(n/128) from a table and a polynomial in the small rest r. For a
//! logarithm, the number is multiplied by a reciprocal of few digits from a table, so that the
//! product is near one and exact without fused operations; a polynomial then gives its logarithm.

use crate::double_double::Wide;

/// The number of entries of each table, and its logarithm to base 2.
const SIZE: usize = 128;
const BITS: u32 = 7;
/// The number of bits of a mantissa.
const MANTISSA: u32 = 52;

/// A number that, added to and then subtracted from another number, rounds it to an integer.
const SHIFT: f64 = 6_755_399_441_055_744.0;

/// The natural logarithm of 2 in two parts: its first digits, whose products with exponents are
/// exact, and the rest.
const LN2: [f64; 2] = in_two(Wide::LN_2);

/// The step ln 2/128, in two parts as [`LN2`].
const STEP: [f64; 2] = in_two(Wide::LN_2.times(1.0 / SIZE as f64));

/// Returns the index of a table's entry, which is in the last bits of a number.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "seven bits are left")]
const fn index(bits: u64) -> usize {
    (bits % SIZE as u64) as usize
}

/// Splits a number into its first digits and the rest.
const fn in_two(value: Wide) -> [f64; 2] {
    let high = value.in_few_digits();
    [high, value.without(high)]
}

/// The exponential e^x, for any x.
///
/// **Error**: 0.52 ulp, and 1.02 ulp where the result is subnormal. Above 709.79 the result is ∞.
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

/// The natural logarithm; NaN for negative numbers, −∞ for zero.
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

/// The power x^y, with the special cases of C's `pow`: x⁰ = 1 and 1^y = 1 even if the other
/// argument is NaN; for negative x, NaN unless y is an integer.
///
/// **Error**: 0.52 ulp, and 1.02 ulp where the result is subnormal.
///
/// ```
/// use linelit_elementary::pow;
/// assert_eq!(pow(2.0, 0.5), std::f64::consts::SQRT_2);
/// assert_eq!(pow(-2.0, 3.0), -8.0);
/// ```
#[must_use]
#[inline]
pub fn pow(x: f64, y: f64) -> f64 {
    // For smaller exponents the power is 1 to its last digit; for larger ones it is 0 or infinite.
    if is_ordinary(x) && y.abs() > 1e-30 && y.abs() < 1e30 {
        return raise(logarithm(x.to_bits(), 0.0), y);
    }
    pow_of_odd(x, y)
}

/// Whether a number is positive and normal: neither zero, subnormal, infinite nor NaN.
#[inline(always)]
fn is_ordinary(x: f64) -> bool {
    (f64::MIN_POSITIVE..=f64::MAX).contains(&x)
}

/// Returns the number without the last 27 bits of its mantissa; products of two such numbers are
/// exact.
#[inline(always)]
fn top(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & !((1 << 27) - 1))
}

/// Computes e^(y (a + b)).
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

/// For each index j, the power 2^(j/128), rounded, and its remainder relative to the power.
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

/// An exponential in parts: (1 + excess) 2^(n/128).
struct Parts {
    /// The number whose last 52 bits are 2⁵¹ + n, after rounding by [`SHIFT`].
    shifted: u64,
    root: f64,
    excess: f64,
}

/// Splits e^(x + low) into parts, for a small `low`.
#[inline(always)]
fn parts(x: f64, low: f64) -> Parts {
    const PER_STEP: f64 = SIZE as f64 * std::f64::consts::LOG2_E;
    let shifted = x * PER_STEP + SHIFT;
    let n = shifted - SHIFT;
    let r = (x - n * STEP[0]) - (n * STEP[1] - low);
    let shifted = shifted.to_bits();
    let [root, rest] = ROOTS[index(shifted)];
    // Compute e^r − 1 for |r| < ln 2/255 by its Taylor series; the truncation error is below 6e-19.
    let r2 = r * r;
    let series = r2 * (0.5 + r * (1.0 / 6.0)) + (r2 * r2) * (1.0 / 24.0 + r * (1.0 / 120.0));
    Parts {
        shifted,
        root,
        excess: (rest + r) + series,
    }
}

/// Computes e^(x + low) for |x| < 700 and a small `low`.
#[inline(always)]
fn exp_near(x: f64, low: f64) -> f64 {
    let Parts {
        shifted,
        root,
        excess,
    } = parts(x, low);
    // Add the integer part of n/128 to the exponent.
    let power = (shifted >> BITS) << MANTISSA;
    let scale = f64::from_bits(root.to_bits().wrapping_add(power));
    scale + scale * excess
}

/// Computes e^(x + low) for any x, including results that are subnormal, zero or infinite.
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
    // Multiply by the integer part of n/128 as two powers of two, since a single one may be out of
    // range.
    let whole = (shifted << (64 - MANTISSA) >> (64 - MANTISSA + BITS)) as i64 - (1 << (51 - BITS));
    let power = |n: i64| f64::from_bits(((n + 1023) as u64) << MANTISSA);
    value * power(whole / 2) * power(whole - whole / 2)
}

/// The entry of the table for one of 128 slices of the numbers between 0.704 and 1.409.
#[derive(Clone, Copy)]
struct Slice {
    /// A reciprocal of the numbers in this slice, with 13 bits.
    reciprocal: f64,
    /// The negative logarithm of the reciprocal, in two parts.
    logarithm: [f64; 2],
}

/// The bits of the least number in the slices. It is chosen such that 1 is in the middle of its
/// slice, measured by logarithms: floating-point numbers below 1 are twice as dense.
const LEAST: u64 = ONE - (ONE_SLICE << SLICE_BITS) - 2 * (1 << SLICE_BITS) / 3;
const ONE: u64 = 1023 << MANTISSA;
/// The index of the slice that contains 1.
const ONE_SLICE: u64 = 75;
const SLICE_BITS: u32 = MANTISSA - BITS;

/// A number that, added to and then subtracted from another number, rounds it to a multiple of
/// 2⁻¹².
const TO_13_BITS: f64 = 1.5 * (1_u64 << 40) as f64;

/// The table of slices. The slice of 1 has the reciprocal 1, so that logarithms of numbers near 1
/// keep a small relative error.
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

/// Returns the logarithm of 2^`more` times the number with these `bits`, as a rounded value and its
/// remainder.
#[inline(always)]
fn logarithm(bits: u64, more: f64) -> [f64; 2] {
    // Split the number into a power of two and a factor near one, in its slice.
    let above = bits.wrapping_sub(LEAST);
    let slice = SLICES[index(above >> SLICE_BITS)];
    // The exponent is signed.
    let exponent = (above as i64) >> MANTISSA;
    let near_one = bits.wrapping_sub((exponent as u64) << MANTISSA);
    let exponent = exponent as f64 + more;
    // Split the factor into its first 21 bits and the other 32.
    let first = f64::from_bits((near_one + (1 << 31)) & !((1 << 32) - 1));
    let second = f64::from_bits(near_one) - first;
    // Multiply by the reciprocal to get 1 + r with r = a + b; everything but this sum is exact.
    let a = first * slice.reciprocal - 1.0;
    let b = second * slice.reciprocal;
    let r = a + b;
    let whole = exponent * LN2[0] + slice.logarithm[0];
    let sum = whole + r;
    let lost = (whole - sum) + r + (a - r + b);
    // Add −r²/2, of which the square of a, which has 24 bits, is exact; then the rest of the
    // series.
    let square = -0.5 * a * a;
    let high = sum + square;
    let lost_square = (sum - high) + square - 0.5 * b * (r + a);
    let r2 = r * r;
    let tail = (r * r2) * series(r, r2);
    let low = (exponent * LN2[1] + slice.logarithm[1]) + lost + lost_square + tail;
    let value = high + low;
    [value, (high - value) + low]
}

/// Returns (ln(1 + r) − r + r²/2)/r³ for |r| < 0.0042, with an error of 4e-23/r³.
#[inline(always)]
fn series(r: f64, r2: f64) -> f64 {
    let first = 1.0 / 3.0 - r * (1.0 / 4.0);
    let second = 1.0 / 5.0 - r * (1.0 / 6.0);
    let third = 1.0 / 7.0 - r * (1.0 / 8.0);
    first + r2 * (second + r2 * (third + r2 * (1.0 / 9.0)))
}

/// Computes [`ln`] of numbers that are not [ordinary](is_ordinary).
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
    // Infinite or NaN.
    x
}

/// Returns the logarithm of a subnormal number, in two parts.
fn small_logarithm(x: f64) -> [f64; 2] {
    const UP: f64 = (1_u64 << 60) as f64;
    logarithm((x * UP).to_bits(), -60.0)
}

/// Computes [`pow`] for arguments that are not ordinary: zeros, infinities, NaN, subnormal or
/// negative numbers, and extreme exponents.
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
    // Numbers from 2⁵³ on are even.
    let odd = whole && y.abs() < 9_007_199_254_740_992.0 && y % 2.0 != 0.0;
    let size = x.abs();
    // Powers of zero and infinity, and infinite exponents.
    if size == 0.0 || size == f64::INFINITY || y.abs() == f64::INFINITY {
        // Replacing 0 by infinity inverts the result, and so does changing the exponent's sign.
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
    // Powers of negative numbers, and of subnormal ones.
    if x < 0.0 && !whole {
        return f64::NAN;
    }
    let log = if size < f64::MIN_POSITIVE {
        small_logarithm(size)
    } else {
        logarithm(size.to_bits(), 0.0)
    };
    // Beyond these limits, the power of any number except 1 is 1, 0 or infinite.
    let value = raise(log, y.clamp(-1e30, 1e30));
    if x < 0.0 && odd { -value } else { value }
}
