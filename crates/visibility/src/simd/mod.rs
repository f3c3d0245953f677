//! Eight lanes of `f32` and `f64` on whatever the processor has.
//!
//! A kernel is written once, generic over [`Simd`], and instantiated per instruction set in
//! [`dispatch`](crate::dispatch). Every operation rounds the same way everywhere, so kernels give
//! the same bits on every machine, and do the same work. [`Simd::fma`] and [`Simd::fms`] are slow
//! without an instruction for them, and used only for the bounds of culling.

mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use scalar::Scalar;

/// An instruction set; a value of it is proof that the processor has it.
pub(crate) trait Simd: Copy {
    /// Eight `f32`.
    type F: Copy;
    /// Eight `f64`.
    type D: Copy;
    /// Eight truth values for `D`.
    type M: Copy;

    /// Asks for the memory of `a` ahead of time.
    fn prefetch<T>(self, a: &T);

    fn load(self, a: &[f32; 8]) -> Self::F;
    fn store(self, a: Self::F, out: &mut [f32; 8]);
    fn splat(self, a: f32) -> Self::F;
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a·b + c`, rounded once.
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a·b − c`, rounded once.
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `b` where either is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `b` where either is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;
    fn abs(self, a: Self::F) -> Self::F;
    /// A bit for each lane with `a ≤ b`; none for NaN.
    fn le(self, a: Self::F, b: Self::F) -> u8;
    /// A bit for each lane with `a < b`; none for NaN.
    fn lt(self, a: Self::F, b: Self::F) -> u8;
    /// Writes the lanes of `m` one after the other to `out[at..]`, and something to the rest of
    /// the eight places there.
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize);
    /// As [`Simd::compress`].
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize);
    /// Numbers with the bits from `first` to `last` set, which are 2²³ plus a number below 64.
    fn spans(self, first: Self::F, last: Self::F, out: &mut [u64; 8]);
    /// A bit for each lane that shares a set bit with `b`.
    fn meets(self, a: &[u64; 8], b: u64) -> u8;
    /// Lanes where both are in `start .. start + len` (wrapping): a bit each.
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8;

    fn dload(self, a: &[f64; 8]) -> Self::D;
    fn dstore(self, a: Self::D, out: &mut [f64; 8]);
    fn dsplat(self, a: f64) -> Self::D;
    fn widen(self, a: Self::F) -> Self::D;
    /// Rounded to the nearest `f32`.
    fn narrow(self, a: Self::D) -> Self::F;
    fn dadd(self, a: Self::D, b: Self::D) -> Self::D;
    fn dsub(self, a: Self::D, b: Self::D) -> Self::D;
    fn dmul(self, a: Self::D, b: Self::D) -> Self::D;
    fn ddiv(self, a: Self::D, b: Self::D) -> Self::D;
    /// `b` where either is NaN.
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D;
    /// `b` where either is NaN.
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D;
    /// False for NaN.
    fn dle(self, a: Self::D, b: Self::D) -> Self::M;
    /// False for NaN.
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M;
    /// `b` where `m`, else `a`.
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D;
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    fn not(self, a: Self::M) -> Self::M;
    fn bits(self, a: Self::M) -> u8;
    /// As [`Simd::compress`].
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize);
}
