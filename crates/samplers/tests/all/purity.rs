//! These tests check that numbers are pure functions of seed, pixel, dimension and sample: there is
//! no order, no state, and no dependence on other numbers that were drawn.
#![allow(clippy::float_cmp, reason = "the same bits are expected")]
#![allow(clippy::cast_possible_truncation, reason = "indices are small")]

use linelit_samplers::{SampleSet, Sampler, SamplerKind};
use proptest::prelude::*;

fn kinds() -> impl Strategy<Value = SamplerKind> {
    prop::sample::select(SamplerKind::ALL.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any order of access, forwards, backwards, repeated, from a fresh set each time: the same
    /// bits.
    #[test]
    fn order_does_not_matter(
        kind in kinds(), seed: u64, pixel: [u32; 2], dimension: u32, count in 1_u32..2000, start: u32,
    ) {
        let set = Sampler::new(kind, seed).points(pixel, dimension, count);
        let forwards: Vec<[f64; 2]> = set.iter_2d().collect();
        let line: Vec<f64> = set.iter_1d().collect();
        for step in 0..count.min(50) {
            let i = (u64::from(start) + u64::from(step) * 7919) as u32 % count;
            let fresh: SampleSet = Sampler::new(kind, seed).points(pixel, dimension, count);
            prop_assert_eq!(fresh.get_2d(i), forwards[i as usize]);
            prop_assert_eq!(set.get_1d(i), line[i as usize]);
        }
    }

    /// Every number is in [0, 1) for all names and any index, also beyond the count.
    /// To the bit, whichever pattern, also where it goes on with another set.
    #[test]
    fn columns_are_the_points_one_by_one(
        kind in kinds(), seed: u64, pixel: [u32; 2], dimension: u32, count in 1_u32..300, first in 0_u32..300, len in 0_usize..90,
    ) {
        let set = Sampler::new(kind, seed).points(pixel, dimension, count);
        let [mut x, mut y] = [[0.0; 90]; 2];
        set.fill_2d(first, [&mut x[..len], &mut y[..len]]);
        for (i, (x, y)) in (first..).zip(x.iter().zip(&y)).take(len) {
            let want = set.get_2d(i).map(f64::to_bits);
            prop_assert_eq!([x, y].map(|u| u.to_bits()), want, "{} {}", kind, i);
        }
    }
}

#[test]
fn progressive_patterns_extend() {
    for kind in SamplerKind::ALL
        .into_iter()
        .filter(|kind| kind.is_progressive())
    {
        let sampler = Sampler::new(kind, 4);
        let (small, large) = (
            sampler.points([1, 2], 3, 10),
            sampler.points([1, 2], 3, 1000),
        );
        for i in 0..20 {
            assert_eq!(small.get_1d(i), large.get_1d(i), "{kind}");
            assert_eq!(small.get_2d(i), large.get_2d(i), "{kind}");
        }
    }
}

/// Beyond its count a finite pattern goes on with sets of the same kind: strata are filled once
/// more by each.
#[test]
fn indices_beyond_the_count_continue_with_fresh_sets() {
    let set = Sampler::new(SamplerKind::Stratified, 4).points([1, 2], 3, 10);
    for round in 0..5 {
        let mut strata: Vec<u32> = (0..10)
            .map(|i| (set.get_1d(10 * round + i) * 10.0) as u32)
            .collect();
        strata.sort_unstable();
        assert_eq!(strata, (0..10).collect::<Vec<_>>(), "round {round}");
    }
    assert_ne!(set.get_1d(0), set.get_1d(10));
}

#[test]
fn different_patterns_have_different_streams() {
    for a in SamplerKind::ALL {
        for b in SamplerKind::ALL {
            let [x, y] = [a, b].map(|kind| Sampler::new(kind, 1).points([0, 0], 0, 1).get_1d(0));
            assert_eq!(a == b, x == y, "{a} and {b}");
        }
    }
}

#[test]
fn sets_report_their_count() {
    let sampler = Sampler::new(SamplerKind::Sobol, 0);
    assert_eq!(sampler.points([0, 0], 0, 7).count(), 7);
    assert_eq!(sampler.points([0, 0], 0, 0).count(), 1);
    assert_eq!(sampler.points([0, 0], 0, 7).iter_2d().len(), 7);
    assert_eq!(sampler.kind(), SamplerKind::Sobol);
}
