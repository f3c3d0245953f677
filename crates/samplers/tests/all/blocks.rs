//! These tests check blocks of a pattern: each block is stratified like a pattern of its own, and
//! so are all blocks together.
#![allow(clippy::cast_possible_truncation, reason = "bins and strata are small")]

use crate::strata::{assert_each_once, assert_net, cell, fractions, stratum};
use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind, hash::mix, hash::unit_f64};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::ztest::{Welford, critical_z};
use proptest::prelude::*;

/// Blocks and samples of each.
const SPLITS: [[u32; 2]; 20] = [
    [64, 1],
    [16, 4],
    [8, 8],
    [4, 16],
    [2, 32],
    [1, 64],
    [60, 1],
    [20, 3],
    [10, 6],
    [6, 10],
    [13, 1],
    [13, 7],
    [7, 13],
    [5, 4],
    [3, 97],
    [97, 2],
    [2, 5],
    [256, 1],
    [100, 9],
    [12, 100],
];

/// All blocks of a pattern.
fn blocks(kind: SamplerKind, seed: u64, [blocks, count]: [u32; 2]) -> Vec<SampleSet> {
    let sampler = Sampler::new(kind, seed);
    let block = |index| sampler.block([1, 1], 0, count, Block::new(index, blocks));
    (0..blocks).map(block).collect()
}

/// Whether as many cells make a grid: no more than twice as many columns as rows.
fn rows_of_grid(n: u32) -> Option<u32> {
    (1..=n).rfind(|a| n.is_multiple_of(*a) && a * a <= n && 2 * a * a >= n)
}

#[test]
fn blocks_have_a_number_in_each_stratum_and_so_have_all_together() {
    use SamplerKind::{BlueNoise, MultiJitter, Stratified, UniformJitter};
    for kind in [Stratified, MultiJitter, UniformJitter, BlueNoise] {
        for split in SPLITS {
            let [s, n] = split;
            for seed in 0..4 {
                let sets = blocks(kind, seed, split);
                let name = format!("{kind} {split:?}");
                for set in &sets {
                    let strata = set.iter_1d().map(|x| stratum(x, n));
                    assert_each_once(strata, u64::from(n), &name);
                }
                let all = sets.iter().flat_map(SampleSet::iter_1d);
                assert_each_once(all.map(|x| stratum(x, s * n)), u64::from(s * n), &name);
            }
        }
    }
}

/// Of a jittered pattern, each block has a point in each cell. All together have one in each part
/// of a cell, of which there are as many as blocks, cut as the square is, but along the other axis.
#[test]
fn blocks_have_a_point_in_each_cell_and_all_together_in_each_part_of_it() {
    for split in SPLITS {
        let [s, n] = split;
        let columns = rows_of_grid(n).map(|rows| [n / rows, rows]);
        for seed in 0..4 {
            let sets = blocks(SamplerKind::Stratified, seed, split);
            let name = format!("{split:?}");
            for set in &sets {
                assert_each_once(set.iter_2d().map(|p| cell(p, n)), u64::from(n), &name);
            }
            let Some([columns, rows]) = columns else {
                continue;
            };
            let part = |[x, y]: [f64; 2]| {
                let [x, y] = [x * f64::from(columns), y * f64::from(rows)];
                let (cell, inside) = (y.floor() * f64::from(columns) + x.floor(), [y, x]);
                cell as u64 * u64::from(s) + self::cell(inside.map(f64::fract), s)
            };
            let all = sets.iter().flat_map(SampleSet::iter_2d);
            assert_each_once(all.map(part), u64::from(s * n), &name);
        }
    }
}

/// Of a multi-jittered pattern, each block has a point in each cell and in each stratum of y, and
/// of x where the cells make a grid; all together have as many in each cell as there are blocks, as
/// many in each of the strata of a cell, and one in each of all strata. Blocks of one sample are a
/// multi-jittered pattern.
#[test]
fn multi_jittered_blocks_are_rooks_and_so_are_all_together() {
    for split in SPLITS {
        let [s, n] = split;
        let (is_grid, all) = (rows_of_grid(n).is_some(), s * n);
        for seed in 0..4 {
            let sets = blocks(SamplerKind::MultiJitter, seed, split);
            let name = format!("{split:?}");
            let rooks = |points: &mut dyn Iterator<Item = [f64; 2]>, n: u32, is_grid: bool| {
                let points: Vec<[f64; 2]> = points.collect();
                let along = |axis: usize| points.iter().map(move |p| stratum(p[axis], n));
                assert_each_once(along(1), u64::from(n), &format!("y of {name}"));
                if is_grid {
                    assert_each_once(along(0), u64::from(n), &format!("x of {name}"));
                }
            };
            let mut in_cells = vec![0; n as usize];
            let mut in_strata = [(); 2].map(|()| vec![0; (n * n) as usize]);
            for set in &sets {
                rooks(&mut set.iter_2d(), n, is_grid);
                assert_each_once(set.iter_2d().map(|p| cell(p, n)), u64::from(n), &name);
                for point in set.iter_2d() {
                    let cell = cell(point, n);
                    in_cells[cell as usize] += 1;
                    for (counts, u) in in_strata.iter_mut().zip(point) {
                        counts[(cell * u64::from(n) + stratum(u, n)) as usize] += 1;
                    }
                }
            }
            assert!(in_cells.iter().all(|&points| points == s), "{name}");
            if let Some(rows) = rows_of_grid(n)
                && s.is_multiple_of(rows * (n / rows))
            {
                for (counts, strata) in in_strata.iter().zip([rows, n / rows]) {
                    let even = |&count: &u32| count == 0 || count == s / strata;
                    assert!(counts.iter().all(even), "{name}: {counts:?}");
                }
            }
            rooks(&mut sets.iter().flat_map(SampleSet::iter_2d), all, is_grid);
            if n == 1 && rows_of_grid(s).is_some() {
                let turned = sets.iter().map(|set| set.get_2d(0)).map(|[x, y]| [y, x]);
                assert_each_once(turned.map(|p| cell(p, s)), u64::from(s), &name);
            }
        }
    }
}

/// Blocks of a power of two of samples are nets, and so are all together if they are a power of
/// two.
#[test]
fn blocks_of_nets_are_nets_and_so_are_all_together() {
    use SamplerKind::{Auto, Sobol, ZSobol};
    for kind in [Sobol, ZSobol, Auto] {
        for split in SPLITS.into_iter().chain([[10, 16], [100, 8], [7, 1]]) {
            let [s, n] = split;
            if !n.is_power_of_two() || (kind == Auto && !s.is_power_of_two()) {
                continue;
            }
            for seed in 0..4 {
                let sets = blocks(kind, seed, split);
                let name = format!("{kind} {split:?}");
                let mut all = Vec::new();
                for set in &sets {
                    let points: Vec<[u32; 2]> = set.iter_2d().map(fractions).collect();
                    assert_net(&points, n.trailing_zeros(), &name);
                    all.extend(points);
                }
                if s.is_power_of_two() {
                    assert_net(&all, (s * n).trailing_zeros(), &name);
                }
            }
        }
    }
}

/// All blocks together are the first points of one sequence: between powers of two no stratum of
/// the next finer level has two of them, for any numbers of blocks and samples.
#[test]
fn blocks_of_sequences_are_runs_of_it() {
    for kind in [SamplerKind::Sobol, SamplerKind::Halton, SamplerKind::ZSobol] {
        for split in SPLITS {
            let fine = (split[0] * split[1]).next_power_of_two();
            let sets = blocks(kind, 6, split);
            let all = sets.iter().flat_map(SampleSet::iter_1d);
            let mut strata: Vec<u64> = all.map(|x| stratum(x, fine)).collect();
            strata.sort_unstable();
            strata.dedup();
            assert_eq!(strata.len() as u32, split[0] * split[1], "{kind} {split:?}");
        }
    }
    // Halton: 2^a·3^b points hold one in each cell of the 2^a × 3^b grid.
    for ([columns, rows], split) in [([8, 9], [6, 12]), ([8, 9], [72, 1]), ([16, 27], [16, 27])] {
        let all = blocks(SamplerKind::Halton, 3, split).into_iter();
        let keys = all
            .flat_map(|set| set.iter_2d())
            .map(|[x, y]| stratum(y, rows) * u64::from(columns) + stratum(x, columns));
        assert_each_once(keys, u64::from(columns * rows), &format!("{split:?}"));
    }
}

/// The law that makes an estimate unbiased: over seeds, a sample of a block is uniform.
#[test]
fn each_sample_of_a_block_is_uniform_over_seeds() {
    const CASES: [([u32; 2], u32, u32); 7] = [
        ([64, 1], 17, 0),
        ([16, 4], 3, 2),
        ([10, 6], 9, 5),
        ([13, 7], 0, 3),
        ([7, 13], 6, 12),
        ([3, 97], 1, 50),
        ([60, 1], 31, 0),
    ];
    let bins = [37, 13 * 13];
    let alpha = sidak(0.01, 2 * CASES.len() * SamplerKind::ALL.len());
    for kind in SamplerKind::ALL {
        for ([blocks, count], index, i) in CASES {
            let mut counts = bins.map(|bins| vec![0_u64; bins]);
            for seed in 0..20_000 {
                let block = Block::new(index, blocks);
                let set = Sampler::new(kind, seed).block([3, 5], 2, count, block);
                let [x, y] = set.get_2d(i);
                counts[0][(set.get_1d(i) * 37.0) as usize] += 1;
                counts[1][(y * 13.0) as usize * 13 + (x * 13.0) as usize] += 1;
            }
            for counts in counts {
                let expected = vec![20_000.0 / counts.len() as f64; counts.len()];
                let test = chi2_test(&counts, &expected, 5.0);
                let name = format!("{kind}, sample {i} of block {index} of {blocks} × {count}");
                assert!(test.p_value > alpha, "{name}: {test:?}");
            }
        }
    }
}

/// For f(x) = x, a block has the variance 1/(12 N³) of a pattern of N numbers, and all together
/// have the variance for SN: parts are independent from stratum to stratum, and each number is
/// within its part.
#[test]
fn variances_of_blocks_and_of_all_together() {
    use SamplerKind::{Halton, MultiJitter, Sobol, Stratified, ZSobol};
    const CASES: [[u32; 2]; 4] = [[64, 1], [16, 4], [4, 16], [8, 8]];
    let limit = critical_z(sidak(0.01, 2 * (5 * CASES.len() + 2 * 2) + 2 * CASES.len()));
    let check = |kind, split: [u32; 2]| {
        let [s, n] = split.map(f64::from);
        let errors = |seed| {
            let sets = blocks(kind, seed, split);
            let mean = |set: &SampleSet| set.iter_1d().sum::<f64>() / n - 0.5;
            let errors: Vec<f64> = sets.iter().map(mean).collect();
            // Take one of the blocks, since the blocks of a pattern are not independent.
            let one = errors[seed as usize % errors.len()];
            [one, errors.iter().sum::<f64>() / s]
        };
        let errors: Vec<[f64; 2]> = (0..5000).map(errors).collect();
        for (k, samples) in [n, s * n].into_iter().enumerate() {
            let squares: Welford = errors.iter().map(|e| e[k] * e[k]).collect();
            let z = squares.z_score(1.0 / (12.0 * samples.powi(3)));
            assert!(z.abs() < limit, "{kind} {split:?} {k}: z = {z}");
        }
    };
    for kind in [Stratified, MultiJitter, Sobol, Halton, ZSobol] {
        for split in CASES {
            check(kind, split);
        }
    }
    for kind in [Stratified, MultiJitter] {
        for split in [[10, 6], [7, 13]] {
            check(kind, split);
        }
    }
    // So has a multi-jittered block along either axis of its points.
    for split in CASES {
        for axis in 0..2 {
            let error = |seed| {
                let set = blocks(MultiJitter, seed, split)[seed as usize % split[0] as usize];
                set.iter_2d().map(|p| p[axis] - 0.5).sum::<f64>() / f64::from(split[1])
            };
            let squares: Welford = (0..5000).map(|seed| f64::powi(error(seed), 2)).collect();
            let z = squares.z_score(1.0 / (12.0 * f64::from(split[1]).powi(3)));
            assert!(z.abs() < limit, "{split:?}, axis {axis}: z = {z}");
        }
    }
}

/// Blocks of independent numbers have no numbers in common, for any sizes.
#[test]
fn blocks_of_independent_numbers_are_independent() {
    for kind in [SamplerKind::Independent, SamplerKind::BlueNoiseIndependent] {
        let mut products = [Welford::default(), Welford::default()];
        for seed in 0..4000 {
            let sampler = Sampler::new(kind, seed);
            let number = |index, count, i| {
                let block = Block::new(index, 9);
                sampler.block([4, 4], 1, count, block).get_1d(i) - 0.5
            };
            products[0].push(number(2, 3, 1) * number(5, 3, 1));
            products[1].push(number(2, 3, 1) * number(3, 2, 1));
        }
        let limit = critical_z(sidak(0.01, 4));
        assert!(
            products.iter().all(|p| p.z_score(0.0).abs() < limit),
            "{kind}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Blocks that choose alike are numbered from zero on, each once, and so are the others.
    #[test]
    fn groups_number_their_blocks(of in 1_u32..200, seed: u64, marks in [0.0..=1.0_f64, 0.0..=1.0_f64]) {
        let u = unit_f64(mix(seed));
        let [low, high] = [marks[0].min(marks[1]), marks[0].max(marks[1])];
        let mut groups = [vec![], vec![]];
        for index in 0..of {
            let block = Block::new(index, of);
            let v = block.spread(u);
            prop_assert!((0.0..1.0).contains(&v));
            groups[usize::from((low..high).contains(&v))].push(block.among(v, marks));
        }
        for group in groups {
            let len = group.len() as u32;
            prop_assert!(group.iter().all(|block| block.of() == len || of == 1));
            let numbers = group.iter().map(|block| u64::from(block.index()));
            assert_each_once(numbers, u64::from(len), "group");
        }
    }

    #[test]
    fn the_other_order_has_each_block_once(of in 1_u32..3000) {
        let all = (0..of).map(|index| u64::from(Block::new(index, of).interleaved().index()));
        assert_each_once(all, u64::from(of), "interleaved");
    }
}
