//! Special cases: zeros, infinities, NaN, and where results overflow or underflow.

use linelit_elementary::*;
use std::f64::consts::{FRAC_PI_2, PI};

const INF: f64 = f64::INFINITY;

/// Whether two results have the same bits, or are both NaN.
#[track_caller]
fn same(got: f64, want: f64) {
    let both = got.is_nan() && want.is_nan();
    assert!(
        both || got.to_bits() == want.to_bits(),
        "{got:e}, not {want:e}"
    );
}

#[test]
fn exponentials_and_logarithms() {
    for (x, want) in [
        (0.0, 1.0),
        (-0.0, 1.0),
        (INF, INF),
        (-INF, 0.0),
        (f64::NAN, f64::NAN),
        (710.0, INF),
        // The largest and the smallest results.
        (709.782712893384, 1.7976931348622732e308),
        (-745.13, f64::from_bits(1)),
        (-745.2, 0.0),
        (1e300, INF),
        (-1e300, 0.0),
        (f64::from_bits(1), 1.0),
    ] {
        same(exp(x), want);
    }
    for (x, want) in [
        (1.0, 0.0),
        (0.0, -INF),
        (-0.0, -INF),
        (-1.0, f64::NAN),
        (-INF, f64::NAN),
        (INF, INF),
        (f64::NAN, f64::NAN),
        (f64::MAX, 709.782712893384),
        (f64::MIN_POSITIVE, -708.3964185322641),
        (f64::from_bits(1), -744.4400719213812),
    ] {
        same(ln(x), want);
    }
}

#[test]
fn powers() {
    let nan = f64::NAN;
    for (x, y, want) in [
        (0.0, 0.0, 1.0),
        (nan, 0.0, 1.0),
        (1.0, nan, 1.0),
        (nan, 1.0, nan),
        (2.0, nan, nan),
        (-1.0, INF, 1.0),
        (-1.0, -INF, 1.0),
        (0.5, INF, 0.0),
        (0.5, -INF, INF),
        (-2.0, INF, INF),
        (-2.0, -INF, 0.0),
        (0.0, 3.0, 0.0),
        (-0.0, 3.0, -0.0),
        (-0.0, 2.0, 0.0),
        (-0.0, 0.5, 0.0),
        (0.0, -3.0, INF),
        (-0.0, -3.0, -INF),
        (-0.0, -2.0, INF),
        (INF, 0.5, INF),
        (INF, -0.5, 0.0),
        (-INF, 3.0, -INF),
        (-INF, 2.5, INF),
        (-INF, -3.0, -0.0),
        (-8.0, 1.0 / 3.0, nan),
        (-2.0, -3.0, -0.125),
        (-2.0, 9_007_199_254_740_994.0, INF),
        (-1.0, 9_007_199_254_740_991.0, -1.0),
        (-1.0, 9_007_199_254_740_992.0, 1.0),
        (0.5, 1e300, 0.0),
        (0.5, -1e300, INF),
        (0.5, 1e-300, 1.0),
        (f64::from_bits(1), 1.0, f64::from_bits(1)),
        (f64::from_bits(1), 0.5, 2.2227587494850775e-162),
        (f64::from_bits(1), -1.0, INF),
        (2.0, 1023.0, 2f64.powi(1023)),
        (2.0, 1024.0, INF),
        (2.0, -1074.0, f64::from_bits(1)),
        (2.0, -1080.0, 0.0),
        (10.0, 308.0, 1e308),
        (f64::MAX, 1.0, f64::MAX),
    ] {
        same(pow(x, y), want);
    }
    for k in -1074..1024 {
        let power = 2f64.powi(k.max(-1022)) * 2f64.powi((k + 1022).min(0));
        same(pow(2.0, f64::from(k)), power);
    }
}

#[test]
fn angles() {
    for f in [sin, tan, asin, atan, atanh, exp_m1, ln_1p] {
        for x in [0.0, -0.0, f64::from_bits(1), -1e-310] {
            same(f(x), x);
        }
        assert!(f(f64::NAN).is_nan());
    }
    for f in [sin, cos, tan] {
        assert!(f(INF).is_nan() && f(-INF).is_nan());
    }
    // Within a unit of the last digit after 10²¹ whole turns.
    assert!((sin(1e22) + 0.8522008497671888).abs() <= 0.5 * f64::EPSILON);
    assert!((cos(1e22) - 0.5232147853951389).abs() <= 0.5 * f64::EPSILON);
    for f in [asin, acos, atanh] {
        assert!(f(1.0 + f64::EPSILON).is_nan() && f(-INF).is_nan());
    }
    same(acos(-1.0), PI);
    same(acos(1.0), 0.0);
    same(asin(-1.0), -FRAC_PI_2);
    same(atanh(1.0), INF);
    same(atan(-INF), -FRAC_PI_2);
    for (y, x, want) in [
        (0.0, 1.0, 0.0),
        (-0.0, 1.0, -0.0),
        (0.0, -1.0, PI),
        (-0.0, -1.0, -PI),
        (0.0, 0.0, 0.0),
        (0.0, -0.0, PI),
        (1.0, 0.0, FRAC_PI_2),
        (-INF, 3.0, -FRAC_PI_2),
        (INF, INF, 0.5 * FRAC_PI_2),
        (INF, -INF, 1.5 * FRAC_PI_2),
        (1e-320, 1e300, 0.0),
        (1.0, f64::NAN, f64::NAN),
    ] {
        same(atan2(y, x), want);
    }
}

#[test]
fn others() {
    same(hypot(INF, f64::NAN), INF);
    for (x, want) in [(-0.0, -0.0), (-27.0, -3.0), (-INF, -INF)] {
        same(cbrt(x), want);
    }
    assert!(cbrt(f64::NAN).is_nan());
    same(hypot(3e300, -4e300), 5e300);
    same(hypot(3e-310, 4e-310), 5e-310);
    same(exp_m1(-INF), -1.0);
    same(ln_1p(-1.0), -INF);
    assert!(ln_1p(-1.1).is_nan());
    same(log2(8.0), 3.0);
    same(log10(1e5), 5.0);
    same(log2(0.0), -INF);
    assert!(log2(-1.0).is_nan() && log10(-1.0).is_nan());
    for k in -1074..1024 {
        same(log2(exp2(f64::from(k))), f64::from(k));
    }
}
