//! This module holds the special functions of the closed forms, as functions of the cosine of an
//! angle.
//!
//! All three are analytic at cosine 1, so that they need neither the angle nor a series for small
//! angles; at cosine −1 they have a pole, which [`Span`](crate::span) removes by reflection. Each
//! is a Chebyshev interpolant on [0, 1] in powers of x = 2c − 1, computed with 45 digits.

/// Evaluates a polynomial of 24 coefficients at x by pairs (Estrin's scheme): dependency chains are
/// short, and the bits are the same on every machine.
#[inline(always)]
fn estrin(c: &[f64; 24], x: f64) -> f64 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    let quad = |i: usize| (c[i] + c[i + 1] * x) + (c[i + 2] + c[i + 3] * x) * x2;
    let low = quad(0) + quad(4) * x4;
    let middle = quad(8) + quad(12) * x4;
    let high = quad(16) + quad(20) * x4;
    low + (middle + high * x8) * x8
}

/// Returns G(c) = (δ − sin δ cos δ)/sin³ δ with c = cos δ ∈ [0, 1]; from π/2 at 0 to 2/3 at 1.
///
/// **Error**: 1 ulp of the largest term, 3e-16 relative (interpolation 3e-17).
#[inline(always)]
pub(crate) fn lune(c: f64) -> f64 {
    estrin(&LUNE, 2.0 * c - 1.0)
}

/// Returns A(c) = δ/sin δ with c = cos δ ∈ [0, 1]; from π/2 at 0 to 1 at 1.
///
/// **Error**: 3e-16 relative (interpolation 6e-18).
#[inline(always)]
pub(crate) fn arc(c: f64) -> f64 {
    estrin(&ARC, 2.0 * c - 1.0)
}

/// Returns Q(c) = (δ/sin δ − 1)/sin² δ with c = cos δ ∈ [0, 1]; from π/2 − 1 at 0 to 1/6 at 1.
///
/// **Error**: 4e-16 relative (interpolation 2e-17).
#[inline(always)]
pub(crate) fn arc_excess(c: f64) -> f64 {
    estrin(&ARC_EXCESS, 2.0 * c - 1.0)
}

/// The coefficients of [`lune`].
pub(crate) const LUNE: [f64; 24] = [
    0.9455994348748603,
    -0.38773389845847345,
    0.14968813538870354,
    -0.05590207179029469,
    0.020443502569169356,
    -0.007368926832965738,
    0.002628248287889764,
    -0.0009298900056833967,
    0.00032692100504605356,
    -0.00011434825490805141,
    3.9827352292720464e-5,
    -1.3822438181863145e-5,
    4.7828170231201285e-6,
    -1.6514676592481236e-6,
    5.68768400157303e-7,
    -1.9409569007277425e-7,
    6.647646506765713e-8,
    -2.4300443049457676e-8,
    8.393950366602639e-9,
    -1.7933649834530698e-9,
    5.77367115543287e-10,
    -6.264504369335949e-10,
    2.1961407925441722e-10,
    0.0,
];

/// The coefficients of [`arc`].
const ARC: [f64; 24] = [
    1.2091995761561452,
    -0.26360014128128495,
    0.06973319205204692,
    -0.019837146922478774,
    0.00586162897495759,
    -0.0017729284611099334,
    0.0005447739881301811,
    -0.00016930994739062122,
    5.307370323056482e-5,
    -1.6749143247281873e-5,
    5.314287188091921e-6,
    -1.693639120851007e-6,
    5.418581985727714e-7,
    -1.7388548997694832e-7,
    5.575738842888287e-8,
    -1.7964789574344403e-8,
    6.0331600097782334e-9,
    -1.966661891855127e-9,
    4.681011903625551e-10,
    -1.4602825315849918e-10,
    1.1890151456850346e-10,
    -3.984620360291936e-11,
    0.0,
    0.0,
];

/// The coefficients of [`arc_excess`].
const ARC_EXCESS: [f64; 24] = [
    0.2789327682081936,
    -0.1655116762362508,
    0.07561406131462929,
    -0.03121071376564019,
    0.012213049894280136,
    -0.004625442607042808,
    0.0017137535460880983,
    -0.0006250584366011213,
    0.00022531047959554253,
    -8.04780029693493e-5,
    2.8537285872466105e-5,
    -1.005939544719259e-5,
    3.5283941147102778e-6,
    -1.2325087576691524e-6,
    4.293195789667236e-7,
    -1.4901491900566486e-7,
    5.109041147048357e-8,
    -1.7604628089698382e-8,
    6.571359782133617e-9,
    -2.2855754394146963e-9,
    4.497028567520129e-10,
    -1.4399942368931667e-10,
    1.7695467836450832e-10,
    -6.228389714925126e-11,
];

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::{precise::Precise, real::Real};

    /// 4001 cosines against 77 digits; the angle is recovered by atan2, away from the removable
    /// singularity at cosine 1.
    #[test]
    fn interpolants_match_their_functions() {
        for i in 0..4000 {
            let c = f64::from(i) / 4000.0;
            let exact = Precise::new(c);
            let one = Precise::new(1.0);
            let sine = ((one.clone() - exact.clone()) * (one.clone() + exact.clone())).sqrt();
            let angle = sine.atan2(&exact);
            let square = sine.clone() * sine.clone();
            let ratio = angle.clone() / sine.clone();
            // One rounding of each of the two or three leading terms: below 2.5 units of 2^-53
            // relative to a value that is at least a third of them.
            let tolerance = 4.0 * f64::EPSILON;
            let want = (angle - sine.clone() * exact) / (square.clone() * sine);
            assert!(want.scaled_error(lune(c), 0.0) < tolerance, "lune {c}");
            assert!(ratio.scaled_error(arc(c), 0.0) < tolerance, "arc {c}");
            let want = (ratio - one) / square;
            assert!(
                want.scaled_error(arc_excess(c), 0.0) < tolerance,
                "excess {c}"
            );
        }
        assert!((lune(1.0) - 2.0 / 3.0).abs() < 2.0 * f64::EPSILON);
    }
}
