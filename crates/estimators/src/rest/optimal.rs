//! Optimal weights of a combination: from one round of samples for the other.

use super::prepared::Sample;
use crate::{MOST_TECHNIQUES, Optimal};
use linelit_geometry::DVec3;
use linelit_mis::{OptimalSystem, balance, clamped_optimal, optimal_contribution};

/// One number for each technique.
type Techniques = [f64; MOST_TECHNIQUES];

/// The strength of the regularization towards the balance heuristic, in samples for each technique
/// (measured in [`OptimalSystem::damped_alphas`]).
const DAMPING: f64 = 3.0;

/// Returns the difference between optimal weights and the balance heuristic, summed over two rounds
/// of samples, each by the coefficients α of the other (Kondapaneni et al. 2019, eqs. 10–14);
/// `expected` are the samples of each technique in a round.
///
/// α from the samples that they weight would be biased. By those of independent samples, and by the
/// numbers of samples that techniques have had, the sum of a round by the optimal weights is an
/// unbiased estimate of the light that these techniques can sample, and so is the sum by the
/// balance heuristic. Their difference is zero in the mean, and a technique without a sample has no
/// part in it. That ∫p_i may be less than one (lines that are wholly hidden give no sample) does
/// not matter, since it is the same in both.
pub(super) fn sum(kind: Optimal, expected: &Techniques, rounds: [Round<'_>; 2]) -> DVec3 {
    let systems = rounds.map(|round| system(expected, round.samples));
    let used = expected.iter().filter(|n| **n > 0.0).count();
    let ridge = DAMPING * used as f64 / expected.iter().sum::<f64>().max(1.0);
    let added = |round: Round<'_>, by: &OptimalSystem<MOST_TECHNIQUES, 3>| {
        let alphas = by.damped_alphas(ridge);
        let one = |sample: &Sample| match kind {
            Optimal::Free => free(&alphas, &round.counts, sample),
            Optimal::Clamped => clamped(&alphas, &round.counts, sample),
        };
        round.samples.iter().map(one).sum::<DVec3>()
    };
    0.5 * (added(rounds[0], &systems[1]) + added(rounds[1], &systems[0]))
}

/// The samples of one round, and how many each technique drew, visible or not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round<'a> {
    pub samples: &'a [Sample],
    pub counts: Techniques,
}

fn system(expected: &Techniques, samples: &[Sample]) -> OptimalSystem<MOST_TECHNIQUES, 3> {
    let mut system = OptimalSystem::new();
    for sample in samples {
        system.add(expected, &sample.densities, sample.value.to_array());
    }
    system.complete(expected);
    system
}

/// The optimal estimator less that by balance, channel by channel: α_i/N_i − Σ α_k p_k / Σ N_k p_k.
fn free(alphas: &[Techniques; 3], counts: &Techniques, sample: &Sample) -> DVec3 {
    let (ps, i) = (&sample.densities, sample.technique);
    DVec3::from_array([0, 1, 2].map(|c| optimal_contribution(&alphas[c], counts, ps, 0.0, i)))
}

/// Returns a sample's difference by weights clamped to [0, 1]: the optimal ones where α ≥ 0 and Σ
/// α_k p_k ≤ f, as they are if techniques sample parts of the light.
fn clamped(alphas: &[Techniques; 3], counts: &Techniques, sample: &Sample) -> DVec3 {
    let (ps, i) = (&sample.densities, sample.technique);
    let mut parts = [0.0; MOST_TECHNIQUES];
    for (k, part) in parts.iter_mut().enumerate() {
        if counts[k] > 0.0 {
            *part = alphas.iter().map(|a| a[k]).sum::<f64>().max(0.0);
        }
    }
    let controlled: f64 = parts.iter().zip(ps).map(|(c, p)| c * p).sum();
    let known = controlled / sample.value.element_sum();
    let weight = clamped_optimal(&parts, counts, ps, known, i) - balance(counts, ps, i);
    sample.value * (weight / (counts[i] * ps[i]))
}
