//! These tests check laws of weights: they sum to one, are never NaN, do not depend on units, and
//! ignore terms that cannot contribute.
#![allow(clippy::float_cmp, reason = "exact laws")]

use linelit_mis::smoothing::{
    border, ease, edge, occluder_width, smoothed_balance, visible_interval,
};
use linelit_mis::{
    Heuristic, OptimalSystem, average, balance, balance_density, clamped_optimal, cutoff, maximum,
    power, visibility_optimal_contribution, weighted_balance,
};
use linelit_testkit::assert_close;
use linelit_testkit::cases::cases;
use proptest::prelude::*;

const HEURISTICS: [Heuristic; 8] = [
    Heuristic::Balance,
    Heuristic::Power(2.0),
    Heuristic::Power(1.0),
    Heuristic::Power(0.5),
    Heuristic::Power(20.0),
    Heuristic::Maximum,
    Heuristic::Cutoff(0.1),
    Heuristic::Average,
];

/// A density: ordinary, of any exponent, or zero, infinite, subnormal, negative, NaN.
fn density() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => 0.0..10.0_f64,
        4 => (-300.0..300.0_f64).prop_map(|e| 10.0_f64.powf(e)),
        1 => prop::sample::select(vec![0.0, -0.0, f64::INFINITY, f64::MIN_POSITIVE, 5e-324, f64::MAX, -1.0, f64::NAN]),
    ]
}

/// Sample counts and densities of one to six techniques.
fn techniques() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    prop::collection::vec(((0_u32..1000).prop_map(f64::from), density()), 1..6)
        .prop_map(|v| v.into_iter().unzip())
}

/// Whether some technique can draw the sample.
fn reachable(ns: &[f64], ps: &[f64]) -> bool {
    ns.iter().zip(ps).any(|(&n, &p)| n > 0.0 && p > 0.0)
}

/// T terms divided by their own sum: a rounding for each term and quotient, T for the sum, and as
/// many for adding up the weights: 2(T + 2)ε covers it.
fn assert_sums_to_one(weights: impl Iterator<Item = f64>, any: bool, name: &str) {
    let weights: Vec<f64> = weights.collect();
    let sum: f64 = weights.iter().sum();
    let tolerance = 2.0 * (weights.len() as f64 + 2.0) * f64::EPSILON;
    assert!(
        weights.iter().all(|w| (0.0..=1.0).contains(w)),
        "{name}: {weights:?}"
    );
    if any {
        assert!(
            (sum - 1.0).abs() <= tolerance,
            "{name}: {weights:?} sum to {sum}"
        );
    } else {
        assert_eq!(sum, 0.0, "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(2000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn weights_sum_to_one((ns, ps) in techniques()) {
        for heuristic in HEURISTICS {
            let weights = (0..ns.len()).map(|i| heuristic.weight(&ns, &ps, i));
            assert_sums_to_one(weights, reachable(&ns, &ps), &format!("{heuristic:?}"));
        }
    }

    #[test]
    fn weights_of_known_parts_sum_to_one((ns, ps) in techniques(), cs in prop::collection::vec(density(), 6), nu: f64) {
        let cs = &cs[..ns.len()];
        let parts = (0..ns.len()).map(|i| weighted_balance(cs, &ps, i));
        // A product that underflows counts as zero.
        let products: Vec<f64> = cs.iter().zip(&ps).map(|(&c, &p)| if c > 0.0 && p > 0.0 { c * p } else { 0.0 }).collect();
        assert_sums_to_one(parts, products.iter().any(|&p| p > 0.0), "weighted balance");
        if nu.is_nan() {
            return Ok(());
        }
        // Techniques without samples draw nothing; give all one, as Peters does.
        let ones = vec![1.0; ns.len()];
        let clamped = (0..ns.len()).map(|i| clamped_optimal(cs, &ones, &ps, nu, i));
        assert_sums_to_one(clamped, reachable(&ones, &ps), "clamped optimal");
    }

    #[test]
    fn smoothed_weights_sum_to_one((ns, ps) in techniques(), factors in prop::collection::vec(0.0..=1.0_f64, 6)) {
        let factors = &factors[..ns.len()];
        let products: Vec<f64> = ps.iter().zip(factors).map(|(&p, &m)| if p > 0.0 && m > 0.0 { p * m } else { 0.0 }).collect();
        let weights = (0..ns.len()).map(|i| smoothed_balance(&ns, &ps, factors, i));
        assert_sums_to_one(weights, reachable(&ns, &products), "smoothed");
        let unsmoothed = (0..ns.len()).map(|i| smoothed_balance(&ns, &ps, &vec![1.0; ns.len()], i));
        prop_assert!(unsmoothed.enumerate().all(|(i, w)| w == balance(&ns, &ps, i)));
    }

    /// A unit of measure (a power of two) changes no bit; the order of the techniques only
    /// rounding.
    #[test]
    fn units_do_not_matter(
        ns in [1.0..50.0_f64, 1.0..50.0, 1.0..50.0], ps in [0.1..10.0_f64, 0.1..10.0, 0.1..10.0], exponent in -300_i32..300,
    ) {
        let scaled = ps.map(|p| p * 2.0_f64.powi(exponent));
        for heuristic in HEURISTICS {
            for i in 0..3 {
                prop_assert_eq!(heuristic.weight(&ns, &ps, i), heuristic.weight(&ns, &scaled, i));
            }
        }
    }

    /// More samples of a technique never lower its weight, nor raise the others'.
    #[test]
    fn weights_grow_with_their_count(
        ns in [1.0..50.0_f64, 1.0..50.0], ps in [0.1..10.0_f64, 0.1..10.0], more in 1.0..10.0_f64,
    ) {
        for heuristic in HEURISTICS {
            let before = heuristic.weight(&ns, &ps, 0);
            let after = heuristic.weight(&[ns[0] * more, ns[1]], &ps, 0);
            prop_assert!(after >= before * (1.0 - 8.0 * f64::EPSILON), "{heuristic:?}: {before} then {after}");
        }
    }

    #[test]
    fn smoothing_factors_are_in_range(
        u in -2.0..3.0_f64, lo in 0.0..0.5_f64, length in 0.0..1.0_f64, gaps in [density(), density()], d_m in density(),
    ) {
        let factor = visible_interval(u, lo, lo + length, gaps[0], gaps[1], d_m);
        prop_assert!((0.0..=1.0).contains(&factor), "{factor}");
        prop_assert!((0.0..=1.0).contains(&border(u, lo, lo + length, d_m)));
    }

    /// The solver never returns NaN, and reproduces an integrand in the span of its densities.
    #[test]
    fn alphas_are_finite_and_exact(rows in prop::collection::vec([0.0..3.0_f64, 0.0..3.0, 0.0..3.0], 1..40), c in [0.1..3.0_f64, 0.1..3.0, 0.1..3.0]) {
        let mut system = OptimalSystem::<3, 1>::new();
        let ns = [1.0, 2.0, 3.0];
        let value = |ps: &[f64; 3]| ps.iter().zip(c).map(|(p, c)| p * c).sum::<f64>();
        for ps in &rows {
            system.add(&ns, ps, [value(ps)]);
        }
        let [alphas] = system.alphas();
        prop_assert!(alphas.iter().all(|a| a.is_finite()), "{alphas:?}");
        // Whatever the rank, the combination is reproduced where samples were taken. The system
        // squares the condition and drops directions below √ε: an error of a few √ε of the values
        // (ε^¼ in dropped directions).
        for ps in &rows {
            let residual = (value(ps) - ps.iter().zip(alphas).map(|(p, a)| p * a).sum::<f64>()).abs();
            let density = balance_density(&ns, ps);
            prop_assert!(density == 0.0 || residual <= 100.0 * f64::EPSILON.powf(0.25) * value(ps), "{residual} of {}", value(ps));
        }
    }
}

#[test]
fn values_by_hand() {
    let (ns, ps) = ([2.0, 1.0], [1.0, 4.0]);
    assert_eq!(balance(&ns, &ps, 0), 1.0 / 3.0);
    assert_eq!(power(&ns, &ps, 2.0, 0), 0.2);
    // ½³ of 1 + ½³, to the roundings of the power and the quotient.
    assert_close!(
        power(&ns, &ps, 3.0, 0),
        1.0 / 9.0,
        rel = 4.0 * f64::EPSILON,
        "cubes"
    );
    assert_eq!(maximum(&ns, &ps, 0), 0.0);
    assert_eq!(cutoff(&ns, &ps, 0.75, 0), 0.0);
    assert_eq!(cutoff(&ns, &ps, 0.5, 0), 1.0 / 3.0);
    assert_eq!(average(&ns, &ps, 0), 0.5);
    assert_eq!(balance_density(&ns, &ps), 6.0);
    assert_eq!(Heuristic::Balance.contribution(&ns, &ps, 4.0, 0), 2.0 / 3.0);
    assert_eq!(
        Heuristic::Balance.contribution(&ns, &[0.0, 4.0], 4.0, 0),
        0.0
    );
}

#[test]
fn delta_techniques_take_all() {
    let (ns, ps) = ([1.0, 1.0, 1.0], [f64::INFINITY, 3.0, f64::INFINITY]);
    for heuristic in [
        Heuristic::Balance,
        Heuristic::Power(2.0),
        Heuristic::Maximum,
    ] {
        assert_eq!(
            [0, 1, 2].map(|i| heuristic.weight(&ns, &ps, i)),
            [0.5, 0.0, 0.5],
            "{heuristic:?}"
        );
    }
    // A technique that others cannot sample has weight one: a linear light under BSDF sampling.
    assert_eq!(balance(&[4.0, 4.0], &[2.5, 0.0], 0), 1.0);
}

#[test]
#[should_panic(expected = "technique 2 of 2 counts and 3 densities")]
fn an_index_out_of_range_panics_with_its_reason() {
    let _ = balance(&[1.0, 1.0], &[1.0, 1.0, 1.0], 2);
}

#[test]
fn smoothing_by_hand() {
    assert_eq!(ease(f64::NAN), 0.0);
    assert_eq!(edge(0.25, 0.5), 0.75);
    assert_eq!(edge(-1.0, 0.0), 1.0);
    // 0/0 guards: a light without width, an interval that ends at the light's border, an occluder
    // of no length.
    assert_eq!(border(0.0, 0.0, 0.0, 0.0), 1.0);
    assert_eq!(visible_interval(0.0, 0.0, 1.0, 0.0, 0.0, 0.5), 1.0);
    assert_eq!(occluder_width(0.0, 0.0), 0.0);
    // Long gaps smooth over d_m, short ones over less: m(½) = ¾.
    assert_eq!(occluder_width(0.25, 0.5), 0.375);
    assert_eq!(visible_interval(0.1875, 0.0, 1.0, 0.25, 0.0, 0.5), 0.75);
}

/// The factor is continuous as an occluder's edge slides away: no jump when its gap shrinks to
/// nothing.
#[test]
fn smoothing_fades_with_the_occluder() {
    let factor = |gap: f64| visible_interval(0.3, 0.25, 1.0, gap, 0.0, 0.5);
    // For a gap g ≪ d_m the width is about 2g; once it is below the distance 0.05 the factor is
    // exactly one.
    assert_eq!(factor(0.0), 1.0);
    assert_eq!(factor(0.02), 1.0);
    assert!(factor(0.2) < 1.0 && factor(1.0) < factor(0.2));
}

#[test]
fn unclamped_optimal_with_visibility() {
    let (cs, ns, ps) = ([1.0, 3.0], [1.0, 2.0], [3.0, 1.0]);
    let f = 1.0 * 3.0 + 3.0 * 1.0;
    // ν = 1 and nothing blocked: constants c/N. ν = 0: the balance heuristic.
    assert_eq!(
        visibility_optimal_contribution(&cs, &ns, &ps, 1.0, f, 1),
        1.5
    );
    assert_eq!(
        visibility_optimal_contribution(&cs, &ns, &ps, 0.0, f, 1),
        f / 5.0
    );
    // Blocked samples contribute, too, and may be negative.
    assert!(visibility_optimal_contribution(&cs, &ns, &ps, 1.0, 0.0, 0) < 0.0);
}

#[test]
fn systems_merge() {
    let (mut whole, mut parts) = (
        OptimalSystem::<2, 3>::new(),
        [OptimalSystem::<2, 3>::default(); 2],
    );
    for i in 0..8 {
        let x = 0.1 + 0.1 * f64::from(i);
        let sample = ([1.0, 2.0 * x], [x, x * x, 1.0]);
        whole.add(&[1.0, 1.0], &sample.0, sample.1);
        parts[usize::from(i >= 4)].add(&[1.0, 1.0], &sample.0, sample.1);
    }
    let [mut first, second] = parts;
    first.merge(&second);
    for (a, b) in whole
        .alphas()
        .iter()
        .flatten()
        .zip(first.alphas().iter().flatten())
    {
        // Sums in another order: a few ε times the condition of the 2×2 system, about 50.
        assert!(
            (a - b).abs() <= 1000.0 * f64::EPSILON * (1.0 + a.abs()),
            "{a} and {b}"
        );
    }
}

/// Of one technique, α Σ wᵢ² (1 + ridge) = Σ f wᵢ/density with wᵢ = 1/n.
#[test]
fn a_ridge_adds_to_the_diagonal() {
    let mut system = OptimalSystem::<1, 1>::new();
    system.add(&[2.0], &[0.5], [3.0]);
    system.add(&[2.0], &[4.0], [1.0]);
    for ridge in [0.0, 0.25, 6.0] {
        // (3/0.5 + 1/4)/4 over 2/4.
        let want = 3.125 / (1.0 + ridge);
        assert_close!(
            system.damped_alphas(ridge)[0][0],
            want,
            rel = 1e-15,
            "{ridge}"
        );
    }
}

/// Two equal techniques leave the system singular; one gets everything, and nothing explodes.
#[test]
fn equal_techniques_are_harmless() {
    let mut system = OptimalSystem::<2, 1>::new();
    for i in 1..10 {
        let p = f64::from(i);
        system.add(&[1.0, 1.0], &[p, p], [2.0 * p]);
    }
    let [alphas] = system.alphas();
    assert!(
        (alphas[0] + alphas[1] - 2.0).abs() < 1e-12 && alphas.contains(&0.0),
        "{alphas:?}"
    );
    // Samples that no technique reaches and values that are not finite change nothing.
    let before = system;
    system.add(&[1.0, 1.0], &[0.0, 0.0], [1.0]);
    system.add(&[1.0, 1.0], &[1.0, 1.0], [f64::NAN]);
    assert_eq!(system, before);
}

/// What samples with light leave of the densities' integrals is what techniques draw alone: by
/// hand, p₀ = 1 on [0, 1], p₁ = 1 on [½, 3/2], 6 and 2 samples, and light on [½, 1] alone, where 4
/// of them are expected; 3 and 1 find none. If they all do, there is nothing to add.
#[test]
fn a_completed_system_knows_of_samples_without_light() {
    let ns = [6.0, 2.0];
    let lit = [3.0, 5.0, 2.0, 7.0];
    let mut told = OptimalSystem::<2, 1>::new();
    for f in lit {
        told.add(&ns, &[1.0, 1.0], [f]);
    }
    let mut completed = told;
    completed.complete(&ns);
    for (alone, count) in [([1.0, 0.0], 3), ([0.0, 1.0], 1)] {
        for _ in 0..count {
            told.add(&ns, &alone, [0.0]);
        }
    }
    for ridge in [0.0, 0.5] {
        let pairs = [completed, told].map(|system| system.damped_alphas(ridge)[0]);
        for (got, want) in pairs[0].iter().zip(pairs[1]) {
            // A dozen roundings of numbers up to 8, in a system of condition 16.
            assert!(
                (got - want).abs() < 12.0 * 8.0 * 16.0 * f64::EPSILON,
                "{got} {want}"
            );
        }
    }
    let again = completed;
    completed.complete(&ns);
    let [[a, b], [c, d]] = [completed, again].map(|system| system.alphas()[0]);
    assert!((a - c).abs() < 1e-12 && (b - d).abs() < 1e-12);
}
