//! The operations that kernels are written in.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// Numbers side by side: one `T`, or eight; `+ − · /` work on each, with such or with a single `T`.
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

/// The number of `f64` that a formula works on at once: [`One`](crate::One), or eight ([`Simd`]).
///
/// A formula that is generic over it is its own scalar twin: one text, and the same bits. Every
/// operation rounds the same way everywhere; nothing is fused.
///
/// ```
/// use linelit_simd::{Lanes, One};
/// fn hypotenuse<L: Lanes>(l: L, a: L::D, b: L::D) -> L::D {
///     l.dsqrt(a * a + b * b)
/// }
/// assert_eq!(hypotenuse(One, 3.0, 4.0), 5.0);
/// ```
pub trait Lanes: Copy {
    /// The numbers.
    type D: Numbers<f64>;
    /// A truth value for each.
    type M: Copy + BitAnd<Output = Self::M> + BitOr<Output = Self::M> + Not<Output = Self::M>;

    /// One number in all lanes.
    fn dsplat(self, a: f64) -> Self::D;
    /// The lesser of each lane; `b` where either is NaN.
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D;
    /// The greater of each lane; `b` where either is NaN.
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D;
    /// √a of each lane.
    fn dsqrt(self, a: Self::D) -> Self::D;
    /// Compares lanes: `a ≤ b`; false for NaN.
    fn dle(self, a: Self::D, b: Self::D) -> Self::M;
    /// Compares lanes: `a < b`; false for NaN.
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M;
    /// `b` where `m`, else `a`.
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D;
    /// 2ⁿ for integers −1022 ≤ n ≤ 1023, given as n + 1.5·2⁵².
    fn exp2(self, n: Self::D) -> Self::D;

    /// Returns the same numbers, at one point of the program: chains of operations that end in them
    /// stay side by side, where a compiler would put one behind the other, further than the
    /// processor looks ahead.
    #[inline(always)]
    fn abreast<const N: usize>(self, a: [Self::D; N]) -> [Self::D; N] {
        a
    }

    /// Two polynomials of degree seven at `s`: the coefficients of sᵏ are `c[k]`.
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

/// An instruction set, as the operations it has on eight `f64` ([`Lanes::D`]) and eight `f32`
/// ([`Simd::F`]); a value of it is proof that the processor has the instructions.
///
/// Every operation rounds the same way on every set, so kernels give the same bits on every
/// machine, and do the same work. Masks of `f32` are bits of a byte, lane 0 in the lowest; masks of
/// `f64` have a type ([`Lanes::M`]), for some sets keep them in registers.
pub trait Simd: Lanes {
    /// Eight `f32`.
    type F: Numbers<f32>;

    /// Calls `f`, compiled with these instructions if it is `#[inline(always)]`.
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R;

    /// Asks for the memory of `a` ahead of time.
    fn prefetch<T>(self, a: &T);

    /// Eight numbers from memory.
    fn load(self, a: &[f32; 8]) -> Self::F;
    /// Eight numbers to memory.
    fn store(self, a: Self::F, out: &mut [f32; 8]);
    /// One number in all lanes.
    fn splat(self, a: f32) -> Self::F;
    /// `a·b + c`, rounded once. Slow without an instruction for it.
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a·b − c`, rounded once. Slow without an instruction for it.
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// The lesser of each lane; `b` where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// The greater of each lane; `b` where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    /// `|a|` of each lane.
    fn abs(self, a: Self::F) -> Self::F;
    /// A bit for each lane with `a ≤ b`; none for NaN.
    fn le(self, a: Self::F, b: Self::F) -> u8;
    /// A bit for each lane with `a < b`; none for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> u8;
    /// Writes the lanes of `m` one after the other to `out[at..]`, and anything to the rest of the
    /// eight places there, which must exist.
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize);
    /// Packs `u32` lanes as [`Simd::compress`] does.
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize);
    /// Numbers whose bits from `first` to `last` are set; both ends are given as 2²³ plus a number
    /// below 64.
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]);
    /// A bit for each lane that shares a set bit with `b`.
    fn intersects(self, a: &[u64; 8], b: u64) -> u8;
    /// A bit for each lane that is in `start .. start + len` (wrapping).
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8;

    /// Eight numbers from memory.
    fn dload(self, a: &[f64; 8]) -> Self::D;
    /// Eight numbers to memory.
    fn dstore(self, a: Self::D, out: &mut [f64; 8]);
    /// Converts lanes to `f64`.
    fn widen(self, a: Self::F) -> Self::D;
    /// Rounded to the nearest `f32`.
    fn narrow(self, a: Self::D) -> Self::F;
    /// A bit for each lane.
    fn bits(self, a: Self::M) -> u8;
    /// Packs `f64` lanes as [`Simd::compress`] does.
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize);
    /// The sum of all lanes: of those four apart first, then of those one apart, then of the rest.
    fn dsum(self, a: Self::D) -> f64;
}
