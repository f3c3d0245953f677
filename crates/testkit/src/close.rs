//! Comparisons of numbers, with messages that state how much they differ.

/// Returns the number of steps between representable numbers from `a` to `b`: 0 when they are equal
/// (and for ±0), 1 for neighbours, `u64::MAX` when either is NaN.
///
/// ```
/// assert_eq!(linelit_testkit::close::ulps(1.0, 1.0 + f64::EPSILON), 1);
/// ```
pub fn ulps(a: f64, b: f64) -> u64 {
    if a.is_nan() || b.is_nan() {
        return u64::MAX;
    }
    ordered(a).abs_diff(ordered(b))
}

/// Maps f64 to integers monotonically, both zeros to 0.
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits();
    let magnitude = i64::try_from(bits & (u64::MAX >> 1)).expect("the sign bit is masked");
    if x.is_sign_negative() {
        -magnitude
    } else {
        magnitude
    }
}

/// Returns `x` moved by `n` representable numbers (towards +∞ for n > 0), saturating at the
/// infinities.
///
/// ```
/// assert_eq!(linelit_testkit::close::nudge(1.0, -1), 1.0 - f64::EPSILON / 2.0);
/// ```
pub fn nudge(x: f64, n: i64) -> f64 {
    if x.is_nan() {
        return x;
    }
    let infinity = ordered(f64::INFINITY);
    let moved = ordered(x).saturating_add(n).clamp(-infinity, infinity);
    let magnitude = f64::from_bits(moved.unsigned_abs());
    if moved < 0 { -magnitude } else { magnitude }
}

/// Returns whether |got − want| ≤ tolerance. Equal infinities are close; NaN is close only to NaN.
pub fn is_close(got: f64, want: f64, tolerance: f64) -> bool {
    if got.is_nan() || want.is_nan() {
        return got.is_nan() && want.is_nan();
    }
    #[expect(clippy::float_cmp, reason = "equal infinities have no difference")]
    let same = got == want;
    same || (got - want).abs() <= tolerance
}

/// Returns the message of a failed comparison: both numbers, the absolute and the scaled
/// difference, and ulps.
pub fn describe(got: f64, want: f64, tolerance: f64, scale: f64) -> String {
    let difference = (got - want).abs();
    format!(
        "got  {got:e}\nwant {want:e}\ndifference {difference:.3e} ({ulps} ulps), tolerance {tolerance:.3e}; \
         scaled error {scaled:.3e} = {in_eps:.1} ε (of scale {scale:.3e})",
        ulps = ulps(got, want),
        scaled = difference / scale,
        in_eps = difference / scale / f64::EPSILON,
    )
}

/// Asserts that two `f64` agree, and on failure prints both, their distance in ulps, and the scaled
/// error.
///
/// - `assert_close!(got, want, tol, "why")`: |got − want| ≤ tol, an absolute tolerance;
/// - `assert_close!(got, want, rel = r, "why")`: |got − want| ≤ r·|want|;
/// - `assert_close!(got, want, rel = r, scale = s, "why")`: |got − want| ≤ r·max(|want|, s), `s`
///   being the magnitude of what was added up (so that `r` is `k · ε` with a derived `k`).
///
/// The reason is a format string with arguments and says where the tolerance comes from. Equal
/// infinities pass; NaN passes only against NaN.
///
/// ```
/// use linelit_testkit::assert_close;
/// assert_close!(0.1 + 0.2, 0.3, rel = 2.0 * f64::EPSILON, "roundings of the inputs and the sum");
/// ```
#[macro_export]
macro_rules! assert_close {
    ($got:expr, $want:expr, rel = $rel:expr, scale = $scale:expr, $($why:tt)+) => {{
        let (got, want): (f64, f64) = ($got, $want);
        let scale = f64::max(want.abs(), $scale);
        let tolerance: f64 = $rel * scale;
        assert!(
            $crate::close::is_close(got, want, tolerance),
            "{}\n{}",
            format_args!($($why)+),
            $crate::close::describe(got, want, tolerance, scale)
        );
    }};
    ($got:expr, $want:expr, rel = $rel:expr, $($why:tt)+) => {
        $crate::assert_close!($got, $want, rel = $rel, scale = 0.0, $($why)+)
    };
    ($got:expr, $want:expr, $tolerance:expr, $($why:tt)+) => {{
        let (got, want, tolerance): (f64, f64, f64) = ($got, $want, $tolerance);
        assert!(
            $crate::close::is_close(got, want, tolerance),
            "{}\n{}",
            format_args!($($why)+),
            $crate::close::describe(got, want, tolerance, want.abs())
        );
    }};
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that are exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn counts_ulps() {
        assert_eq!(ulps(0.0, -0.0), 0);
        assert_eq!(ulps(-f64::from_bits(1), f64::from_bits(1)), 2);
        assert_eq!(ulps(1.0, 2.0), 1 << 52);
        assert_eq!(ulps(f64::NAN, 1.0), u64::MAX);
    }

    #[test]
    fn nudges_across_zero_and_saturates() {
        assert_eq!(
            nudge(f64::from_bits(1), -2).to_bits(),
            (-f64::from_bits(1)).to_bits()
        );
        assert_eq!(nudge(f64::MAX, 5), f64::INFINITY);
        assert_eq!(ulps(nudge(-3.5, 17), -3.5), 17);
    }

    #[test]
    fn three_forms() {
        assert_close!(1.0, 1.05, 0.1, "absolute");
        assert_close!(100.0, 101.0, rel = 0.01, "relative");
        assert_close!(1e-20, 0.0, rel = f64::EPSILON, scale = 1.0, "scaled {}", 1);
        assert_close!(f64::INFINITY, f64::INFINITY, 0.0, "infinite");
    }

    #[test]
    #[should_panic(expected = "1 ulps")]
    fn fails_and_says_how_much() {
        assert_close!(
            1.0 + f64::EPSILON,
            1.0,
            rel = 0.5 * f64::EPSILON,
            "half an ulp is too strict"
        );
    }

    #[test]
    #[should_panic(expected = "never")]
    fn nan_is_not_close() {
        assert_close!(f64::NAN, 1.0, f64::INFINITY, "never");
    }
}
