//! This module distributes Owen–Sobol' points over the pixels along a shuffled Z-order curve.

use crate::block::Block;
use crate::hash::{lane, mix};
use crate::sobol::OwenSobol;

/// Makes one Owen-scrambled Sobol' sequence per dimension for the whole image.
///
/// **Method.** Ahmed & Wonka 2020, *Screen-space blue-noise diffusion of Monte Carlo sampling error
/// via hierarchical ordering of pixels*: the pixels take consecutive runs of N indices along a
/// Z-order curve whose base-4 digits are permuted at random, each depending on the digits above it
/// and on the dimension. Neighbouring pixels therefore have parts of one larger set, and their
/// errors cancel under a blur (the error is like blue noise), while each pixel's own points are a
/// net if N = 2^m. For any other N the paper takes the first of 2^m > N indices. Then all pixels
/// leave out the same part of the square, and their errors add up (blotches); here the runs have
/// the length N.
///
/// **Domain.** Pixel coordinates below 2¹⁶ share one curve; beyond, each tile of 2¹⁶ × 2¹⁶ pixels
/// has its own curve. The keys are the keys of [`OwenSobol::along_curve`].
#[inline]
pub(crate) fn z_sobol(keys: [u64; 2], pixel: [u32; 2], count: u32, block: Block) -> OwenSobol {
    let place = shuffled_z_order(pixel, lane(keys[0], 2));
    OwenSobol::along_curve(keys, place, count, block)
}

/// Returns the position of a pixel (with 16 bits per coordinate) on a Z-order curve with nested
/// random permutations of digits.
#[inline]
fn shuffled_z_order(pixel: [u32; 2], key: u64) -> u32 {
    let mut position = 0;
    for level in 0..16 {
        // Use the digits above before their permutation, so that no digit waits for another.
        let above = pixel.map(|c| u64::from((c & 0xFFFF) >> level >> 1));
        let choice = mix(key ^ lane(above[0] << 20 | above[1] << 4, level));
        let digit = (pixel[0] >> level & 1) | (pixel[1] >> level & 1) << 1;
        position |= permuted_digit(choice, digit) << (2 * level);
    }
    position
}

/// Permutes a base-4 digit by one of the 24 permutations: the map d ↦ A·d + b over two bits, with A
/// one of the six invertible 2×2 matrices. All permutations of four elements have this form.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "values below 6 and below 4"
)]
fn permuted_digit(choice: u64, digit: u32) -> u32 {
    // The columns (images of 1 and of 2) of the six matrices.
    const MATRICES: [[u32; 2]; 6] = [[1, 2], [2, 1], [1, 3], [3, 1], [2, 3], [3, 2]];
    let [one, two] = MATRICES[(((choice >> 32) * 6) >> 32) as usize];
    ((digit & 1) * one) ^ ((digit >> 1) * two) ^ (choice as u32 & 3)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
