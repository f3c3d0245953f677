//! The operations that kernels are written in.

/// An instruction set, as the operations it has on eight lanes of `f32` ([`Simd::F`]) and `f64`
/// ([`Simd::D`]); a value of it is proof that the processor has the instructions.
///
/// Every operation rounds the same way on every set, so kernels give the same bits on every
/// machine, and do the same work. Masks of `f32` are bits of a byte, lane 0 in the lowest; masks of
/// `f64` have a type ([`Simd::M`]), for some sets keep them in registers.
pub trait Simd: Copy {
    /// Eight `f32`.
    type F: Copy;
    /// Eight `f64`.
    type D: Copy;
    /// Eight truth values for `D`.
    type M: Copy;

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
    /// `a + b` of each lane.
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a − b` of each lane.
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a · b` of each lane.
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a / b` of each lane.
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
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
    /// As [`Simd::compress`].
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
    /// One number in all lanes.
    fn dsplat(self, a: f64) -> Self::D;
    /// The same numbers as `f64`.
    fn widen(self, a: Self::F) -> Self::D;
    /// Rounded to the nearest `f32`.
    fn narrow(self, a: Self::D) -> Self::F;
    /// `a + b` of each lane.
    fn dadd(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a − b` of each lane.
    fn dsub(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a · b` of each lane.
    fn dmul(self, a: Self::D, b: Self::D) -> Self::D;
    /// `a / b` of each lane.
    fn ddiv(self, a: Self::D, b: Self::D) -> Self::D;
    /// The lesser of each lane; `b` where either is NaN.
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D;
    /// The greater of each lane; `b` where either is NaN.
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D;
    /// Where `a ≤ b`; false for NaN.
    fn dle(self, a: Self::D, b: Self::D) -> Self::M;
    /// Where `a < b`; false for NaN.
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M;
    /// `b` where `m`, else `a`.
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D;
    /// Where both are.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// Where either is.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Where it is not.
    fn not(self, a: Self::M) -> Self::M;
    /// A bit for each lane.
    fn bits(self, a: Self::M) -> u8;
    /// As [`Simd::compress`].
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize);
}
