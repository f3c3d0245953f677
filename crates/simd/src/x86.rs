//! AVX-512 and AVX2 with FMA.
#![allow(
    unsafe_code,
    reason = "vendor intrinsics, behind tokens that prove they exist"
)]

use crate::{Avx2, Avx512, Simd};
use std::arch::x86_64::*;

/// The eight lanes of a move-mask.
#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "eight bits are set"
)]
fn byte(mask: i32) -> u8 {
    mask as u8
}

/// Asks for the cache lines of a value.
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

impl Simd for Avx512 {
    type F = __m256;
    type D = __m512d;
    type M = u8;

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        #[target_feature(
            enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
        )]
        fn inner<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { inner(f) }
    }
    #[inline(always)]
    fn prefetch<T>(self, a: &T) {
        prefetch_lines(a);
    }
    #[inline(always)]
    fn load(self, a: &[f32; 8]) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_loadu_ps(a.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, a: Self::F, out: &mut [f32; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn splat(self, a: f32) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_set1_ps(a) }
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_div_ps(a, b) }
    }
    #[inline(always)]
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_fmsub_ps(a, b, c) }
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
    }
    #[inline(always)]
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize) {
        let out = &mut out[at..at + 8];
        // SAFETY: a value of this type exists only where the instructions do; eight places.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), _mm256_maskz_compress_ps(m, a)) }
    }
    #[inline(always)]
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize) {
        let out = &mut out[at..at + 8];
        // SAFETY: a value of this type exists only where the instructions do; eight places.
        unsafe {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let packed = _mm256_maskz_compress_epi32(m, a);
            _mm256_storeu_si256(out.as_mut_ptr().cast(), packed);
        }
    }
    #[inline(always)]
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let low = _mm256_set1_epi32(63);
            let first = _mm256_and_si256(_mm256_castps_si256(first), low);
            let last = _mm256_andnot_si256(_mm256_castps_si256(last), low);
            let all = _mm512_set1_epi64(-1);
            let above = _mm512_sllv_epi64(all, _mm512_cvtepu32_epi64(first));
            let below = _mm512_srlv_epi64(all, _mm512_cvtepu32_epi64(last));
            _mm512_storeu_si512(out.as_mut_ptr().cast(), _mm512_and_si512(above, below));
        }
    }
    #[inline(always)]
    fn intersects(self, a: &[u64; 8], b: u64) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let a = _mm512_loadu_si512(a.as_ptr().cast());
            _mm512_test_epi64_mask(a, _mm512_set1_epi64(b.cast_signed()))
        }
    }
    #[inline(always)]
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let a = _mm256_sub_epi32(a, _mm256_set1_epi32(start.cast_signed()));
            _mm256_cmplt_epu32_mask(a, _mm256_set1_epi32(len.cast_signed()))
        }
    }
    #[inline(always)]
    fn dload(self, a: &[f64; 8]) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_loadu_pd(a.as_ptr()) }
    }
    #[inline(always)]
    fn dstore(self, a: Self::D, out: &mut [f64; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_storeu_pd(out.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn dsplat(self, a: f64) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_set1_pd(a) }
    }
    #[inline(always)]
    fn widen(self, a: Self::F) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_cvtps_pd(a) }
    }
    #[inline(always)]
    fn narrow(self, a: Self::D) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_cvtpd_ps(a) }
    }
    #[inline(always)]
    fn dadd(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_add_pd(a, b) }
    }
    #[inline(always)]
    fn dsub(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_sub_pd(a, b) }
    }
    #[inline(always)]
    fn dmul(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_mul_pd(a, b) }
    }
    #[inline(always)]
    fn ddiv(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_div_pd(a, b) }
    }
    #[inline(always)]
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_min_pd(a, b) }
    }
    #[inline(always)]
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_max_pd(a, b) }
    }
    #[inline(always)]
    fn dle(self, a: Self::D, b: Self::D) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(a, b) }
    }
    #[inline(always)]
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b) }
    }
    #[inline(always)]
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm512_mask_blend_pd(m, a, b) }
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        a & b
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        a | b
    }
    #[inline(always)]
    fn not(self, a: Self::M) -> Self::M {
        !a
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u8 {
        a
    }
    #[inline(always)]
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize) {
        let out = &mut out[at..at + 8];
        // SAFETY: a value of this type exists only where the instructions do; eight places.
        unsafe { _mm512_storeu_pd(out.as_mut_ptr(), _mm512_maskz_compress_pd(m, a)) }
    }
}

impl Simd for Avx2 {
    type F = __m256;
    type D = [__m256d; 2];
    type M = [__m256d; 2];

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn inner<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { inner(f) }
    }
    #[inline(always)]
    fn prefetch<T>(self, a: &T) {
        prefetch_lines(a);
    }
    #[inline(always)]
    fn load(self, a: &[f32; 8]) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_loadu_ps(a.as_ptr()) }
    }
    #[inline(always)]
    fn store(self, a: Self::F, out: &mut [f32; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), a) }
    }
    #[inline(always)]
    fn splat(self, a: f32) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_set1_ps(a) }
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_add_ps(a, b) }
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_sub_ps(a, b) }
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_mul_ps(a, b) }
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_min_ps(a, b) }
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_max_ps(a, b) }
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_div_ps(a, b) }
    }
    #[inline(always)]
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_fmadd_ps(a, b, c) }
    }
    #[inline(always)]
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_fmsub_ps(a, b, c) }
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), a) }
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { byte(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b))) }
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { byte(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b))) }
    }
    #[inline(always)]
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize) {
        let out = &mut out[at..at + 8];
        // SAFETY: a value of this type exists only where the instructions do; eight places.
        unsafe {
            let packed = _mm256_permutevar8x32_ps(a, front_lanes(m));
            _mm256_storeu_ps(out.as_mut_ptr(), packed);
        }
    }
    #[inline(always)]
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize) {
        let out = &mut out[at..at + 8];
        // SAFETY: a value of this type exists only where the instructions do; eight places.
        unsafe {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let packed = _mm256_permutevar8x32_epi32(a, front_lanes(m));
            _mm256_storeu_si256(out.as_mut_ptr().cast(), packed);
        }
    }
    #[inline(always)]
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let low = _mm256_set1_epi32(63);
            let first = _mm256_and_si256(_mm256_castps_si256(first), low);
            let last = _mm256_andnot_si256(_mm256_castps_si256(last), low);
            let all = _mm256_set1_epi64x(-1);
            let at = _mm256_cvtepu32_epi64(_mm256_castsi256_si128(first));
            let off = _mm256_cvtepu32_epi64(_mm256_castsi256_si128(last));
            let bits = _mm256_and_si256(_mm256_sllv_epi64(all, at), _mm256_srlv_epi64(all, off));
            _mm256_storeu_si256(out.as_mut_ptr().cast(), bits);
            let at = _mm256_cvtepu32_epi64(_mm256_extracti128_si256::<1>(first));
            let off = _mm256_cvtepu32_epi64(_mm256_extracti128_si256::<1>(last));
            let bits = _mm256_and_si256(_mm256_sllv_epi64(all, at), _mm256_srlv_epi64(all, off));
            _mm256_storeu_si256(out.as_mut_ptr().add(4).cast(), bits);
        }
    }
    #[inline(always)]
    fn intersects(self, a: &[u64; 8], b: u64) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let b = _mm256_set1_epi64x(b.cast_signed());
            let zero = _mm256_setzero_si256();
            let low = _mm256_and_si256(_mm256_loadu_si256(a.as_ptr().cast()), b);
            let high = _mm256_and_si256(_mm256_loadu_si256(a.as_ptr().add(4).cast()), b);
            let low = _mm256_castsi256_pd(_mm256_cmpeq_epi64(low, zero));
            let high = _mm256_castsi256_pd(_mm256_cmpeq_epi64(high, zero));
            !byte(_mm256_movemask_pd(low) | (_mm256_movemask_pd(high) << 4))
        }
    }
    #[inline(always)]
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let a = _mm256_loadu_si256(a.as_ptr().cast());
            let a = _mm256_sub_epi32(a, _mm256_set1_epi32(start.cast_signed()));
            // a ≥ len, unsigned: the larger of the two is a.
            let out =
                _mm256_cmpeq_epi32(_mm256_max_epu32(a, _mm256_set1_epi32(len.cast_signed())), a);
            !byte(_mm256_movemask_ps(_mm256_castsi256_ps(out)))
        }
    }
    #[inline(always)]
    fn dload(self, a: &[f64; 8]) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            [
                _mm256_loadu_pd(a.as_ptr()),
                _mm256_loadu_pd(a.as_ptr().add(4)),
            ]
        }
    }
    #[inline(always)]
    fn dstore(self, a: Self::D, out: &mut [f64; 8]) {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            _mm256_storeu_pd(out.as_mut_ptr(), a[0]);
            _mm256_storeu_pd(out.as_mut_ptr().add(4), a[1]);
        }
    }
    #[inline(always)]
    fn dsplat(self, a: f64) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_set1_pd(a); 2] }
    }
    #[inline(always)]
    fn widen(self, a: Self::F) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            [
                _mm256_cvtps_pd(_mm256_castps256_ps128(a)),
                _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a)),
            ]
        }
    }
    #[inline(always)]
    fn narrow(self, a: Self::D) -> Self::F {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])) }
    }
    #[inline(always)]
    fn dadd(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn dsub(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn dmul(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn ddiv(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_div_pd(a[0], b[0]), _mm256_div_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_max_pd(a[0], b[0]), _mm256_max_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn dle(self, a: Self::D, b: Self::D) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            [
                _mm256_cmp_pd::<_CMP_LE_OQ>(a[0], b[0]),
                _mm256_cmp_pd::<_CMP_LE_OQ>(a[1], b[1]),
            ]
        }
    }
    #[inline(always)]
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            [
                _mm256_cmp_pd::<_CMP_LT_OQ>(a[0], b[0]),
                _mm256_cmp_pd::<_CMP_LT_OQ>(a[1], b[1]),
            ]
        }
    }
    #[inline(always)]
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            [
                _mm256_blendv_pd(a[0], b[0], m[0]),
                _mm256_blendv_pd(a[1], b[1], m[1]),
            ]
        }
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_and_pd(a[0], b[0]), _mm256_and_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { [_mm256_or_pd(a[0], b[0]), _mm256_or_pd(a[1], b[1])] }
    }
    #[inline(always)]
    fn not(self, a: Self::M) -> Self::M {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe {
            let ones = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
            [_mm256_xor_pd(a[0], ones), _mm256_xor_pd(a[1], ones)]
        }
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u8 {
        // SAFETY: a value of this type exists only where the instructions do.
        unsafe { byte(_mm256_movemask_pd(a[0]) | (_mm256_movemask_pd(a[1]) << 4)) }
    }
    #[inline(always)]
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize) {
        let out = &mut out[at..at + 8];
        let (low, high) = (m & 15, m >> 4);
        // SAFETY: a value of this type exists only where the instructions do; four places each,
        // the second of which start at most four further on.
        unsafe {
            _mm256_storeu_pd(out.as_mut_ptr(), squeeze_four(low, a[0]));
            let second = &mut out[low.count_ones() as usize..];
            _mm256_storeu_pd(second.as_mut_ptr(), squeeze_four(high, a[1]));
        }
    }
}

/// The numbers of the lanes of `m`, one after the other.
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

/// Moves the lanes of `m` to the front.
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
