//! Running moments, z and t tests, and the normal distribution.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

use puruspe::{betai, erfc, inverfc};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2, TAU};

/// Returns Φ(z) = P(Z ≤ z) for a standard normal Z, accurate in both tails (by erfc).
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z * FRAC_1_SQRT_2)
}

/// Returns z with Φ(z) = p, for p in (0, 1); ±∞ at the ends, NaN outside.
///
/// It is the inverse error function, improved by two Newton steps: |Φ(z) − p| is within a few ulps
/// of p.
pub fn normal_quantile(p: f64) -> f64 {
    if p.is_nan() || !(0.0..=1.0).contains(&p) {
        return f64::NAN;
    }
    if p <= 0.0 {
        return f64::NEG_INFINITY;
    }
    if p >= 1.0 {
        return f64::INFINITY;
    }
    let mut z = -SQRT_2 * inverfc(2.0 * p);
    for _ in 0..2 {
        let density = (-0.5 * z * z).exp() / TAU.sqrt();
        let step = (normal_cdf(z) - p) / density;
        if step.is_finite() {
            z -= step;
        }
    }
    z
}

/// Returns the two-sided p-value of a z score, P(|Z| ≥ |z|); 0 for NaN.
pub fn p_value(z: f64) -> f64 {
    if z.is_nan() {
        0.0
    } else {
        erfc(z.abs() * FRAC_1_SQRT_2)
    }
}

/// Returns the |z| beyond which a two-sided test at level `alpha` rejects; combine it with
/// [`crate::chi2::sidak`].
///
/// ```
/// assert!((linelit_testkit::ztest::critical_z(0.05) - 1.959_963_984_540_054).abs() < 1e-12);
/// ```
pub fn critical_z(alpha: f64) -> f64 {
    -normal_quantile(0.5 * alpha)
}

/// Returns (got − want) / standard_error; zero when both agree exactly, and ±∞ when they differ and
/// the error is zero.
pub fn z_score(got: f64, want: f64, standard_error: f64) -> f64 {
    let difference = got - want;
    if difference == 0.0 {
        0.0
    } else {
        difference / standard_error
    }
}

/// Returns the z score of the difference of two independent means; zero when both agree exactly.
pub fn z_score_two(a: &Welford, b: &Welford) -> f64 {
    z_score(
        a.mean(),
        b.mean(),
        a.standard_error().hypot(b.standard_error()),
    )
}

/// Returns the two-sided p-value of Student's t with `dof` degrees of freedom: I_{ν/(ν+t²)}(ν/2,
/// 1/2).
///
/// Use it instead of [`p_value`] when the variance comes from fewer than about 50 values.
pub fn t_p_value(t: f64, dof: f64) -> f64 {
    if t.is_nan() {
        return 0.0;
    }
    if t.is_infinite() {
        return 0.0;
    }
    betai(0.5 * dof, 0.5, dof / (dof + t * t))
}

/// The running count, mean and variance of values (Welford 1962), which can be merged (Chan, Golub,
/// LeVeque 1979).
///
/// ```
/// let w: linelit_testkit::ztest::Welford = [1.0, 2.0, 4.0].into_iter().collect();
/// assert_eq!((w.count(), w.mean()), (3, 7.0 / 3.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Welford {
    count: u64,
    mean: f64,
    m2: f64,
}

impl Welford {
    /// Creates moments without values.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a value.
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let delta = x - self.mean;
        self.mean += delta / self.count as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// Adds all values of `other`.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        let (a, b) = (self.count as f64, other.count as f64);
        let delta = other.mean - self.mean;
        self.count += other.count;
        let n = a + b;
        self.mean += delta * (b / n);
        self.m2 += other.m2 + delta * delta * (a * b / n);
    }

    /// Returns the number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the mean of the values; zero if there are none.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Returns the unbiased variance of the values; zero for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            0.0
        } else {
            self.m2 / (self.count - 1) as f64
        }
    }

    /// Returns the standard deviation, √variance.
    pub fn std_dev(&self) -> f64 {
        self.variance().sqrt()
    }

    /// Returns the standard error of the mean, √(variance / n).
    pub fn standard_error(&self) -> f64 {
        if self.count == 0 {
            0.0
        } else {
            (self.variance() / self.count as f64).sqrt()
        }
    }

    /// Returns the number of standard errors by which the mean lies above `want`.
    pub fn z_score(&self, want: f64) -> f64 {
        z_score(self.mean, want, self.standard_error())
    }

    /// Returns the two-sided p-value of the mean being `want`, by Student's t.
    pub fn p_value(&self, want: f64) -> f64 {
        t_p_value(
            self.z_score(want),
            self.count.saturating_sub(1).max(1) as f64,
        )
    }
}

impl FromIterator<f64> for Welford {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut all = Self::new();
        values.into_iter().for_each(|x| all.push(x));
        all
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that are exact by construction")]
mod tests {
    use super::*;
    use crate::rng::SplitMix64;

    #[test]
    fn normal_tails() {
        // 30-digit values of Φ(−z): z = 1, 5, 10, 20.
        for (z, want) in [
            (1.0, 0.158_655_253_931_457_05),
            (5.0, 2.866_515_718_791_939e-7),
            (10.0, 7.619_853_024_160_527e-24),
            (20.0, 2.753_624_118_606_233_7e-89),
        ] {
            // erfc's condition number is about z²; allow 16 ε of it.
            let tolerance = 16.0 * f64::EPSILON * (1.0 + z * z);
            assert!(
                (normal_cdf(-z) / want - 1.0).abs() < tolerance,
                "Φ(−{z}) = {}",
                normal_cdf(-z)
            );
            assert!((p_value(z) / (2.0 * want) - 1.0).abs() < tolerance);
        }
        assert!((normal_cdf(1.0) + normal_cdf(-1.0) - 1.0).abs() < 2.0 * f64::EPSILON);
    }

    #[test]
    fn quantile_inverts_cdf() {
        for p in [1e-300, 1e-20, 1e-5, 0.3, 0.5, 0.9, 1.0 - 1e-10] {
            assert!(
                (normal_cdf(normal_quantile(p)) / p - 1.0).abs() < 1e-11,
                "p = {p}"
            );
        }
        assert!(normal_quantile(1.5).is_nan());
    }

    #[test]
    fn student_closed_forms() {
        // One degree of freedom is Cauchy, two is algebraic.
        for t in [0.1_f64, 1.0, 7.0] {
            let cauchy = 1.0 - 2.0 * t.atan() / std::f64::consts::PI;
            assert!((t_p_value(t, 1.0) / cauchy - 1.0).abs() < 1e-9);
            let two = 1.0 - t / (2.0 + t * t).sqrt();
            assert!((t_p_value(t, 2.0) / two - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn welford_is_stable_and_merges() {
        let mut rng = SplitMix64::new(5);
        let values: Vec<f64> = (0..1000).map(|_| 1e9 + rng.next_f64()).collect();
        let all: Welford = values.iter().copied().collect();
        let mut merged: Welford = values[..300].iter().copied().collect();
        merged.merge(&values[300..].iter().copied().collect());
        merged.merge(&Welford::new());
        assert_eq!(all.count(), merged.count());
        // Values carry 1e9·ε of rounding; the variance is about 1/12.
        assert!((all.variance() - merged.variance()).abs() < 1e9 * f64::EPSILON);
        assert!((all.variance() * 12.0 - 1.0).abs() < 0.2);
        assert!(all.z_score(1e9 + 0.5).abs() < 4.0, "fixed seed");
        assert!(all.z_score(1e9 + 0.6).abs() > 4.0);
    }

    #[test]
    fn z_score_of_certain_values() {
        assert_eq!(z_score(1.0, 1.0, 0.0), 0.0);
        assert_eq!(p_value(z_score(1.0, 2.0, 0.0)), 0.0);
        assert_eq!(p_value(f64::NAN), 0.0);
    }
}
