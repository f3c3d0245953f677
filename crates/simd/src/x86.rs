//! The vector operations by intrinsics of AVX-512, and of AVX2 with FMA; all unsafe code of this
//! crate is here.
#![allow(
    unsafe_code,
    reason = "vendor intrinsics, behind tokens that prove they exist"
)]

use crate::{Avx2, Avx512, Lanes, Simd};
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// Eight `f32`, made only by methods of a token.
#[derive(Clone, Copy, Debug)]
pub struct F32x8(__m256);

/// Eight `f64` in one register, made only by methods of a token.
#[derive(Clone, Copy, Debug)]
pub struct F64x8(__m512d);

/// Eight `f64` in two registers, made only by methods of a token.
#[derive(Clone, Copy, Debug)]
pub struct F64x4x2([__m256d; 2]);

/// Eight truth values in two registers, made only by methods of a token.
#[derive(Clone, Copy, Debug)]
pub struct M64x4x2([__m256d; 2]);

/// Defines methods of a token, each of which is one expression of vendor intrinsics.
macro_rules! methods {
    ($($name:ident($($a:ident: $t:ty),*) $(-> $r:ty)? = $e:expr;)*) => {$(
        #[inline(always)]
        fn $name(self, $($a: $t),*) $(-> $r)? {
            // SAFETY: a token exists only where the instructions do; arrays are as long as read.
            unsafe { $e }
        }
    )*};
}

/// Defines operators between two vectors, and between a vector and a number.
macro_rules! operators {
    ($v:ident, $t:ty: $splat:expr; $($trait:ident $name:ident($a:ident, $b:ident) = $e:expr;)*) => {$(
        impl $trait for $v {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let ($a, $b) = (self.0, other.0);
                // SAFETY: such a value exists only where a token did, and the instructions do.
                Self(unsafe { $e })
            }
        }
        impl $trait<$t> for $v {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: $t) -> Self {
                // SAFETY: as above.
                $trait::$name(self, Self(unsafe { $splat(other) }))
            }
        }
    )*};
}

operators! { F32x8, f32: _mm256_set1_ps;
    Add add(a, b) = _mm256_add_ps(a, b);
    Sub sub(a, b) = _mm256_sub_ps(a, b);
    Mul mul(a, b) = _mm256_mul_ps(a, b);
    Div div(a, b) = _mm256_div_ps(a, b);
}
operators! { F64x8, f64: _mm512_set1_pd;
    Add add(a, b) = _mm512_add_pd(a, b);
    Sub sub(a, b) = _mm512_sub_pd(a, b);
    Mul mul(a, b) = _mm512_mul_pd(a, b);
    Div div(a, b) = _mm512_div_pd(a, b);
}
operators! { F64x4x2, f64: twice;
    Add add(a, b) = [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])];
    Sub sub(a, b) = [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])];
    Mul mul(a, b) = [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])];
    Div div(a, b) = [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])];
}

impl BitAnd for M64x4x2 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, b: Self) -> Self {
        let a = self;
        // SAFETY: such a value exists only where a token did, and the instructions do.
        Self(unsafe { [_mm256_and_pd(a.0[0], b.0[0]), _mm256_and_pd(a.0[1], b.0[1])] })
    }
}
impl BitOr for M64x4x2 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, b: Self) -> Self {
        let a = self;
        // SAFETY: such a value exists only where a token did, and the instructions do.
        Self(unsafe { [_mm256_or_pd(a.0[0], b.0[0]), _mm256_or_pd(a.0[1], b.0[1])] })
    }
}
impl Not for M64x4x2 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let a = self.0;
        // SAFETY: such a value exists only where a token did, and the instructions do.
        Self(unsafe {
            let ones = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
            [_mm256_xor_pd(a[0], ones), _mm256_xor_pd(a[1], ones)]
        })
    }
}

/// Returns the same number in all lanes of both registers.
///
/// # Safety
/// The processor must have AVX2.
#[inline(always)]
unsafe fn twice(a: f64) -> [__m256d; 2] {
    // SAFETY: the caller sees to the instructions.
    unsafe { [_mm256_set1_pd(a); 2] }
}

/// Returns the lower eight bits of a move mask.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "eight bits are set"
)]
fn byte(mask: i32) -> u8 {
    mask as u8
}

/// Prefetches all cache lines of a value.
#[inline(always)]
fn prefetch_lines<T>(a: &T) {
    let start = std::ptr::from_ref(a).cast::<i8>();
    let mut offset = 0;
    while offset < size_of::<T>() {
        // SAFETY: within the value; a prefetch reads nothing, and SSE is part of x86-64.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(offset)) };
        offset += 64;
    }
}

/// Returns the sum `((0 + 4) + (1 + 5)) + ((2 + 6) + (3 + 7))` of eight lanes, given the four sums
/// of lanes that are four apart.
///
/// # Safety
/// The processor must have AVX2.
#[inline(always)]
unsafe fn sum_of_four(fours: __m256d) -> f64 {
    // SAFETY: the caller sees to the instructions.
    unsafe {
        let a = _mm256_castpd256_pd128(fours);
        let b = _mm256_extractf128_pd::<1>(fours);
        let a = _mm_add_sd(a, _mm_unpackhi_pd(a, a));
        let b = _mm_add_sd(b, _mm_unpackhi_pd(b, b));
        _mm_cvtsd_f64(_mm_add_sd(a, b))
    }
}

/// The operations that have the same code for both instruction sets.
macro_rules! common {
    ($features:literal) => {
        type F = F32x8;

        #[inline(always)]
        fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
            #[target_feature(enable = $features)]
            fn inner<R>(f: impl FnOnce() -> R) -> R {
                f()
            }
            // SAFETY: a token exists only where the instructions do.
            unsafe { inner(f) }
        }
        #[inline(always)]
        fn prefetch<T>(self, a: &T) {
            prefetch_lines(a);
        }
        methods! {
            load(a: &[f32; 8]) -> F32x8 = F32x8(_mm256_loadu_ps(a.as_ptr()));
            store(a: F32x8, out: &mut [f32; 8]) = _mm256_storeu_ps(out.as_mut_ptr(), a.0);
            splat(a: f32) -> F32x8 = F32x8(_mm256_set1_ps(a));
            min(a: F32x8, b: F32x8) -> F32x8 = F32x8(_mm256_min_ps(a.0, b.0));
            max(a: F32x8, b: F32x8) -> F32x8 = F32x8(_mm256_max_ps(a.0, b.0));
            abs(a: F32x8) -> F32x8 = F32x8(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a.0));
            fma(a: F32x8, b: F32x8, c: F32x8) -> F32x8 = F32x8(_mm256_fmadd_ps(a.0, b.0, c.0));
            fms(a: F32x8, b: F32x8, c: F32x8) -> F32x8 = F32x8(_mm256_fmsub_ps(a.0, b.0, c.0));
        }
    };
}

impl Lanes for Avx512 {
    type D = F64x8;
    type M = u8;

    methods! {
        dsplat(a: f64) -> F64x8 = F64x8(_mm512_set1_pd(a));
        dmin(a: F64x8, b: F64x8) -> F64x8 = F64x8(_mm512_min_pd(a.0, b.0));
        dmax(a: F64x8, b: F64x8) -> F64x8 = F64x8(_mm512_max_pd(a.0, b.0));
        dsqrt(a: F64x8) -> F64x8 = F64x8(_mm512_sqrt_pd(a.0));
        dle(a: F64x8, b: F64x8) -> u8 = _mm512_cmp_pd_mask::<_CMP_LE_OQ>(a.0, b.0);
        dlt(a: F64x8, b: F64x8) -> u8 = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.0, b.0);
        select(m: u8, a: F64x8, b: F64x8) -> F64x8 = F64x8(_mm512_mask_blend_pd(m, a.0, b.0));
        exp2(n: F64x8) -> F64x8 = {
            let n = _mm512_slli_epi64::<52>(_mm512_castpd_si512(n.0));
            F64x8(_mm512_castsi512_pd(_mm512_add_epi64(n, _mm512_set1_epi64(1023 << 52))))
        };
    }
    #[inline(always)]
    fn abreast<const N: usize>(self, mut a: [F64x8; N]) -> [F64x8; N] {
        for i in 1..N {
            // SAFETY: a token exists only where the instructions do.
            [a[i - 1], a[i]] = unsafe { pair(a[i - 1], a[i]) };
        }
        a
    }
}

impl Simd for Avx512 {
    common!("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt");

    methods! {
        le(a: F32x8, b: F32x8) -> u8 = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(a.0, b.0);
        lt(a: F32x8, b: F32x8) -> u8 = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0);
        compress(m: u8, a: F32x8, out: &mut [f32], at: usize) = {
            let out = &mut out[at..at + 8];
            _mm256_storeu_ps(out.as_mut_ptr(), _mm256_maskz_compress_ps(m, a.0));
        };
        pack(m: u8, a: &[u32; 8], out: &mut [u32], at: usize) = {
            let out = &mut out[at..at + 8];
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let packed = _mm256_maskz_compress_epi32(m, a);
            _mm256_storeu_si256(out.as_mut_ptr().cast(), packed);
        };
        bin_masks(first: F32x8, last: F32x8, out: &mut [u64; 8]) = {
            let low = _mm256_set1_epi32(63);
            let first = _mm256_and_si256(_mm256_castps_si256(first.0), low);
            let last = _mm256_andnot_si256(_mm256_castps_si256(last.0), low);
            let all = _mm512_set1_epi64(-1);
            let above = _mm512_sllv_epi64(all, _mm512_cvtepu32_epi64(first));
            let below = _mm512_srlv_epi64(all, _mm512_cvtepu32_epi64(last));
            _mm512_storeu_si512(out.as_mut_ptr().cast(), _mm512_and_si512(above, below));
        };
        intersects(a: &[u64; 8], b: u64) -> u8 = {
            let a = _mm512_loadu_si512(a.as_ptr().cast());
            _mm512_test_epi64_mask(a, _mm512_set1_epi64(b.cast_signed()))
        };
        in_range(a: &[u32; 8], start: u32, len: u32) -> u8 = {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let a = _mm256_sub_epi32(a, _mm256_set1_epi32(start.cast_signed()));
            _mm256_cmplt_epu32_mask(a, _mm256_set1_epi32(len.cast_signed()))
        };
        dload(a: &[f64; 8]) -> F64x8 = F64x8(_mm512_loadu_pd(a.as_ptr()));
        dstore(a: F64x8, out: &mut [f64; 8]) = _mm512_storeu_pd(out.as_mut_ptr(), a.0);
        widen(a: F32x8) -> F64x8 = F64x8(_mm512_cvtps_pd(a.0));
        narrow(a: F64x8) -> F32x8 = F32x8(_mm512_cvtpd_ps(a.0));
        dcompress(m: u8, a: F64x8, out: &mut [f64], at: usize) = {
            let out = &mut out[at..at + 8];
            _mm512_storeu_pd(out.as_mut_ptr(), _mm512_maskz_compress_pd(m, a.0));
        };
        dsum(a: F64x8) -> f64 = {
            let low = _mm512_castpd512_pd256(a.0);
            sum_of_four(_mm256_add_pd(low, _mm512_extractf64x4_pd::<1>(a.0)))
        };
    }
    #[inline(always)]
    fn bits(self, a: u8) -> u8 {
        a
    }
}

/// Returns both unchanged, by a step that needs both at the same time and has no instructions.
#[inline]
#[target_feature(enable = "avx512f")]
fn pair(mut a: F64x8, mut b: F64x8) -> [F64x8; 2] {
    // SAFETY: an empty text changes nothing.
    unsafe {
        std::arch::asm!("/* {} {} */", inout(zmm_reg) a.0, inout(zmm_reg) b.0,
            options(pure, nomem, nostack, preserves_flags));
    }
    [a, b]
}

impl Lanes for Avx2 {
    type D = F64x4x2;
    type M = M64x4x2;

    methods! {
        dsplat(a: f64) -> F64x4x2 = F64x4x2(twice(a));
        dmin(a: F64x4x2, b: F64x4x2) -> F64x4x2 =
            F64x4x2([_mm256_min_pd(a.0[0], b.0[0]), _mm256_min_pd(a.0[1], b.0[1])]);
        dmax(a: F64x4x2, b: F64x4x2) -> F64x4x2 =
            F64x4x2([_mm256_max_pd(a.0[0], b.0[0]), _mm256_max_pd(a.0[1], b.0[1])]);
        dsqrt(a: F64x4x2) -> F64x4x2 = F64x4x2([_mm256_sqrt_pd(a.0[0]), _mm256_sqrt_pd(a.0[1])]);
        dle(a: F64x4x2, b: F64x4x2) -> M64x4x2 = M64x4x2([
            _mm256_cmp_pd::<_CMP_LE_OQ>(a.0[0], b.0[0]),
            _mm256_cmp_pd::<_CMP_LE_OQ>(a.0[1], b.0[1]),
        ]);
        dlt(a: F64x4x2, b: F64x4x2) -> M64x4x2 = M64x4x2([
            _mm256_cmp_pd::<_CMP_LT_OQ>(a.0[0], b.0[0]),
            _mm256_cmp_pd::<_CMP_LT_OQ>(a.0[1], b.0[1]),
        ]);
        select(m: M64x4x2, a: F64x4x2, b: F64x4x2) -> F64x4x2 = F64x4x2([
            _mm256_blendv_pd(a.0[0], b.0[0], m.0[0]),
            _mm256_blendv_pd(a.0[1], b.0[1], m.0[1]),
        ]);
        exp2(n: F64x4x2) -> F64x4x2 = {
            let one = _mm256_set1_epi64x(1023 << 52);
            let low = _mm256_slli_epi64::<52>(_mm256_castpd_si256(n.0[0]));
            let high = _mm256_slli_epi64::<52>(_mm256_castpd_si256(n.0[1]));
            F64x4x2([
                _mm256_castsi256_pd(_mm256_add_epi64(low, one)),
                _mm256_castsi256_pd(_mm256_add_epi64(high, one)),
            ])
        };
    }
}

impl Simd for Avx2 {
    common!("avx2,fma,bmi1,bmi2,lzcnt,popcnt");

    methods! {
        le(a: F32x8, b: F32x8) -> u8 = byte(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0)));
        lt(a: F32x8, b: F32x8) -> u8 = byte(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0)));
        compress(m: u8, a: F32x8, out: &mut [f32], at: usize) = {
            let out = &mut out[at..at + 8];
            _mm256_storeu_ps(out.as_mut_ptr(), _mm256_permutevar8x32_ps(a.0, front_lanes(m)));
        };
        pack(m: u8, a: &[u32; 8], out: &mut [u32], at: usize) = {
            let out = &mut out[at..at + 8];
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let packed = _mm256_permutevar8x32_epi32(a, front_lanes(m));
            _mm256_storeu_si256(out.as_mut_ptr().cast(), packed);
        };
        bin_masks(first: F32x8, last: F32x8, out: &mut [u64; 8]) = {
            let low = _mm256_set1_epi32(63);
            let first = _mm256_and_si256(_mm256_castps_si256(first.0), low);
            let last = _mm256_andnot_si256(_mm256_castps_si256(last.0), low);
            let all = _mm256_set1_epi64x(-1);
            let at = _mm256_cvtepu32_epi64(_mm256_castsi256_si128(first));
            let off = _mm256_cvtepu32_epi64(_mm256_castsi256_si128(last));
            let bits = _mm256_and_si256(_mm256_sllv_epi64(all, at), _mm256_srlv_epi64(all, off));
            _mm256_storeu_si256(out.as_mut_ptr().cast(), bits);
            let at = _mm256_cvtepu32_epi64(_mm256_extracti128_si256::<1>(first));
            let off = _mm256_cvtepu32_epi64(_mm256_extracti128_si256::<1>(last));
            let bits = _mm256_and_si256(_mm256_sllv_epi64(all, at), _mm256_srlv_epi64(all, off));
            _mm256_storeu_si256(out.as_mut_ptr().add(4).cast(), bits);
        };
        intersects(a: &[u64; 8], b: u64) -> u8 = {
            let b = _mm256_set1_epi64x(b.cast_signed());
            let zero = _mm256_setzero_si256();
            let low = _mm256_and_si256(_mm256_loadu_si256(a.as_ptr().cast()), b);
            let high = _mm256_and_si256(_mm256_loadu_si256(a.as_ptr().add(4).cast()), b);
            let low = _mm256_castsi256_pd(_mm256_cmpeq_epi64(low, zero));
            let high = _mm256_castsi256_pd(_mm256_cmpeq_epi64(high, zero));
            !byte(_mm256_movemask_pd(low) | (_mm256_movemask_pd(high) << 4))
        };
        in_range(a: &[u32; 8], start: u32, len: u32) -> u8 = {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let a = _mm256_sub_epi32(a, _mm256_set1_epi32(start.cast_signed()));
            // a ≥ len, unsigned: the larger of the two is a.
            let most = _mm256_max_epu32(a, _mm256_set1_epi32(len.cast_signed()));
            !byte(_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(most, a))))
        };
        dload(a: &[f64; 8]) -> F64x4x2 =
            F64x4x2([_mm256_loadu_pd(a.as_ptr()), _mm256_loadu_pd(a.as_ptr().add(4))]);
        dstore(a: F64x4x2, out: &mut [f64; 8]) = {
            _mm256_storeu_pd(out.as_mut_ptr(), a.0[0]);
            _mm256_storeu_pd(out.as_mut_ptr().add(4), a.0[1]);
        };
        widen(a: F32x8) -> F64x4x2 = F64x4x2([
            _mm256_cvtps_pd(_mm256_castps256_ps128(a.0)),
            _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a.0)),
        ]);
        narrow(a: F64x4x2) -> F32x8 =
            F32x8(_mm256_set_m128(_mm256_cvtpd_ps(a.0[1]), _mm256_cvtpd_ps(a.0[0])));
        bits(a: M64x4x2) -> u8 =
            byte(_mm256_movemask_pd(a.0[0]) | (_mm256_movemask_pd(a.0[1]) << 4));
        dcompress(m: u8, a: F64x4x2, out: &mut [f64], at: usize) = {
            let out = &mut out[at..at + 8];
            // Store four entries each; the second four begin at most four entries after the first.
            let (low, high) = (m & 15, m >> 4);
            _mm256_storeu_pd(out.as_mut_ptr(), squeeze_four(low, a.0[0]));
            let second = &mut out[low.count_ones() as usize..];
            _mm256_storeu_pd(second.as_mut_ptr(), squeeze_four(high, a.0[1]));
        };
        dsum(a: F64x4x2) -> f64 = sum_of_four(_mm256_add_pd(a.0[0], a.0[1]));
    }
}

/// Returns the indices of the lanes in the mask `m`, moved to the front.
///
/// # Safety
/// The processor must have AVX2 and BMI2.
#[inline(always)]
unsafe fn front_lanes(m: u8) -> __m256i {
    // SAFETY: the caller sees to the instructions.
    unsafe {
        // Each bit of the mask becomes a byte of ones, which picks a lane's number.
        let bytes = _pdep_u64(m.into(), 0x0101_0101_0101_0101) * 0xff;
        let lanes = _pext_u64(0x0706_0504_0302_0100, bytes).cast_signed();
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes))
    }
}

/// Moves the lanes in the mask `m` to the front.
///
/// # Safety
/// The processor must have AVX2 and BMI2.
#[inline(always)]
unsafe fn squeeze_four(m: u8, a: __m256d) -> __m256d {
    // SAFETY: the caller sees to the instructions.
    unsafe {
        // Each bit of the mask becomes two bytes of ones, which pick a lane's two halves.
        let bytes = _pdep_u64(m.into(), 0x0001_0001_0001_0001) * 0xffff;
        let lanes = _pext_u64(0x0706_0504_0302_0100, bytes).cast_signed();
        let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes));
        _mm256_castps_pd(_mm256_permutevar8x32_ps(_mm256_castpd_ps(a), lanes))
    }
}

/// Evaluates [`Lanes::polynomials`] for one number, with both polynomials in one register.
#[inline(always)]
pub(crate) fn polynomials_of_one(c: &[[f64; 2]; 8], s: f64) -> [f64; 2] {
    // SAFETY: SSE2 is part of x86-64; two numbers are read where there are two.
    unsafe {
        let s2 = s * s;
        let s4 = _mm_set1_pd(s2 * s2);
        let (s, s2) = (_mm_set1_pd(s), _mm_set1_pd(s2));
        let mut terms = [s; 4];
        for (k, term) in terms.iter_mut().enumerate() {
            let low = _mm_loadu_pd(c[2 * k].as_ptr());
            let high = _mm_loadu_pd(c[2 * k + 1].as_ptr());
            *term = _mm_add_pd(low, _mm_mul_pd(high, s));
        }
        let low = _mm_add_pd(terms[0], _mm_mul_pd(terms[1], s2));
        let high = _mm_add_pd(terms[2], _mm_mul_pd(terms[3], s2));
        let sum = _mm_add_pd(low, _mm_mul_pd(high, s4));
        [_mm_cvtsd_f64(sum), _mm_cvtsd_f64(_mm_unpackhi_pd(sum, sum))]
    }
}
