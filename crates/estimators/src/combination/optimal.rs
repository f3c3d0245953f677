//! Optimal weights of a combination: from one round of samples for the other.

use super::Sample;
use crate::{MOST_TECHNIQUES, Optimal};
use linelit_geometry::DVec3;
use linelit_mis::{OptimalSystem, clamped_optimal, optimal_contribution};

/// One number for each technique.
type Techniques = [f64; MOST_TECHNIQUES];

/// What pulls the coefficients towards the balance heuristic, in samples for each technique
/// (measured in [`linelit_mis::OptimalEstimator`]).
const DAMPING: f64 = 3.0;

/// The mean of what two rounds of samples say, each with the coefficients α of the other
/// (Kondapaneni et al. 2019, eqs. 10–14); `expected` are the samples of each technique in a round.
///
/// α from the samples that they weight would be biased. With those of independent samples, any α
/// is unbiased: α_i for each sample of technique i has the mean α_i ∫p_i, and Σ α_k p_k is what is
/// subtracted. That ∫p_i may be less than one (lines that are wholly hidden give no sample) does
/// not matter, since it is the same in both.
pub(super) fn sum(kind: Optimal, expected: &Techniques, rounds: [Round<'_>; 2]) -> DVec3 {
    let systems = rounds.map(|round| system(expected, round));
    let used = expected.iter().filter(|n| **n > 0.0).count();
    let ridge = DAMPING * used as f64 / expected.iter().sum::<f64>().max(1.0);
    let weighted = |round: Round<'_>, by: &OptimalSystem<MOST_TECHNIQUES, 3>| {
        let alphas = by.damped_alphas(ridge);
        let one = |sample: &Sample| match kind {
            Optimal::Free => free(&alphas, expected, sample),
            Optimal::Clamped => clamped(&alphas, expected, sample),
        };
        round.samples.iter().map(one).sum::<DVec3>()
    };
    0.5 * (weighted(rounds[0], &systems[1]) + weighted(rounds[1], &systems[0]))
}

/// The samples of one round, and how many draws of each technique gave none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round<'a> {
    pub samples: &'a [Sample],
    pub misses: &'a [usize; MOST_TECHNIQUES],
}

fn system(expected: &Techniques, round: Round<'_>) -> OptimalSystem<MOST_TECHNIQUES, 3> {
    let mut system = OptimalSystem::new();
    for sample in round.samples {
        system.add(expected, &sample.densities, sample.value.to_array());
    }
    // What only one technique can draw and carries no light: without it a technique that seldom
    // meets the light would look as sure as one that always does.
    for (k, &misses) in round.misses.iter().enumerate() {
        let mut alone = [0.0; MOST_TECHNIQUES];
        alone[k] = 1.0;
        for _ in 0..misses {
            system.add(expected, &alone, [0.0; 3]);
        }
    }
    system
}

/// The optimal estimator, channel by channel.
fn free(alphas: &[Techniques; 3], expected: &Techniques, sample: &Sample) -> DVec3 {
    let (ps, i) = (&sample.densities, sample.technique);
    DVec3::from_array(
        [0, 1, 2].map(|c| optimal_contribution(&alphas[c], expected, ps, sample.value[c], i)),
    )
}

/// Weights between none and all: the optimal ones where α ≥ 0 and Σ α_k p_k ≤ f, which is what
/// they are if techniques sample parts of the light.
fn clamped(alphas: &[Techniques; 3], expected: &Techniques, sample: &Sample) -> DVec3 {
    let (ps, i) = (&sample.densities, sample.technique);
    let mut parts = [0.0; MOST_TECHNIQUES];
    for (k, part) in parts.iter_mut().enumerate() {
        *part = alphas.iter().map(|a| a[k]).sum::<f64>().max(0.0);
    }
    let controlled: f64 = parts.iter().zip(ps).map(|(c, p)| c * p).sum();
    let known = controlled / sample.value.element_sum();
    let weight = clamped_optimal(&parts, expected, ps, known, i);
    sample.value * (weight / (expected[i] * ps[i]))
}
