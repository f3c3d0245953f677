//! The elementary operations on eight and on four lanes.

use super::kernels::{four, kernels};
use super::{BLOCK, CYLINDER, Columns, POINT_LINE, RIBBON};
use crate::gauss::{
    FEW, FEW_NODES, FEW_WEIGHTS, INVERSE_FACTORIALS, LN2_HIGH, LN2_LOW, NODE, NODES,
    ODD_RECIPROCALS, SHIFT, WEIGHT,
};
use crate::ordinary::{CLEAR, FAR, LEAST_COSINE, LONG_NORMAL, LUNE, NEAR, SHORT};
use linelit_geometry::DVec3;

/// The two columns of [`LUNE`].
const OVER: [f64; 8] = column(0);
const UNDER: [f64; 8] = column(1);

const fn column(j: usize) -> [f64; 8] {
    let mut out = [0.0; 8];
    let mut i = 0;
    while i < 8 {
        out[i] = LUNE[i][j];
        i += 1;
    }
    out
}

/// An operation on K registers, one after the other.
macro_rules! each {
    ($feature:literal $($name:ident ($($argument:ident),+) = $operation:expr;)*) => {$(
        #[inline]
        #[target_feature(enable = $feature)]
        fn $name<const K: usize>($($argument: [V; K]),+) -> [V; K] {
            let mut out = [zero(); K];
            let mut i = 0;
            while i < K {
                $(let $argument = $argument[i];)+
                out[i] = $operation;
                i += 1;
            }
            out
        }
    )*};
}

/// Comparisons: a bit for each lane.
macro_rules! compare {
    ($feature:literal $($name:ident ($a:ident, $b:ident) = $bits:expr;)*) => {$(
        #[inline]
        #[target_feature(enable = $feature)]
        fn $name<const K: usize>(a: [V; K], b: [V; K]) -> u32 {
            let mut out = 0;
            let mut i = 0;
            while i < K {
                let ($a, $b) = (a[i], b[i]);
                out |= u32::from($bits) << (i * WIDTH);
                i += 1;
            }
            out
        }
    )*};
}

/// Eight lanes.
#[allow(unsafe_code, reason = "whole-register loads and stores")]
pub(super) mod avx512 {
    use super::*;
    use std::arch::x86_64::*;

    type V = __m512d;
    const WIDTH: usize = 8;

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn zero() -> V {
        _mm512_setzero_pd()
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn splat<const K: usize>(x: f64) -> [V; K] {
        [_mm512_set1_pd(x); K]
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load<const K: usize, const N: usize>(from: &[f64; N]) -> [V; K] {
        const { assert!(N == K * WIDTH) };
        let mut out = [zero(); K];
        let mut i = 0;
        while i < K {
            // SAFETY: the array holds K times eight numbers, read at any alignment.
            out[i] = unsafe { _mm512_loadu_pd(from.as_ptr().add(i * WIDTH)) };
            i += 1;
        }
        out
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn store<const K: usize, const N: usize>(x: [V; K], to: &mut [f64; N]) {
        const { assert!(N == K * WIDTH) };
        let mut i = 0;
        while i < K {
            // SAFETY: the array holds K times eight numbers, written at any alignment.
            unsafe { _mm512_storeu_pd(to.as_mut_ptr().add(i * WIDTH), x[i]) };
            i += 1;
        }
    }
    each! { "avx512f"
        add(a, b) = _mm512_add_pd(a, b);
        sub(a, b) = _mm512_sub_pd(a, b);
        mul(a, b) = _mm512_mul_pd(a, b);
        div(a, b) = _mm512_div_pd(a, b);
        min(a, b) = _mm512_min_pd(a, b);
        max(a, b) = _mm512_max_pd(a, b);
        sqrt(a) = _mm512_sqrt_pd(a);
        or(a, b) = _mm512_castsi512_pd(
            _mm512_or_si512(_mm512_castpd_si512(a), _mm512_castpd_si512(b)));
        zero_below(x, value) = _mm512_maskz_mov_pd(
            _mm512_cmp_pd_mask::<_CMP_GE_OQ>(x, _mm512_set1_pd(-700.0)), value);
        power_of_two(shifted) = _mm512_castsi512_pd(_mm512_add_epi64(
            _mm512_slli_epi64::<52>(_mm512_castpd_si512(shifted)), _mm512_set1_epi64(1023 << 52)));
    }
    compare! { "avx512f"
        at_least(a, b) = _mm512_cmp_pd_mask::<_CMP_GE_OQ>(a, b);
    }
    /// A bit for each lane whose sign is set.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn signs<const K: usize>(a: [V; K]) -> u32 {
        let mut out = 0;
        let mut i = 0;
        while i < K {
            let bits = _mm512_cmplt_epi64_mask(_mm512_castpd_si512(a[i]), _mm512_setzero_si512());
            out |= u32::from(bits) << (i * WIDTH);
            i += 1;
        }
        out
    }

    /// Marks eight lanes.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn mark(bits: u32, trusted: &mut [u8], round: usize) {
        #[allow(clippy::cast_possible_truncation, reason = "eight of them are set")]
        let bits = bits as u8;
        trusted[round] = bits;
    }

    /// Nothing, for both registers at once.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn together<const K: usize>(mut x: [V; K]) -> [V; K] {
        if K == 2 {
            let (mut a, mut b) = (x[0], x[K - 1]);
            // SAFETY: an empty text changes nothing.
            unsafe {
                std::arch::asm!("/* {a} {b} */", a = inout(zmm_reg) a, b = inout(zmm_reg) b,
                    options(pure, nomem, nostack, preserves_flags));
            }
            x[0] = a;
            x[K - 1] = b;
        }
        x
    }

    /// The sum of sixteen terms in the order of [`few_total`](crate::lobe).
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn total(x: [V; 2]) -> f64 {
        let lanes = _mm512_add_pd(x[0], x[1]);
        let low = _mm512_castpd512_pd256(lanes);
        let fours = _mm256_add_pd(low, _mm512_extractf64x4_pd::<1>(lanes));
        let (a, b) = (
            _mm256_castpd256_pd128(fours),
            _mm256_extractf128_pd::<1>(fours),
        );
        let a = _mm_add_sd(a, _mm_unpackhi_pd(a, a));
        let b = _mm_add_sd(b, _mm_unpackhi_pd(b, b));
        _mm_cvtsd_f64(_mm_add_sd(a, b))
    }

    kernels!("avx512f");
}

/// Four lanes.
#[allow(unsafe_code, reason = "whole-register loads and stores")]
pub(super) mod avx2 {
    use super::*;
    use std::arch::x86_64::*;

    type V = __m256d;
    const WIDTH: usize = 4;

    #[inline]
    #[target_feature(enable = "avx2")]
    fn zero() -> V {
        _mm256_setzero_pd()
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn splat<const K: usize>(x: f64) -> [V; K] {
        [_mm256_set1_pd(x); K]
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn load<const K: usize, const N: usize>(from: &[f64; N]) -> [V; K] {
        const { assert!(N == K * WIDTH) };
        let mut out = [zero(); K];
        let mut i = 0;
        while i < K {
            // SAFETY: the array holds K times four numbers, read at any alignment.
            out[i] = unsafe { _mm256_loadu_pd(from.as_ptr().add(i * WIDTH)) };
            i += 1;
        }
        out
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn store<const K: usize, const N: usize>(x: [V; K], to: &mut [f64; N]) {
        const { assert!(N == K * WIDTH) };
        let mut i = 0;
        while i < K {
            // SAFETY: the array holds K times four numbers, written at any alignment.
            unsafe { _mm256_storeu_pd(to.as_mut_ptr().add(i * WIDTH), x[i]) };
            i += 1;
        }
    }
    /// The sign bits of four lanes.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn bits(mask: V) -> u8 {
        u8::try_from(_mm256_movemask_pd(mask)).unwrap_or(0)
    }
    each! { "avx2"
        add(a, b) = _mm256_add_pd(a, b);
        sub(a, b) = _mm256_sub_pd(a, b);
        mul(a, b) = _mm256_mul_pd(a, b);
        div(a, b) = _mm256_div_pd(a, b);
        min(a, b) = _mm256_min_pd(a, b);
        max(a, b) = _mm256_max_pd(a, b);
        sqrt(a) = _mm256_sqrt_pd(a);
        or(a, b) = _mm256_or_pd(a, b);
        zero_below(x, value) = _mm256_and_pd(
            value, _mm256_cmp_pd::<_CMP_GE_OQ>(x, _mm256_set1_pd(-700.0)));
        power_of_two(shifted) = _mm256_castsi256_pd(_mm256_add_epi64(
            _mm256_slli_epi64::<52>(_mm256_castpd_si256(shifted)), _mm256_set1_epi64x(1023 << 52)));
    }
    compare! { "avx2"
        at_least(a, b) = bits(_mm256_cmp_pd::<_CMP_GE_OQ>(a, b));
    }
    /// A bit for each lane whose sign is set.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn signs<const K: usize>(a: [V; K]) -> u32 {
        let mut out = 0;
        let mut i = 0;
        while i < K {
            out |= u32::from(bits(a[i])) << (i * WIDTH);
            i += 1;
        }
        out
    }

    /// Marks four lanes: the first half of a byte, then the second.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn mark(bits: u32, trusted: &mut [u8], round: usize) {
        #[allow(clippy::cast_possible_truncation, reason = "four of them are set")]
        let bits = bits as u8;
        if round.is_multiple_of(2) {
            trusted[round / 2] = bits;
        } else {
            trusted[round / 2] |= bits << 4;
        }
    }

    /// Nothing, for both registers at once.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn together<const K: usize>(x: [V; K]) -> [V; K] {
        x
    }

    /// The sum of eight sums of two terms in the order of [`few_total`](crate::lobe).
    #[inline]
    #[target_feature(enable = "avx2")]
    fn total(x: [V; 2]) -> f64 {
        let fours = _mm256_add_pd(x[0], x[1]);
        let (a, b) = (
            _mm256_castpd256_pd128(fours),
            _mm256_extractf128_pd::<1>(fours),
        );
        let a = _mm_add_sd(a, _mm_unpackhi_pd(a, a));
        let b = _mm_add_sd(b, _mm_unpackhi_pd(b, b));
        _mm_cvtsd_f64(_mm_add_sd(a, b))
    }

    kernels!("avx2");
}
