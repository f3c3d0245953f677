//! The scalar twin: what every other instruction set is held to.

use crate::Simd;

/// Plain Rust.
#[derive(Clone, Copy, Debug)]
pub struct Scalar;

#[inline(always)]
fn zip<T: Copy, U: Copy, V>(a: [T; 8], b: [U; 8], f: impl Fn(T, U) -> V) -> [V; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

#[inline(always)]
fn pack(a: [bool; 8]) -> u8 {
    let mut bits = 0;
    for (i, &set) in a.iter().enumerate() {
        bits |= u8::from(set) << i;
    }
    bits
}

/// `a·b + c` rounded once, whether or not the processor has an instruction for it: culling then
/// keeps the same boxes and triangles everywhere, and counters agree.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "rounded")]
fn fused(a: f32, b: f32, c: f32) -> f32 {
    // The product is exact in `f64`; the sum is rounded to odd (Boldo & Melquiond 2008), so that
    // rounding it once more gives what rounding once would have.
    let (product, c) = (f64::from(a) * f64::from(b), f64::from(c));
    let sum = product + c;
    let part = sum - product;
    let lost = (product - (sum - part)) + (c - part);
    let bits = sum.to_bits();
    let even = bits & 1 == 0;
    // Nothing is lost of what is exact, nor (a NaN) of what is not finite.
    let odd = match (lost.abs() > 0.0 && even, (lost > 0.0) == (sum > 0.0)) {
        (false, _) => bits,
        (true, true) => bits + 1,
        (true, false) => bits - 1,
    };
    f64::from_bits(odd) as f32
}

impl Simd for Scalar {
    type F = [f32; 8];
    type D = [f64; 8];
    type M = [bool; 8];

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}

    #[inline(always)]
    fn load(self, a: &[f32; 8]) -> Self::F {
        *a
    }
    #[inline(always)]
    fn store(self, a: Self::F, out: &mut [f32; 8]) {
        *out = a;
    }
    #[inline(always)]
    fn splat(self, a: f32) -> Self::F {
        [a; 8]
    }
    #[inline(always)]
    fn add(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|i| fused(a[i], b[i], c[i]))
    }
    #[inline(always)]
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        std::array::from_fn(|i| fused(a[i], b[i], -c[i]))
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u8 {
        pack(zip(a, b, |a, b| a <= b))
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u8 {
        pack(zip(a, b, |a, b| a < b))
    }
    #[inline(always)]
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize) {
        squeeze(m, &a, &mut out[at..at + 8]);
    }
    #[inline(always)]
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize) {
        squeeze(m, a, &mut out[at..at + 8]);
    }
    #[inline(always)]
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]) {
        for ((bits, first), last) in out.iter_mut().zip(first).zip(last) {
            let (first, last) = (first.to_bits() & 63, last.to_bits() & 63);
            *bits = (u64::MAX << first) & (u64::MAX >> (63 - last));
        }
    }
    #[inline(always)]
    fn intersects(self, a: &[u64; 8], b: u64) -> u8 {
        pack(zip(*a, [b; 8], |a, b| a & b != 0))
    }
    #[inline(always)]
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8 {
        pack(a.map(|a| a.wrapping_sub(start) < len))
    }

    #[inline(always)]
    fn dload(self, a: &[f64; 8]) -> Self::D {
        *a
    }
    #[inline(always)]
    fn dstore(self, a: Self::D, out: &mut [f64; 8]) {
        *out = a;
    }
    #[inline(always)]
    fn dsplat(self, a: f64) -> Self::D {
        [a; 8]
    }
    #[inline(always)]
    fn widen(self, a: Self::F) -> Self::D {
        a.map(f64::from)
    }
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounded")]
    fn narrow(self, a: Self::D) -> Self::F {
        a.map(|x| x as f32)
    }
    #[inline(always)]
    fn dadd(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn dsub(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn dmul(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn ddiv(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn dle(self, a: Self::D, b: Self::D) -> Self::M {
        zip(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M {
        zip(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D {
        std::array::from_fn(|i| if m[i] { b[i] } else { a[i] })
    }
    #[inline(always)]
    fn and(self, a: Self::M, b: Self::M) -> Self::M {
        zip(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn or(self, a: Self::M, b: Self::M) -> Self::M {
        zip(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn not(self, a: Self::M) -> Self::M {
        a.map(|a| !a)
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u8 {
        pack(a)
    }
    #[inline(always)]
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize) {
        squeeze(m, &a, &mut out[at..at + 8]);
    }
}

/// Moves the lanes of `m` to the front.
#[inline(always)]
fn squeeze<T: Copy>(m: u8, a: &[T; 8], out: &mut [T]) {
    let mut m = m;
    for slot in out {
        if m == 0 {
            break;
        }
        *slot = a[m.trailing_zeros() as usize];
        m &= m - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::fused;
    use proptest::prelude::*;

    /// Numbers of all sizes, and such as cancel nearly or are next to halfway.
    fn numbers() -> impl Strategy<Value = [f32; 3]> {
        let all = prop::array::uniform3(any::<f32>());
        let near =
            (any::<f32>(), any::<f32>(), -4..4_i32, 0..60_i32).prop_map(|(a, b, off, down)| {
                let c = -(a * b);
                let c = f32::from_bits(c.to_bits().wrapping_add_signed(off));
                [a, b, c * 2.0_f32.powi(-down / 2)]
            });
        // Few digits: sums that end halfway between two numbers.
        let short = prop::array::uniform3((-4096..4096_i16, -30..30_i32))
            .prop_map(|x| x.map(|(m, e)| f32::from(m) * 2.0_f32.powi(e)));
        prop_oneof![all, near, short]
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: linelit_testkit::cases::cases(20_000),
            failure_persistence: None,
            ..ProptestConfig::default()
        })]

        #[test]
        fn sums_are_rounded_once([a, b, c] in numbers()) {
            let (got, want) = (fused(a, b, c), a.mul_add(b, c));
            prop_assert!(
                got.to_bits() == want.to_bits() || (got.is_nan() && want.is_nan()),
                "{a:e} {b:e} {c:e}: {got:e} {want:e}"
            );
        }
    }
}
