//! This module holds control variates: an estimate of the slope at each number of a set, from the
//! values on both sides, removes most of the noise of stratified sampling.
#![allow(clippy::disallowed_types, reason = "kept from one set to the next")]

use crate::SampleSet;

/// The numbers of a set with their weights: the weight is the factor with which f counts at a
/// number, where 1 is the factor of a plain mean.
///
/// N numbers lie one in each stratum: number k at u_k, in a stratum with the middle m_k. Let the
/// slope be s_k = (f_{k+1} − f_{k−1})/(u_{k+1} − u_{k−1}), and 0 in the first and last stratum.
/// Then the mean of f_k − s_k (u_k − m_k) is an estimate of ∫ f du. It is unbiased, since s_k does
/// not depend on u_k, whose mean is m_k. Its variance falls as N⁻⁴ where f is continuous and
/// piecewise smooth, compared with N⁻³ for the plain mean; where f jumps, both fall as N⁻². A
/// function that is linear in u has noise only in the outer two strata. Since s_k is linear in f,
/// number k has the weight 1 − (u_{k−1} − m_{k−1})/(u_k − u_{k−2}) + (u_{k+1} − m_{k+1})/(u_{k+2} −
/// u_k), which is between 0 and 2, so that no estimate of a positive f becomes negative.
///
/// In a [`Block`](crate::Block), m_k is the middle of the part of the stratum that the block takes:
/// the other blocks are in the other parts.
///
/// **Source**: Chopin & Gerber 2024, *Higher-order Monte Carlo through cubic stratification*, with
/// the nearest values only.
///
/// ```
/// use linelit_samplers::{Sampler, SamplerKind, Slopes};
/// let set = Sampler::new(SamplerKind::Stratified, 1).points([0, 0], 0, 64);
/// let mut slopes = Slopes::default();
/// slopes.set(&set, true);
/// let mean = slopes.iter().map(|(u, share)| share * u * u).sum::<f64>() / 64.0;
/// assert!((mean - 1.0 / 3.0).abs() < 1e-3);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Slopes {
    numbers: Vec<f64>,
    /// The number in each stratum.
    sorted: Vec<f64>,
    /// The weight of the number in each stratum; empty if all weights are one.
    shares: Vec<f64>,
}

impl Slopes {
    /// Replaces the numbers by those of another set. All weights are one without slopes, for fewer
    /// than three numbers, and if their [strata](SampleSet::has_independent_strata) are not
    /// independent.
    pub fn set(&mut self, set: &SampleSet, with_slopes: bool) {
        self.numbers.clear();
        self.numbers.extend(set.iter_1d());
        self.shares.clear();
        let count = self.numbers.len();
        if !with_slopes || count < 3 || !set.has_independent_strata() {
            return;
        }
        // Sort the numbers by their strata.
        self.sorted.clear();
        self.sorted.resize(count, f64::NAN);
        for &u in &self.numbers {
            self.sorted[stratum(u, count)] = u;
        }
        // Once in 10¹⁵ numbers, one is rounded into its neighbour's stratum: then all weights are
        // one.
        if self.sorted.iter().any(|u| u.is_nan()) {
            return;
        }
        // Collect the weights: each slope changes the weights of both neighbours.
        self.shares.resize(count, 1.0);
        let parts = set.parts();
        let middle = |u: f64| ((u * parts).floor() + 0.5) / parts;
        for (k, near) in self.sorted.windows(3).enumerate() {
            let change = (near[1] - middle(near[1])) / (near[2] - near[0]);
            self.shares[k] += change;
            self.shares[k + 2] -= change;
        }
    }

    /// Returns the numbers in sample order, each with its weight.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        let share = |u| self.shares.get(stratum(u, self.shares.len())).copied();
        let with_share = move |&u| (u, share(u).unwrap_or(1.0));
        self.numbers.iter().map(with_share)
    }
}

/// Returns the stratum, of `count` equal ones, in which a number in [0, 1) lies.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the count"
)]
#[must_use]
pub fn stratum(u: f64, count: usize) -> usize {
    ((u * count as f64) as usize).min(count.saturating_sub(1))
}
