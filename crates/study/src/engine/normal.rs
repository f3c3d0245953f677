//! The normal distribution: how large a z score chance allows.

/// The z that a standard normal exceeds in magnitude with probability `alpha` (0 < α < 1), by
/// bisection of the tail.
#[must_use]
pub fn critical_z(alpha: f64) -> f64 {
    let (mut lo, mut hi) = (0.0, 40.0);
    for _ in 0..80 {
        let mid = 0.5 * (lo + hi);
        if two_sided_tail(mid) > alpha {
            lo = mid
        } else {
            hi = mid
        }
    }
    0.5 * (lo + hi)
}

/// P(|Z| > z), to about 1e-14 relative: a series near the centre, a continued fraction beyond.
#[must_use]
pub fn two_sided_tail(z: f64) -> f64 {
    let density = (-0.5 * z * z).exp() * (2.0 / std::f64::consts::PI).sqrt();
    if z < 3.0 {
        let (mut term, mut sum, mut k) = (z, z, 1.0);
        while term > 1e-17 * sum {
            k += 2.0;
            term *= z * z / k;
            sum += term;
        }
        return 1.0 - density * sum;
    }
    let mut fraction = z;
    for k in (1..=60u32).rev() {
        fraction = z + f64::from(k) / fraction;
    }
    density / fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_values_are_those_of_the_tables() {
        for (alpha, z) in [
            (0.05, 1.959_963_985),
            (0.01, 2.575_829_304),
            (1e-6, 4.891_638_476),
        ] {
            // the table's ten digits
            assert!((critical_z(alpha) - z).abs() < 1e-9, "{alpha}");
        }
    }
}
