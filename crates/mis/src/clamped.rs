//! Weights that know the integrand's parts: weighted balance, optimal with a visibility estimate,
//! clamped optimal.

use crate::heuristics::{balance, score, share};
use crate::optimal::optimal_contribution;

/// The weighted balance heuristic.
///
/// **Formula.** wᵢ = cᵢpᵢ/Σₖ cₖpₖ. If the integrand is Σₖ cₖpₖ exactly (each technique perfect for
/// a part whose integral cₖ is known: diffuse and specular unshadowed shading), every sample of
/// technique i contributes the constant cᵢ/Nᵢ: zero variance for any sample counts, which therefore
/// do not enter.
///
/// **Measure.** Densities in one measure; `cs` in the integral's unit, any common factor.
/// **Domain.** Terms with cₖ ≤ 0, pₖ ≤ 0 or NaN count as zero; if all do, the weight is 0. A
/// technique with cᵢ = 0 is never heard: c must be positive for techniques that alone cover a part
/// (Peters clamps diffuse albedos to 0.01). **Error bound.** The weights sum to 1 within (T + 2)ε.
///
/// **Reference.** Peters 2021, *BRDF importance sampling for polygonal lights*, section 5.
///
/// # Panics
/// If `i` is not an index of both slices.
///
/// ```
/// use linelit_mis::weighted_balance;
/// assert_eq!(weighted_balance(&[1.0, 3.0], &[3.0, 1.0], 0), 0.5);
/// ```
#[inline]
#[must_use]
pub fn weighted_balance(cs: &[f64], ps: &[f64], i: usize) -> f64 {
    assert!(
        i < cs.len() && i < ps.len(),
        "technique {i} of {} parts and {} densities",
        cs.len(),
        ps.len()
    );
    share(cs.len().min(ps.len()), |j| score(cs[j], ps[j]), |t| t, i)
}

/// The clamped optimal heuristic.
///
/// **Formula.** wᵢ = ν cᵢpᵢ/Σₖ cₖpₖ + (1 − ν) Nᵢpᵢ/Σₖ Nₖpₖ (Peters 2021, *BRDF importance sampling
/// for linear lights*, section 4.2, with the sample counts that it leaves at one). ν = 0 is
/// [`balance`], ν = 1 [`weighted_balance`].
///
/// It is the optimal heuristic (Kondapaneni et al. 2019) under the assumption that the shadowed
/// shading is ν times the unshadowed parts `cs`, clamped so that a blocked sample contributes
/// nothing; the unclamped form is [`visibility_optimal_contribution`]. Peters recommends ν = ½.
///
/// **Measure, domain, error bound** as for [`weighted_balance`]; `nu` is clamped to [0, 1], NaN to
/// 0. Where all cₖpₖ vanish the balance heuristic takes over, so that the weights still sum to 1
/// there.
///
/// # Panics
/// If `i` is not an index of all slices.
///
/// ```
/// use linelit_mis::clamped_optimal;
/// // c = (1, 3) unshadowed diffuse and specular shading, one sample each, densities (3, 1):
/// let (ns, ps, cs) = ([1.0, 3.0], [1.0, 1.0], [3.0, 1.0]);
/// assert_eq!(clamped_optimal(&ns, &ps, &cs, 0.5, 0), 0.5 * 0.5 + 0.5 * 0.75);
/// ```
#[inline]
#[must_use]
pub fn clamped_optimal(cs: &[f64], ns: &[f64], ps: &[f64], nu: f64, i: usize) -> f64 {
    let nu = nu.clamp(0.0, 1.0);
    let plain = balance(ns, ps, i);
    let known = cs.iter().zip(ps).any(|(&c, &p)| score(c, p) > 0.0);
    if nu > 0.0 && known {
        nu * weighted_balance(cs, ps, i) + (1.0 - nu) * plain
    } else {
        plain
    }
}

/// One sample's contribution under the optimal heuristic with a visibility estimate, unclamped.
///
/// **Formula.** [`optimal_contribution`] with αₖ = ν cₖ: ν cᵢ/Nᵢ + (f − ν Σₖ cₖpₖ)/Σₖ Nₖpₖ, where f
/// includes the true visibility. Unbiased for every ν and every c; contributions may be negative,
/// and blocked samples contribute, too.
///
/// **Reference.** Peters 2021, *BRDF importance sampling for polygonal lights*, section 5;
/// Kondapaneni et al. 2019, *Optimal multiple importance sampling*, eq. 14.
///
/// # Panics
/// If `i` is not an index of all slices.
///
/// ```
/// use linelit_mis::visibility_optimal_contribution;
/// let (cs, ns, ps) = ([1.0, 3.0], [1.0, 1.0], [3.0, 1.0]);
/// // Nothing blocked and the parts exact: each technique returns its own part.
/// assert_eq!(visibility_optimal_contribution(&cs, &ns, &ps, 1.0, 1.0 * 3.0 + 3.0 * 1.0, 1), 3.0);
/// ```
#[inline]
#[must_use]
pub fn visibility_optimal_contribution<const T: usize>(
    cs: &[f64; T],
    ns: &[f64; T],
    ps: &[f64; T],
    nu: f64,
    f: f64,
    i: usize,
) -> f64 {
    optimal_contribution(&cs.map(|c| nu * c), ns, ps, f, i)
}
