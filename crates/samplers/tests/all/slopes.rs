//! These tests check slopes between numbers: they are unbiased, have no noise for linear functions,
//! and converge one order faster.

use linelit_samplers::hash::{mix, unit_f64};
use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind, Slopes};
use linelit_testkit::chi2::sidak;
use linelit_testkit::ztest::{Welford, critical_z};

fn points(kind: SamplerKind, seed: u64, count: u32) -> SampleSet {
    Sampler::new(kind, seed).points([3, 4], 0, count)
}

/// The numbers of a set and their shares.
fn shares(set: &SampleSet, with_slopes: bool) -> Vec<(f64, f64)> {
    let mut slopes = Slopes::default();
    slopes.set(set, with_slopes);
    slopes.iter().collect()
}

/// The mean of a function, by shares.
fn mean(set: &SampleSet, with_slopes: bool, f: impl Fn(f64) -> f64) -> f64 {
    let values = shares(set, with_slopes).into_iter();
    values.map(|(u, share)| share * f(u)).sum::<f64>() / f64::from(set.count())
}

/// Shares are what the formula says: of a function that has its slope in the inner strata, what
/// is left is the noise of the outer two.
#[test]
fn what_changes_linearly_has_no_noise_inside() {
    for count in [3, 4, 7, 16, 100] {
        for seed in 0..200 {
            let set = points(SamplerKind::Stratified, seed, count);
            let shares = shares(&set, true);
            let mut numbers: Vec<f64> = set.iter_1d().collect();
            assert!(numbers.iter().eq(shares.iter().map(|(u, _)| u)));
            assert!((shares.iter()).all(|(_, s)| (-1e-12..=2.0 + 1e-12).contains(s)));
            let n = f64::from(count);
            // Each share is a sum of three numbers of rounding 2⁻⁵³, a few times for quotients.
            let room = 8.0 * f64::EPSILON * n;
            let sum: f64 = shares.iter().map(|(_, share)| share).sum();
            assert!((sum - n).abs() < room, "{count} {seed}");
            numbers.sort_by(f64::total_cmp);
            let [first, last] = [numbers[0], numbers[numbers.len() - 1]];
            let outer = (first - 0.5 / n) + (last - (1.0 - 0.5 / n));
            let got = mean(&set, true, |u| 3.0 - 2.0 * u);
            let want = 2.0 - 2.0 * outer / n;
            assert!((got - want).abs() < room, "{count} {seed}: {got} {want}");
        }
    }
}

#[test]
fn all_count_one_where_strata_are_not_independent() {
    use SamplerKind::{Independent, Sobol, Stratified, UniformJitter};
    for (kind, count, with_slopes, plain) in [
        (UniformJitter, 16, true, true),
        (Independent, 16, true, true),
        (Sobol, 12, true, true),
        (Stratified, 2, true, true),
        (Stratified, 16, false, true),
        (Stratified, 16, true, false),
    ] {
        let shares = shares(&points(kind, 5, count), with_slopes);
        assert_eq!(shares.len(), count as usize);
        let all_one = shares
            .iter()
            .all(|(_, share)| share.to_bits() == 1_f64.to_bits());
        assert_eq!(all_one, plain, "{kind} {count}");
    }
}

/// A function of the distance from a place in [0, 1], and its integral.
struct Case {
    name: &'static str,
    value: fn(f64) -> f64,
    integral: fn(f64) -> f64,
    /// The variance falls as N to minus that, with slopes and without.
    orders: [f64; 2],
}

const CASES: [Case; 3] = [
    Case {
        name: "smooth",
        value: |x| (2.0 * x).exp(),
        integral: |a| 0.5 * ((2.0 * (1.0 - a)).exp() - (-2.0 * a).exp()),
        orders: [4.0, 3.0],
    },
    Case {
        name: "corner",
        value: |x| x.max(0.0),
        integral: |a| 0.5 * (1.0 - a) * (1.0 - a),
        orders: [4.0, 3.0],
    },
    Case {
        name: "jump",
        value: |x| if x > 0.0 { 1.0 } else { 0.0 },
        integral: |a| 1.0 - a,
        orders: [2.0, 2.0],
    },
];

impl Case {
    /// Errors of the mean over blocks of a pattern, with and without slopes.
    fn errors(&self, kind: SamplerKind, [blocks, count]: [u32; 2], seeds: u64) -> [Welford; 2] {
        [true, false].map(|with_slopes| {
            let error = |seed: u64| {
                let place = unit_f64(mix(seed + 1));
                let sampler = Sampler::new(kind, seed);
                let block = |index| sampler.block([3, 4], 0, count, Block::new(index, blocks));
                let of = |set| mean(&set, with_slopes, |u| (self.value)(u - place));
                let sum: f64 = (0..blocks).map(block).map(of).sum();
                sum / f64::from(blocks) - (self.integral)(place)
            };
            (0..seeds).map(error).collect()
        })
    }
}

/// Of blocks, slopes take only what their part of a stratum leaves: the mean over all blocks
/// stays unbiased and is as exact as without them, where the middle of the whole stratum would
/// add noise (3 times the error by Sobol' points).
#[test]
fn slopes_of_blocks_leave_what_all_together_have() {
    use SamplerKind::{Auto, Sobol, Stratified};
    let kinds = [Stratified, Sobol, Auto];
    let splits = [[16, 4], [10, 6], [4, 16], [8, 8]];
    let limit = critical_z(sidak(0.01, kinds.len() * splits.len() * CASES.len() * 2));
    for case in &CASES {
        for (kind, split) in kinds.into_iter().flat_map(|k| splits.map(|s| (k, s))) {
            let errors = case.errors(kind, split, 1000);
            let name = format!("{} {kind} {split:?}", case.name);
            for error in &errors {
                let z = error.z_score(0.0);
                assert!(z.abs() < limit, "{name}: z = {z}");
            }
            // Variances of 1,000 errors of a kurtosis of 20 are off by .14, their ratio by .2
            // if they were independent: four of that.
            let ratio = errors[0].variance() / errors[1].variance();
            assert!(ratio < 1.8, "{name}: {ratio}");
        }
    }
}

/// Unbiased by all patterns, and as exact as the documentation says.
#[test]
fn slopes_are_unbiased_and_converge_faster() {
    let limit = critical_z(sidak(0.01, CASES.len() * SamplerKind::ALL.len() * 4));
    for (case, kind) in CASES.iter().flat_map(|c| SamplerKind::ALL.map(|k| (c, k))) {
        let errors = [16, 64].map(|count| case.errors(kind, [1, count], 4000));
        for error in errors.iter().flatten() {
            let z = error.z_score(0.0);
            assert!(z.abs() < limit, "{} {kind}: z = {z}", case.name);
        }
        if kind != SamplerKind::Stratified {
            continue;
        }
        for (k, order) in case.orders.into_iter().enumerate() {
            let [few, many] = [0, 1].map(|n| errors[n][k].variance());
            let got = (few / many).ln() / 4_f64.ln();
            // A variance of 4,000 errors of a kurtosis of 20 is off by a part in 15: an order
            // by .07, of which this is four.
            assert!((got - order).abs() < 0.28, "{}: {got}, {order}", case.name);
        }
    }
}
