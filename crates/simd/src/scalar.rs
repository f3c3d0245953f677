//! The vector operations in plain Rust. The results of all other instruction sets have to be
//! bit-identical to these.

use crate::{Lanes, Simd};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// The instruction set of plain Rust, for eight numbers at a time.
#[derive(Clone, Copy, Debug)]
pub struct Scalar;

/// A single `f64` in place of eight, for formulas that are generic over [`Lanes`].
#[derive(Clone, Copy, Debug)]
pub struct One;

/// Eight numbers or truth values, in an array.
#[derive(Clone, Copy, Debug)]
pub struct Eight<T>([T; 8]);

#[inline(always)]
fn zip<T: Copy, U: Copy, V>(a: [T; 8], b: [U; 8], f: impl Fn(T, U) -> V) -> [V; 8] {
    std::array::from_fn(|i| f(a[i], b[i]))
}

/// Returns a mask with a bit for each true lane, lane 0 in the lowest bit.
#[inline(always)]
fn pack(a: [bool; 8]) -> u8 {
    let mut bits = 0;
    for (i, &set) in a.iter().enumerate() {
        bits |= u8::from(set) << i;
    }
    bits
}

/// Returns `a·b + c`, rounded once, even if the processor has no instruction for it. So culling
/// keeps the same boxes and triangles on every machine, and work counters agree.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "rounded")]
fn fused(a: f32, b: f32, c: f32) -> f32 {
    // The product is exact in `f64`. The sum is rounded to odd (Boldo & Melquiond 2008): then
    // rounding it to `f32` gives the same as a single rounding.
    let (product, c) = (f64::from(a) * f64::from(b), f64::from(c));
    let sum = product + c;
    let part = sum - product;
    let lost = (product - (sum - part)) + (c - part);
    let bits = sum.to_bits();
    let even = bits & 1 == 0;
    // If the sum is exact, it stays as it is; also if it is not finite, where `lost` is NaN.
    let odd = match (lost.abs() > 0.0 && even, (lost > 0.0) == (sum > 0.0)) {
        (false, _) => bits,
        (true, true) => bits + 1,
        (true, false) => bits - 1,
    };
    f64::from_bits(odd) as f32
}

/// Operators between two vectors of eight, and between a vector and a number.
macro_rules! operators {
    ($t:ty: $($trait:ident $name:ident,)*) => {$(
        impl $trait for Eight<$t> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: Self) -> Self {
                Self(zip(self.0, b.0, |a, b| a.$name(b)))
            }
        }
        impl $trait<$t> for Eight<$t> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, b: $t) -> Self {
                Self(self.0.map(|a| a.$name(b)))
            }
        }
    )*};
}
operators!(f32: Add add, Sub sub, Mul mul, Div div,);
operators!(f64: Add add, Sub sub, Mul mul, Div div,);
operators!(bool: BitAnd bitand, BitOr bitor,);

impl Not for Eight<bool> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|a| !a))
    }
}

impl Lanes for One {
    type D = f64;
    type M = bool;

    #[inline(always)]
    fn dsplat(self, a: f64) -> f64 {
        a
    }
    #[inline(always)]
    fn dmin(self, a: f64, b: f64) -> f64 {
        if a < b { a } else { b }
    }
    #[inline(always)]
    fn dmax(self, a: f64, b: f64) -> f64 {
        if a > b { a } else { b }
    }
    #[inline(always)]
    fn dsqrt(self, a: f64) -> f64 {
        a.sqrt()
    }
    #[inline(always)]
    fn dle(self, a: f64, b: f64) -> bool {
        a <= b
    }
    #[inline(always)]
    fn dlt(self, a: f64, b: f64) -> bool {
        a < b
    }
    #[inline(always)]
    fn select(self, m: bool, a: f64, b: f64) -> f64 {
        if m { b } else { a }
    }
    #[inline(always)]
    fn exp2(self, n: f64) -> f64 {
        // The low bits hold n in two's complement; shift them to the exponent.
        f64::from_bits((n.to_bits() << 52).wrapping_add(1023 << 52))
    }
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn polynomials(self, c: &[[f64; 2]; 8], s: f64) -> [f64; 2] {
        crate::x86::polynomials_of_one(c, s)
    }
}

impl Lanes for Scalar {
    type D = Eight<f64>;
    type M = Eight<bool>;

    #[inline(always)]
    fn dsplat(self, a: f64) -> Self::D {
        Eight([a; 8])
    }
    #[inline(always)]
    fn dmin(self, a: Self::D, b: Self::D) -> Self::D {
        Eight(zip(a.0, b.0, |a, b| One.dmin(a, b)))
    }
    #[inline(always)]
    fn dmax(self, a: Self::D, b: Self::D) -> Self::D {
        Eight(zip(a.0, b.0, |a, b| One.dmax(a, b)))
    }
    #[inline(always)]
    fn dsqrt(self, a: Self::D) -> Self::D {
        Eight(a.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn dle(self, a: Self::D, b: Self::D) -> Self::M {
        Eight(zip(a.0, b.0, |a, b| a <= b))
    }
    #[inline(always)]
    fn dlt(self, a: Self::D, b: Self::D) -> Self::M {
        Eight(zip(a.0, b.0, |a, b| a < b))
    }
    #[inline(always)]
    fn select(self, m: Self::M, a: Self::D, b: Self::D) -> Self::D {
        Eight(std::array::from_fn(
            |i| if m.0[i] { b.0[i] } else { a.0[i] },
        ))
    }
    #[inline(always)]
    fn exp2(self, n: Self::D) -> Self::D {
        Eight(n.0.map(|n| One.exp2(n)))
    }
}

impl Simd for Scalar {
    type F = Eight<f32>;

    #[inline(always)]
    fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        // In a function of its own, like code for instruction sets, so that the caller that chooses
        // among them need not save its registers.
        #[inline(never)]
        fn inner<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        inner(f)
    }
    #[inline(always)]
    fn prefetch<T>(self, _: &T) {}

    #[inline(always)]
    fn load(self, a: &[f32; 8]) -> Self::F {
        Eight(*a)
    }
    #[inline(always)]
    fn store(self, a: Self::F, out: &mut [f32; 8]) {
        *out = a.0;
    }
    #[inline(always)]
    fn splat(self, a: f32) -> Self::F {
        Eight([a; 8])
    }
    #[inline(always)]
    fn fma(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        Eight(std::array::from_fn(|i| fused(a.0[i], b.0[i], c.0[i])))
    }
    #[inline(always)]
    fn fms(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        Eight(std::array::from_fn(|i| fused(a.0[i], b.0[i], -c.0[i])))
    }
    #[inline(always)]
    fn min(self, a: Self::F, b: Self::F) -> Self::F {
        Eight(zip(a.0, b.0, |a, b| if a < b { a } else { b }))
    }
    #[inline(always)]
    fn max(self, a: Self::F, b: Self::F) -> Self::F {
        Eight(zip(a.0, b.0, |a, b| if a > b { a } else { b }))
    }
    #[inline(always)]
    fn abs(self, a: Self::F) -> Self::F {
        Eight(a.0.map(f32::abs))
    }
    #[inline(always)]
    fn le(self, a: Self::F, b: Self::F) -> u8 {
        pack(zip(a.0, b.0, |a, b| a <= b))
    }
    #[inline(always)]
    fn lt(self, a: Self::F, b: Self::F) -> u8 {
        pack(zip(a.0, b.0, |a, b| a < b))
    }
    #[inline(always)]
    fn compress(self, m: u8, a: Self::F, out: &mut [f32], at: usize) {
        squeeze(m, &a.0, &mut out[at..at + 8]);
    }
    #[inline(always)]
    fn pack(self, m: u8, a: &[u32; 8], out: &mut [u32], at: usize) {
        squeeze(m, a, &mut out[at..at + 8]);
    }
    #[inline(always)]
    fn bin_masks(self, first: Self::F, last: Self::F, out: &mut [u64; 8]) {
        for ((bits, first), last) in out.iter_mut().zip(first.0).zip(last.0) {
            let (first, last) = (first.to_bits() & 63, last.to_bits() & 63);
            *bits = (u64::MAX << first) & (u64::MAX >> (63 - last));
        }
    }
    #[inline(always)]
    fn intersects(self, a: &[u64; 8], b: u64) -> u8 {
        pack(a.map(|a| a & b != 0))
    }
    #[inline(always)]
    fn in_range(self, a: &[u32; 8], start: u32, len: u32) -> u8 {
        pack(a.map(|a| a.wrapping_sub(start) < len))
    }

    #[inline(always)]
    fn dload(self, a: &[f64; 8]) -> Self::D {
        Eight(*a)
    }
    #[inline(always)]
    fn dstore(self, a: Self::D, out: &mut [f64; 8]) {
        *out = a.0;
    }
    #[inline(always)]
    fn widen(self, a: Self::F) -> Self::D {
        Eight(a.0.map(f64::from))
    }
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "rounded")]
    fn narrow(self, a: Self::D) -> Self::F {
        Eight(a.0.map(|x| x as f32))
    }
    #[inline(always)]
    fn bits(self, a: Self::M) -> u8 {
        pack(a.0)
    }
    #[inline(always)]
    fn dcompress(self, m: u8, a: Self::D, out: &mut [f64], at: usize) {
        squeeze(m, &a.0, &mut out[at..at + 8]);
    }
    #[inline(always)]
    fn dsum(self, a: Self::D) -> f64 {
        let a = a.0;
        ((a[0] + a[4]) + (a[1] + a[5])) + ((a[2] + a[6]) + (a[3] + a[7]))
    }
}

/// Copies the lanes in the mask `m` to the front of `out`, in order.
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

    /// Numbers of all sizes, among them pairs that nearly cancel and sums that are close to halfway
    /// between two numbers.
    fn numbers() -> impl Strategy<Value = [f32; 3]> {
        let all = prop::array::uniform3(any::<f32>());
        let near =
            (any::<f32>(), any::<f32>(), -4..4_i32, 0..60_i32).prop_map(|(a, b, off, down)| {
                let c = -(a * b);
                let c = f32::from_bits(c.to_bits().wrapping_add_signed(off));
                [a, b, c * 2.0_f32.powi(-down / 2)]
            });
        // Numbers with few digits, whose sums are exactly halfway between two numbers.
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
