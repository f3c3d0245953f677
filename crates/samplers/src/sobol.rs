//! This module holds the Sobol' (0,2)-sequence, Owen-scrambled and shuffled, in 32-bit arithmetic
//! with f64 results.

use crate::block::Block;
use crate::hash::lane;
use crate::owen::{deepen, owen_scramble};
use crate::permute::Permutation;
use linelit_simd::{Isa, Simd, dispatch};

/// Returns the `index`-th point of the van der Corput sequence in base 2 as a 32-bit fraction: the
/// digits of the index are mirrored at the binary point. It is the first coordinate of the Sobol'
/// sequence.
///
/// ```
/// assert_eq!(linelit_samplers::van_der_corput(1), 1 << 31); // 1/2
/// assert_eq!(linelit_samplers::van_der_corput(6), 0b011 << 29); // 3/8
/// ```
#[inline]
#[must_use]
pub const fn van_der_corput(index: u32) -> u32 {
    index.reverse_bits()
}

/// Returns the `index`-th point of the Sobol' (0,2)-sequence, as two 32-bit fractions.
///
/// **Formula.** x is [`van_der_corput`]; the generator matrix of y is the Pascal triangle modulo
/// two (direction numbers v₁ = ½, v_{k+1} = v_k ⊕ v_k/2; Sobol' 1967, second dimension). This
/// matrix is the fifth Kronecker power of the 2×2 matrix with ones on and above the diagonal, so
/// that five butterfly steps replace a loop over the bits of the index.
///
/// **Guarantee.** Any 2^m points whose index starts at a multiple of 2^m have one point in each
/// elementary interval of the area 2^−m, for all m ≤ 32.
///
/// ```
/// let points: Vec<[u32; 2]> = (0..4).map(linelit_samplers::sobol_02).collect();
/// let quarters: Vec<[u32; 2]> = points.iter().map(|p| [p[0] >> 30, p[1] >> 30]).collect();
/// assert_eq!(quarters, [[0, 0], [2, 2], [1, 3], [3, 1]]);
/// ```
#[inline]
#[must_use]
pub const fn sobol_02(index: u32) -> [u32; 2] {
    let mut y = index;
    y ^= (y & 0xAAAA_AAAA) >> 1;
    y ^= (y & 0xCCCC_CCCC) >> 2;
    y ^= (y & 0xF0F0_F0F0) >> 4;
    y ^= (y & 0xFF00_FF00) >> 8;
    y ^= (y & 0xFFFF_0000) >> 16;
    [index.reverse_bits(), y.reverse_bits()]
}

/// One padded dimension: the first N points of an Owen-scrambled Sobol' sequence, in random order.
///
/// Every dimension reuses the same one- or two-dimensional sequence with its own scrambling *and*
/// its own order (Burley 2020, section 5, *padding*). Burley's order is a nested scrambling of the
/// index, for which all aligned blocks are nets. But then two neighbouring samples lie in opposite
/// halves of *every* dimension, and for the product of two padded dimensions, (x − ½)(y − ½), the
/// variance is 1.58 times the variance with a random pairing. Here the order is a random
/// permutation of the N indices: the set is the same, and the pairing is random.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct OwenSobol {
    order: Permutation,
    pub(crate) scramble: [u64; 2],
    /// The index of the block's first point in the sequence.
    first: u64,
    /// The mask of the bits of indices; after it the sequence begins again.
    bits: u64,
}

impl OwenSobol {
    /// Makes the sequence from the keys of pattern and block; it repeats after 2³² points.
    #[inline]
    pub(crate) fn new([all, own]: [u64; 2], count: u32, block: Block) -> Self {
        Self {
            order: Permutation::new(count, own),
            scramble: scrambles(all),
            first: u64::from(block.index().wrapping_mul(count)),
            bits: u64::from(u32::MAX),
        }
    }

    /// Makes the points of one sequence for the whole image, from the position of the block's pixel
    /// on a curve. `tile_key` must depend only on the seed, the dimension and the pixel's tile;
    /// `own`, the key of the block, depends on the pixel as well.
    #[inline]
    pub(crate) fn along_curve(
        [tile_key, own]: [u64; 2],
        place: u32,
        count: u32,
        block: Block,
    ) -> Self {
        let blocks = u64::from(place)
            .wrapping_mul(u64::from(block.of()))
            .wrapping_add(u64::from(block.index()));
        Self {
            order: Permutation::new(count, own),
            scramble: scrambles(tile_key),
            first: blocks.wrapping_mul(u64::from(count)),
            bits: u64::MAX,
        }
    }

    /// Returns the index of sample `i` in the sequence.
    #[inline]
    pub(crate) fn number(&self, i: u32) -> u64 {
        self.first.wrapping_add(u64::from(self.order.get(i))) & self.bits
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.first_axis(self.number(i))
    }

    /// Returns the first coordinate of a point of the sequence.
    #[inline]
    pub(crate) fn first_axis(&self, number: u64) -> f64 {
        scrambled_1d(high_fraction(number), self.scramble)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let number = self.number(i);
        let point = [number, pascal(number)].map(high_fraction);
        scrambled_2d(point, self.scramble)
    }

    /// Fills the columns with points from `first` on, all of them within the set.
    pub(crate) fn fill_2d(&self, first: u32, x: &mut [f64], y: &mut [f64]) {
        if self.bits > u64::from(u32::MAX) {
            for (i, (x, y)) in (first..).zip(x.iter_mut().zip(y)) {
                [*x, *y] = self.get_2d(i);
            }
            return;
        }
        for (x, i) in x.iter_mut().zip(first..) {
            *x = self.number(i) as f64;
        }
        into_net(Isa::best(), self.scramble, x, y);
    }
}

/// Computes the points of the sequence whose indices `x` holds: [`OwenSobol::get_2d`] to the bit.
///
/// It is a plain loop that compilers vectorize.
#[inline(always)]
fn net_kernel<S: Simd>(_: S, scramble: [u64; 2], x: &mut [f64], y: &mut [f64]) {
    for (x, y) in x.iter_mut().zip(y) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers below 2^32"
        )]
        let number = *x as u32;
        [*x, *y] = scrambled_2d(sobol_02(number), scramble);
    }
}
dispatch! {
    fn into_net = net_kernel(scramble: [u64; 2], x: &mut [f64], y: &mut [f64])
}

/// Returns the first 32 digits of the fraction whose digits are the bits of `mirrored`, lowest
/// first.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "the low half holds the first 32 digits"
)]
const fn high_fraction(mirrored: u64) -> u32 {
    van_der_corput(mirrored as u32)
}

/// Applies the generator matrix of the second dimension to 64-bit indices; see [`sobol_02`].
#[inline]
const fn pascal(mut y: u64) -> u64 {
    y ^= (y & 0xAAAA_AAAA_AAAA_AAAA) >> 1;
    y ^= (y & 0xCCCC_CCCC_CCCC_CCCC) >> 2;
    y ^= (y & 0xF0F0_F0F0_F0F0_F0F0) >> 4;
    y ^= (y & 0xFF00_FF00_FF00_FF00) >> 8;
    y ^= (y & 0xFFFF_0000_FFFF_0000) >> 16;
    y ^ (y >> 32)
}

/// Returns the scrambling seeds of the two axes.
#[inline]
const fn scrambles(key: u64) -> [u64; 2] {
    [lane(key, SCRAMBLE), lane(key, SCRAMBLE + 1)]
}

/// The first lane of a key for scrambling; lanes below belong to its permutation.
const SCRAMBLE: u64 = 1 << 32;

/// Scrambles a fraction and continues it to 53 digits.
#[inline]
pub(crate) const fn scrambled_1d(fraction: u32, scramble: [u64; 2]) -> f64 {
    deepen(owen_scramble(fraction, scramble[0]), scramble[1])
}

/// Scrambles both coordinates of a point and continues them to 53 digits.
#[inline]
pub(crate) const fn scrambled_2d(point: [u32; 2], scramble: [u64; 2]) -> [f64; 2] {
    [
        scrambled_1d(point[0], scramble),
        scrambled_1d(point[1], [scramble[1], scramble[0]]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both are linear over the bits of the index, so that these say all.
    #[test]
    fn butterfly_is_the_generator_matrix() {
        let mut direction = 1 << 31;
        for bit in 0..32 {
            assert_eq!(sobol_02(1 << bit), [1 << (31 - bit), direction], "{bit}");
            direction ^= direction >> 1;
        }
    }
}
