//! Pearson's χ² test of a histogram, with pooling of thin bins, and Šidák's correction for many
//! tests.
#![allow(clippy::disallowed_methods, reason = "no pixel depends on it")]

/// The result of a χ² test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquare {
    /// Σ (observed − expected)² / expected over the pooled bins.
    pub statistic: f64,
    /// The degrees of freedom: pooled bins − 1.
    pub dof: usize,
    /// The probability of a statistic at least this large if the model holds.
    pub p_value: f64,
}

/// Tests `observed` counts against `expected` counts, bin by bin.
///
/// Bins whose expectation is below `min_expected` (5 by custom) are pooled, thinnest first, until
/// each pool reaches it; if every single bin is below it, the last pool may not reach it. An
/// observation in a bin with expectation exactly zero (or less, or NaN) refutes the model outright:
/// p = 0. With fewer than two pools no test is possible: p = 1, dof = 0.
///
/// The sums of both slices need not agree; the test then also detects the difference in total mass.
///
/// ```
/// use linelit_testkit::chi2::chi2_test;
/// assert!(chi2_test(&[260, 240, 255, 245], &[250.0; 4], 5.0).p_value > 0.1);
/// assert!(chi2_test(&[400, 100, 255, 245], &[250.0; 4], 5.0).p_value < 1e-6);
/// ```
///
/// # Panics
/// If the slices differ in length.
pub fn chi2_test(observed: &[u64], expected: &[f64], min_expected: f64) -> ChiSquare {
    assert_eq!(
        observed.len(),
        expected.len(),
        "one expectation for each bin"
    );
    // An observation where none is possible.
    let refuted = observed
        .iter()
        .zip(expected)
        .any(|(&o, &e)| e.is_nan() || (o > 0 && e <= 0.0));
    // Sum over the pools.
    let pools = pooled(observed, expected, min_expected);
    let statistic: f64 = pools.iter().map(|(o, e)| (o - e) * (o - e) / e).sum();
    let dof = pools.len().saturating_sub(1);
    let p_value = if refuted || statistic.is_nan() {
        0.0
    } else {
        survival(statistic, dof)
    };
    ChiSquare {
        statistic,
        dof,
        p_value,
    }
}

/// Merges bins until each pool holds at least `min_expected`, and returns the sums (observed,
/// expected).
fn pooled(observed: &[u64], expected: &[f64], min_expected: f64) -> Vec<(f64, f64)> {
    let mut order: Vec<usize> = (0..expected.len()).filter(|&i| expected[i] > 0.0).collect();
    order.sort_by(|&i, &j| expected[i].total_cmp(&expected[j]));
    let mut pools: Vec<(f64, f64)> = Vec::new();
    let (mut o, mut e) = (0.0, 0.0);
    for i in order {
        o += observed[i] as f64;
        e += expected[i];
        if e >= min_expected {
            pools.push((o, e));
            (o, e) = (0.0, 0.0);
        }
    }
    // As bins come in ascending order, bins remain only if every single bin is thin.
    if e > 0.0 {
        pools.push((o, e));
    }
    pools
}

/// Returns P(χ²_dof ≥ statistic) = Q(dof/2, statistic/2), the regularized upper incomplete gamma
/// function; one for `dof == 0`.
///
/// The relative error is below 1e-10 for p > 1e-100 (tested against closed forms).
pub fn survival(statistic: f64, dof: usize) -> f64 {
    if dof == 0 || statistic <= 0.0 {
        return 1.0;
    }
    if statistic.is_infinite() {
        return 0.0;
    }
    upper_gamma(0.5 * dof as f64, 0.5 * statistic)
}

/// Computes Q(a, x): by a series for x < a + 1, by Lentz's continued fraction for larger x
/// (Abramowitz & Stegun 6.5.29, 6.5.31).
///
/// Iterations grow with √a only near x ≈ a; the limit of 100 000 is never reached for a < 10⁸.
fn upper_gamma(a: f64, x: f64) -> f64 {
    let front = (a * x.ln() - x - puruspe::ln_gamma(a)).exp();
    // 1 − Q by the series xᵃe⁻ˣ/Γ(a) Σ xᵏ/(a(a + 1)…(a + k)).
    if x < a + 1.0 {
        let (mut term, mut sum, mut k) = (1.0 / a, 1.0 / a, a);
        for _ in 0..100_000 {
            k += 1.0;
            term *= x / k;
            sum += term;
            if term < sum * f64::EPSILON {
                break;
            }
        }
        return (1.0 - front * sum).max(0.0);
    }
    // The continued fraction.
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / f64::MIN_POSITIVE;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..100_000_u32 {
        let n = f64::from(i);
        let an = -n * (n - a);
        b += 2.0;
        d = 1.0 / nonzero(an * d + b);
        c = nonzero(b + an / c);
        h *= d * c;
        if (d * c - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    (front * h).min(1.0)
}

/// Replaces zero by the smallest normal number, as Lentz's method requires.
fn nonzero(x: f64) -> f64 {
    if x.abs() < f64::MIN_POSITIVE {
        f64::MIN_POSITIVE
    } else {
        x
    }
}

/// Returns the level at which each of `n` independent tests must be made so that all together err
/// with probability `alpha` (Šidák): 1 − (1 − α)^(1/n), computed without cancellation. For one
/// test, or none, it is `alpha`.
///
/// ```
/// let each = linelit_testkit::chi2::sidak(0.01, 1000);
/// assert!((1.0 - (1.0 - each).powi(1000) - 0.01).abs() < 1e-12);
/// ```
pub fn sidak(alpha: f64, n: usize) -> f64 {
    -((-alpha).ln_1p() / n.max(1) as f64).exp_m1()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that are exact by construction")]
mod tests {
    use super::*;
    use crate::rng::SplitMix64;

    /// Checks exp(−x/2) for two degrees of freedom and (1 + x/2)·exp(−x/2) for four.
    #[test]
    fn survival_closed_forms() {
        for x in [0.1_f64, 1.0, 3.0, 10.0, 50.0, 300.0] {
            let two = (-0.5 * x).exp();
            assert!((survival(x, 2) / two - 1.0).abs() < 1e-10, "dof 2 at {x}");
            let four = (1.0 + 0.5 * x) * two;
            assert!((survival(x, 4) / four - 1.0).abs() < 1e-10, "dof 4 at {x}");
        }
    }

    /// Quantiles from printed tables (e.g. NIST): χ²₀.₀₅ for 1, 10 and 100 degrees of freedom.
    #[test]
    fn survival_table() {
        for (dof, x, p) in [
            (1, 3.841, 0.05),
            (10, 18.307, 0.05),
            (100, 124.342, 0.05),
            (100, 149.449, 0.001),
        ] {
            // Tables round x to 5e-4, which moves p by less than 2e-4 of itself.
            assert!(
                (survival(x, dof) / p - 1.0).abs() < 2e-3,
                "dof {dof}: {}",
                survival(x, dof)
            );
        }
        // Many degrees of freedom: the median is near dof − 2/3.
        assert!((survival(100_000.0 - 2.0 / 3.0, 100_000) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn p_values_are_uniform_under_the_model() {
        let mut rng = SplitMix64::new(11);
        let mut below = 0;
        for _ in 0..1000 {
            let mut counts = [0_u64; 20];
            for _ in 0..2000 {
                counts[usize::try_from(rng.below(20)).unwrap()] += 1;
            }
            below += u32::from(chi2_test(&counts, &[100.0; 20], 5.0).p_value < 0.1);
        }
        // Binomial(1000, 0.1): standard deviation 9.5; five of them either side (α ≈ 6e-7).
        assert!((53..=147).contains(&below), "{below} of 1000 below 0.1");
    }

    #[test]
    fn rejects_a_wrong_pdf_and_an_impossible_bin() {
        let observed = [110, 90, 100, 100];
        assert!(chi2_test(&observed, &[100.0; 4], 5.0).p_value > 0.1);
        assert!(chi2_test(&observed, &[50.0, 150.0, 100.0, 100.0], 5.0).p_value < 1e-9);
        assert_eq!(chi2_test(&[100, 1], &[101.0, 0.0], 5.0).p_value, 0.0);
        assert_eq!(chi2_test(&[100, 1], &[101.0, f64::NAN], 5.0).p_value, 0.0);
    }

    #[test]
    fn pools_thin_bins() {
        let found = chi2_test(
            &[1, 0, 2, 1, 50, 46],
            &[1.0, 1.0, 1.0, 2.0, 47.0, 48.0],
            5.0,
        );
        assert_eq!(found.dof, 2);
        assert_eq!(chi2_test(&[1, 1], &[1.0, 1.0], 5.0).dof, 0);
    }

    #[test]
    fn sidak_limits() {
        assert!((sidak(0.05, 1) - 0.05).abs() < 1e-16);
        let many = sidak(0.01, 1_000_000);
        assert!((many / 1.005_033_580_299_681_5e-8 - 1.0).abs() < 1e-12);
    }
}
