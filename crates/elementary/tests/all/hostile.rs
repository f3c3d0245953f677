//! Extreme arguments for every function: none panics, and results are in their ranges.

use linelit_elementary::{
    acos, asin, atan, atan2, atanh, cbrt, cos, exp, exp_m1, exp2, hypot, ln, ln_1p, log2, log10,
    pow, sin, sin_cos, tan,
};
use linelit_testkit::public;
use linelit_testkit::strategies::hostile;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

#[test]
fn every_public_function_is_called_here() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let missing = public::missing(&src, include_str!("hostile.rs"), &[]);
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// Whether a result is within bounds, or is NaN where the argument is NaN or `without` a value.
fn within(value: f64, [low, high]: [f64; 2], without: bool) -> bool {
    if without {
        value.is_nan()
    } else {
        (low..=high).contains(&value)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: linelit_testkit::cases::cases(20_000), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn results_are_where_they_belong(x in hostile(), y in hostile()) {
        let (all, nan) = ([f64::NEG_INFINITY, f64::INFINITY], x.is_nan());
        let (turning, outside) = (!x.is_finite(), nan || x.abs() > 1.0);
        prop_assert!(within(sin(x), [-1.0, 1.0], turning));
        prop_assert!(within(cos(x), [-1.0, 1.0], turning));
        prop_assert_eq!(sin_cos(x).0.to_bits(), sin(x).to_bits());
        prop_assert!(within(tan(x), all, turning));
        prop_assert!(within(asin(x), [-FRAC_PI_2, FRAC_PI_2], outside));
        prop_assert!(within(acos(x), [0.0, PI], outside));
        prop_assert!(within(atanh(x), all, outside));
        prop_assert!(within(atan(x), [-FRAC_PI_2, FRAC_PI_2], nan));
        prop_assert!(within(atan2(y, x), [-PI, PI], nan || y.is_nan()));
        prop_assert!(within(exp(x), [0.0, f64::INFINITY], nan));
        prop_assert!(within(exp2(x), [0.0, f64::INFINITY], nan));
        prop_assert!(within(exp_m1(x), [-1.0, f64::INFINITY], nan));
        for log in [ln(x), log2(x), log10(x)] {
            prop_assert!(within(log, all, nan || x < 0.0));
        }
        prop_assert!(within(ln_1p(x), all, nan || x < -1.0));
        prop_assert!(within(cbrt(x), all, nan));
        let long = hypot(x, y);
        prop_assert!(long >= x.abs().max(y.abs()) * (1.0 - f64::EPSILON) || nan || y.is_nan());
        let power = pow(x.abs(), y);
        prop_assert!(power >= 0.0 || nan || y.is_nan());
        prop_assert_eq!(pow(x, 0.0).to_bits(), 1f64.to_bits());
    }
}
