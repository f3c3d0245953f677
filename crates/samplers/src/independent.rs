//! This module holds independent random numbers, by `rand_pcg`.

use crate::hash::{lane, unit_f64};
use rand::Rng;
use rand_pcg::Pcg32;

/// Returns a PCG-XSH-RR 64/32 generator (O'Neill 2014, *PCG*) whose state and stream come from a
/// key.
pub(crate) fn generator(key: u64) -> Pcg32 {
    Pcg32::new(key, lane(key, 0))
}

/// Independent uniform numbers. Each sample takes three numbers of 64 bits from one generator: the
/// first for one dimension, and the others for two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Independent {
    key: u64,
}

/// The number of 32-bit words that a sample takes from the generator.
const WORDS: u64 = 6;

impl Independent {
    pub(crate) const fn new(key: u64) -> Self {
        Self { key }
    }

    /// Returns the generator before a word of sample `i`.
    fn before(&self, i: u32, word: u64) -> Pcg32 {
        let mut generator = generator(self.key);
        generator.advance(WORDS * u64::from(i) + word);
        generator
    }

    pub(crate) fn get_1d(&self, i: u32) -> f64 {
        unit_f64(self.before(i, 0).next_u64())
    }

    pub(crate) fn get_2d(&self, i: u32) -> [f64; 2] {
        let mut generator = self.before(i, 2);
        [generator.next_u64(), generator.next_u64()].map(unit_f64)
    }

    /// Draws the points of the samples from `first` on, in sequence.
    pub(crate) fn fill_2d(&self, first: u32, x: &mut [f64], y: &mut [f64]) {
        let mut generator = self.before(first, 0);
        for (x, y) in x.iter_mut().zip(y) {
            generator.next_u64();
            *x = unit_f64(generator.next_u64());
            *y = unit_f64(generator.next_u64());
        }
    }
}
