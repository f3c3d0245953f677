//! How many random cases a property is tried on, and the seed of random loops.
//!
//! A property says what it costs: `cases(64)` is for one that runs a renderer, `cases(4000)` for one of a few
//! multiplications. That number is for a usual run, for which proptest itself takes [`USUAL`]; `PROPTEST_CASES` then
//! scales all of them by the same factor, so that a long run is long for every property.

use crate::rng::SplitMix64;

/// The cases that proptest takes without being told; as `PROPTEST_CASES`, it changes nothing.
pub const USUAL: u32 = 256;

/// The variable that sets how many cases are run, relative to [`USUAL`].
const CASES: &str = "PROPTEST_CASES";
/// The variable that sets which.
const SEED: &str = "PROPTEST_RNG_SEED";

/// The number of cases of a property that usually takes `usual`: `usual` × `PROPTEST_CASES` / [`USUAL`], at least one.
///
/// # Panics
///
/// If the variable is set to what is not a number: a long run that is not long must not pass for one.
#[must_use]
pub fn cases(usual: u32) -> u32 {
    let set = variable(CASES).map(|cases| u32::try_from(cases).unwrap_or(u32::MAX));
    scaled(usual, set.unwrap_or(USUAL))
}

fn scaled(usual: u32, cases: u32) -> u32 {
    let product = u64::from(usual) * u64::from(cases) / u64::from(USUAL);
    u32::try_from(product).unwrap_or(u32::MAX).max(1)
}

/// Random numbers for a loop of a test's own: the stream `usual` on every run, unless `PROPTEST_RNG_SEED` says another,
/// from which each `usual` makes a stream of its own.
///
/// # Panics
///
/// If the variable is set to what is not a number.
#[must_use]
pub fn rng(usual: u64) -> SplitMix64 {
    SplitMix64::new(mixed(usual, variable(SEED)))
}

/// The seed of a stream: `usual` itself without a seed of the run.
fn mixed(usual: u64, run: Option<u64>) -> u64 {
    run.map_or(usual, |run| {
        usual ^ SplitMix64::new(run ^ SplitMix64::new(usual).next_u64()).next_u64()
    })
}

fn variable(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    let number = text.parse();
    assert!(number.is_ok(), "{name}={text} is not a whole number");
    number.ok()
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
        assert_eq!(mixed(7, None), 7);
        let all = [mixed(7, Some(1)), mixed(8, Some(1)), mixed(7, Some(2)), 7];
        for (i, a) in all.iter().enumerate() {
            assert!(!all[..i].contains(a));
        }
        assert_eq!(mixed(7, Some(1)), all[0]);
    }
}
