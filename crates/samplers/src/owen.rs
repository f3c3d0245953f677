//! This module holds Owen's nested uniform scrambling, by hashing.

use crate::hash::{mix, unit_f64};

/// Scrambles the base-2 digits of a fraction whose digits are numbered from the **lowest** bit: bit
/// k of the result is bit k of `digits`, flipped by a random bit that depends only on the bits
/// below k and on `seed`.
///
/// **Formula.** `d ^= d·e₁; d += s₀; d *= s₁|1; d ^= d·e₂; d ^= d·e₃` with even constants eᵢ: in
/// every step information flows only from lower to higher bits. Laine & Karras 2011, *Stratified
/// sampling for stochastic transparency*, section 3.1; Burley 2020, *Practical hash-based Owen
/// scrambling*, section 4; the constants are from N. Vegdahl, *Building a better LK hash* (2021),
/// here with a key of 64 bits, not 32.
///
/// **Error bound.** Over 2¹⁶ random seeds no pair of tree nodes in the first six levels has flips
/// whose correlation exceeds sampling noise (tested).
#[inline]
#[must_use]
#[expect(
    clippy::cast_possible_truncation,
    reason = "the two halves of the seed"
)]
const fn scramble_low_first(mut digits: u32, seed: u64) -> u32 {
    digits ^= digits.wrapping_mul(0x3D20_ADEA);
    digits = digits.wrapping_add(seed as u32);
    digits = digits.wrapping_mul((seed >> 32) as u32 | 1);
    digits ^= digits.wrapping_mul(0x0552_6C56);
    digits ^ digits.wrapping_mul(0x53A2_2864)
}

/// Applies nested uniform scrambling to a 32-bit binary fraction, whose highest bit is the first
/// digit after the point.
///
/// **Formula.** Owen 1995: digit k of the result is digit k of `fraction`, flipped by a random bit
/// that depends on the digits before k. **Domain.** All of u32; it is a bijection for each seed.
/// Elementary intervals are mapped to elementary intervals, so that a net remains a net.
///
/// ```
/// use linelit_samplers::owen_scramble;
/// // Fractions that share k leading digits share k leading digits afterwards.
/// let (a, b) = (owen_scramble(0b1010 << 28, 7), owen_scramble(0b1011 << 28, 7));
/// assert_eq!(a >> 29, b >> 29);
/// assert_ne!(a >> 28, b >> 28);
/// ```
#[inline]
#[must_use]
pub const fn owen_scramble(fraction: u32, seed: u64) -> u32 {
    scramble_low_first(fraction.reverse_bits(), seed).reverse_bits()
}

/// Converts a 32-bit fraction to f64, with random digits 33 to 53.
///
/// Owen scrambling to infinite depth gives points that differ in their first 32 digits independent
/// further digits. With these digits the number is uniform on [0, 1) down to 2⁻⁵³; without them it
/// would be biased by 2⁻³³.
#[inline]
#[must_use]
pub(crate) const fn deepen(fraction: u32, seed: u64) -> f64 {
    let tail = mix(seed ^ (fraction as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    unit_f64(((fraction as u64) << 32) | (tail >> 32))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_possible_truncation, reason = "parts of words")]
    use super::*;
    use linelit_testkit::chi2::sidak;
    use linelit_testkit::ztest::critical_z;

    /// Whether `seed` flips the digit that follows the digits `prefix` (numbered from the lowest
    /// bit).
    fn flips(level: u32, prefix: u32, seed: u64) -> bool {
        scramble_low_first(prefix, seed) >> level & 1 == 1
    }

    #[test]
    fn is_nested() {
        for seed in (0..100).map(mix) {
            for fraction in (0..200).map(|i| mix(i) as u32) {
                for level in 0..32 {
                    // Changing a digit changes that digit of the result and none before it.
                    let changed = owen_scramble(fraction, seed)
                        ^ owen_scramble(fraction ^ 1 << (31 - level), seed);
                    assert_eq!(changed.leading_zeros(), level);
                }
            }
        }
    }

    /// All nodes of the first six levels of the tree, and random deep pairs of neighbours, flip
    /// independently of each other: 2¹⁴ seeds, z score of the number of agreements, Šidák-corrected
    /// over all pairs.
    #[test]
    fn nodes_flip_independently() {
        let seeds: Vec<u64> = (1..=1 << 14).map(mix).collect();
        let nodes: Vec<(u32, u32)> = (0..6)
            .flat_map(|k| (0..1 << k).map(move |p| (k, p)))
            .collect();
        let deep = (0..300_u64).map(|i| {
            let (level, bits) = (6 + (mix(i + 1) % 26) as u32, mix(i + 7919));
            let prefix = bits as u32 & ((1 << level) - 1);
            [
                (level, prefix),
                (level, prefix ^ 1 << ((bits >> 40) % u64::from(level))),
            ]
        });
        let pairs = (0..nodes.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let all: Vec<[(u32, u32); 2]> = pairs
            .map(|(a, b)| [nodes[a], nodes[b]])
            .chain(deep)
            .collect();
        let limit = critical_z(sidak(0.01, all.len()));
        for [(k, p), (l, q)] in &all {
            let agree = seeds
                .iter()
                .filter(|&&s| flips(*k, *p, s) == flips(*l, *q, s))
                .count();
            let z = (agree as f64 - 8192.0) / 64.0;
            assert!(
                z.abs() < limit,
                "nodes ({k}, {p:b}) and ({l}, {q:b}): z = {z}"
            );
        }
    }
}
