//! These tests check padding: numbers of different dimensions, pixels and seeds are independent,
//! and are paired at random.
#![allow(clippy::cast_possible_truncation, reason = "bins are small")]

use linelit_samplers::{Sampler, SamplerKind, hash::unit_f64};
use linelit_testkit::chi2::{chi2_test, sidak};
use linelit_testkit::ztest::{Welford, critical_z, z_score};
use rand::Rng;

/// All tests of this file together err with probability 0.01 at most; there are fewer than this
/// many.
const TESTS: usize = 600;

/// A stream's seed, pixel and dimension.
type Stream = (u64, [u32; 2], u32);

/// A pair of streams that the cases below compare.
struct Case {
    name: &'static str,
    streams: fn(u64) -> [Stream; 2],
    couples_pixels: bool,
}

/// (seed, pixel, dimension) of two streams, for each of many trials.
const CASES: [Case; 9] = [
    Case {
        name: "neighbouring dimensions",
        streams: |t| [(t, [3, 4], 0), (t, [3, 4], 1)],
        couples_pixels: false,
    },
    Case {
        name: "dimensions 1 and 2",
        streams: |t| [(t, [3, 4], 1), (t, [3, 4], 2)],
        couples_pixels: false,
    },
    Case {
        name: "dimensions 2^16 apart",
        streams: |t| [(t, [3, 4], 5), (t, [3, 4], 65_541)],
        couples_pixels: false,
    },
    Case {
        name: "last dimension",
        streams: |t| [(t, [3, 4], 0), (t, [3, 4], u32::MAX)],
        couples_pixels: false,
    },
    Case {
        name: "neighbouring seeds",
        streams: |t| [(2 * t, [3, 4], 0), (2 * t + 1, [3, 4], 0)],
        couples_pixels: false,
    },
    Case {
        name: "seeds that differ in one high bit",
        streams: |t| [(t, [3, 4], 0), (t | 1 << (t % 30 + 34), [3, 4], 0)],
        couples_pixels: false,
    },
    Case {
        name: "neighbouring pixels",
        streams: |t| [(t, [3, 4], 0), (t, [4, 4], 0)],
        couples_pixels: true,
    },
    Case {
        name: "mirrored pixels",
        streams: |t| [(t, [3, 4], 0), (t, [4, 3], 0)],
        couples_pixels: true,
    },
    Case {
        name: "pixel against dimension",
        streams: |t| [(t, [0, 1], 0), (t, [0, 0], 1)],
        couples_pixels: true,
    },
];

/// The applicable (kind, case) pairs.
fn all_cases() -> impl Iterator<Item = (SamplerKind, &'static Case)> {
    SamplerKind::ALL.into_iter().flat_map(|kind| {
        CASES
            .iter()
            .filter(move |case| kind.pixels_are_independent() || !case.couples_pixels)
            .map(move |c| (kind, c))
    })
}

fn set(
    kind: SamplerKind,
    (seed, pixel, dimension): Stream,
    count: u32,
) -> linelit_samplers::SampleSet {
    Sampler::new(kind, seed).points(pixel, dimension, count)
}

/// The joint histogram of a number of one stream's generator and of another's is flat; so is that
/// of a generator and the pattern's numbers.
#[test]
fn pairs_of_generators_have_a_flat_joint_histogram() {
    let nth = |(seed, pixel, dimension): Stream, n: usize| {
        let mut rng = Sampler::new(SamplerKind::Independent, seed).rng(pixel, dimension);
        unit_f64((0..=n).map(|_| rng.next_u64()).last().unwrap_or(0))
    };
    let flat = |pairs: &dyn Fn(u64) -> [f64; 2], name: &str| {
        let mut counts = vec![0; 64];
        for [a, b] in (0..20_000).map(pairs) {
            counts[(a * 8.0) as usize * 8 + (b * 8.0) as usize] += 1;
        }
        let test = chi2_test(&counts, &[20_000.0 / 64.0; 64], 5.0);
        assert!(test.p_value > sidak(0.01, TESTS), "{name}: {test:?}");
    };
    for case in &CASES {
        for [m, n] in [[0, 0], [0, 1], [16, 16]] {
            flat(
                &|t| {
                    let [a, b] = (case.streams)(t);
                    [nth(a, m), nth(b, n)]
                },
                case.name,
            );
        }
    }
    for n in [0, 1, 16] {
        flat(
            &|t| {
                let stream = (t, [3, 4], 0);
                let points = set(SamplerKind::Independent, stream, 64);
                [nth(stream, n), points.get_1d(n as u32)]
            },
            "generator and points",
        );
    }
}

/// The joint histogram of sample i of one stream and sample i of another is flat.
#[test]
fn pairs_of_streams_have_a_flat_joint_histogram() {
    for (kind, case) in all_cases() {
        for count in [1, 16] {
            let mut counts = vec![0; 64];
            for trial in 0..20_000 {
                let [a, b] =
                    (case.streams)(trial).map(|s| set(kind, s, count).get_1d(trial as u32 % count));
                counts[(a * 8.0) as usize * 8 + (b * 8.0) as usize] += 1;
            }
            let test = chi2_test(&counts, &[20_000.0 / 64.0; 64], 5.0);
            assert!(
                test.p_value > sidak(0.01, TESTS),
                "{kind}, {}, {count} samples: {test:?}",
                case.name
            );
        }
    }
}

/// Errors of whole estimates are uncorrelated, in one and two dimensions: this is what averaging
/// over pixels, trials and lights relies on.
#[test]
fn errors_of_streams_are_uncorrelated() {
    let trials = 20_000_u64;
    for (kind, case) in all_cases() {
        for count in [4_u32, 13] {
            let (mut line, mut square) = (Correlation::default(), Correlation::default());
            for trial in 0..trials {
                let sets = (case.streams)(trial).map(|s| set(kind, s, count));
                line.push(sets.map(|s| s.iter_1d().map(|x| x * x).sum()));
                square
                    .push(sets.map(|s| s.iter_2d().map(|[x, y]| f64::from(x + y * y < 0.7)).sum()));
            }
            for (name, correlation) in [("1-D", line), ("2-D", square)] {
                let z = correlation.z();
                assert!(
                    z.abs() < critical_z(sidak(0.01, TESTS)),
                    "{kind}, {}, {count}, {name}: z = {z}",
                    case.name
                );
            }
        }
    }
}

#[derive(Default)]
struct Correlation {
    values: Vec<[f64; 2]>,
}

impl Correlation {
    fn push(&mut self, pair: [f64; 2]) {
        self.values.push(pair);
    }

    /// The sample correlation over its standard error 1/√n under independence.
    fn z(&self) -> f64 {
        let [a, b] = [0, 1].map(|k| self.values.iter().map(|v| v[k]).collect::<Welford>());
        let products = self
            .values
            .iter()
            .map(|v| (v[0] - a.mean()) * (v[1] - b.mean()));
        let correlation = products.collect::<Welford>().mean() / (a.std_dev() * b.std_dev());
        correlation * (self.values.len() as f64).sqrt()
    }
}

/// Two padded dimensions A and B are paired at random: the mean of (a − ½)(b − ½) over N samples
/// has the variance of two one-dimensional stratified sets in random order.
///
/// With aᵢ − ½ of variance 1/12 and covariance c = −(N + 1)/(12 N²) for i ≠ k (from the variance
/// 1/(12 N³) of the stratified mean), the product's mean has variance (1/144)(1/N + (N − 1)(N +
/// 1)²/N⁵). Burley's nested shuffling gives 1.58 times as much; a shared order many times as much.
#[test]
fn padded_dimensions_pair_at_random() {
    use SamplerKind::{Halton, MultiJitter, Sobol, Stratified, ZSobol};
    let trials = 20_000_u64;
    for kind in [Stratified, MultiJitter, Sobol, Halton, ZSobol] {
        for n in [4_u32, 16, 64, 128, 256] {
            let squares: Welford = (0..trials)
                .map(|seed| {
                    let sampler = Sampler::new(kind, seed);
                    let (a, b) = (sampler.points([5, 6], 0, n), sampler.points([5, 6], 1, n));
                    let sum: f64 = a
                        .iter_1d()
                        .zip(b.iter_1d())
                        .map(|(x, y)| (x - 0.5) * (y - 0.5))
                        .sum();
                    (sum / f64::from(n)).powi(2)
                })
                .collect();
            let n = f64::from(n);
            let expected = (1.0 / n + (n - 1.0) * (n + 1.0).powi(2) / n.powi(5)) / 144.0;
            let z = squares.z_score(expected);
            assert!(
                z.abs() < critical_z(sidak(0.01, TESTS)),
                "{kind}, N = {n}: variance {:e}, expected {expected:e}, z = {z}",
                squares.mean()
            );
        }
    }
}

/// Independent samples have the variance 1/(12 N) of independent samples, no less: nothing is
/// secretly stratified.
#[test]
fn independent_samples_are_independent() {
    for n in [2_u32, 16, 100] {
        let squares: Welford = (0..50_000)
            .map(|seed| {
                let set = Sampler::new(SamplerKind::Independent, seed).points([0, 0], 0, n);
                (set.iter_1d().sum::<f64>() / f64::from(n) - 0.5).powi(2)
            })
            .collect();
        let z = z_score(
            squares.mean(),
            1.0 / (12.0 * f64::from(n)),
            squares.standard_error(),
        );
        assert!(z.abs() < critical_z(sidak(0.01, TESTS)), "N = {n}: z = {z}");
    }
}

/// Where the numbers of sets are in their strata, by strata, and of every seed: half a stratum to
/// the left at least, to the right at most; `None` if a stratum holds two.
fn in_strata(kind: SamplerKind, count: u32, seed: u64) -> Option<Vec<f64>> {
    let mut offsets = vec![f64::NAN; count as usize];
    for u in set(kind, (seed, [3, 4], 7), count).iter_1d() {
        let at = u * f64::from(count);
        let old = std::mem::replace(&mut offsets[at as usize], at.fract() - 0.5);
        if !old.is_nan() {
            return None;
        }
    }
    Some(offsets)
}

/// The largest z score of the means of the offset in each stratum, and of its products with those
/// in the next two; infinite if a stratum ever holds two.
fn dependence(kind: SamplerKind, count: u32) -> f64 {
    let strata = count as usize;
    let mut sums = vec![Welford::default(); 3 * strata];
    for seed in 0..4000 {
        let Some(offsets) = in_strata(kind, count, seed) else {
            return f64::INFINITY;
        };
        for k in 0..strata {
            sums[3 * k].push(offsets[k]);
            for ahead in (1..3).filter(|ahead| k + ahead < strata) {
                sums[3 * k + ahead].push(offsets[k] * offsets[k + ahead]);
            }
        }
    }
    let scores = sums.iter().filter(|sum| sum.count() > 0);
    scores.map(|sum| sum.z_score(0.0).abs()).fold(0.0, f64::max)
}

/// Numbers that are said to be one in each stratum and independent there are; where that is denied,
/// strata hold several, or offsets are alike.
#[test]
fn strata_are_independent_where_a_set_says_so() {
    const COUNTS: [u32; 5] = [3, 4, 8, 12, 16];
    // Means of bounded numbers over 4,000 seeds: three for each stratum of each set.
    let scores = 3 * COUNTS.iter().sum::<u32>() as usize * SamplerKind::ALL.len();
    let limit = critical_z(sidak(0.01, scores));
    for kind in SamplerKind::ALL {
        for count in COUNTS {
            let claimed = set(kind, (0, [3, 4], 7), count).has_independent_strata();
            let z = dependence(kind, count);
            assert_eq!(claimed, z < limit, "{kind} {count}: z = {z}");
        }
    }
}
