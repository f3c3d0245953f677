//! These tests check the strata of each pattern in one set: one sample per stratum, cell, or
//! elementary interval.
#![allow(clippy::cast_possible_truncation, reason = "bins and strata are small")]

use linelit_samplers::{Sampler, SamplerKind, owen_scramble, sobol_02, van_der_corput};
use std::collections::BTreeSet;

const COUNTS: [u32; 22] = [
    1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 16, 17, 31, 36, 48, 64, 97, 100, 128, 1000, 1024,
];

/// Asserts that `keys` are 0..n in some order.
pub(crate) fn assert_each_once(keys: impl Iterator<Item = u64>, n: u64, name: &str) {
    let mut seen = vec![false; n as usize];
    for key in keys {
        assert!(
            !std::mem::replace(&mut seen[key as usize], true),
            "{name}: stratum {key} of {n} holds two"
        );
    }
    assert!(seen.into_iter().all(|s| s), "{name}: an empty stratum");
}

pub(crate) fn stratum(x: f64, n: u32) -> u64 {
    (x * f64::from(n)) as u64
}

/// The cell of a point: ⌊√n⌉ rows of nearly equally many cells, or the squarest grid if its aspect
/// is at most two. Written again from the documentation, not shared with the crate.
pub(crate) fn cell(point: [f64; 2], n: u32) -> u64 {
    let divisor = (1..=n)
        .filter(|a| n.is_multiple_of(*a) && a * a <= n && 2 * a * a >= n)
        .max();
    let rows = u64::from(divisor.unwrap_or_else(|| f64::from(n).sqrt().round() as u32));
    let n64 = u64::from(n);
    let position = point[1] * f64::from(n);
    let row = (0..rows)
        .rev()
        .find(|r| (r * n64 / rows) as f64 <= position)
        .expect("row 0 starts at 0");
    let (first, next) = (row * n64 / rows, (row + 1) * n64 / rows);
    first + (point[0] * (next - first) as f64) as u64
}

#[test]
fn one_sample_per_stratum_in_one_dimension() {
    use SamplerKind::{BlueNoise, MultiJitter, Stratified, UniformJitter};
    for kind in [Stratified, MultiJitter, UniformJitter, BlueNoise] {
        for n in COUNTS {
            for seed in 0..20 {
                let set = Sampler::new(kind, seed).points([1, 1], 0, n);
                assert_each_once(
                    set.iter_1d().map(|x| stratum(x, n)),
                    u64::from(n),
                    &format!("{kind} {n}"),
                );
            }
        }
    }
}

#[test]
fn one_sample_per_cell_in_two_dimensions_for_any_count() {
    for kind in [SamplerKind::Stratified, SamplerKind::MultiJitter] {
        for n in COUNTS {
            for seed in 0..20 {
                let set = Sampler::new(kind, seed).points([1, 1], 0, n);
                assert_each_once(
                    set.iter_2d().map(|p| cell(p, n)),
                    u64::from(n),
                    &format!("{kind} {n}"),
                );
            }
        }
    }
}

/// Multi-jittered: also one sample per stratum of y always, and of x where the cells form a grid.
#[test]
fn multi_jittered_points_are_n_rooks() {
    for n in COUNTS {
        let grid = (1..=n).any(|a| n.is_multiple_of(a) && a * a <= n && 2 * a * a >= n);
        for seed in 0..20 {
            let set = Sampler::new(SamplerKind::MultiJitter, seed).points([1, 1], 0, n);
            assert_each_once(
                set.iter_2d().map(|p| stratum(p[1], n)),
                u64::from(n),
                &format!("y of {n}"),
            );
            if grid {
                assert_each_once(
                    set.iter_2d().map(|p| stratum(p[0], n)),
                    u64::from(n),
                    &format!("x of {n}"),
                );
            }
        }
    }
}

/// The better of both: nets of powers of two, else one in each cell and each stratum of y.
#[test]
fn automatic_points_are_nets_or_rooks() {
    for n in COUNTS {
        for seed in 0..4 {
            let set = Sampler::new(SamplerKind::Auto, seed).points([1, 1], 0, n);
            if n.is_power_of_two() {
                let points: Vec<[u32; 2]> = set.iter_2d().map(fractions).collect();
                assert_net(&points, n.trailing_zeros(), "auto");
            }
            let once = |strata: &mut dyn Iterator<Item = u64>| {
                assert_each_once(strata, u64::from(n), &format!("auto {n}"));
            };
            once(&mut set.iter_2d().map(|p| cell(p, n)));
            once(&mut set.iter_2d().map(|p| stratum(p[1], n)));
            once(&mut set.iter_1d().map(|u| stratum(u, n)));
        }
    }
}

/// Lattices: one sample per stratum of x for any N, and gaps in y of at most φ²/N (the
/// three-distance theorem: for a golden rotation the largest gap is below φ²/N, Swierczkowski
/// 1958).
#[test]
fn lattices_are_even_on_both_axes() {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    for kind in [SamplerKind::UniformJitter, SamplerKind::BlueNoise] {
        for n in COUNTS {
            let set = Sampler::new(kind, 3).points([1, 1], 0, n);
            assert_each_once(
                set.iter_2d().map(|p| stratum(p[0], n)),
                u64::from(n),
                &format!("{kind} {n}"),
            );
            let mut ys: Vec<f64> = set.iter_2d().map(|p| p[1]).collect();
            ys.sort_by(f64::total_cmp);
            ys.push(ys[0] + 1.0);
            let gap = ys.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
            assert!(
                gap <= phi * phi / f64::from(n),
                "{kind} {n}: a gap of {gap}"
            );
        }
    }
}

/// All elementary intervals of area 2^−m hold one point each: a (0, m, 2)-net in base 2.
pub(crate) fn assert_net(points: &[[u32; 2]], m: u32, name: &str) {
    for k in 0..=m {
        let keys = points.iter().map(|&[x, y]| {
            let high = |v: u32, bits: u32| u64::from(v).checked_shr(32 - bits).unwrap_or(0);
            high(x, k) << (m - k) | high(y, m - k)
        });
        assert_each_once(keys, 1 << m, &format!("{name}, m = {m}, {k} digits of x"));
    }
}

pub(crate) fn fractions([x, y]: [f64; 2]) -> [u32; 2] {
    [x, y].map(|v| (v * 4_294_967_296.0) as u32)
}

#[test]
fn sobol_points_are_nets() {
    for m in 0..=12 {
        // The bare sequence: every aligned block.
        for block in [0, 1, 5] {
            let points: Vec<[u32; 2]> = (block << m..(block + 1) << m).map(sobol_02).collect();
            assert_net(&points, m, "bare");
            let scrambled: Vec<[u32; 2]> = points
                .iter()
                .map(|&[x, y]| [owen_scramble(x, 11), owen_scramble(y, 12)])
                .collect();
            assert_net(&scrambled, m, "scrambled");
        }
        for kind in [SamplerKind::Sobol, SamplerKind::ZSobol] {
            for seed in 0..4 {
                let set = Sampler::new(kind, seed).points([seed as u32, 2], 3, 1 << m);
                let points: Vec<[u32; 2]> = set.iter_2d().map(fractions).collect();
                assert_net(&points, m, kind.name());
            }
        }
    }
}

/// The full depth: 2^16 points resolve intervals of area 2^−16, and late blocks of the bare
/// sequence use all 32 bits.
#[test]
fn large_sobol_sets_are_nets() {
    let set = Sampler::new(SamplerKind::Sobol, 9).points([0, 0], 0, 1 << 16);
    assert_net(
        &set.iter_2d().map(fractions).collect::<Vec<_>>(),
        16,
        "sobol",
    );
    let last: Vec<[u32; 2]> = (u32::MAX - 1023..=u32::MAX).map(sobol_02).collect();
    assert_net(&last, 10, "the last block");
}

#[test]
fn one_dimensional_sequences_are_stratified_at_powers_of_two() {
    for kind in [SamplerKind::Sobol, SamplerKind::Halton, SamplerKind::ZSobol] {
        for m in 0..=12 {
            let set = Sampler::new(kind, 5).points([4, 4], 1, 1 << m);
            assert_each_once(
                set.iter_1d().map(|x| stratum(x, 1 << m)),
                1 << m,
                kind.name(),
            );
        }
        // Between powers of two no stratum of the next finer level holds two, none of the coarser
        // level is empty.
        for n in COUNTS {
            let set = Sampler::new(kind, 6).points([4, 4], 1, n);
            let (fine, coarse) = (n.next_power_of_two(), n.next_power_of_two() / 2);
            let distinct: BTreeSet<u64> = set.iter_1d().map(|x| stratum(x, fine)).collect();
            assert_eq!(distinct.len(), n as usize, "{kind} {n}");
            if coarse > 0 {
                let covered: BTreeSet<u64> = set.iter_1d().map(|x| stratum(x, coarse)).collect();
                assert_eq!(covered.len(), coarse as usize, "{kind} {n}");
            }
        }
    }
}

/// Halton: the first 2^a·3^b points hold one in each cell of the 2^a × 3^b grid, for consecutive
/// indices.
#[test]
fn halton_points_fill_their_grids() {
    for (a, b) in [
        (0, 1),
        (1, 1),
        (2, 1),
        (1, 2),
        (3, 2),
        (4, 3),
        (5, 3),
        (6, 4),
    ] {
        let (columns, rows) = (1_u32 << a, 3_u32.pow(b));
        for seed in 0..5 {
            let set = Sampler::new(SamplerKind::Halton, seed).points([2, 2], 0, columns * rows);
            let keys = set
                .iter_2d()
                .map(|[x, y]| stratum(y, rows) * u64::from(columns) + stratum(x, columns));
            assert_each_once(keys, u64::from(columns * rows), &format!("2^{a} × 3^{b}"));
        }
    }
}

/// Uniform jitter: all samples share the place in their stratum, to rounding.
#[test]
fn uniform_jitter_shares_its_offset() {
    for n in [3_u32, 16, 100] {
        let set = Sampler::new(SamplerKind::UniformJitter, 8).points([0, 5], 0, n);
        let offsets: Vec<f64> = set.iter_1d().map(|x| (x * f64::from(n)).fract()).collect();
        // (k + ξ)/N·N rounds three times at magnitude N.
        let tolerance = 3.0 * f64::EPSILON * f64::from(n);
        for offset in &offsets {
            assert!(
                (offset - offsets[0]).abs() <= tolerance,
                "{n}: {offset} and {}",
                offsets[0]
            );
        }
    }
}

/// The sets of neighbouring pixels on the Z-order curve join into one larger net: four pixels of a
/// quad, sixteen of the next, and so on. This is what diffuses the error.
#[test]
fn z_order_quads_share_a_net() {
    for (side, m) in [(2_u32, 2), (4, 4), (8, 2)] {
        let sampler = Sampler::new(SamplerKind::ZSobol, 77);
        let mut points = Vec::new();
        for x in 0..side {
            for y in 0..side {
                let set = sampler.points([8 + x, 16 + y], 4, 1 << m);
                points.extend(set.iter_2d().map(fractions));
            }
        }
        assert_net(&points, m + 2 * side.trailing_zeros(), "quads");
    }
}

/// Our generator against sobol_burley's, unscrambled: the same sequence in both dimensions, within
/// its 16 bits of index.
#[test]
fn bare_sequence_equals_sobol_burley() {
    for i in 0..1_u32 << 16 {
        let theirs =
            [0, 1].map(|d| sobol_burley::parts::sobol_rev(i.reverse_bits(), d).reverse_bits());
        let [x, y] = sobol_02(i);
        assert_eq!(x, van_der_corput(i));
        assert_eq!([x, y], theirs, "index {i}");
    }
}
