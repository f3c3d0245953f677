//! This module holds counter-based hashing, the only source of randomness of this crate.

/// 2⁶⁴ divided by the golden ratio, made odd: the step of a Weyl sequence that fills 64 bits
/// evenly.
pub(crate) const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// A bijection of 64-bit words with full avalanche.
///
/// **Formula.** Three xor-shifts by 27, 33, 27 with two odd multiplications between them (P.
/// Evensen's *moremur* parameters for the construction of D. Stafford and S. Vigna's SplitMix64
/// finaliser).
///
/// Zero maps to zero, so that callers add or xor constants first. Since it is a bijection, it never
/// merges two streams.
///
/// ```
/// assert_ne!(linelit_samplers::hash::mix(1), linelit_samplers::hash::mix(2));
/// ```
#[inline]
#[must_use]
pub const fn mix(mut x: u64) -> u64 {
    x ^= x >> 27;
    x = x.wrapping_mul(0x3C79_AC49_2BA7_B653);
    x ^= x >> 33;
    x = x.wrapping_mul(0x1C69_B3F7_4AC4_AE35);
    x ^ (x >> 27)
}

/// Returns the key of the stream for a salted seed, a pixel and a dimension.
///
/// For one seed, different pixels have different intermediate words by construction. Two (pixel,
/// dimension) pairs share a key only with the probability of a 64-bit birthday collision.
#[inline]
#[must_use]
pub(crate) const fn stream_key(salted_seed: u64, pixel: [u32; 2], dimension: u32) -> u64 {
    let place = (pixel[0] as u64) | ((pixel[1] as u64) << 32);
    let here = mix(salted_seed ^ mix(place ^ GOLDEN));
    mix(here.wrapping_add((dimension as u64 + 1).wrapping_mul(GOLDEN)))
}

/// Derives a further key from `key`, for one independent sub-stream for each `lane`.
#[inline]
#[must_use]
pub(crate) const fn lane(key: u64, lane: u64) -> u64 {
    mix(key ^ lane.wrapping_add(1).wrapping_mul(0xD1B5_4A32_D192_ED03))
}

/// Returns the `counter`-th random word of a stream.
///
/// The counter enters by xor, so that two streams can share single words (by 64-bit birthday
/// collisions), but never a run.
#[inline]
#[must_use]
pub(crate) const fn word(key: u64, counter: u64) -> u64 {
    mix(key ^ counter.wrapping_add(1).wrapping_mul(GOLDEN))
}

/// Maps the top 53 bits of a word to the multiples of 2⁻⁵³ in [0, 1); the result is never 1.
///
/// **Error bound.** The result is exact: every value is representable. The mean of the 2⁵³ values
/// is ½ − 2⁻⁵⁴.
///
/// ```
/// use linelit_samplers::hash::unit_f64;
/// assert_eq!(unit_f64(0), 0.0);
/// assert!(unit_f64(u64::MAX) < 1.0);
/// ```
#[inline]
#[must_use]
pub const fn unit_f64(word: u64) -> f64 {
    (word >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// The largest f64 below one, 1 − 2⁻⁵³.
pub(crate) const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Returns a number that rounding may have raised to one, moved below one.
#[inline]
#[must_use]
pub(crate) const fn below_one(x: f64) -> f64 {
    if x < BELOW_ONE { x } else { BELOW_ONE }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mix_has_full_avalanche() {
        // Each of 64×64 flip frequencies over n words is a mean of n fair coins: standard error
        // ½/√n. With n = 4096 and 4096 frequencies a six-sigma bound fails by chance with
        // probability < 1e-5.
        let n = 4096_u64;
        for bit in 0..64 {
            let mut flips = [0_u32; 64];
            for i in 0..n {
                let difference = mix(i) ^ mix(i ^ (1 << bit));
                for (out, count) in flips.iter_mut().enumerate() {
                    *count += u32::from(difference >> out & 1 == 1);
                }
            }
            for (out, &count) in flips.iter().enumerate() {
                let z = (f64::from(count) - 2048.0) / 32.0;
                assert!(z.abs() < 6.0, "bit {bit} -> {out}: z = {z}");
            }
        }
    }
}
