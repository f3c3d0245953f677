//! The vector kernels: the ribbon integral over columns of segments, and the nodes of a lobe's panel,
//! written once and compiled for AVX-512 and AVX2.
//!
//! Every operation is the one of the scalar twin ([`ribbon::ordinary`](crate::ribbon),
//! [`lobe`](crate::lobe)) in the same order, without fused operations, so the bits are the same;
//! tests hold them to it. The only unsafe code is loading and storing whole registers and calling a
//! function compiled for a CPU feature after detecting it.

use crate::gauss::{
    INVERSE_FACTORIALS, LN2_HIGH, LN2_LOW, NODE, NODES, ODD_RECIPROCALS, SHIFT, WEIGHT,
};
use crate::lobe::Panel;
use crate::special::LUNE;
use linelit_geometry::DVec3;

/// The most lanes a kernel takes at once.
pub(crate) const LANES: usize = 8;

/// Eight segments in columns: x, y, z of the first ends, then of the second.
pub(crate) type Block<'a> = [&'a [f64; LANES]; 6];

/// The ribbon integrals of a block, and a bit for each lane that may be trusted.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a detected CPU feature"
)]
pub(crate) fn ribbons(block: &Block<'_>, n: DVec3, out: &mut [f64; LANES], level: Level) -> u8 {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the level was found by detecting its features.
        Level::Avx512 => unsafe { avx512::ribbons(block, n, out) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the level was found by detecting its features.
        Level::Avx2 => unsafe { avx2::ribbons(block, n, out) },
        Level::Scalar => {
            let mut bits = 0;
            for i in 0..LANES {
                let c = |j: usize| block[j][i];
                let (p0, p1) = (DVec3::new(c(0), c(1), c(2)), DVec3::new(c(3), c(4), c(5)));
                let (value, ordinary) = crate::ribbon::ordinary(p0, p1, n);
                out[i] = value;
                bits |= u8::from(ordinary) << i;
            }
            bits
        }
    }
}

/// The terms of a lobe's panel.
#[inline]
#[allow(
    unsafe_code,
    reason = "calling a function compiled for a detected CPU feature"
)]
pub(crate) fn panel(panel: &Panel, k: f64, terms: &mut [f64; NODES], level: Level) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the level was found by detecting its features.
        Level::Avx512 => unsafe { avx512::panel(panel, k, terms) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the level was found by detecting its features.
        Level::Avx2 => unsafe { avx2::panel(panel, k, terms) },
        Level::Scalar => panel.terms(k, terms),
    }
}

/// Which vector instructions to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// None beyond the compiler's baseline.
    Scalar,
    /// Four lanes.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Eight lanes.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// The best that this machine has (remembered by the standard library after the first call).
    #[inline]
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Scalar
    }
}

#[cfg(target_arch = "x86_64")]
macro_rules! kernels {
    ($feature:literal, $width:literal) => {
        /// 24 coefficients by pairs.
        #[inline]
        #[target_feature(enable = $feature)]
        fn estrin(c: &[f64; 24], x: V) -> V {
            let x2 = mul(x, x);
            let x4 = mul(x2, x2);
            let x8 = mul(x4, x4);
            let quad = |i: usize| {
                add(
                    add(splat(c[i]), mul(splat(c[i + 1]), x)),
                    mul(add(splat(c[i + 2]), mul(splat(c[i + 3]), x)), x2),
                )
            };
            let low = add(quad(0), mul(quad(4), x4));
            let middle = add(quad(8), mul(quad(12), x4));
            let high = add(quad(16), mul(quad(20), x4));
            add(low, mul(add(middle, mul(high, x8)), x8))
        }

        /// x·a + y·b + z·c, from the left.
        #[inline]
        #[target_feature(enable = $feature)]
        fn sum3(a: V, b: V, c: V) -> V {
            add(add(a, b), c)
        }

        #[inline]
        #[target_feature(enable = $feature)]
        fn ribbon(p: [V; 6], n: [V; 3]) -> (V, u8) {
            let [x0, y0, z0, x1, y1, z1] = p;
            let a = sum3(mul(x0, x0), mul(y0, y0), mul(z0, z0));
            let b = sum3(mul(x1, x1), mul(y1, y1), mul(z1, z1));
            let (ex, ey, ez) = (sub(x1, x0), sub(y1, y0), sub(z1, z0));
            let length = sqrt(sum3(mul(ex, ex), mul(ey, ey), mul(ez, ez)));
            let t0 = [mul(n[0], x0), mul(n[1], y0), mul(n[2], z0)];
            let t1 = [mul(n[0], x1), mul(n[1], y1), mul(n[2], z1)];
            let (c0, c1) = (sum3(t0[0], t0[1], t0[2]), sum3(t1[0], t1[1], t1[2]));
            let one = splat(1.0);
            let inverse = div(one, sqrt(mul(a, b)));
            let dot = sum3(mul(x0, x1), mul(y0, y1), mul(z0, z1));
            let cos = mul(dot, inverse);
            let acute = estrin(&LUNE, sub(mul(splat(2.0), abs(cos)), one));
            let mut g = acute;
            if any_negative(cos) {
                let square = mul(sub(one, cos), add(one, cos));
                let turned = div(splat(std::f64::consts::PI), mul(square, sqrt(square)));
                g = select_negative(cos, sub(turned, acute), acute);
            }
            let w0 = add(one, mul(g, mul(sub(b, dot), inverse)));
            let w1 = add(one, mul(g, mul(sub(a, dot), inverse)));
            let lit = mul(add(mul(c0, w0), mul(c1, w1)), inverse);
            let value = mul(mul(splat(0.5), mul(length, inverse)), lit);
            let eighth = splat(0.125);
            let size0 = mul(eighth, sum3(abs(t0[0]), abs(t0[1]), abs(t0[2])));
            let size1 = mul(eighth, sum3(abs(t1[0]), abs(t1[1]), abs(t1[2])));
            let (low, high) = (splat(1e-70), splat(1e70));
            let trusted = greater_or_equal(c0, size0)
                & greater_or_equal(c1, size1)
                & greater(a, low)
                & greater(high, a)
                & greater(b, low)
                & greater(high, b)
                & greater(cos, splat(-0.5))
                & greater(length, splat(0.0));
            (value, trusted)
        }

        #[target_feature(enable = $feature)]
        pub(super) fn ribbons(block: &Block<'_>, n: DVec3, out: &mut [f64; LANES]) -> u8 {
            let n = [splat(n.x), splat(n.y), splat(n.z)];
            let mut bits = 0;
            for part in 0..LANES / $width {
                let p = [0, 1, 2, 3, 4, 5].map(|j| load(block[j], part * $width));
                let (value, trusted) = ribbon(p, n);
                store(value, out, part * $width);
                bits |= trusted << (part * $width);
            }
            bits
        }

        /// exp of what is not positive.
        #[inline]
        #[target_feature(enable = $feature)]
        fn exp_negative(x: V) -> V {
            let clamped = max(x, splat(-700.0));
            let shifted = add(mul(clamped, splat(std::f64::consts::LOG2_E)), splat(SHIFT));
            let n = sub(shifted, splat(SHIFT));
            let r = sub(
                sub(clamped, mul(n, splat(LN2_HIGH))),
                mul(n, splat(LN2_LOW)),
            );
            let c = &INVERSE_FACTORIALS;
            let r2 = mul(r, r);
            let r4 = mul(r2, r2);
            let quad = |i: usize| {
                add(
                    add(splat(c[i]), mul(splat(c[i + 1]), r)),
                    mul(add(splat(c[i + 2]), mul(splat(c[i + 3]), r)), r2),
                )
            };
            let tail = add(quad(0), mul(add(quad(4), mul(quad(8), r4)), r4));
            let mantissa = add(splat(1.0), add(r, mul(r2, tail)));
            zero_below(x, mul(mantissa, power_of_two(shifted)))
        }

        #[inline]
        #[target_feature(enable = $feature)]
        fn atanh_ratio(q: V) -> V {
            let c = &ODD_RECIPROCALS;
            let y = mul(q, q);
            let y2 = mul(y, y);
            let y4 = mul(y2, y2);
            let quad = |i: usize| {
                add(
                    add(splat(c[i]), mul(splat(c[i + 1]), y)),
                    mul(add(splat(c[i + 2]), mul(splat(c[i + 3]), y)), y2),
                )
            };
            add(quad(0), mul(add(quad(4), mul(quad(8), y4)), y4))
        }

        #[target_feature(enable = $feature)]
        pub(super) fn panel(panel: &Panel, k: f64, terms: &mut [f64; NODES]) {
            let (end, slope, one) = (splat(panel.half_tan), splat(panel.slope), splat(1.0));
            let wide = add(one, mul(end, end));
            let factor = |i: usize, s: V| {
                let [from, to] = panel.factors[i];
                let near = mul(
                    mul(sub(one, s), add(one, mul(end, mul(end, s)))),
                    splat(from),
                );
                add(near, mul(mul(s, wide), splat(to)))
            };
            for part in 0..NODES / $width {
                let s = load(&NODE, part * $width);
                let t = mul(end, s);
                let q = div(mul(t, add(t, slope)), sub(one, mul(slope, t)));
                let power = exp_negative(mul(mul(splat(-2.0 * k), q), atanh_ratio(q)));
                let inverse = div(one, add(one, mul(t, t)));
                let mut value = mul(mul(factor(0, s), inverse), inverse);
                if panel.count == 2 {
                    value = mul(value, mul(factor(1, s), inverse));
                }
                let term = mul(mul(load(&WEIGHT, part * $width), value), power);
                store(term, terms, part * $width);
            }
        }
    };
}

/// Eight lanes.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "whole-register loads and stores")]
mod avx512 {
    use super::*;
    use std::arch::x86_64::*;

    type V = __m512d;

    macro_rules! binary {
        ($($name:ident $intrinsic:ident),*) => {$(
            #[inline]
            #[target_feature(enable = "avx512f")]
            fn $name(a: V, b: V) -> V {
                $intrinsic(a, b)
            }
        )*};
    }
    binary!(add _mm512_add_pd, sub _mm512_sub_pd, mul _mm512_mul_pd, div _mm512_div_pd, max _mm512_max_pd);

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn splat(x: f64) -> V {
        _mm512_set1_pd(x)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn sqrt(x: V) -> V {
        _mm512_sqrt_pd(x)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn abs(x: V) -> V {
        _mm512_abs_pd(x)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load<const N: usize>(from: &[f64; N], at: usize) -> V {
        let lanes: &[f64; 8] = from[at..at + 8].try_into().expect("eight of them");
        // SAFETY: the array holds the eight numbers that are read, at any alignment.
        unsafe { _mm512_loadu_pd(lanes.as_ptr()) }
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn store<const N: usize>(x: V, to: &mut [f64; N], at: usize) {
        let lanes: &mut [f64; 8] = (&mut to[at..at + 8]).try_into().expect("eight of them");
        // SAFETY: the array holds the eight numbers that are written, at any alignment.
        unsafe { _mm512_storeu_pd(lanes.as_mut_ptr(), x) }
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn greater_or_equal(a: V, b: V) -> u8 {
        _mm512_cmp_pd_mask::<_CMP_GE_OQ>(a, b)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn greater(a: V, b: V) -> u8 {
        _mm512_cmp_pd_mask::<_CMP_GT_OQ>(a, b)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn any_negative(x: V) -> bool {
        greater(splat(0.0), x) != 0
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn select_negative(x: V, negative: V, other: V) -> V {
        _mm512_mask_blend_pd(greater(splat(0.0), x), other, negative)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn zero_below(x: V, value: V) -> V {
        _mm512_maskz_mov_pd(greater_or_equal(x, splat(-700.0)), value)
    }
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn power_of_two(shifted: V) -> V {
        let bits = _mm512_slli_epi64::<52>(_mm512_castpd_si512(shifted));
        _mm512_castsi512_pd(_mm512_add_epi64(bits, _mm512_set1_epi64(1023 << 52)))
    }

    kernels!("avx512f", 8);
}

/// Four lanes.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "whole-register loads and stores")]
mod avx2 {
    use super::*;
    use std::arch::x86_64::*;

    type V = __m256d;

    macro_rules! binary {
        ($($name:ident $intrinsic:ident),*) => {$(
            #[inline]
            #[target_feature(enable = "avx2")]
            fn $name(a: V, b: V) -> V {
                $intrinsic(a, b)
            }
        )*};
    }
    binary!(add _mm256_add_pd, sub _mm256_sub_pd, mul _mm256_mul_pd, div _mm256_div_pd, max _mm256_max_pd);

    #[inline]
    #[target_feature(enable = "avx2")]
    fn splat(x: f64) -> V {
        _mm256_set1_pd(x)
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn sqrt(x: V) -> V {
        _mm256_sqrt_pd(x)
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn abs(x: V) -> V {
        _mm256_andnot_pd(splat(-0.0), x)
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn load<const N: usize>(from: &[f64; N], at: usize) -> V {
        let lanes: &[f64; 4] = from[at..at + 4].try_into().expect("four of them");
        // SAFETY: the array holds the four numbers that are read, at any alignment.
        unsafe { _mm256_loadu_pd(lanes.as_ptr()) }
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn store<const N: usize>(x: V, to: &mut [f64; N], at: usize) {
        let lanes: &mut [f64; 4] = (&mut to[at..at + 4]).try_into().expect("four of them");
        // SAFETY: the array holds the four numbers that are written, at any alignment.
        unsafe { _mm256_storeu_pd(lanes.as_mut_ptr(), x) }
    }
    /// The sign bits of four lanes.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn bits(mask: V) -> u8 {
        u8::try_from(_mm256_movemask_pd(mask)).unwrap_or(0)
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn greater_or_equal(a: V, b: V) -> u8 {
        bits(_mm256_cmp_pd::<_CMP_GE_OQ>(a, b))
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn greater(a: V, b: V) -> u8 {
        bits(_mm256_cmp_pd::<_CMP_GT_OQ>(a, b))
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn any_negative(x: V) -> bool {
        greater(splat(0.0), x) != 0
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn select_negative(x: V, negative: V, other: V) -> V {
        _mm256_blendv_pd(other, negative, _mm256_cmp_pd::<_CMP_LT_OQ>(x, splat(0.0)))
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn zero_below(x: V, value: V) -> V {
        _mm256_and_pd(value, _mm256_cmp_pd::<_CMP_GE_OQ>(x, splat(-700.0)))
    }
    #[inline]
    #[target_feature(enable = "avx2")]
    fn power_of_two(shifted: V) -> V {
        let bits = _mm256_slli_epi64::<52>(_mm256_castpd_si256(shifted));
        _mm256_castsi256_pd(_mm256_add_epi64(bits, _mm256_set1_epi64x(1023 << 52)))
    }

    kernels!("avx2", 4);
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::rng::SplitMix64;

    fn levels() -> Vec<Level> {
        let mut levels = vec![Level::Scalar];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                levels.push(Level::Avx2);
            }
            if std::arch::is_x86_feature_detected!("avx512f") {
                levels.push(Level::Avx512);
            }
        }
        levels
    }

    #[test]
    fn panels_have_the_same_bits_at_every_level() {
        let mut rng = SplitMix64::new(5);
        for _ in 0..2000 {
            let mut random = || rng.next_f64();
            let panel_data = Panel {
                half_tan: 0.3 * random(),
                slope: random(),
                factors: [[random(), random()], [random(), random()]],
                count: 1 + usize::from(random() < 0.5),
            };
            let k = 10f64.powf(5.0 * random());
            let results: Vec<[u64; NODES]> = levels()
                .into_iter()
                .map(|level| {
                    let mut terms = [0.0; NODES];
                    panel(&panel_data, k, &mut terms, level);
                    terms.map(f64::to_bits)
                })
                .collect();
            assert!(
                results.iter().all(|r| *r == results[0]),
                "{panel_data:?} {k}"
            );
        }
    }

    #[test]
    fn ribbons_have_the_same_bits_at_every_level() {
        let mut rng = SplitMix64::new(6);
        for _ in 0..2000 {
            let columns: [[f64; LANES]; 6] =
                std::array::from_fn(|_| std::array::from_fn(|_| rng.in_range(-1.0, 1.5)));
            let block: Block<'_> = std::array::from_fn(|j| &columns[j]);
            let n = DVec3::from_array(rng.unit_vector());
            let results: Vec<([u64; LANES], u8)> = levels()
                .into_iter()
                .map(|level| {
                    let mut out = [0.0; LANES];
                    let bits = ribbons(&block, n, &mut out, level);
                    for (i, value) in out.iter_mut().enumerate() {
                        if bits >> i & 1 == 0 {
                            *value = 0.0;
                        }
                    }
                    (out.map(f64::to_bits), bits)
                })
                .collect();
            assert!(results.iter().all(|r| *r == results[0]), "{columns:?} {n}");
        }
    }
}
