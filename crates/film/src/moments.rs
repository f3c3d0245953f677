//! [`Moments`], the running mean and variance of a pixel.

/// The count, the mean and the sum of squared deviations (M2) of colours, for each channel.
///
/// **Formula**: Welford's update for single values, and for merging two sets a and b the formulas
/// of Chan, Golub and LeVeque (1979): `mean = mean_a + δ·n_b/n`, `M2 = M2_a + M2_b + δ²·n_a·n_b/n`
/// with `δ = mean_b − mean_a`.
/// **Units**: the units of the values; for M2 their square.
/// **Error bound**: the relative error of M2 is about `n·ε·κ` with `κ² = 1 + mean²/variance` (Chan
/// et al., table 1), where the textbook formula has `n·ε·κ²`.
///
/// Merging is not associative in floating point: merge in a fixed order to get the same bits.
///
/// ```
/// use linelit_film::Moments;
/// let mut moments = Moments::default();
/// for value in [1.0, 2.0, 3.0] {
///     moments.push([value; 3]);
/// }
/// assert_eq!((moments.count, moments.mean[0], moments.variance()[0]), (3, 2.0, 1.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// The number of values.
    pub count: u64,
    /// The mean of the values.
    pub mean: [f64; 3],
    /// The sum of squared deviations from the mean.
    pub m2: [f64; 3],
}

impl Moments {
    /// Adds one value.
    pub fn push(&mut self, value: [f64; 3]) {
        self.count += 1;
        let count = self.count as f64;
        for ((value, mean), m2) in value.iter().zip(&mut self.mean).zip(&mut self.m2) {
            let delta = value - *mean;
            *mean += delta / count;
            *m2 += delta * (value - *mean);
        }
    }

    /// Adds all values that were added to `other`.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let total = self.count + other.count;
        let (ours, theirs, all) = (self.count as f64, other.count as f64, total as f64);
        for channel in 0..3 {
            let delta = other.mean[channel] - self.mean[channel];
            self.mean[channel] += delta * (theirs / all);
            self.m2[channel] += other.m2[channel] + delta * delta * (ours * theirs / all);
        }
        self.count = total;
    }

    /// Returns the unbiased estimate of the variance of one value, M2/(n − 1); NaN for fewer than
    /// two values.
    #[must_use]
    pub fn variance(&self) -> [f64; 3] {
        if self.count < 2 {
            return [f64::NAN; 3];
        }
        let freedom = (self.count - 1) as f64;
        self.m2.map(|m2| m2 / freedom)
    }

    /// Returns the estimate of the variance of the mean, M2/(n(n − 1)), for independent values: use
    /// the results of different seeds, not the samples of one stratified set. NaN for fewer than
    /// two values.
    #[must_use]
    pub fn variance_of_mean(&self) -> [f64; 3] {
        let count = self.count as f64;
        self.variance().map(|variance| variance / count)
    }
}

/// Rounds to single precision.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the film stores f32, within 2^-24 relative"
)]
pub(crate) fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn gather(values: &[f64]) -> Moments {
        let mut moments = Moments::default();
        for &value in values {
            moments.push([value, -value, value * 0.5]);
        }
        moments
    }

    /// Returns exact moments by integer arithmetic: the values are small integers.
    fn exact(values: &[i64]) -> (f64, f64) {
        let n = values.len() as i64;
        let sum: i64 = values.iter().sum();
        let squares: i64 = values.iter().map(|v| v * v).sum();
        (
            sum as f64 / n as f64,
            (n * squares - sum * sum) as f64 / n as f64,
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn merging_any_split_equals_the_exact_moments(
            values in prop::collection::vec(-1000_i64..1000, 2..200),
            offset in -1_000_000_i64..1_000_000,
            cut in 0.0..1.0_f64,
        ) {
            let values: Vec<i64> = values.iter().map(|v| v + offset).collect();
            let floats: Vec<f64> = values.iter().map(|&v| v as f64).collect();
            #[allow(clippy::cast_possible_truncation, reason = "an index into the vector")]
            let cut = (cut * floats.len() as f64) as usize;
            let mut merged = gather(&floats[..cut]);
            merged.merge(&gather(&floats[cut..]));
            let (mean, m2) = exact(&values);
            let n = floats.len() as f64;
            let largest = floats.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            prop_assert_eq!(merged.count, floats.len() as u64);
            // Each step rounds the mean by at most ε·max|v|.
            prop_assert!((merged.mean[0] - mean).abs() <= 2.0 * n * f64::EPSILON * largest);
            // δ is off by that much, and enters linearly with |δ| up to the spread √M2.
            let bound = 8.0 * n * f64::EPSILON * (m2 + largest * m2.sqrt() + largest * largest * f64::EPSILON);
            prop_assert!((merged.m2[0] - m2).abs() <= bound, "{} {}", merged.m2[0], m2);
            prop_assert!(merged.m2[0] >= 0.0);
        }
    }

    #[test]
    fn a_large_offset_does_not_cancel() {
        // The textbook formula loses every digit here: 1e9² needs 60 bits.
        let moments = gather(&[1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0]);
        assert!((moments.variance()[0] - 30.0).abs() < 30.0 * 4.0 * f64::EPSILON * 2e8);
    }

    #[test]
    fn merging_nothing_changes_nothing() {
        let mut moments = gather(&[0.1, 0.2, 0.7]);
        let before = moments;
        moments.merge(&Moments::default());
        assert_eq!(moments, before);
        let mut empty = Moments::default();
        empty.merge(&before);
        assert_eq!(empty, before);
    }

    #[test]
    fn one_value_has_no_variance() {
        assert!(gather(&[3.0]).variance()[0].is_nan());
        assert!(Moments::default().variance_of_mean()[2].is_nan());
    }
}
