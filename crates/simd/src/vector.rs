//! The traits [`Lanes`] and [`Simd`]: the operations in which kernels are written.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// One `T` or a vector of eight. `+ − · /` work lane by lane; `+ − ·` also accept a single `T` on
/// the right.
pub trait Numbers<T>:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<T, Output = Self>
    + Sub<T, Output = Self>
    + Mul<T, Output = Self>
{
}

impl<T, V> Numbers<T> for V where
    V: Copy
        + Add<Output = Self>
        + Sub<Output = Self>
        + Mul<Output = Self>
        + Div<Output = Self>
        + Add<T, Output = Self>
        + Sub<T, Output = Self>
        + Mul<T, Output = Self>
{
}

/// The number of `f64` that a formula computes at once: `One`, or eight ([`Simd`]).
///
/// A formula that is generic over this trait is its own scalar version: there is one source for
/// both, and their results are bit-identical. Every operation rounds in the same way everywhere,
/// and operations are never fused.
///
/// ```
/// use linelit_simd::{Lanes, One};
/// fn hypotenuse<L: Lanes>(l: L, a: L::D, b: L::D) -> L::D {
///     l.dsqrt(a * a + b * b)
/// }
/// assert_eq!(hypotenuse(One, 3.0, 4.0), 5.0);
/// ```
pub trait Lanes: Copy {
    /// The numbers of all lanes.
    type D: Numbers<f64>;
    /// A truth value for each lane.
    type M: Copy + BitAnd<Output = Self::M> + BitOr<Output = Self::M> + Not<Output = Self::M>;

    /// Returns a vector with the same number in all lanes.
    fn dsplat(self, a: f64) -> Self::D;
    /// Returns the minimum in each lane; `b` where either is NaN.
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D;
    /// Returns the maximum in each lane; `b` where either is NaN.
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D;
    /// Returns the square root in each lane.
    fn dsqrt(self, a: Self::D) -> Self::D;
    /// Compares lanes: `a ≤ b`; false for NaN.
    fn dle(self, a: Self::D, b: Self::D) -> Self::M;
    /// Compares lanes: `a < b`; false for NaN.
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M;
    /// Returns in each lane `b` where `m` is true, otherwise `a`.
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D;
    /// Returns 2ⁿ for integers −1022 ≤ n ≤ 1023, which are given as n + 1.5·2⁵².
    fn exp2(self, n: Self::D) -> Self::D;

    /// Returns the same numbers, but requires all of them at one point of the program. Independent
    /// chains of operations that end here stay interleaved; otherwise a compiler may put one after
    /// the other, further apart than the processor looks ahead.
    #[inline(always)]
    fn abreast<const N: usize>(self, a: [Self::D; N]) -> [Self::D; N] {
        a
    }

    /// Evaluates two polynomials of degree seven at `s`; `c[k]` are their coefficients of sᵏ.
    ///
    /// Four terms are summed at a time, from the lowest: `(c₀ + c₁ s) + (c₂ + c₃ s) s²`.
    #[inline(always)]
    fn polynomials(self, c: &[[f64; 2]; 8], s: Self::D) -> [Self::D; 2] {
        let s2 = s * s;
        let s4 = s2 * s2;
        let mut sums = [s; 2];
        for (j, sum) in sums.iter_mut().enumerate() {
            let low = (s * c[1][j] + c[0][j]) + (s * c[3][j] + c[2][j]) * s2;
            let high = (s * c[5][j] + c[4][j]) + (s * c[7][j] + c[6][j]) * s2;
            *sum = low + high * s4;
        }
        sums
    }
}

/// An instruction set, given by its operations on eight `f64` ([`Lanes::D`]) and eight `f32`
/// ([`Simd::F`]). A value of it is proof that the processor has the instructions.
///
/// Every operation rounds in the same way on every instruction set, so that kernels give the same
/// bits on every machine, and do the same work. Masks for `f32` are bits of a byte, with lane 0 in
/// the lowest; masks for `f64` have a type of their own ([`Lanes::M`]), since some instruction sets
/// keep them in registers.
pub trait Simd: Lanes {
    /// Eight numbers of type `f32`.
    type F: Numbers<f32>;

    /// Calls `f`, compiled with these instructions if it is `#[inline(always)]`.
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R;

    /// Prefetches the memory of `a`.
    fn prefetch<T>(self, a: &T);

    /// Loads eight numbers from memory.
    fn load(self, a: &[f32; 8]) -> Self::F;
    /// Stores eight numbers to memory.
    fn store(self, a: Self::F, out: &mut [f32; 8]);
    /// Returns a vector with the same number in all lanes.
    fn splat(self, a: f32) -> Self::F;
    /// Returns `a·b + c`, rounded once. The operation is slow if the processor has no instruction
    /// for it.
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// Returns `a·b − c`, rounded once. The operation is slow if the processor has no instruction
    /// for it.
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// Returns the minimum in each lane; `b` where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the maximum in each lane; `b` where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// Returns the absolute value in each lane.
    fn abs(self, a: Self::F) -> Self::F;
    /// Returns a mask with a bit for each lane in which `a ≤ b`; the bit is zero for NaN.
    fn le(self, a: Self::F, b: Self::F) -> u8;
    /// Returns a mask with a bit for each lane in which `a < b`; the bit is zero for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> u8;
    /// Writes the lanes in the mask `m` consecutively to `out[at..]`, and arbitrary values to the
    /// rest of the eight entries there, which have to exist.
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize);
    /// Packs `u32` lanes as [`Simd::compress`] does.
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize);
    /// For each lane, stores a mask with the bits from `first` to `last` set; both are given as 2²³
    /// plus a number below 64.
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]);
    /// Returns a mask with a bit for each lane of `a` that has a set bit in common with `b`.
    fn intersects(self, a: &[u64; 8], b: u64) -> u8;
    /// Returns a mask with a bit for each lane of `a` in the range from `start` to `start + len`,
    /// excluding its end, in wrapping arithmetic.
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8;

    /// Loads eight numbers from memory.
    fn dload(self, a: &[f64; 8]) -> Self::D;
    /// Stores eight numbers to memory.
    fn dstore(self, a: Self::D, out: &mut [f64; 8]);
    /// Converts all lanes to `f64`.
    fn widen(self, a: Self::F) -> Self::D;
    /// Rounds all lanes to the nearest `f32`.
    fn narrow(self, a: Self::D) -> Self::F;
    /// Converts truth values to a mask with a bit for each lane.
    fn bits(self, a: Self::M) -> u8;
    /// Packs `f64` lanes as [`Simd::compress`] does.
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize);
    /// Returns the sum of all lanes: lanes that are four apart are added first, then lanes that are
    /// one apart, then the rest.
    fn dsum(self, a: Self::D) -> f64;
}
