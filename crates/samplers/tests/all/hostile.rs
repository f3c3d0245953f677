//! Every public function with arguments that attack it: none panics, and all numbers lie in [0, 1).

use linelit_samplers::{
    Block, SampleSet, Sampler, SamplerKind, Slopes, blue_noise_rank, hash::mix, hash::unit_f64,
    owen_scramble, sobol_02, stratum, van_der_corput,
};
use linelit_testkit::public;
use linelit_testkit::strategies::hostile_unit;
use proptest::prelude::*;
use std::path::Path;

#[test]
fn every_public_function_is_called_here() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    // What methods return: they are called on it, not by its name.
    let exempt = ["UnknownSampler", "SampleSet"];
    let missing = public::missing(&src, include_str!("hostile.rs"), &exempt);
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

fn is_unit(x: f64) -> bool {
    (0.0..1.0).contains(&x)
}

/// Any bits, with the ends and powers of two, where carries and masks are.
fn word() -> impl Strategy<Value = u32> {
    prop_oneof![
        any::<u32>(),
        0..70_u32,
        Just(u32::MAX),
        (0..32_u32).prop_map(|b| 1 << b),
        (1..32_u32).prop_map(|b| (1 << b) - 1)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: linelit_testkit::cases::cases(10_000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn blocks(index in word(), of in word(), u in hostile_unit(), marks in [hostile_unit(), hostile_unit()]) {
        let block = Block::new(index, of);
        prop_assert_eq!(block.of(), of.max(1));
        prop_assert_eq!(block.index(), index % of.max(1));
        prop_assert!(stratum(u, of as usize) < of.max(1) as usize);
        let v = block.spread(u);
        for other in [block.among(v, marks), block.among(u, marks), block.interleaved(), Block::WHOLE] {
            prop_assert!(other.index() < other.of() && other.of() <= of.max(1));
            for kind in SamplerKind::ALL {
                let count = if of.is_multiple_of(2) { 3 } else { index };
                let set = Sampler::new(kind, 5).block([1, index], 2, count, other);
                prop_assert!((0..4).all(|i| is_unit(set.get_1d(i)) && set.get_2d(i).iter().all(|x| is_unit(*x))));
                prop_assert!(set.parts() >= f64::from(set.count()));
                if set.count() <= 64 {
                    let mut slopes = Slopes::default();
                    slopes.set(&set, true);
                    let in_range = |(u, share)| is_unit(u) && (-1e-12..=2.0 + 1e-12).contains(&share);
                    prop_assert!(slopes.iter().all(in_range), "{kind}");
                }
            }
        }
    }

    #[test]
    fn patterns(seed in any::<u64>(), pixel in [word(), word()], dimension in word(), count in word(), i in word()) {
        for kind in SamplerKind::ALL {
            let sampler = Sampler::new(kind, seed);
            prop_assert_eq!(sampler.kind(), kind);
            let _ = (kind.name(), kind.is_progressive(), kind.pixels_are_independent());
            let set: SampleSet = sampler.points(pixel, dimension, count);
            prop_assert_eq!(set.count(), count.max(1));
            if set.has_independent_strata() && set.count() <= 64 {
                let mut strata: Vec<f64> =
                    set.iter_1d().map(|u| (u * f64::from(set.count())).floor()).collect();
                strata.sort_by(f64::total_cmp);
                strata.dedup();
                prop_assert_eq!(strata.len(), set.count() as usize, "{}", kind);
            }
            for i in [i, 0, set.count() - 1, u32::MAX] {
                prop_assert!(is_unit(set.get_1d(i)), "{kind} {i}");
                prop_assert!(set.get_2d(i).iter().all(|x| is_unit(*x)), "{kind} {i}");
                let [mut x, mut y] = [[0.5; 11]; 2];
                set.fill_2d(i, [&mut x, &mut y[..10]]);
                prop_assert!(x.iter().chain(&y).all(|x| is_unit(*x)), "{kind} {i}");
            }
            let mut rng = sampler.rng(pixel, dimension);
            prop_assert!(rng.next_u64() != rng.next_u64(), "{kind}: once in 1.8e19");
            let _ = (set.iter_1d().take(3).all(is_unit), set.iter_2d().next());
        }
        prop_assert!(is_unit(unit_f64(mix(seed))) && is_unit(unit_f64(seed)));
        prop_assert!(blue_noise_rank(pixel) < 64 * 64);
        prop_assert_eq!(sobol_02(i)[0], van_der_corput(i));
        let _ = owen_scramble(i, seed);
    }
}
