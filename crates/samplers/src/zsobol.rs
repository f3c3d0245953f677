//! Owen–Sobol' points dealt out to the pixels along a shuffled Z-order curve.

use crate::block::Block;
use crate::hash::{lane, mix};
use crate::permute::Permutation;
use crate::sobol::{scrambled_1d, scrambled_2d, scrambles};

/// One Owen-scrambled Sobol' sequence per dimension for the whole image.
///
/// **Method.** Ahmed & Wonka 2020, *Screen-space blue-noise diffusion of Monte Carlo sampling error
/// via hierarchical ordering of pixels*: the pixels take consecutive runs of N indices along a
/// Z-order curve whose base-4 digits are permuted at random, each depending on the digits above it
/// and on the dimension. Neighbouring pixels thus hold parts of one larger set, and their errors
/// cancel under a blur (error like blue noise), while each pixel's own points are a net if N = 2^m.
/// For any other N the paper takes the first of 2^m > N indices; then all pixels leave out the same
/// part of the square, and their errors add up (blotches).
///
/// **Domain.** Pixel coordinates below 2¹⁶ share one curve; beyond, each tile of 2¹⁶ × 2¹⁶ pixels
/// has its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ZSobol {
    /// Where the indices of the pixel's block start.
    first: u64,
    order: Permutation,
    scramble: [u64; 2],
}

impl ZSobol {
    /// `tile_key` must depend on seed, dimension and pixel tile only; `own`, the key of the block,
    /// on the pixel as well.
    #[inline]
    pub(crate) fn new(tile_key: u64, own: u64, pixel: [u32; 2], count: u32, block: Block) -> Self {
        let curve = u64::from(shuffled_z_order(pixel, lane(tile_key, 2)));
        let blocks = curve
            .wrapping_mul(u64::from(block.of()))
            .wrapping_add(u64::from(block.index()));
        Self {
            first: blocks.wrapping_mul(u64::from(count)),
            order: Permutation::new(count, own),
            scramble: scrambles(tile_key),
        }
    }

    #[inline]
    fn index(&self, i: u32) -> u64 {
        self.first.wrapping_add(u64::from(self.order.get(i)))
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        scrambled_1d(high_fraction(self.index(i)), self.scramble)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let index = self.index(i);
        scrambled_2d(
            [high_fraction(index), high_fraction(pascal(index))],
            self.scramble,
        )
    }
}

/// The first 32 digits of the fraction whose digits are the bits of `mirrored`, lowest first.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "the low half holds the first 32 digits"
)]
fn high_fraction(mirrored: u64) -> u32 {
    (mirrored as u32).reverse_bits()
}

/// The generator matrix of the second Sobol' dimension for 64-bit indices; see [`crate::sobol_02`].
#[inline]
fn pascal(mut y: u64) -> u64 {
    y ^= (y & 0xAAAA_AAAA_AAAA_AAAA) >> 1;
    y ^= (y & 0xCCCC_CCCC_CCCC_CCCC) >> 2;
    y ^= (y & 0xF0F0_F0F0_F0F0_F0F0) >> 4;
    y ^= (y & 0xFF00_FF00_FF00_FF00) >> 8;
    y ^= (y & 0xFFFF_0000_FFFF_0000) >> 16;
    y ^ (y >> 32)
}

/// The position of a pixel (16 bits a coordinate) on a Z-order curve with nested random digit
/// permutations.
#[inline]
fn shuffled_z_order(pixel: [u32; 2], key: u64) -> u32 {
    let mut position = 0;
    for level in 0..16 {
        // The digits above, as they were before their permutation: no digit waits for another.
        let above = pixel.map(|c| u64::from((c & 0xFFFF) >> level >> 1));
        let choice = mix(key ^ lane(above[0] << 20 | above[1] << 4, level));
        let digit = (pixel[0] >> level & 1) | (pixel[1] >> level & 1) << 1;
        position |= permuted_digit(choice, digit) << (2 * level);
    }
    position
}

/// Permutes a base-4 digit by one of the 24 permutations: the map d ↦ A·d + b over two bits, with A
/// one of the six invertible 2×2 matrices; all permutations of four things are of this form.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "values below 6 and below 4"
)]
fn permuted_digit(choice: u64, digit: u32) -> u32 {
    // Columns (image of 1, image of 2) of the six matrices.
    const MATRICES: [[u32; 2]; 6] = [[1, 2], [2, 1], [1, 3], [3, 1], [2, 3], [3, 2]];
    let [one, two] = MATRICES[(((choice >> 32) * 6) >> 32) as usize];
    ((digit & 1) * one) ^ ((digit >> 1) * two) ^ (choice as u32 & 3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sobol_02;

    #[test]
    fn agrees_with_the_32_bit_sequence() {
        for i in (0..5_000).chain([u32::MAX, 0x1234_5678]) {
            assert_eq!(
                [
                    high_fraction(u64::from(i)),
                    high_fraction(pascal(u64::from(i)))
                ],
                sobol_02(i)
            );
        }
    }

    #[test]
    fn all_24_digit_permutations_occur() {
        let mut seen = std::collections::BTreeSet::new();
        for c in 0..2_000 {
            let image: Vec<u32> = (0..4).map(|d| permuted_digit(mix(c), d)).collect();
            let mut sorted = image.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3]);
            seen.insert(image);
        }
        assert_eq!(seen.len(), 24);
    }

    #[test]
    fn the_curve_visits_every_pixel_of_a_quad_once() {
        for key in 0..4 {
            let mut seen = vec![false; 256];
            let corner = shuffled_z_order([32, 48], key) >> 8;
            for x in 32..48 {
                for y in 48..64 {
                    let p = shuffled_z_order([x, y], key);
                    assert_eq!(p >> 8, corner);
                    assert!(!std::mem::replace(&mut seen[(p & 255) as usize], true));
                }
            }
        }
    }
}
