//! Control variates of lines: what the lines beside each say of it.

use crate::LineControl;
use linelit_samplers::SampleSet;

/// The random numbers of lines, and how much each line counts: one is as much as in a plain mean.
///
/// Of N lines, one in each stratum, number k at u_k in a stratum with middle m_k, the mean of
/// f_k − s_k (u_k − m_k) is an estimate of ∫ f du, with s_k = (f_{k+1} − f_{k−1}) / (u_{k+1} −
/// u_{k−1}), and 0 in the first and last stratum. It is unbiased, since s_k does not depend on u_k,
/// which is m_k on average. What is linear in u has no noise but in the outer two strata, and
/// between the corners of what is visible f is nearly so: its variance falls as N⁻⁴ where that of
/// the plain mean falls as N⁻³; where f jumps, both fall as N⁻². Since s_k is linear in f,
/// line k counts 1 − (u_{k−1} − m_{k−1})/(u_k − u_{k−2}) + (u_{k+1} − m_{k+1})/(u_{k+2} − u_k):
/// from 0 to 2, so that no light becomes negative.
///
/// Of several camera samples, the lines of each are a block of one pattern, and m_k is the middle
/// of the part of the stratum that the block takes: the others are in the other parts.
///
/// Chopin & Gerber 2024, *Higher-order Monte Carlo through cubic stratification*, with the nearest
/// values only.
#[derive(Clone, Debug, Default)]
pub(crate) struct Offsets {
    numbers: Vec<f64>,
    /// By strata: where the number is.
    at: Vec<f64>,
    /// By strata: how much the line counts; none if all count one.
    shares: Vec<f64>,
}

impl Offsets {
    /// The numbers of a set.
    pub(crate) fn set(&mut self, set: &SampleSet, control: LineControl) {
        self.numbers.clear();
        self.numbers.extend(set.iter_1d());
        self.shares.clear();
        let count = self.numbers.len();
        if control == LineControl::None || count < 3 || !set.has_independent_strata() {
            return;
        }
        self.at.clear();
        self.at.resize(count, f64::NAN);
        for &u in &self.numbers {
            self.at[stratum(u, count)] = u;
        }
        // One is rounded into its neighbour's stratum: all count one, once in 10¹⁵ numbers.
        if self.at.iter().any(|u| u.is_nan()) {
            return;
        }
        self.shares.resize(count, 1.0);
        let parts = set.parts();
        let middle = |u: f64| ((u * parts).floor() + 0.5) / parts;
        for (k, beside) in self.at.windows(3).enumerate() {
            let change = (beside[1] - middle(beside[1])) / (beside[2] - beside[0]);
            self.shares[k] += change;
            self.shares[k + 2] -= change;
        }
    }

    /// The numbers, and how much each counts.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (f64, f64)> {
        let share = |u| self.shares.get(stratum(u, self.shares.len())).copied();
        self.numbers
            .iter()
            .map(move |&u| (u, share(u).unwrap_or(1.0)))
    }
}

/// The stratum of a number in [0, 1).
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "below the count"
)]
pub(crate) fn stratum(u: f64, count: usize) -> usize {
    ((u * count as f64) as usize).min(count.saturating_sub(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_samplers::{Block, Sampler, SamplerKind, hash::unit_f64};
    use linelit_testkit::chi2::sidak;
    use linelit_testkit::ztest::{Welford, critical_z};

    fn offsets(kind: SamplerKind, seed: u64, count: u32, control: LineControl) -> Offsets {
        let mut offsets = Offsets::default();
        let set = Sampler::new(kind, seed).points([3, 4], 0, count);
        offsets.set(&set, control);
        offsets
    }

    fn mean(offsets: &Offsets, f: impl Fn(f64) -> f64) -> f64 {
        let sum: f64 = offsets.iter().map(|(u, share)| share * f(u)).sum();
        sum / offsets.numbers.len() as f64
    }

    /// Shares are what the formula says: of a function that has its slope in the inner strata, what
    /// is left is the noise of the outer two.
    #[test]
    fn what_changes_linearly_has_no_noise_inside() {
        for count in [3, 4, 7, 16, 100] {
            for seed in 0..200 {
                let offsets = offsets(SamplerKind::Stratified, seed, count, LineControl::Slopes);
                let shares: Vec<f64> = offsets.iter().map(|(_, share)| share).collect();
                assert!(shares.iter().all(|s| (-1e-12..=2.0 + 1e-12).contains(s)));
                let n = f64::from(count);
                // Each share is a sum of three numbers of rounding 2⁻⁵³, a few times for quotients.
                let room = 8.0 * f64::EPSILON * n;
                assert!(
                    (shares.iter().sum::<f64>() - n).abs() < room,
                    "{count} {seed}"
                );
                let [first, last] = [offsets.at[0], offsets.at[count as usize - 1]];
                let outer = (first - 0.5 / n) + (last - (1.0 - 0.5 / n));
                let got = mean(&offsets, |u| 3.0 - 2.0 * u);
                let want = 2.0 - 2.0 * outer / n;
                assert!((got - want).abs() < room, "{count} {seed}: {got} {want}");
            }
        }
    }

    #[test]
    fn all_count_one_where_strata_are_not_independent() {
        let plain = |kind, count, control| {
            let offsets = offsets(kind, 5, count, control);
            offsets.shares.is_empty() && offsets.numbers.len() == count as usize
        };
        assert!(plain(SamplerKind::UniformJitter, 16, LineControl::Slopes));
        assert!(plain(SamplerKind::Independent, 16, LineControl::Slopes));
        assert!(plain(SamplerKind::Sobol, 12, LineControl::Slopes));
        assert!(plain(SamplerKind::Stratified, 2, LineControl::Slopes));
        assert!(plain(SamplerKind::Stratified, 16, LineControl::None));
        assert!(!plain(SamplerKind::Stratified, 16, LineControl::Slopes));
    }

    /// Of blocks, slopes take only what their part of a stratum leaves: the mean over all blocks
    /// stays unbiased and is as exact as without them, where the middle of the whole stratum would
    /// add noise (3 times the error by Sobol' points).
    #[test]
    fn slopes_of_blocks_leave_what_all_together_have() {
        let kinds = [
            SamplerKind::Stratified,
            SamplerKind::Sobol,
            SamplerKind::Auto,
        ];
        let cases = [[16, 4], [10, 6], [4, 16], [8, 8]];
        let limit = critical_z(sidak(0.01, kinds.len() * cases.len() * CASES.len() * 2));
        for (kind, case) in kinds
            .iter()
            .flat_map(|k| CASES.iter().map(move |c| (*k, c)))
        {
            for [blocks, count] in cases {
                let [slopes, plain] = [LineControl::Slopes, LineControl::None].map(|control| {
                    let error = |seed: u64| {
                        let place = unit_f64(linelit_samplers::hash::mix(seed + 1));
                        let sampler = Sampler::new(kind, seed);
                        let mut sum = 0.0;
                        for index in 0..blocks {
                            let block = Block::new(index, blocks);
                            let mut offsets = Offsets::default();
                            offsets.set(&sampler.block([3, 4], 0, count, block), control);
                            sum += mean(&offsets, |u| (case.value)(u - place));
                        }
                        sum / f64::from(blocks) - (case.integral)(place)
                    };
                    (0..1000).map(error).collect::<Welford>()
                });
                let name = format!("{} {kind} {blocks} × {count}", case.name);
                for error in [&slopes, &plain] {
                    let z = error.z_score(0.0);
                    assert!(z.abs() < limit, "{name}: z = {z}");
                }
                // Variances of 1,000 errors of a kurtosis of 20 are off by .14, their ratio by .2
                // if they were independent: four of that.
                let ratio = slopes.variance() / plain.variance();
                assert!(ratio < 1.8, "{name}: {ratio}");
            }
        }
    }

    /// Errors of the mean with and without slopes.
    fn errors(kind: SamplerKind, count: u32, case: &Case) -> [Welford; 2] {
        [LineControl::Slopes, LineControl::None].map(|control| {
            let error = |seed: u64| {
                let place = unit_f64(linelit_samplers::hash::mix(seed + 1));
                let offsets = offsets(kind, seed, count, control);
                mean(&offsets, |u| (case.value)(u - place)) - (case.integral)(place)
            };
            (0..4000).map(error).collect()
        })
    }

    /// A function of the distance from a place in [0, 1], and its integral.
    struct Case {
        name: &'static str,
        value: fn(f64) -> f64,
        integral: fn(f64) -> f64,
        /// The variance falls as N to minus that, with slopes and without.
        orders: [f64; 2],
    }

    const CASES: [Case; 3] = [
        Case {
            name: "smooth",
            value: |x| (2.0 * x).exp(),
            integral: |a| 0.5 * ((2.0 * (1.0 - a)).exp() - (-2.0 * a).exp()),
            orders: [4.0, 3.0],
        },
        Case {
            name: "corner",
            value: |x| x.max(0.0),
            integral: |a| 0.5 * (1.0 - a) * (1.0 - a),
            orders: [4.0, 3.0],
        },
        Case {
            name: "jump",
            value: |x| if x > 0.0 { 1.0 } else { 0.0 },
            integral: |a| 1.0 - a,
            orders: [2.0, 2.0],
        },
    ];

    /// Unbiased by all patterns, and as exact as the documentation says.
    #[test]
    fn slopes_are_unbiased_and_converge_faster() {
        let limit = critical_z(sidak(0.01, CASES.len() * SamplerKind::ALL.len() * 4));
        for (case, kind) in CASES.iter().flat_map(|c| SamplerKind::ALL.map(|k| (c, k))) {
            let errors = [16, 64].map(|count| errors(kind, count, case));
            for error in errors.iter().flatten() {
                let z = error.z_score(0.0);
                assert!(z.abs() < limit, "{} {kind}: z = {z}", case.name);
            }
            if kind != SamplerKind::Stratified {
                continue;
            }
            for (k, order) in case.orders.into_iter().enumerate() {
                let [few, many] = [0, 1].map(|n| errors[n][k].variance());
                let got = (few / many).ln() / 4_f64.ln();
                // A variance of 4,000 errors of a kurtosis of 20 is off by a part in 15: an order
                // by .07, of which this is four.
                assert!((got - order).abs() < 0.28, "{}: {got}, {order}", case.name);
            }
        }
    }
}
