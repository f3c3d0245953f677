//! Student's t distribution: how much wider an interval must be when its width was itself estimated
//! from few trials.

use linelit_elementary::{atan, sin_cos};

/// Returns the probability P(|T| ≤ t) for a variable T of Student's distribution with `freedom` ≥ 1
/// degrees of freedom, and t ≥ 0.
///
/// **Formula**: the finite trigonometric sums of Abramowitz & Stegun 26.7.3 and 26.7.4, exact for
/// whole degrees. **Error bound**: a few ulps for each of the `freedom/2` terms, all positive.
#[must_use]
pub fn central_probability(t: f64, freedom: u32) -> f64 {
    let theta = atan(t / f64::from(freedom).sqrt());
    let (sin, cos) = sin_cos(theta);
    let square = cos * cos;
    // Even degrees: sin θ (1 + ½ cos²θ + (1·3)/(2·4) cos⁴θ + …).
    if freedom.is_multiple_of(2) {
        let mut term = 1.0;
        let mut sum = 1.0;
        for k in (2..freedom).step_by(2) {
            term *= square * f64::from(k - 1) / f64::from(k);
            sum += term;
        }
        return sin * sum;
    }
    // Odd degrees: 2/π (θ + sin θ (cos θ + ⅔ cos³θ + …)).
    let mut term = cos;
    let mut sum = if freedom > 1 { cos } else { 0.0 };
    for k in (3..freedom).step_by(2) {
        term *= square * f64::from(k - 1) / f64::from(k);
        sum += term;
    }
    (theta + sin * sum) * std::f64::consts::FRAC_2_PI
}

/// Returns the t with `central_probability(t, freedom) = confidence`, found by bisection down to
/// the last bits of t.
///
/// **Domain**: 0 < confidence < 1; `freedom` zero counts as one, above 10 000 as 10 000 (where the
/// normal quantile is 2.4e-4 less).
///
/// ```
/// let t = linelit_study::stats::student::quantile(0.95, 7);
/// assert!((t - 2.364_624).abs() < 1e-6); // the tables' seven digits
/// ```
#[must_use]
pub fn quantile(confidence: f64, freedom: u32) -> f64 {
    let freedom = freedom.clamp(1, 10_000);
    let (mut low, mut high) = (0.0_f64, 1e9_f64);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if central_probability(middle, freedom) < confidence {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Abramowitz & Stegun, table 26.10 (three decimals); one degree: tan(0.95·π/2).
        let exact = (0.95 * std::f64::consts::FRAC_PI_2).tan();
        assert!((quantile(0.95, 1) - exact).abs() < 1e-9 * exact);
        for (confidence, freedom, t) in [
            (0.95, 2, 4.303),
            (0.95, 3, 3.182),
            (0.99, 5, 4.032),
            (0.90, 30, 1.697),
            (0.95, 120, 1.980),
        ] {
            assert!(
                (quantile(confidence, freedom) - t).abs() <= 5e-4,
                "{freedom}"
            );
        }
    }
}
