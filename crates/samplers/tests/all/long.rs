//! Longer looks at the same laws: `cargo test -p linelit-samplers --test all -- --ignored long`.
#![allow(clippy::cast_possible_truncation, reason = "bins are small")]

use linelit_samplers::{Sampler, SamplerKind};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::ztest::{Welford, critical_z};

/// Beyond sobol_burley's 2¹⁶ samples and 23 bits: at N = 2¹⁸ the ramp's error is 2·10⁻⁹, a fiftieth
/// of the spacing of 23-bit numbers, and still has the exact variance 1/(12 N³); in two dimensions
/// x + y has twice that.
#[test]
#[ignore = "long: 10⁸ points, 10 s"]
fn references_keep_their_rate() {
    let n = 1_u32 << 18;
    for kind in [SamplerKind::Sobol, SamplerKind::Stratified] {
        let squares: Welford = (0..300)
            .map(|seed| {
                let set = Sampler::new(kind, seed).points([1, 2], 0, n);
                // Summed about the middle, so that rounding stays at 10⁻¹³.
                (set.iter_1d().map(|x| x - 0.5).sum::<f64>() / f64::from(n)).powi(2)
            })
            .collect();
        let z = squares.z_score(1.0 / (12.0 * f64::from(n).powi(3)));
        assert!(z.abs() < critical_z(0.002), "{kind}: z = {z}");
    }
    let squares: Welford = (0..300)
        .map(|seed| {
            let set = Sampler::new(SamplerKind::MultiJitter, seed).points([1, 2], 0, n);
            (set.iter_2d().map(|[x, y]| x + y - 1.0).sum::<f64>() / f64::from(n)).powi(2)
        })
        .collect();
    let z = squares.z_score(1.0 / (6.0 * f64::from(n).powi(3)));
    assert!(z.abs() < critical_z(0.002), "multijitter: z = {z}");
}

/// 2²⁶ independent numbers in 2²⁰ cells of three dimensions, drawn as pixels would: few samples
/// each of many streams.
#[test]
#[ignore = "long: 7·10⁷ numbers, 5 s"]
fn many_small_streams_fill_three_dimensions() {
    let sampler = Sampler::new(SamplerKind::Independent, 2);
    let mut counts = vec![0_u64; 1 << 20];
    let bin = |x: f64, bins: f64| (x * bins) as usize;
    for y in 0..2048 {
        for x in 0..2048 {
            let sets = [0, 1].map(|d| sampler.points([x, y], d, 4));
            for i in 0..4 {
                let [u, v] = sets[0].get_2d(i);
                counts[bin(u, 128.0) << 13 | bin(v, 128.0) << 6 | bin(sets[1].get_1d(i), 64.0)] +=
                    1;
            }
        }
    }
    let test = chi2_test(&counts, &vec![16.0; 1 << 20], 5.0);
    assert!(test.p_value > 0.01 && test.p_value < 0.999, "{test:?}");
}

/// The seeds and dimensions of two streams, for each trial.
type Pair = fn(u64) -> [(u64, u32); 2];

/// A million trials of the pairing of streams that differ in one word, for every pattern:
/// correlations of 0.5 % would show.
#[test]
#[ignore = "long: 2·10⁷ sets, 20 s"]
fn streams_are_uncorrelated_to_a_thousandth() {
    let trials = 1_000_000_u64;
    for kind in SamplerKind::ALL {
        let pairs: [Pair; 2] = [|t| [(t, 0), (t, 1)], |t| [(2 * t, 0), (2 * t + 1, 0)]];
        for pair in pairs {
            let products: Welford = (0..trials)
                .map(|t| {
                    let [a, b] = pair(t).map(|(seed, dimension)| {
                        let set = Sampler::new(kind, seed).points([5, 6], dimension, 3);
                        set.iter_1d().map(|x| x * x - 1.0 / 3.0).sum::<f64>()
                    });
                    a * b
                })
                .collect();
            let z = products.z_score(0.0);
            assert!(z.abs() < critical_z(sidak(0.01, 18)), "{kind}: z = {z}");
        }
    }
}
