//! A small, fixed random generator for tests, independent of the samplers under test, and inputs
//! that benches share.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

/// SplitMix64: a 64-bit counter with an avalanche finaliser.
///
/// Deterministic, seedable from any number (including zero), equidistributed over its period 2⁶⁴.
/// Statistical laws drive samplers with it, so that a broken sampler crate cannot vouch for itself.
///
/// Source: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators" (OOPSLA 2014), with
/// Stafford's variant 13 of the finaliser.
///
/// ```
/// let mut rng = linelit_testkit::rng::SplitMix64::new(1);
/// let u = rng.next_f64();
/// assert!((0.0..1.0).contains(&u));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SplitMix64 {
    state: u64,
}

impl SplitMix64 {
    /// Creates a generator for this seed; different seeds give unrelated streams.
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Draws the next 64 uniform bits.
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Draws a number that is uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn next_f64(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Draws a number that is uniform in [a, b) up to rounding.
    pub fn in_range(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next_f64()
    }

    /// Draws an integer that is uniform in 0..n (n > 0), with a bias below n/2⁶⁴.
    pub fn below(&mut self, n: u64) -> u64 {
        let high = (u128::from(self.next_u64()) * u128::from(n)) >> 64;
        u64::try_from(high).expect("the product's upper half is below n")
    }

    /// Draws a direction that is uniform on the unit sphere (Archimedes: z and azimuth are
    /// uniform).
    pub fn unit_vector(&mut self) -> [f64; 3] {
        let z = self.in_range(-1.0, 1.0);
        let azimuth = self.in_range(0.0, std::f64::consts::TAU);
        let r = ((1.0 - z) * (1.0 + z)).sqrt();
        [r * azimuth.cos(), r * azimuth.sin(), z]
    }

    /// Draws a standard normal deviate (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.next_f64()).ln()).sqrt();
        radius * self.in_range(0.0, std::f64::consts::TAU).cos()
    }
}

/// Returns the fractional parts of multiples of the golden ratio: uniformly distributed numbers in
/// [0, 1), the same for every bench.
pub fn golden_numbers(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| (i as f64 + 0.5) * 0.618_033_988_749_894_9 % 1.0)
        .collect()
}

/// Returns shading points around the origin, each with a unit normal that leans to +z, for benches
/// of the light that they receive.
pub fn receivers(count: usize) -> Vec<([f64; 3], [f64; 3])> {
    let u = golden_numbers(count);
    let receiver = |i: usize| {
        let at = |k: usize| 2.0 * u[(i * k + k) % count] - 1.0;
        let n = [at(11), at(13), 1.5_f64];
        let length = n.iter().map(|c| c * c).sum::<f64>().sqrt();
        let x = [3.0 * at(3), 3.0 * at(5), 0.4 * at(7)];
        (x, n.map(|c| c / length))
    };
    (0..count).map(receiver).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reproduces_the_published_stream() {
        // First outputs for seed 1234567, as listed with the reference implementation
        // (prng.di.unimi.it).
        let mut rng = SplitMix64::new(1_234_567);
        assert_eq!(rng.next_u64(), 6_457_827_717_110_365_317);
        assert_eq!(rng.next_u64(), 3_203_168_211_198_807_973);
        assert_eq!(rng.next_u64(), 9_817_491_932_198_370_423);
    }

    #[test]
    fn below_stays_below_and_reaches_all() {
        let mut rng = SplitMix64::new(3);
        let mut seen = [false; 7];
        for _ in 0..200 {
            let k = usize::try_from(rng.below(7)).unwrap();
            seen[k] = true;
        }
        // A missing value has probability 7·(6/7)²⁰⁰ ≈ 3e-13.
        assert_eq!(seen, [true; 7]);
    }
}
