//! This module computes the optimal weights of a combination, for one round of samples from the
//! other round.

use super::prepared::Sample;
use crate::{MOST_TECHNIQUES, Optimal};
use linelit_geometry::DVec3;
use linelit_mis::{OptimalSystem, balance, clamped_optimal, optimal_contribution};

/// One number for each technique, such as a coefficient or a number of samples.
type Techniques = [f64; MOST_TECHNIQUES];

/// The strength of the regularization towards the balance heuristic, in samples for each technique
/// (measured in [`OptimalSystem::damped_alphas`]).
const DAMPING: f64 = 3.0;

/// Returns the difference between the estimates by optimal weights and by the balance heuristic,
/// summed over two rounds of samples. Each round is weighted by the coefficients α of the other
/// (Kondapaneni et al. 2019, eqs. 10–14). `expected` has the expected number of samples of each
/// technique in a round.
///
/// Coefficients from the samples that they weight would make the estimate biased. With coefficients
/// from independent samples, and with the numbers of samples that the techniques have in fact
/// drawn, the sum of a round by optimal weights is an unbiased estimate of the light that these
/// techniques can sample. So is the sum by the balance heuristic. Hence their difference is zero in
/// the mean, and a technique without a sample does not contribute to it. It does not matter that
/// ∫p_i may be less than one, because lines that are wholly hidden give no sample: it is less than
/// one in both.
pub(super) fn sum(kind: Optimal, expected: &Techniques, rounds: [Round<'_>; 2]) -> DVec3 {
    let systems = rounds.map(|round| system(expected, round.samples));
    let used = expected.iter().filter(|n| **n > 0.0).count();
    let ridge = DAMPING * used as f64 / expected.iter().sum::<f64>().max(1.0);
    // Add up the differences of one round, by the coefficients of the other.
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

/// The samples of one round, and the number of samples that each technique drew, including hidden
/// ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round<'a> {
    pub samples: &'a [Sample],
    pub counts: Techniques,
}

/// The linear system for the coefficients, from the samples of one round.
fn system(expected: &Techniques, samples: &[Sample]) -> OptimalSystem<MOST_TECHNIQUES, 3> {
    let mut system = OptimalSystem::new();
    for sample in samples {
        system.add(expected, &sample.densities, sample.value.to_array());
    }
    system.complete(expected);
    system
}

/// The contribution of a sample by optimal weights minus its contribution by the balance heuristic,
/// channel by channel: α_i/N_i − Σ α_k p_k / Σ N_k p_k.
fn free(alphas: &[Techniques; 3], counts: &Techniques, sample: &Sample) -> DVec3 {
    let (ps, i) = (&sample.densities, sample.technique);
    DVec3::from_array([0, 1, 2].map(|c| optimal_contribution(&alphas[c], counts, ps, 0.0, i)))
}

/// The same difference for weights that are clamped to [0, 1]. They are the optimal weights if α ≥
/// 0 and Σ α_k p_k ≤ f, which holds if techniques sample parts of the light.
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
