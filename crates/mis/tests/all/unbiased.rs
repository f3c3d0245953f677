//! These tests check that every heuristic is unbiased, by comparison of Monte Carlo estimates with
//! exact integrals, and that variances are the ones of theory.
#![allow(clippy::cast_possible_truncation, reason = "counts are small")]

use linelit_mis::smoothing::{border, smoothed_balance};
use linelit_mis::{
    Heuristic, OptimalSystem, clamped_optimal, optimal_contribution,
    visibility_optimal_contribution, weighted_balance,
};
use linelit_testkit::chi2::sidak;
use linelit_testkit::rng::SplitMix64;
use linelit_testkit::ztest::{Welford, critical_z};

/// All tests of this file together err with probability 0.01 at most; there are fewer than this
/// many.
const TESTS: usize = 100;
const TRIALS: usize = 40_000;

/// Three techniques on [0, 1]: uniform; 2x; and 2 on [½, 1] only.
const T: usize = 3;

fn draw(technique: usize, u: f64) -> f64 {
    match technique {
        0 => u,
        1 => u.sqrt(),
        _ => 0.5 + 0.5 * u,
    }
}

fn densities(x: f64) -> [f64; T] {
    [1.0, 2.0 * x, if x >= 0.5 { 2.0 } else { 0.0 }]
}

/// An integrand with a jump ("shadow"): 1 + 3x² outside [0.3, 0.6]. Integral 2 − (0.3 + 0.216 −
/// 0.027).
fn integrand(x: f64) -> f64 {
    if (0.3..0.6).contains(&x) {
        0.0
    } else {
        1.0 + 3.0 * x * x
    }
}

const INTEGRAL: f64 = 2.0 - 0.489;

const COUNTS: [f64; T] = [3.0, 1.0, 2.0];

/// The multi-sample estimator with `contribution(x, densities, f, technique)` for each sample, over
/// many trials.
fn estimate(seed: u64, contribution: impl Fn(f64, &[f64; T], f64, usize) -> f64) -> Welford {
    let mut rng = SplitMix64::new(seed);
    let sample = |technique: usize, u: f64| {
        let x = draw(technique, u);
        contribution(x, &densities(x), integrand(x), technique)
    };
    let mut trial = || {
        let mut sum = 0.0;
        for (technique, &n) in COUNTS.iter().enumerate() {
            for _ in 0..n as u32 {
                sum += sample(technique, rng.next_f64());
            }
        }
        sum
    };
    (0..TRIALS).map(|_| trial()).collect()
}

fn assert_unbiased(got: &Welford, want: f64, name: &str) {
    let z = got.z_score(want);
    assert!(
        z.abs() < critical_z(sidak(0.01, TESTS)),
        "{name}: {} instead of {want}, z = {z}",
        got.mean()
    );
}

#[test]
fn multi_sample_estimators_are_unbiased() {
    for (k, heuristic) in [
        Heuristic::Balance,
        Heuristic::Power(2.0),
        Heuristic::Power(0.7),
        Heuristic::Maximum,
        Heuristic::Cutoff(0.3),
        Heuristic::Average,
    ]
    .into_iter()
    .enumerate()
    {
        let got = estimate(k as u64, |_, ps, f, i| {
            heuristic.contribution(&COUNTS, ps, f, i)
        });
        assert_unbiased(&got, INTEGRAL, &format!("{heuristic:?}"));
    }
}

/// The published eq. 7 has a further 1/S in front: it must fail by that factor, or this file tests
/// nothing.
#[test]
fn the_erratum_would_be_noticed() {
    let got = estimate(77, |_, ps, f, i| {
        Heuristic::Balance.contribution(&COUNTS, ps, f, i) / T as f64
    });
    assert!(got.z_score(INTEGRAL).abs() > 100.0);
    assert_unbiased(&got, INTEGRAL / T as f64, "eq. 7 as printed");
}

#[test]
fn one_sample_estimators_are_unbiased() {
    let chances = [0.5, 0.3, 0.2];
    for (k, heuristic) in [
        Heuristic::Balance,
        Heuristic::Power(2.0),
        Heuristic::Average,
    ]
    .into_iter()
    .enumerate()
    {
        let mut rng = SplitMix64::new(100 + k as u64);
        let got: Welford = (0..TRIALS)
            .map(|_| {
                let choice = rng.next_f64();
                let technique = usize::from(choice >= 0.5) + usize::from(choice >= 0.8);
                let x = draw(technique, rng.next_f64());
                heuristic.contribution(&chances, &densities(x), integrand(x), technique)
            })
            .collect();
        assert_unbiased(&got, INTEGRAL, &format!("one sample, {heuristic:?}"));
    }
}

#[test]
fn known_parts_are_unbiased() {
    // Rough guesses of the parts' sizes; any positive ones are unbiased.
    let cs = [0.7, 1.9, 0.4];
    let weighted = |_: f64, ps: &[f64; T], f: f64, i: usize| {
        if ps[i] > 0.0 {
            weighted_balance(&cs, ps, i) * f / (COUNTS[i] * ps[i])
        } else {
            0.0
        }
    };
    assert_unbiased(&estimate(200, weighted), INTEGRAL, "weighted balance");
    for nu in [0.0, 0.3, 0.5, 1.0] {
        let clamped = |_: f64, ps: &[f64; T], f: f64, i: usize| {
            clamped_optimal(&cs, &COUNTS, ps, nu, i) * f / (COUNTS[i] * ps[i])
        };
        assert_unbiased(
            &estimate(201, clamped),
            INTEGRAL,
            &format!("clamped optimal, ν = {nu}"),
        );
        let unclamped = |_: f64, ps: &[f64; T], f: f64, i: usize| {
            visibility_optimal_contribution(&cs, &COUNTS, ps, nu, f, i)
        };
        assert_unbiased(
            &estimate(202, unclamped),
            INTEGRAL,
            &format!("optimal, ν = {nu}"),
        );
    }
    // Where a part is unknown to all (c = 0), the balance heuristic takes over.
    let partial = |_: f64, ps: &[f64; T], f: f64, i: usize| {
        clamped_optimal(&[0.0, 0.0, 1.0], &COUNTS, ps, 0.5, i) * f / (COUNTS[i] * ps[i])
    };
    assert_unbiased(
        &estimate(203, partial),
        INTEGRAL,
        "clamped optimal with unknown parts",
    );
}

/// α of the optimal heuristic from a fine midpoint rule, its residual error far below the Monte
/// Carlo error.
fn exact_alphas() -> [f64; T] {
    let mut system = OptimalSystem::<T, 1>::new();
    let steps = 100_000;
    for k in 0..steps {
        let x = (f64::from(k) + 0.5) / f64::from(steps);
        let ps = densities(x);
        // The rule wants p pᵀ/D and f p/D with D = Σ Nⱼpⱼ; a sample adds both over D². Counts
        // divided by √D turn its D² into D.
        let density: f64 = ps.iter().zip(COUNTS).map(|(p, n)| p * n).sum();
        let root = density.sqrt();
        let scaled_counts = COUNTS.map(|n| n / root);
        system.add(&scaled_counts, &ps, [integrand(x)]);
    }
    system.alphas()[0]
}

#[test]
fn optimal_weights_are_unbiased_and_best() {
    let alphas = exact_alphas();
    // At the solution the integral is Σ α; the midpoint rule's error at the jumps is below 4·10⁻⁵.
    assert!(
        (alphas.iter().sum::<f64>() - INTEGRAL).abs() < 1e-4,
        "{alphas:?}"
    );
    let optimal = estimate(300, |_, ps, f, i| {
        optimal_contribution(&alphas, &COUNTS, ps, f, i)
    });
    assert_unbiased(&optimal, INTEGRAL, "optimal");
    // Kondapaneni et al.: no other fixed weights have less variance. Compare with those above; the
    // standard error of a variance of 40 000 values is below 2 % here.
    for heuristic in [
        Heuristic::Balance,
        Heuristic::Power(2.0),
        Heuristic::Maximum,
        Heuristic::Average,
    ] {
        let other = estimate(300, |_, ps, f, i| heuristic.contribution(&COUNTS, ps, f, i));
        assert!(
            optimal.variance() < 0.98 * other.variance(),
            "{heuristic:?}: {}",
            other.variance()
        );
    }
    for nudge in 0..T {
        let mut worse = alphas;
        worse[nudge] += 1.0;
        let other = estimate(300, |_, ps, f, i| {
            optimal_contribution(&worse, &COUNTS, ps, f, i)
        });
        assert_unbiased(&other, INTEGRAL, "optimal with wrong α");
        assert!(
            optimal.variance() < 0.98 * other.variance(),
            "α[{nudge}]: {}",
            other.variance()
        );
    }
}

/// Zero variance where theory says so: parts known exactly.
#[test]
fn exact_parts_have_no_variance() {
    let parts = [1.25, 0.5];
    let f = |ps: &[f64; 2]| parts[0] * ps[0] + parts[1] * ps[1];
    let mut rng = linelit_testkit::cases::rng(5);
    for _ in 0..1000 {
        let x = rng.next_f64();
        let ps = [1.0, 2.0 * x];
        for i in 0..2 {
            let weighted = weighted_balance(&parts, &ps, i) * f(&ps) / ps[i];
            let optimal = optimal_contribution(&parts, &[1.0, 1.0], &ps, f(&ps), i);
            // Five roundings.
            assert!(
                (weighted / parts[i] - 1.0).abs() < 5.0 * f64::EPSILON,
                "{weighted}"
            );
            assert!(
                (optimal - parts[i]).abs() < 10.0 * f64::EPSILON * (1.0 + f(&ps)),
                "{optimal}"
            );
        }
    }
}

/// Salesin & Jarosz, Fig. 7, in one dimension. A light on [0, 1] is sampled by a point technique
/// that knows nothing of its borders (uniform on an interval of length 3 around it) and by one that
/// does. Unsmoothed, the point technique's effective integrand jumps at the borders and
/// stratification gains N⁻²; smoothed, it is N⁻³. Both unbiased.
#[test]
fn smoothing_restores_the_rate() {
    let f = |x: f64| {
        if (0.0..1.0).contains(&x) {
            1.0 + x
        } else {
            0.0
        }
    };
    let estimate = |n: u32, smooth: bool, seed: u64| {
        let mut rng = SplitMix64::new(seed);
        let count = f64::from(n);
        let ns = [count, count];
        // The borders fall anywhere in their strata.
        let start = -1.0 - rng.next_f64() * 0.5;
        let mut sum = 0.0;
        for k in 0..n {
            for technique in 0..2 {
                let u = (f64::from(k) + rng.next_f64()) / count;
                let x = if technique == 0 { start + 3.0 * u } else { u };
                if f(x) > 0.0 {
                    let ps = [1.0 / 3.0, 1.0];
                    let factors = [
                        if smooth {
                            border(x, 0.0, 1.0, 0.5)
                        } else {
                            1.0
                        },
                        1.0,
                    ];
                    sum += smoothed_balance(&ns, &ps, &factors, technique) * f(x)
                        / (count * ps[technique]);
                }
            }
        }
        sum
    };
    let exponent = |smooth: bool, ns: [u32; 2]| {
        let variances = ns.map(|n| {
            let values: Welford = (0..4000).map(|seed| estimate(n, smooth, seed)).collect();
            assert_unbiased(&values, 1.5, &format!("smoothing {smooth}, N = {n}"));
            values.variance()
        });
        (variances[1] / variances[0]).ln() / (f64::from(ns[1]) / f64::from(ns[0])).ln()
    };
    let (plain, smoothed) = (exponent(false, [64, 512]), exponent(true, [64, 512]));
    // A variance from 4000 values of bounded kurtosis has the relative error √(2/4000) = 0.022; of
    // an exponent from two of them 0.022·√2/ln 8 = 0.015. Five of those, plus the next term of the
    // law: 1 + b/N from the two border strata (of 3/N each, against d_m = ½): b ≤ 6, at most ln(1 +
    // 6/64)/ln 8 = 0.043.
    let tolerance = 5.0 * 0.015 + 0.043;
    assert!(
        (plain + 2.0).abs() < tolerance,
        "without smoothing N^{plain}"
    );
    assert!(
        (smoothed + 3.0).abs() < tolerance,
        "with smoothing N^{smoothed}"
    );
}
