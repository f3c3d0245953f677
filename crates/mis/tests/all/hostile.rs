//! Every public function with floats that attack it in any argument: none panics, weights lie in
//! [0, 1] and sum to one (those of the optimal heuristic may leave [0, 1]), and nothing is NaN.

use linelit_mis::smoothing::{
    border, ease, edge, occluder_width, smoothed_balance, visible_interval,
};
use linelit_mis::{
    Heuristic, OptimalSystem, average, balance, balance_density, clamped_optimal, cutoff, maximum,
    optimal_contribution, power, visibility_optimal_contribution, weighted_balance,
};
use linelit_testkit::public;
use linelit_testkit::strategies::hostile;
use proptest::prelude::*;
use std::path::Path;

#[test]
fn every_public_function_is_called_here() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let missing = public::missing(&src, include_str!("hostile.rs"), &[]);
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

fn three() -> impl Strategy<Value = [f64; 3]> {
    [hostile(), hostile(), hostile()]
}

fn is_factor(x: f64) -> bool {
    (0.0..=1.0).contains(&x)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: linelit_testkit::cases::cases(10_000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn weights(cs in three(), ns in three(), ps in three(), number in hostile(), f in hostile()) {
        // What a sample has to be drawn by.
        let drawn = |n: &[f64; 3]| (0..3).any(|k| n[k] > 0.0 && ps[k] > 0.0 && n[k] * ps[k] > 0.0);
        let sums_to_one = |n: &[f64; 3], weight: &dyn Fn(usize) -> f64| {
            let w = [0, 1, 2].map(weight);
            let sum = w[0] + w[1] + w[2];
            let want = if drawn(n) { 1.0 } else { 0.0 };
            // (T + 2) ε, with the sum here on top.
            w.iter().all(|w| is_factor(*w)) && (sum - want).abs() <= 8.0 * f64::EPSILON
        };
        prop_assert!(sums_to_one(&ns, &|i| balance(&ns, &ps, i)));
        prop_assert!(sums_to_one(&ns, &|i| power(&ns, &ps, number, i)), "{number}");
        prop_assert!(sums_to_one(&ns, &|i| power(&ns, &ps, 2.0, i)));
        prop_assert!(sums_to_one(&ns, &|i| maximum(&ns, &ps, i)));
        prop_assert!(sums_to_one(&ns, &|i| cutoff(&ns, &ps, number, i)), "{number}");
        prop_assert!(sums_to_one(&ns, &|i| average(&ns, &ps, i)));
        prop_assert!(sums_to_one(&cs, &|i| weighted_balance(&cs, &ps, i)));
        for i in 0..3 {
            prop_assert!(is_factor(clamped_optimal(&cs, &ns, &ps, number, i)));
            prop_assert!(is_factor(smoothed_balance(&ns, &ps, &cs, i)));
        }
        let density = balance_density(&ns, &ps);
        prop_assert!(density >= 0.0);
        for h in [Heuristic::Balance, Heuristic::Power(number), Heuristic::Maximum, Heuristic::Cutoff(number), Heuristic::Average] {
            for i in 0..3 {
                prop_assert!(is_factor(h.weight(&ns, &ps, i)), "{h:?}");
                let c = h.contribution(&ns, &ps, f, i);
                prop_assert!(c.is_finite() && (c == 0.0 || (c > 0.0) == (f > 0.0)), "{h:?} {c}");
            }
        }
    }

    #[test]
    fn optimal(alphas in three(), ns in three(), ps in three(), nu in hostile(), f in hostile()) {
        for i in 0..3 {
            prop_assert!(optimal_contribution(&alphas, &ns, &ps, f, i).is_finite());
            prop_assert!(visibility_optimal_contribution(&alphas, &ns, &ps, nu, f, i).is_finite());
        }
    }

    #[test]
    fn systems(
        samples in prop::collection::vec((three(), three(), [hostile(), hostile()]), 1..6),
        ridge in hostile(),
    ) {
        let (mut system, mut other) = (OptimalSystem::<3, 2>::new(), OptimalSystem::default());
        for (ns, ps, f) in &samples {
            system.add(ns, ps, *f);
            other.add(&samples[0].0, ps, *f);
        }
        system.merge(&other);
        other.complete(&samples[0].0);
        for alphas in [system.alphas(), system.damped_alphas(ridge), other.damped_alphas(ridge)] {
            prop_assert!(alphas.iter().flatten().all(|a| a.is_finite()), "{alphas:?}");
        }
    }

    #[test]
    fn smoothing(n in [hostile(), hostile(), hostile(), hostile(), hostile(), hostile()]) {
        let [u, lo, hi, gap_lo, gap_hi, d_m] = n;
        prop_assert!(is_factor(ease(u)) && is_factor(edge(u, d_m)) && is_factor(border(u, lo, hi, d_m)));
        let width = occluder_width(gap_lo, d_m);
        prop_assert!(width >= 0.0 && width <= d_m.max(0.0) && width.is_finite());
        prop_assert!(is_factor(visible_interval(u, lo, hi, gap_lo, gap_hi, d_m)));
    }
}
