//! These tests check that every number is uniform: over a set, over seeds and over pixels, down to
//! the last bits, for ordinary and extreme arguments.
#![allow(clippy::cast_possible_truncation, reason = "bins and strata are small")]

use linelit_samplers::{Sampler, SamplerKind};
use linelit_testkit::chi2::{chi2_test, sidak};

/// All tests of this file together err with probability 0.01 at most; there are fewer than this
/// many.
const TESTS: usize = 400;

fn assert_uniform(counts: &[u64], name: &str) {
    let total: u64 = counts.iter().sum();
    let expected = vec![total as f64 / counts.len() as f64; counts.len()];
    let test = chi2_test(counts, &expected, 5.0);
    assert!(test.p_value > sidak(0.01, TESTS), "{name}: {test:?}");
}

/// The bin of x among `bins` equal ones; panics unless x is in [0, 1).
fn bin(x: f64, bins: usize) -> usize {
    assert!((0.0..1.0).contains(&x), "{x:e} is outside [0, 1)");
    (x * bins as f64) as usize
}

/// Seeds, pixels and dimensions that a weak hash would confuse: zeros, single bits, all ones,
/// neighbours, multiples of the hash's own constants.
fn nasty_words() -> Vec<u64> {
    let mut words = vec![
        0,
        1,
        2,
        3,
        u64::MAX,
        u64::MAX - 1,
        0x9E37_79B9_7F4A_7C15,
        0x6C69_6E65_6C69_7421,
    ];
    words.extend((0..64).map(|b| 1_u64 << b));
    words.extend((1..16).map(|k| 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(k)));
    words
}

/// Sample `i` alone over many seeds: the law that makes an estimator unbiased. 2-D on a grid that
/// no pattern favours.
#[test]
fn each_sample_is_uniform_over_seeds() {
    for kind in SamplerKind::ALL {
        for (count, i) in [(1, 0), (7, 3), (12, 11), (16, 5), (100, 42), (257, 0)] {
            let (mut line, mut square) = ([0; 37], [0; 13 * 13]);
            for seed in 0..20_000 {
                let set = Sampler::new(kind, seed).points([3, 5], 2, count);
                line[bin(set.get_1d(i), 37)] += 1;
                let [x, y] = set.get_2d(i);
                square[bin(y, 13) * 13 + bin(x, 13)] += 1;
            }
            assert_uniform(&line, &format!("{kind}, 1-D, sample {i} of {count}"));
            assert_uniform(&square, &format!("{kind}, 2-D, sample {i} of {count}"));
        }
    }
}

/// Sample 0 of one, over pixels and dimensions of one seed.
#[test]
fn first_samples_are_uniform_over_pixels_and_dimensions() {
    for kind in SamplerKind::ALL {
        let sampler = Sampler::new(kind, 1);
        let (mut over_pixels, mut over_dimensions) = ([0; 64], [0; 64]);
        for k in 0..16_384 {
            // Blue noise is by design *more* even over a tile than random numbers: its pixels are
            // spaced out.
            let step = if kind.pixels_are_independent() {
                1
            } else {
                7919
            };
            let pixel = [k % 128 * step, k / 128 * step];
            over_pixels[bin(sampler.points(pixel, 0, 1).get_2d(0)[1], 64)] += 1;
            over_dimensions[bin(sampler.points([9, 9], k, 1).get_1d(0), 64)] += 1;
        }
        if kind.pixels_are_independent() {
            assert_uniform(&over_pixels, &format!("{kind} over pixels"));
        }
        assert_uniform(&over_dimensions, &format!("{kind} over dimensions"));
    }
}

/// The low-order bits count, too: references average 10⁹ numbers.
#[test]
fn the_last_bits_are_random() {
    // Those of sobol-burley have 24 bits.
    let long = SamplerKind::ALL
        .into_iter()
        .filter(|kind| *kind != SamplerKind::SobolBurley);
    for kind in long {
        // Jittered strata divide by N and round, and the tile adds 12 bits above the jitter; with N
        // = 1 both keep at least 20 random bits below 2⁻³².
        let mut counts = [0; 256];
        for seed in 0..50_000 {
            let x = Sampler::new(kind, seed).points([1, 2], 3, 1).get_1d(0);
            let below_2_to_minus_32 = (x * 4_294_967_296.0).fract();
            counts[bin(below_2_to_minus_32, 256)] += 1;
        }
        assert_uniform(&counts, &format!("{kind}, bits 33 to 40"));
    }
}

#[test]
fn nasty_names_give_uniform_numbers_in_range() {
    let words = nasty_words();
    for kind in SamplerKind::ALL {
        let (mut by_seed, mut by_place, mut by_dimension) = ([0; 20], [0; 20], [0; 20]);
        for &a in &words {
            for &b in &words {
                let (low, high) = ((b & 0xFFFF_FFFF) as u32, (b >> 32) as u32);
                let set = Sampler::new(kind, a).points([low, high], low ^ high, 4);
                by_seed[bin(set.get_1d(2), 20)] += u64::from(b == 5 || b == 1);
                by_place[bin(set.get_2d(1)[0], 20)] += u64::from(low != high);
                by_dimension[bin(
                    Sampler::new(kind, a).points([0, 0], low, 4).get_2d(3)[1],
                    20,
                )] += u64::from(high == 0);
            }
        }
        if kind.pixels_are_independent() {
            assert_uniform(&by_seed, &format!("{kind}, nasty seeds"));
            assert_uniform(&by_place, &format!("{kind}, nasty seeds and pixels"));
            assert_uniform(
                &by_dimension,
                &format!("{kind}, nasty seeds and dimensions"),
            );
        }
    }
}

/// The numbers of one large set of independent samples, in pairs and triples of consecutive ones.
#[test]
fn consecutive_independent_numbers_are_independent() {
    let set = Sampler::new(SamplerKind::Independent, 3).points([0, 0], 0, 1 << 20);
    let (mut pairs, mut triples) = (vec![0; 32 * 32], vec![0; 8 * 8 * 8]);
    for i in (0..(1 << 20) - 3).step_by(3) {
        let [a, b, c] = [0, 1, 2].map(|k| set.get_1d(i + k));
        pairs[bin(a, 32) * 32 + bin(b, 32)] += 1;
        triples[(bin(a, 8) * 8 + bin(b, 8)) * 8 + bin(c, 8)] += 1;
    }
    assert_uniform(&pairs, "pairs");
    assert_uniform(&triples, "triples");
}
