//! Keyed random permutations of 0..n with random access and no table.

use crate::hash::{lane, mix};

/// A pseudo-random permutation of 0..n, chosen by a 64-bit key; O(1) to build and to evaluate.
///
/// **Method.** Three rounds of (add, odd multiply, xor-shift) on the bits that n needs are a bijection of the next
/// power of two; values that fall outside 0..n are sent round again (cycle walking, fewer than two turns on
/// average), and a last rotation by a random amount makes each single image exactly uniform. The idea, not the code,
/// is that of Kensler 2013, *Correlated Multi-Jittered Sampling*, section 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Permutation {
    n: u32,
    mask: u32,
    shift: u32,
    rotation: u32,
    add: [u32; 3],
    multiply: [u32; 3],
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "words are cut into the 32-bit halves that they hold"
)]
impl Permutation {
    /// The permutation of 0..n (n ≥ 1) that `key` names.
    #[inline]
    pub(crate) fn new(n: u32, key: u64) -> Self {
        debug_assert!(n >= 1);
        let bits = u32::BITS - (n - 1).leading_zeros();
        let a = lane(key, 0);
        let b = lane(key, 1);
        let c = mix(a ^ b.rotate_left(29));
        Self {
            n,
            mask: ((1_u64 << bits) - 1) as u32,
            shift: bits.div_ceil(2).max(1),
            rotation: (((c >> 32) * u64::from(n)) >> 32) as u32,
            add: [a as u32, b as u32, c as u32],
            multiply: [
                (a >> 32) as u32 | 1,
                (b >> 32) as u32 | 1,
                ((a ^ b) >> 17) as u32 | 1,
            ],
        }
    }

    /// The image of `i`, which must be below n.
    #[inline]
    pub(crate) fn get(&self, i: u32) -> u32 {
        debug_assert!(i < self.n);
        let mut x = i;
        loop {
            for round in 0..3 {
                x = x
                    .wrapping_add(self.add[round])
                    .wrapping_mul(self.multiply[round])
                    & self.mask;
                x ^= x >> self.shift;
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

    #[test]
    fn is_a_permutation() {
        for n in (1..130).chain([255, 256, 257, 1000, 1024, 4093]) {
            for key in 0..5_u64 {
                let p = Permutation::new(n, mix(key + 1));
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let j = p.get(i) as usize;
                    assert!(!seen[j], "n = {n}, key = {key}");
                    seen[j] = true;
                }
            }
        }
    }

    #[test]
    fn works_at_the_top_of_the_range() {
        let p = Permutation::new(u32::MAX, 7);
        for i in [0, 1, u32::MAX / 2, u32::MAX - 1] {
            assert!(p.get(i) < u32::MAX);
        }
    }
}
