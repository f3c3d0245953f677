//! These tests check the blue-noise tile: it is a permutation of its ranks, and blue.
#![allow(clippy::cast_possible_truncation, reason = "sizes are at most 64×64")]

use linelit_samplers::{Sampler, SamplerKind, blue_noise_rank};
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z};
use std::f64::consts::TAU;

#[test]
fn every_rank_occurs_once() {
    let mut ranks: Vec<u16> = (0..4096)
        .map(|i| blue_noise_rank([i % 64, i / 64]))
        .collect();
    ranks.sort_unstable();
    assert_eq!(ranks, (0..4096).collect::<Vec<u16>>());
}

/// Mean periodogram over the frequencies with radius in [low, high) cycles per 64 pixels, in units
/// of white noise.
fn power(values: &[f64], low: f64, high: f64) -> f64 {
    let mean = values.iter().sum::<f64>() / 4096.0;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4096.0;
    let (mut sum, mut count) = (0.0, 0);
    for fx in -32..32_i32 {
        for fy in 0..32_i32 {
            let radius = f64::from(fx * fx + fy * fy).sqrt();
            if radius < low || radius >= high {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (i, v) in values.iter().enumerate() {
                let phase = TAU * f64::from(fx * (i as i32 % 64) + fy * (i as i32 / 64)) / 64.0;
                re += (v - mean) * phase.cos();
                im += (v - mean) * phase.sin();
            }
            sum += (re * re + im * im) / 4096.0;
            count += 1;
        }
    }
    sum / f64::from(count) / variance
}

/// Below a quarter of the highest frequency the tile has less than 2 % of white noise's power; a
/// periodogram average of white noise over these 100 frequencies is 1 ± 0.1.
#[test]
fn the_tile_is_blue() {
    let values: Vec<f64> = (0..4096)
        .map(|i| f64::from(blue_noise_rank([i % 64, i / 64])))
        .collect();
    let (low, high) = (power(&values, 1.0, 8.0), power(&values, 24.0, 32.0));
    assert!(
        low < 0.02 && high > 1.0,
        "power {low} at low, {high} at high frequencies"
    );
}

/// So is what the sampler hands out, for any placement, in both axes, for several samples; white
/// kinds are not.
#[test]
fn first_samples_are_blue_across_pixels() {
    for (kind, count) in [
        (SamplerKind::BlueNoise, 1),
        (SamplerKind::BlueNoiseIndependent, 4),
    ] {
        for seed in 0..3 {
            for axis in 0..2 {
                let sampler = Sampler::new(kind, seed);
                let number = |i: u32| {
                    sampler
                        .points([100 + i % 64, 37 + i / 64], 5, count)
                        .get_2d(count - 1)[axis]
                };
                let values: Vec<f64> = (0..4096).map(number).collect();
                let low = power(&values, 1.0, 6.0);
                assert!(low < 0.02, "{kind}, seed {seed}: low-frequency power {low}");
            }
        }
    }
    let sampler = Sampler::new(SamplerKind::UniformJitter, 1);
    let white: Vec<f64> = (0..4096)
        .map(|i| sampler.points([i % 64, i / 64], 5, 1).get_1d(0))
        .collect();
    // 54 exponential periodogram values: 1 ± 0.136; three of them.
    assert!((power(&white, 1.0, 6.0) - 1.0).abs() < 0.41);
}

/// The error of a pixel estimate is blue across pixels: with four samples of uniform jitter for x²,
/// low frequencies hold far less error than white noise would. Z-order Sobol' likewise for a 2-D
/// integrand.
#[test]
fn errors_are_blue_across_pixels() {
    let blue = Sampler::new(SamplerKind::BlueNoise, 3);
    let estimate = |i: u32| {
        blue.points([i % 64, i / 64], 0, 4)
            .iter_1d()
            .map(|x| x * x)
            .sum::<f64>()
    };
    let errors: Vec<f64> = (0..4096).map(estimate).collect();
    assert!(
        power(&errors, 1.0, 6.0) < 0.05,
        "{}",
        power(&errors, 1.0, 6.0)
    );

    let z_order = Sampler::new(SamplerKind::ZSobol, 3);
    let estimate = |i: u32| {
        z_order
            .points([i % 64, i / 64], 0, 4)
            .iter_2d()
            .map(|[x, y]| x * y)
            .sum::<f64>()
    };
    let errors: Vec<f64> = (0..4096).map(estimate).collect();
    // Ahmed & Wonka diffuse over quads of 2, 4, 8… pixels, so that less remains the lower the
    // frequency.
    assert!(
        power(&errors, 1.0, 4.0) < 0.25,
        "{}",
        power(&errors, 1.0, 4.0)
    );
}

/// For Z-order Sobol' points in any number, neighbouring pixels have consecutive points of one
/// sequence, so that the errors of neighbours cancel, which is a negative correlation. If pixels
/// took the first points of blocks of a power of two, all would leave the same points out, and the
/// correlation would be positive for 24, 48 and 96.
#[test]
fn errors_of_neighbours_cancel_for_any_number_of_points() {
    let e = std::f64::consts::E;
    type Integrand = fn([f64; 2]) -> f64;
    let integrands: [(Integrand, f64); 3] = [
        (|[x, y]| x * y, 0.25),
        (
            |[x, y]| (x + 0.5 * y).exp(),
            2.0 * (e - 1.0) * (e.sqrt() - 1.0),
        ),
        (
            |[x, y]| f64::from(u8::from((x - 0.45).hypot(y - 0.52) < 0.3)),
            0.09 * std::f64::consts::PI,
        ),
    ];
    const COUNTS: [u32; 10] = [3, 5, 6, 12, 13, 24, 48, 96, 16, 64];
    let limit = critical_z(2.0 * sidak(0.01, COUNTS.len() * integrands.len()));
    for count in COUNTS {
        for (k, (f, integral)) in integrands.into_iter().enumerate() {
            // Of the 1,984 pairs of a picture of 32 × 32 pixels; pictures are independent.
            let correlation = |seed: u64| {
                let sampler = Sampler::new(SamplerKind::ZSobol, seed);
                let mut values = vec![0.0; 32 * 32];
                for (i, value) in (0..).zip(&mut values) {
                    let set = sampler.points([i % 32, i / 32], 0, count);
                    *value = set.iter_2d().map(f).sum::<f64>();
                }
                let error = |x: usize, y: usize| values[32 * y + x] / f64::from(count) - integral;
                let variance = (0..1024)
                    .map(|i| error(i % 32, i / 32).powi(2))
                    .sum::<f64>();
                let mut products = 0.0;
                for x in 0..31 {
                    for y in 0..32 {
                        products += error(x, y) * error(x + 1, y) + error(y, x) * error(y, x + 1);
                    }
                }
                (products / 1984.0) / (variance / 1024.0)
            };
            let correlations: Welford = (0..24).map(correlation).collect();
            let z = correlations.z_score(0.0);
            assert!(z < -limit, "{count} {k}: {}, z = {z}", correlations.mean());
        }
    }
}
