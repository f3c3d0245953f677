//! This module holds weights that use estimates of the integrand's parts: the weighted balance
//! heuristic, the optimal heuristic with a visibility estimate, and its clamped form.

use crate::heuristics::{balance, score, share};
use crate::optimal::optimal_contribution;

/// The weighted balance heuristic.
///
/// **Formula.** wᵢ = cᵢpᵢ/Σₖ cₖpₖ. Suppose the integrand is exactly Σₖ cₖpₖ: each technique is
/// perfect for a part whose integral cₖ is known, as for diffuse and specular shading without
/// occluders. Then every sample of technique i contributes the constant cᵢ/Nᵢ. The variance is zero
/// for any sample counts, which therefore do not appear.
///
/// **Measure.** All densities are in one measure; `cs` are in the unit of the integral, up to a
/// common factor. **Domain.** Terms with cₖ ≤ 0, pₖ ≤ 0 or NaN count as zero; if all do, the weight
/// is 0. A technique with cᵢ = 0 has no weight anywhere: c must be positive for a technique that
/// alone covers a part (Peters clamps diffuse albedos to 0.01). **Error bound.** The weights sum to
/// 1 within (T + 2)ε.
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
/// for linear lights*, section 4.2, here with sample counts, which the paper sets to one). ν = 0 is
/// [`balance`], and ν = 1 is [`weighted_balance`].
///
/// It is the optimal heuristic (Kondapaneni et al. 2019) under the assumption that the shadowed
/// shading is ν times the unshadowed parts `cs`, clamped so that a blocked sample contributes zero.
/// The unclamped form is [`visibility_optimal_contribution`]. Peters recommends ν = ½.
///
/// **Measure, domain and error bound** are those of [`weighted_balance`]; `nu` is clamped to [0,
/// 1], and NaN counts as 0. Where all cₖpₖ are zero the balance heuristic is used, so that the
/// weights sum to 1 there as well.
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

/// Returns one sample's contribution under the optimal heuristic with a visibility estimate,
/// unclamped.
///
/// **Formula.** [`optimal_contribution`] with αₖ = ν cₖ: ν cᵢ/Nᵢ + (f − ν Σₖ cₖpₖ)/Σₖ Nₖpₖ, where f
/// includes the true visibility. It is unbiased for every ν and every c. Contributions may be
/// negative, and blocked samples contribute as well.
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
