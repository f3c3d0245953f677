//! This module holds keyed random permutations of 0..n with random access.

use crate::hash::lane;

/// The largest n for which a permutation is a shuffled table.
const TABLE: u32 = 64;
/// The number of rounds of the hashed permutation for larger n.
const ROUNDS: usize = 5;

/// A pseudo-random permutation of 0..n, chosen by a 64-bit key.
///
/// **Method.** Up to n = 64 it is a table, shuffled by Fisher & Yates, which is exactly uniform
/// over all n! orders except for a bias of n/2³²: hashed permutations show structure just in the
/// small sets that are used in rendering. For larger n, five rounds of (add, odd multiply, reverse
/// the bits) on the bits that n needs are a bijection of the next power of two. Values that fall
/// outside 0..n pass through the rounds again (cycle walking, fewer than two turns on average). A
/// rotation by a random amount makes each single image exactly uniform. The idea of hashing is
/// Kensler's (2013, *Correlated Multi-Jittered Sampling*, section 4), the rounds are ours: measured
/// differences π(i) − π(j) are uniform from n = 65 on (tested).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Permutation {
    Table { n: u8, images: [u8; TABLE as usize] },
    Hashed(Hashed),
}

/// The constants of a hashed permutation of 0..n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Hashed {
    n: u32,
    mask: u32,
    /// 32 minus the number of bits of the mask.
    spare: u32,
    rotation: u32,
    add: [u32; ROUNDS],
    multiply: [u32; ROUNDS],
}

impl Permutation {
    /// The permutation of a single element.
    pub(crate) const ONE: Self = Self::Table {
        n: 1,
        images: [0; TABLE as usize],
    };

    /// Makes the permutation of 0..n (n ≥ 1) that belongs to `key`.
    #[inline]
    pub(crate) fn new(n: u32, key: u64) -> Self {
        debug_assert!(n >= 1);
        if n <= TABLE {
            #[expect(clippy::cast_possible_truncation, reason = "at most 64")]
            Self::Table {
                n: n as u8,
                images: shuffled(n, key),
            }
        } else {
            Self::Hashed(Hashed::new(n, key))
        }
    }

    /// Returns the number of permuted elements.
    #[inline]
    pub(crate) fn len(&self) -> u32 {
        match self {
            Self::Table { n, .. } => u32::from(*n),
            Self::Hashed(hashed) => hashed.n,
        }
    }

    /// Returns the image of `i`, which must be below n.
    #[inline]
    pub(crate) fn get(&self, i: u32) -> u32 {
        match self {
            Self::Table { images, .. } => u32::from(images[(i % TABLE) as usize]),
            Self::Hashed(hashed) => hashed.get(i),
        }
    }
}

/// Returns the image of `i` < n under a permutation of 0..n, for permutations that are used once.
/// It is cheaper than [`Permutation`], and its single images are only nearly uniform.
///
/// Three rounds of (odd multiply, add, shift and xor) are a bijection of the next power of two;
/// values that fall outside 0..n pass through the rounds again.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "words are cut into parts")]
pub(crate) const fn permuted(i: u32, n: u32, key: u64) -> u32 {
    let spare = (n - 1).leading_zeros();
    if spare == u32::BITS {
        return 0;
    }
    let (mask, shift) = (u32::MAX >> spare, (u32::BITS + 1 - spare) / 2);
    let mut x = i;
    loop {
        let mut round = 0;
        while round < 3 {
            let word = (key >> (16 * round)) as u32;
            x = x.wrapping_mul(word | 1).wrapping_add(word >> 16) & mask;
            x ^= x >> shift;
            round += 1;
        }
        if x < n {
            return x;
        }
    }
}

/// Shuffles by Fisher & Yates from the inside out (Durstenfeld 1964): entry i goes to a random
/// index among the first i + 1.
#[inline]
#[expect(
    clippy::cast_possible_truncation,
    reason = "indices below 64; products below 2^38 shifted by 32"
)]
fn shuffled(n: u32, key: u64) -> [u8; TABLE as usize] {
    let mut table = [0; TABLE as usize];
    let mut i = 1;
    while i < n as usize {
        // One random word serves for two entries.
        let random = lane(key, i as u64);
        for half in [random >> 32, random & 0xFFFF_FFFF] {
            if i < n as usize {
                let place = ((half * (i as u64 + 1)) >> 32) as usize;
                table[i] = table[place];
                table[place] = i as u8;
                i += 1;
            }
        }
    }
    table
}

impl Hashed {
    #[inline]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "words are cut into the 32-bit halves that they hold"
    )]
    fn new(n: u32, key: u64) -> Self {
        let keys: [u64; ROUNDS] = std::array::from_fn(|round| lane(key, round as u64));
        let spare = (n - 1).leading_zeros();
        Self {
            n,
            mask: u32::MAX >> spare,
            spare,
            rotation: (((key >> 32) * u64::from(n)) >> 32) as u32,
            add: keys.map(|k| k as u32),
            multiply: keys.map(|k| (k >> 32) as u32 | 1),
        }
    }

    /// Returns the image of `i` < n.
    #[inline]
    fn get(&self, i: u32) -> u32 {
        debug_assert!(i < self.n);
        let mut x = i;
        loop {
            for (add, multiply) in self.add.iter().zip(self.multiply) {
                x = x.wrapping_add(*add).wrapping_mul(multiply) & self.mask;
                x = x.reverse_bits() >> self.spare;
            }
            if x < self.n {
                break;
            }
        }
        let (sum, wrapped) = x.overflowing_add(self.rotation);
        if wrapped || sum >= self.n {
            sum.wrapping_sub(self.n)
        } else {
            sum
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::mix;
    use linelit_testkit::chi2::{chi2_test, sidak};
    use std::collections::BTreeMap;

    #[test]
    fn small_permutations_are_all_equally_likely() {
        let trials = 120_000_u64;
        for (n, factorial) in [(2, 2_usize), (3, 6), (4, 24), (5, 120), (6, 720)] {
            let mut seen = BTreeMap::new();
            for key in 0..trials {
                let p = Permutation::new(n, mix(key + 1));
                *seen
                    .entry((0..n).map(|i| p.get(i)).collect::<Vec<_>>())
                    .or_insert(0_u64) += 1;
            }
            let mut counts: Vec<u64> = seen.into_values().collect();
            counts.resize(factorial, 0);
            let expected = vec![trials as f64 / factorial as f64; factorial];
            let test = chi2_test(&counts, &expected, 5.0);
            assert!(test.p_value > sidak(0.01, 5), "n = {n}: {test:?}");
        }
    }

    #[test]
    fn differences_of_images_are_uniform() {
        let (trials, sizes) = (50_000_u64, [7, 16, 64, 65, 81, 100, 128, 256, 1000, 1024]);
        for n in sizes {
            for (i, j) in [(0, 1), (0, n / 2), (1, 2), (n - 2, n - 1), (3, 5)] {
                let mut counts = vec![0_u64; n as usize - 1];
                for key in 0..trials {
                    let p = Permutation::new(n, mix(key + 1));
                    counts[((p.get(i) + n - p.get(j)) % n - 1) as usize] += 1;
                }
                let expected = vec![trials as f64 / f64::from(n - 1); n as usize - 1];
                let test = chi2_test(&counts, &expected, 5.0);
                assert!(
                    test.p_value > sidak(0.01, 5 * sizes.len()),
                    "n = {n}, ({i}, {j}): {test:?}"
                );
            }
        }
    }
}
