//! This module holds Gauss–Legendre rules with fixed nodes, and the exponentials and logarithms of
//! all nodes of a panel at once.

use linelit_simd::Lanes;

/// The number of nodes of the full rule.
pub(crate) const NODES: usize = 24;

/// The nodes of the 24-point rule on [0, 1].
pub(crate) const NODE: [f64; NODES] = [
    0.00240639000148932,
    0.012635722014345251,
    0.030862723998633622,
    0.056792236497799485,
    0.08999900701304854,
    0.12993790421072282,
    0.17595317403151223,
    0.22728926430558022,
    0.2831032461869774,
    0.3424786601519183,
    0.40444056626319186,
    0.4679715535686972,
    0.5320284464313028,
    0.5955594337368082,
    0.6575213398480817,
    0.7168967538130225,
    0.7727107356944197,
    0.8240468259684878,
    0.8700620957892772,
    0.9100009929869515,
    0.9432077635022005,
    0.9691372760013663,
    0.9873642779856547,
    0.9975936099985107,
];

/// The weights of the nodes; they add up to one.
pub(crate) const WEIGHT: [f64; NODES] = [
    0.0061706148999936,
    0.014265694314466832,
    0.022138719408709904,
    0.02964929245771839,
    0.03667324070554015,
    0.04309508076597664,
    0.04880932605205694,
    0.05372213505798282,
    0.0577528340268628,
    0.060835236463901696,
    0.06291872817341415,
    0.06396909767337608,
    0.06396909767337608,
    0.06291872817341415,
    0.060835236463901696,
    0.0577528340268628,
    0.05372213505798282,
    0.04880932605205694,
    0.04309508076597664,
    0.03667324070554015,
    0.02964929245771839,
    0.022138719408709904,
    0.014265694314466832,
    0.0061706148999936,
];

/// The number of nodes of the short rule, for panels of moderate lobes.
pub(crate) const FEW: usize = 16;

/// The nodes of the 16-point rule on [0, 1].
pub(crate) const FEW_NODES: [f64; FEW] = [
    0.005299532504175033,
    0.02771248846338371,
    0.06718439880608412,
    0.12229779582249849,
    0.19106187779867811,
    0.2709916111713863,
    0.35919822461037054,
    0.4524937450811813,
    0.5475062549188188,
    0.6408017753896295,
    0.7290083888286137,
    0.8089381222013219,
    0.8777022041775016,
    0.9328156011939158,
    0.9722875115366163,
    0.994700467495825,
];

/// The weights of the short rule; they add up to one.
pub(crate) const FEW_WEIGHTS: [f64; FEW] = [
    0.013576229705877048,
    0.031126761969323947,
    0.04757925584124639,
    0.06231448562776694,
    0.07479799440828837,
    0.08457825969750127,
    0.09130170752246179,
    0.09472530522753425,
    0.09472530522753425,
    0.09130170752246179,
    0.08457825969750127,
    0.07479799440828837,
    0.06231448562776694,
    0.04757925584124639,
    0.031126761969323947,
    0.013576229705877048,
];

/// The coefficients 1/k! from 2! to 13!; the truncation error of exp(r) for |r| ≤ ln 2/2 is below
/// 4e-18.
const INVERSE_FACTORIALS: [f64; 12] = [
    0.5,
    0.16666666666666666,
    0.041666666666666664,
    0.008333333333333333,
    0.001388888888888889,
    0.0001984126984126984,
    2.48015873015873e-5,
    2.7557319223985893e-6,
    2.755731922398589e-7,
    2.505210838544172e-8,
    2.08767569878681e-9,
    1.6059043836821613e-10,
];

/// The number 3·2⁵¹: adding it to a double and subtracting it again rounds the double to an
/// integer.
const SHIFT: f64 = 6_755_399_441_055_744.0;
/// The first 32 bits of ln 2.
const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
/// The rest of ln 2 after [`LN2_HIGH`].
const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Returns exp(x) for x ≤ 700; 0 below −700, and for NaN. It takes a few operations without a
/// branch.
///
/// **Error**: 2 ulp; with `SHORT`, 9e-15 from ten terms, not twelve. **Method**: x = n ln 2 + r
/// with ln 2 in two parts, and Taylor's series in r.
#[inline(always)]
pub(crate) fn exp_bounded<L: Lanes, const SHORT: bool>(l: L, x: L::D) -> L::D {
    let clamped = l.dmax(x, l.dsplat(-700.0));
    let shifted = clamped * std::f64::consts::LOG2_E + SHIFT;
    let n = shifted - SHIFT;
    let r = (clamped - n * LN2_HIGH) - n * LN2_LOW;
    let c = &INVERSE_FACTORIALS;
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (r * c[1] + c[0]) + (r * c[3] + c[2]) * r2;
    let middle = (r * c[5] + c[4]) + (r * c[7] + c[6]) * r2;
    let mut high = r * c[9] + c[8];
    if !SHORT {
        high = high + (r * c[11] + c[10]) * r2;
    }
    let tail = low + (middle + high * r4) * r4;
    let mantissa = (r + r2 * tail) + 1.0;
    let zero = l.dsplat(0.0);
    l.select(l.dle(l.dsplat(-700.0), x), zero, mantissa * l.exp2(shifted))
}

/// The coefficients 1/(2k + 1).
const ODD_RECIPROCALS: [f64; 12] = [
    1.0,
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
    1.0 / 19.0,
    1.0 / 21.0,
    1.0 / 23.0,
];

/// Returns Σ q²ᵏ/(2k + 1) for k = 0 to 11, which is atanh(q)/q for q ≤ 0.2, to 2e-18.
#[inline(always)]
pub(crate) fn atanh_ratio<L: Lanes>(q: L::D) -> L::D {
    let y = q * q;
    let y2 = y * y;
    let y4 = y2 * y2;
    let c = &ODD_RECIPROCALS;
    let low = (y * c[1] + c[0]) + (y * c[3] + c[2]) * y2;
    let middle = (y * c[5] + c[4]) + (y * c[7] + c[6]) * y2;
    let high = (y * c[9] + c[8]) + (y * c[11] + c[10]) * y2;
    low + (middle + high * y4) * y4
}

/// The largest argument of [`atanh_ratio_narrow`].
pub(crate) const NARROW: f64 = 0.03;

/// Computes [`atanh_ratio`] for q ≤ 0.03 from five terms, to 6e-17.
#[inline(always)]
pub(crate) fn atanh_ratio_narrow<L: Lanes>(q: L::D) -> L::D {
    let y = q * q;
    let y2 = y * y;
    let c = &ODD_RECIPROCALS;
    ((y * c[1] + c[0]) + (y * c[3] + c[2]) * y2) + (y2 * y2) * c[4]
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::One;
    use linelit_testkit::assert_close;

    /// A sum of products of relative error (power + 3) eps/2 at worst, all positive.
    fn is_exact(nodes: &[f64], weights: &[f64]) {
        for power in 0..2 * i32::try_from(nodes.len()).unwrap() {
            let terms = nodes.iter().zip(weights).map(|(x, w)| w * x.powi(power));
            let tolerance = f64::from(power + 4) * f64::EPSILON;
            let want = 1.0 / f64::from(power + 1);
            assert_close!(terms.sum::<f64>(), want, rel = tolerance, "x^{power}");
        }
    }

    #[test]
    fn rules_are_exact_for_polynomials() {
        is_exact(&NODE, &WEIGHT);
        is_exact(&FEW_NODES, &FEW_WEIGHTS);
    }

    #[test]
    fn exponential_and_atanh() {
        for i in 0..20_000 {
            let x = -f64::from(i) * 0.0371;
            let want = if x < -700.0 { 0.0 } else { x.exp() };
            assert_close!(
                exp_bounded::<_, false>(One, x),
                want,
                rel = 3.0 * f64::EPSILON,
                "exp({x}), both rounded"
            );
            // (ln 2/2)¹²/12! · √2 = 8.9e-15, and 2 ulp.
            assert_close!(
                exp_bounded::<_, true>(One, x),
                want,
                rel = 9.4e-15,
                "exp({x}), ten terms"
            );
            let q = f64::from(i) * 1e-5;
            let want = if q > 0.0 {
                0.5 * (2.0 * q / (1.0 - q)).ln_1p() / q
            } else {
                1.0
            };
            assert_close!(
                atanh_ratio::<One>(q),
                want,
                rel = 4.0 * f64::EPSILON,
                "atanh({q}), both rounded"
            );
        }
    }
}
