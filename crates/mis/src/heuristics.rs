//! This module holds weights for the multi-sample estimator: balance, power, maximum, cutoff and
//! average.

use linelit_elementary::pow;

/// Returns N·p, or zero where either is not positive, so that NaN and negative densities mean "the
/// technique cannot draw this sample".
#[inline]
pub(crate) fn score(n: f64, p: f64) -> f64 {
    if n > 0.0 && p > 0.0 { n * p } else { 0.0 }
}

/// Returns `x`, or zero if it is not finite.
#[inline]
pub(crate) fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// Returns `part/whole` for `part` ≤ `whole`, with ∞/∞ = 1.
#[inline]
#[expect(
    clippy::float_cmp,
    reason = "the largest term is compared with itself, also when it is infinite"
)]
pub(crate) fn ratio(part: f64, whole: f64) -> f64 {
    if part == whole { 1.0 } else { part / whole }
}

/// Returns g(sᵢ/s_max)/Σⱼ g(sⱼ/s_max) over the scores `s(0..count)`; 0 if none is positive.
#[inline]
pub(crate) fn share(
    count: usize,
    s: impl Fn(usize) -> f64,
    g: impl Fn(f64) -> f64,
    i: usize,
) -> f64 {
    let largest = (0..count).map(&s).fold(0.0, f64::max);
    if largest <= 0.0 {
        return 0.0;
    }
    // The largest term is g(1) > 0, so the sum is positive and no term overflows.
    let sum: f64 = (0..count).map(|j| g(ratio(s(j), largest))).sum();
    g(ratio(s(i), largest)) / sum
}

/// Returns Σⱼ Nⱼpⱼ, the density of all samples together. It is ∞ where a product is (a Dirac
/// delta), and never negative or NaN.
///
/// f divided by this density is the whole contribution of the balance heuristic, wᵢf/(Nᵢpᵢ), for
/// any technique that drew the sample. Only positive terms are summed. **Measure:** the measure of
/// the densities.
///
/// ```
/// use linelit_mis::{balance, balance_density};
/// let (ns, ps, f) = ([3.0, 1.0], [0.5, 2.0], 7.0);
/// let by_weight = balance(&ns, &ps, 1) * f / (ns[1] * ps[1]);
/// assert!((f / balance_density(&ns, &ps) - by_weight).abs() < 1e-14);
/// ```
#[inline]
#[must_use]
pub fn balance_density(ns: &[f64], ps: &[f64]) -> f64 {
    ns.iter().zip(ps).map(|(&n, &p)| score(n, p)).sum()
}

/// Returns the weight of the balance heuristic.
///
/// **Formula.** wᵢ = Nᵢpᵢ/Σⱼ Nⱼpⱼ for the estimator Σₛ (1/Nₛ) Σₖ wₛ f/pₛ, *without* a further 1/S
/// in front (Salesin & Jarosz 2019, eqs. 7 and 8; the 1/S printed in eq. 7 divides the result by
/// the number of techniques).
///
/// **Measure.** All densities `ps` at the sample are in one measure, which may be any. `ns` are
/// sample counts or, in the one-sample model, probabilities. **Domain.** A density that is zero,
/// negative or NaN means that the technique cannot draw this sample. An infinite density (a Dirac
/// delta) takes all the weight, and several infinite ones share it. If no technique can draw the
/// sample, the weight is 0. **Error bound.** The weights of all techniques sum to 1 within (T +
/// 2)ε.
///
/// **Reference.** Veach & Guibas 1995, *Optimally combining sampling techniques for Monte Carlo
/// rendering*, eq. 10.
///
/// # Panics
/// If `i` is not an index of both slices.
///
/// ```
/// use linelit_mis::balance;
/// assert_eq!(balance(&[1.0, 1.0], &[3.0, 1.0], 0), 0.75);
/// assert_eq!(balance(&[1.0, 3.0], &[3.0, 1.0], 0), 0.5);
/// assert_eq!(balance(&[1.0, 1.0], &[0.0, 0.0], 0), 0.0);
/// ```
#[inline]
#[must_use]
pub fn balance(ns: &[f64], ps: &[f64], i: usize) -> f64 {
    assert!(
        i < ns.len() && i < ps.len(),
        "technique {i} of {} counts and {} densities",
        ns.len(),
        ps.len()
    );
    share(ns.len().min(ps.len()), |j| score(ns[j], ps[j]), |t| t, i)
}

/// Returns the weight of the power heuristic.
///
/// **Formula.** wᵢ = (Nᵢpᵢ)^β/Σⱼ (Nⱼpⱼ)^β. β = 2 is the usual choice, β = 1 is the [`balance`]
/// heuristic, and β → ∞ the [`maximum`] heuristic. Below 0, and for NaN, β counts as 0, the
/// [`average`]. Measure, domain, error bound and panics are those of [`balance`]; squares neither
/// overflow nor underflow to 0/0.
///
/// **Reference.** Veach & Guibas 1995, section 3.2.
///
/// ```
/// use linelit_mis::power;
/// assert_eq!(power(&[1.0, 1.0], &[2.0, 1.0], 2.0, 0), 0.8);
/// assert_eq!(power(&[1.0, 1.0], &[2e200, 1e200], 2.0, 0), 0.8);
/// ```
#[inline]
#[must_use]
#[expect(
    clippy::float_cmp,
    reason = "two is the exact value for which squaring replaces powf"
)]
pub fn power(ns: &[f64], ps: &[f64], beta: f64, i: usize) -> f64 {
    assert!(
        i < ns.len() && i < ps.len(),
        "technique {i} of {} counts and {} densities",
        ns.len(),
        ps.len()
    );
    let count = ns.len().min(ps.len());
    let scores = |j: usize| score(ns[j], ps[j]);
    if beta == 2.0 {
        share(count, scores, |t| t * t, i)
    } else {
        // A negative exponent would favour the worst technique, without bound; `max` also maps NaN
        // to 0.
        let beta = beta.max(0.0);
        // A technique that cannot draw the sample has no weight for any exponent, 0 included.
        share(
            count,
            scores,
            |t| if t > 0.0 { pow(t, beta) } else { 0.0 },
            i,
        )
    }
}

/// Scores that differ by less than this fraction count as equal.
const TIE: f64 = 1e-6;

/// Returns the weight of the maximum heuristic: the technique with the largest Nᵢpᵢ gets all the
/// weight, and techniques whose Nᵢpᵢ is equal, to a part in a million, share it. The tolerance is
/// needed because techniques that agree over a region (lines and points without occluders) compute
/// their densities separately, with different rounding errors. Without it, both could claim the
/// weight of a sample, or neither.
///
/// Measure, domain and panics are those of [`balance`]. **Reference.** Veach & Guibas 1995, section
/// 3.2.
///
/// ```
/// assert_eq!(linelit_mis::maximum(&[1.0, 1.0], &[3.0, 1.0], 0), 1.0);
/// ```
#[inline]
#[must_use]
pub fn maximum(ns: &[f64], ps: &[f64], i: usize) -> f64 {
    cutoff(ns, ps, 1.0, i)
}

/// Returns the weight of the cutoff heuristic: the balance heuristic among the techniques whose
/// Nᵢpᵢ is at least α times the largest; the others get weight 0.
///
/// Measure, domain, error bound and panics are those of [`balance`]; `alpha` is in [0, 1) (larger
/// values and NaN act as [`maximum`], negative ones as 0). **Reference.** Veach & Guibas 1995,
/// section 3.2.
///
/// ```
/// assert_eq!(linelit_mis::cutoff(&[1.0, 1.0], &[30.0, 1.0], 0.1, 0), 1.0);
/// ```
#[inline]
#[must_use]
pub fn cutoff(ns: &[f64], ps: &[f64], alpha: f64, i: usize) -> f64 {
    assert!(
        i < ns.len() && i < ps.len(),
        "technique {i} of {} counts and {} densities",
        ns.len(),
        ps.len()
    );
    let alpha = alpha.min(1.0 - TIE);
    share(
        ns.len().min(ps.len()),
        |j| score(ns[j], ps[j]),
        |t| if t >= alpha { t } else { 0.0 },
        i,
    )
}

/// Returns the weight in the plain average of the techniques.
///
/// **Formula.** wᵢ = 1/(number of techniques that can draw the sample): Salesin & Jarosz 2019, eq.
/// 6, whose 1/S is right. Where a technique does not reach a point, the others share its part. This
/// keeps the estimator unbiased when techniques do not cover the whole integrand (a line that is
/// hidden, an LTC that ends at its horizon).
///
/// Measure, domain, error bound and panics are those of [`balance`]; of the counts only the sign
/// matters.
///
/// ```
/// use linelit_mis::average;
/// assert_eq!(average(&[1.0, 9.0], &[3.0, 1.0], 1), 0.5);
/// assert_eq!(average(&[1.0, 9.0], &[0.0, 1.0], 1), 1.0);
/// ```
#[inline]
#[must_use]
pub fn average(ns: &[f64], ps: &[f64], i: usize) -> f64 {
    power(ns, ps, 0.0, i)
}

/// A heuristic that is chosen at run time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heuristic {
    /// The heuristic of [`balance`].
    Balance,
    /// The heuristic of [`power`], with an exponent.
    Power(f64),
    /// The heuristic of [`maximum`].
    Maximum,
    /// The heuristic of [`cutoff`], with a threshold.
    Cutoff(f64),
    /// The heuristic of [`average`].
    Average,
}

impl Heuristic {
    /// Returns the weight of technique `i`; see the function with the variant's name.
    ///
    /// # Panics
    /// If `i` is not an index of both slices.
    ///
    /// ```
    /// use linelit_mis::Heuristic;
    /// assert_eq!(Heuristic::Power(2.0).weight(&[1.0, 1.0], &[2.0, 1.0], 1), 0.2);
    /// ```
    #[inline]
    #[must_use]
    pub fn weight(self, ns: &[f64], ps: &[f64], i: usize) -> f64 {
        match self {
            Self::Balance => balance(ns, ps, i),
            Self::Power(beta) => power(ns, ps, beta, i),
            Self::Maximum => maximum(ns, ps, i),
            Self::Cutoff(alpha) => cutoff(ns, ps, alpha, i),
            Self::Average => average(ns, ps, i),
        }
    }

    /// Returns the weighted contribution wᵢf/(Nᵢpᵢ) of one sample of technique `i` to the
    /// multi-sample estimator. It is 0 where the technique cannot have drawn the sample, and where
    /// f or the result is not finite.
    ///
    /// In the one-sample model (`ns` are the probabilities of choosing each technique) this is the
    /// whole estimate.
    ///
    /// # Panics
    /// If `i` is not an index of both slices.
    #[inline]
    #[must_use]
    pub fn contribution(self, ns: &[f64], ps: &[f64], f: f64, i: usize) -> f64 {
        let own = score(ns[i], ps[i]);
        if own > 0.0 && own.is_finite() {
            finite(self.weight(ns, ps, i) * (f / own))
        } else {
            0.0
        }
    }
}
