//! The number of random cases that a property is tried on, and the seeds of random loops.
//!
//! Each property states its number of cases according to its cost: `cases(64)` for one that runs a
//! renderer, `cases(4000)` for one of a few multiplications. This is the number of a usual run;
//! proptest's own default is [`USUAL`]. `PROPTEST_CASES` scales all of these numbers by the same
//! factor, so that a long run is long for every property. `cargo xtask test --long` sets it to
//! 4,096, sixteen times the usual number, with a new `PROPTEST_RNG_SEED`.
//!
//! ```
//! use linelit_testkit::cases::{cases, rng};
//! use proptest::prelude::*;
//! let config = ProptestConfig { cases: cases(64), ..ProptestConfig::default() };
//! # assert!(config.cases > 0);
//! let mut numbers = rng(7);
//! for _ in 0..cases(1000) {
//!     assert!(numbers.next_f64() < 1.0);
//! }
//! ```

use crate::rng::SplitMix64;
use proptest::test_runner::{Config, RngSeed};

/// The number of cases that proptest takes by default. With this value, `PROPTEST_CASES` changes
/// nothing.
pub const USUAL: u32 = 256;

/// Returns the number of cases of a property that usually takes `usual`: `usual` × `PROPTEST_CASES`
/// / [`USUAL`], at least one.
#[must_use]
pub fn cases(usual: u32) -> u32 {
    // Proptest reads the environment variables.
    scaled(usual, Config::default().cases)
}

/// Scales a number of cases by `cases` over [`USUAL`].
fn scaled(usual: u32, cases: u32) -> u32 {
    let product = u64::from(usual) * u64::from(cases) / u64::from(USUAL);
    u32::try_from(product).unwrap_or(u32::MAX).max(1)
}

/// Returns the seed of a test's own loop over random cases. In a usual run it is `usual` itself,
/// the same every time; in a longer run, with more than [`USUAL`] cases and `PROPTEST_RNG_SEED`, it
/// is mixed from both.
///
/// Use it for properties that hold in every case. A statistical test must keep its seed: it fails
/// by chance for one seed in 1/α, so that new seeds would sometimes make it fail.
#[must_use]
pub fn seed(usual: u64) -> u64 {
    let config = Config::default();
    match config.rng_seed {
        RngSeed::Fixed(run) if config.cases > USUAL => mixed(usual, run),
        RngSeed::Fixed(_) | RngSeed::Random => usual,
    }
}

/// Returns random numbers from that [`seed`].
#[must_use]
pub fn rng(usual: u64) -> SplitMix64 {
    SplitMix64::new(seed(usual))
}

/// Mixes the seed of the stream `usual` with the seed of the run.
fn mixed(usual: u64, run: u64) -> u64 {
    SplitMix64::new(run ^ SplitMix64::new(usual).next_u64()).next_u64()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_property_is_scaled_alike() {
        assert_eq!(scaled(64, 256), 64);
        assert_eq!(scaled(64, 4096), 1024);
        assert_eq!(scaled(2000, 4096), 32_000);
        // A quick run is quick, but runs.
        assert_eq!(scaled(64, 16), 4);
        assert_eq!(scaled(3, 1), 1);
        assert_eq!(scaled(u32::MAX, u32::MAX), u32::MAX);
    }

    #[test]
    fn seeds_make_streams() {
        let all = [mixed(7, 1), mixed(8, 1), mixed(7, 2), mixed(8, 2), 7, 8];
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].contains(a));
        }
        assert_eq!(mixed(7, 1), all[0]);
    }
}
