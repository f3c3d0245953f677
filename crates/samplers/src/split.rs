//! Choosing among several things with a number that is used again.

use crate::hash::below_one;

/// Chooses one of several things in proportion to its share, and stretches the number to [0, 1) for
/// further use.
///
/// **Formula.** With Sₖ = Σ_{j<k} shares\[j\] and S their sum, the k with Sₖ ≤ uS < Sₖ₊₁, and (uS −
/// Sₖ)/shares\[k\]. A stratified set of u splits into stratified sets for each technique: the
/// *split and rescale* of Salesin & Jarosz 2019, section 5, and Shirley & Wang's choice of a
/// luminaire (1991, eq. 4).
///
/// **Domain.** u in [0, 1), else it counts as the nearer end, NaN as 0; shares that are not
/// positive (or NaN) are never chosen; `None` if none is positive or their sum is not finite.
/// **Error bound.** The stretched number keeps 53 + log₂(shares\[k\]/S) random bits; it is in [0,
/// 1).
///
/// ```
/// use linelit_samplers::split;
/// assert_eq!(split(0.125, &[1.0, 3.0]), Some((0, 0.5)));
/// assert_eq!(split(0.625, &[1.0, 3.0]), Some((1, 0.5)));
/// assert_eq!(split(0.5, &[0.0, 0.0]), None);
/// ```
#[inline]
#[must_use]
pub fn split(u: f64, shares: &[f64]) -> Option<(usize, f64)> {
    let share = |k: usize| if shares[k] > 0.0 { shares[k] } else { 0.0 };
    let sum: f64 = (0..shares.len()).map(share).sum();
    if !sum.is_finite() {
        return None;
    }
    // The last positive share takes what rounding leaves over.
    let last = (0..shares.len()).rfind(|&k| share(k) > 0.0)?;
    // What is not in [0, 1) counts as the nearer end, NaN as 0.
    let mut rest = if u > 0.0 { below_one(u) * sum } else { 0.0 };
    for k in 0..last {
        if rest < share(k) {
            return Some((k, below_one(rest / share(k))));
        }
        rest -= share(k);
    }
    Some((last, below_one((rest / share(last)).max(0.0))))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_possible_truncation, reason = "bins are small")]
    use super::*;
    use crate::{Sampler, SamplerKind};
    use linelit_testkit::chi2::chi2_test;

    #[test]
    fn extremes() {
        let below_one = 1.0 - f64::EPSILON / 2.0;
        assert_eq!(split(below_one, &[1.0, 1.0, 0.0]).map(|(k, _)| k), Some(1));
        assert_eq!(split(0.0, &[0.0, f64::NAN, 2.0]), Some((2, 0.0)));
        assert_eq!(split(0.5, &[f64::INFINITY, 1.0]), None);
        assert_eq!(split(0.5, &[]), None);
        // Shares of any magnitude, and sums that round.
        assert!(split(below_one, &[0.1; 10]).is_some_and(|(k, v)| k == 9 && v < 1.0));
        assert_eq!(split(0.5, &[1e-300, 1e300]).map(|(k, _)| k), Some(1));
    }

    /// Numbers and choices together are uniform; a stratified set stays stratified within each
    /// choice.
    #[test]
    fn splits_in_proportion_and_stretches() {
        let shares = [1.0, 0.0, 2.0, 5.0];
        let set = Sampler::new(SamplerKind::Independent, 1).points([0, 0], 0, 80_000);
        let mut counts = [0_u64; 40];
        for u in set.iter_1d() {
            let (k, v) = split(u, &shares).expect("positive shares");
            counts[k * 10 + usize::from((v * 10.0) as u8)] += 1;
        }
        let expected: Vec<f64> = (0..40).map(|i| 1000.0 * shares[i / 10]).collect();
        assert!(chi2_test(&counts, &expected, 5.0).p_value > 0.01);

        let strata = Sampler::new(SamplerKind::Stratified, 1).points([0, 0], 0, 16);
        let mut second: Vec<f64> = strata
            .iter_1d()
            .filter_map(|u| split(u, &[1.0, 3.0]))
            .filter(|c| c.0 == 1)
            .map(|c| c.1)
            .collect();
        second.sort_by(f64::total_cmp);
        assert!(
            second
                .iter()
                .enumerate()
                .all(|(i, v)| usize::from((v * 12.0) as u8) == i),
            "{second:?}"
        );
    }
}
