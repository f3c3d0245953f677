//! The blue-noise tile: made again bit for bit, a permutation of its ranks, and blue.
#![allow(clippy::cast_possible_truncation, reason = "sizes are at most 64×64")]

use linelit_samplers::{Sampler, SamplerKind, blue_noise_rank};
use std::f64::consts::TAU;

#[path = "../../examples/blue_noise_tile/void_and_cluster.rs"]
mod void_and_cluster;

#[test]
fn the_generator_reproduces_the_committed_tile() {
    let tile = void_and_cluster::void_and_cluster(64, 0);
    for (i, &rank) in tile.iter().enumerate() {
        assert_eq!(
            rank,
            blue_noise_rank([i as u32 % 64, i as u32 / 64]),
            "entry {i}"
        );
    }
}

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
