//! Two sums of one shape in the two halves of a register, which every x86-64 has.

use crate::ordinary::LUNE;

/// The two polynomials of [`LUNE`] at s, from its powers: the same bits however they are formed.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
#[allow(unsafe_code, reason = "calling a function compiled for a CPU feature")]
pub(crate) fn side_by_side(s: f64, s2: f64, s4: f64) -> [f64; 2] {
    // SAFETY: SSE2 is part of x86-64.
    unsafe { sse2(s, s2, s4) }
}

#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "sse2")]
fn sse2(s: f64, s2: f64, s4: f64) -> [f64; 2] {
    use std::arch::x86_64::*;
    let (s, s2, s4) = (_mm_set1_pd(s), _mm_set1_pd(s2), _mm_set1_pd(s4));
    let low = _mm_add_pd(term(0, s), _mm_mul_pd(term(2, s), s2));
    let high = _mm_add_pd(term(4, s), _mm_mul_pd(term(6, s), s2));
    let sum = _mm_add_pd(low, _mm_mul_pd(high, s4));
    [_mm_cvtsd_f64(sum), _mm_cvtsd_f64(_mm_unpackhi_pd(sum, sum))]
}

/// The coefficient i and the next times s.
#[cfg(target_arch = "x86_64")]
#[inline]
#[target_feature(enable = "sse2")]
fn term(i: usize, s: std::arch::x86_64::__m128d) -> std::arch::x86_64::__m128d {
    use std::arch::x86_64::*;
    let low = _mm_set_pd(LUNE[i][1], LUNE[i][0]);
    let high = _mm_set_pd(LUNE[i + 1][1], LUNE[i + 1][0]);
    _mm_add_pd(low, _mm_mul_pd(high, s))
}

/// The two polynomials of [`LUNE`] at s, from its powers.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub(crate) fn side_by_side(s: f64, s2: f64, s4: f64) -> [f64; 2] {
    [0, 1].map(|j| {
        let term = |i: usize| LUNE[i][j] + LUNE[i + 1][j] * s;
        (term(0) + term(2) * s2) + (term(4) + term(6) * s2) * s4
    })
}
