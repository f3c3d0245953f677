//! Control variates: slopes between the numbers on either side of each.
#![allow(clippy::disallowed_types, reason = "kept from one set to the next")]

use crate::SampleSet;

/// The numbers of a set with their shares: how much f counts at each, where 1 is as much as in a
/// plain mean.
///
/// N numbers lie one in each stratum: number k at u_k, in a stratum with middle m_k. The slope
/// s_k = (f_{k+1} − f_{k−1})/(u_{k+1} − u_{k−1}), and 0 in the first and last stratum, makes the
/// mean of f_k − s_k (u_k − m_k) an estimate of ∫ f du. It is unbiased, since s_k does not depend
/// on u_k, which is m_k on average. Its variance falls as N⁻⁴ where f is continuous and smooth
/// between its corners, for N⁻³ of the plain mean, and both fall as N⁻² where f jumps: what is
/// linear in u has no noise but in the outer two strata. Since s_k is linear in f, number k counts
/// 1 − (u_{k−1} − m_{k−1})/(u_k − u_{k−2}) + (u_{k+1} − m_{k+1})/(u_{k+2} − u_k): from 0 to 2, so
/// that no estimate of a positive f becomes negative.
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
    /// The share of the number in each stratum; none if all count one.
    shares: Vec<f64>,
}

impl Slopes {
    /// Takes the numbers of a set in place of those before. All count one without slopes, if there
    /// are fewer than three, and if their [strata](SampleSet::has_independent_strata) are not
    /// independent.
    pub fn set(&mut self, set: &SampleSet, with_slopes: bool) {
        self.numbers.clear();
        self.numbers.extend(set.iter_1d());
        self.shares.clear();
        let count = self.numbers.len();
        if !with_slopes || count < 3 || !set.has_independent_strata() {
            return;
        }
        self.sorted.clear();
        self.sorted.resize(count, f64::NAN);
        for &u in &self.numbers {
            self.sorted[stratum(u, count)] = u;
        }
        // One is rounded into its neighbour's stratum: all count one, once in 10¹⁵ numbers.
        if self.sorted.iter().any(|u| u.is_nan()) {
            return;
        }
        self.shares.resize(count, 1.0);
        let parts = set.parts();
        let middle = |u: f64| ((u * parts).floor() + 0.5) / parts;
        for (k, near) in self.sorted.windows(3).enumerate() {
            let change = (near[1] - middle(near[1])) / (near[2] - near[0]);
            self.shares[k] += change;
            self.shares[k + 2] -= change;
        }
    }

    /// The numbers in sample order, each with its share.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        let share = |u| self.shares.get(stratum(u, self.shares.len())).copied();
        let with_share = move |&u| (u, share(u).unwrap_or(1.0));
        self.numbers.iter().map(with_share)
    }
}

/// The stratum, of `count` equal ones, that a number in [0, 1) lies in.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "below the count"
)]
#[must_use]
pub fn stratum(u: f64, count: usize) -> usize {
    ((u * count as f64) as usize).min(count.saturating_sub(1))
}
