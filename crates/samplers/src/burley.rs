//! This module holds the Sobol' sequence of the `sobol_burley` crate, for comparison.

use crate::block::Block;

/// The points 0 to 2¹⁶ − 1 of `sobol_burley`'s Owen-scrambled Sobol' sequence (Burley 2020,
/// *Practical hash-based Owen scrambling*), dimensions 0 and 1, as f32. After these points another
/// sequence begins. Its seeds have 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SobolBurley {
    seed: u32,
    /// The index in the sequence of the block's first point.
    first: u32,
}

/// The base-2 logarithm of the number of points after which another sequence begins.
const LENGTH: u32 = 16;

impl SobolBurley {
    /// Creates the pattern from the keys of the pattern and of the block.
    pub(crate) const fn new([all, _]: [u64; 2], count: u32, block: Block) -> Self {
        Self {
            seed: (all >> 32) as u32,
            first: block.index().wrapping_mul(count),
        }
    }

    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        self.number(i, 0)
    }

    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        [self.number(i, 0), self.number(i, 1)]
    }

    fn number(&self, i: u32, dimension: u32) -> f64 {
        let index = self.first.wrapping_add(i);
        let sequence = index >> LENGTH;
        let seed = self.seed.wrapping_add(sequence);
        let number = sobol_burley::sample(index % (1 << LENGTH), dimension, seed);
        f64::from(number)
    }
}
