//! This module holds the Halton sequence in bases 2 and 3, Owen-scrambled, with its points in
//! random order.

use crate::block::Block;
use crate::hash::{below_one, mix, unit_f64};
use crate::sobol::OwenSobol;

/// The first N points of an Owen-scrambled Halton sequence, in random order.
///
/// **Formula.** 1-D: the radical inverse in base 2 (van der Corput); 2-D: bases 2 and 3 (Halton
/// 1960). Digits are scrambled by nested uniform permutations (Owen 1995) and continued at random
/// to the last bit.
///
/// Every padded dimension reuses bases 2 and 3 with its own scrambling and its own order of the
/// same N points, which keeps dimensions independent; the order depends on N, so that the sets for
/// different N are not nested.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Halton {
    /// The sequence in base 2, with the order of the points.
    base_2: OwenSobol,
    /// The number of base-3 digits that distinguish the points of all blocks, and the weight
    /// 3^−digits of the last digit.
    digits: u32,
    weight: f64,
}

impl Halton {
    /// Makes the sequence from the keys of pattern and block; it repeats after 2³² points.
    #[inline]
    pub(crate) fn new(keys: [u64; 2], count: u32, block: Block) -> Self {
        let (mut digits, mut power) = (0, 1_u64);
        let points = u64::from(count) * u64::from(block.of());
        while power < points.min(1 << 32) {
            digits += 1;
            power *= 3;
        }
        Self {
            base_2: OwenSobol::new(keys, count, block),
            digits,
            weight: 1.0 / power as f64,
        }
    }

    #[inline]
    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.base_2.get_1d(i)
    }

    #[inline]
    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let number = self.base_2.number(i);
        [self.base_2.first_axis(number), self.base_3(number)]
    }

    /// Returns the scrambled radical inverse in base 3, digit by digit. The state is a hash of the
    /// digits so far, and chooses one of the six affine maps a·d + b mod 3.
    #[inline]
    fn base_3(&self, index: u64) -> f64 {
        let mut state = mix(self.base_2.scramble[1] ^ 3);
        let mut rest = index;
        let mut value = 0_u64;
        for _ in 0..self.digits {
            let digit = rest % 3;
            rest /= 3;
            let map = ((state >> 32) * 6) >> 32;
            value = value * 3 + ((1 + (map & 1)) * digit + (map >> 1)) % 3;
            state = mix(state.wrapping_add((digit + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        }
        below_one((value as f64 + unit_f64(state)) * self.weight)
    }
}
