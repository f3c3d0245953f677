//! This module integrates any reflection along a line, by adaptive Gauss–Kronrod quadrature with an
//! error estimate, for reflections without a closed form.

use crate::fan::Fan;
use linelit_elementary::sin_cos;
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative;

/// The result of the quadrature of a vector-valued integrand, with one component for each colour
/// channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The integral.
    pub value: DVec3,
    /// An estimate of the largest absolute error of a component; it is usually far too large.
    pub error: f64,
    /// The number of evaluations of the integrand.
    pub evaluations: u32,
}

/// The nodes of Gauss and Kronrod on [−1, 1], the positive half from the outside in, with their
/// weights in Kronrod's rule of fifteen and in Gauss' rule of seven, which is zero for nodes that
/// are not in it.
const HALF_RULE: [(f64, f64, f64); 7] = [
    (0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0),
    (
        0.949_107_912_342_758_5,
        0.063_092_092_629_978_56,
        0.129_484_966_168_869_7,
    ),
    (0.864_864_423_359_769_1, 0.104_790_010_322_250_18, 0.0),
    (
        0.741_531_185_599_394_4,
        0.140_653_259_715_525_92,
        0.279_705_391_489_276_64,
    ),
    (0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0),
    (
        0.405_845_151_377_397_2,
        0.190_350_578_064_785_4,
        0.381_830_050_505_118_9,
    ),
    (0.207_784_955_007_898_47, 0.204_432_940_075_298_9, 0.0),
];

/// The two weights of the middle node.
const MIDDLE: [f64; 2] = [0.209_482_141_084_727_82, 0.417_959_183_673_469_4];

/// The number of intervals that can wait to be halved, which is also the largest depth.
const STACK: usize = 48;

/// Returns ∫ f over [a, b]. An interval is halved until Gauss' seven nodes and Kronrod's fifteen
/// agree on it.
///
/// **Error**: `tolerance` relative to the largest component of the integral of |f|, for integrands
/// that the rule resolves somewhere (a peak that no node meets is not found). After `budget`
/// evaluations the estimate is returned as it is, with its error. Ends that are not finite give
/// zero.
///
/// **Source**: Kronrod 1965; Piessens et al. 1983 (QUADPACK).
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::quadrature::adaptive;
/// let e = adaptive(|x| DVec3::splat(x.abs().sqrt()), -1.0, 1.0, 1e-10, 100_000);
/// assert!((e.value.x - 4.0 / 3.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn adaptive(f: impl Fn(f64) -> DVec3, a: f64, b: f64, tolerance: f64, budget: u32) -> Estimate {
    if !(a.is_finite() && b.is_finite()) {
        return Estimate::default();
    }
    let mut stack = [(a, b); STACK];
    let mut waiting = 1;
    let mut estimate = Estimate::default();
    let mut size = 0.0f64;
    while waiting > 0 {
        waiting -= 1;
        let (lo, hi) = stack[waiting];
        let (middle, half) = (0.5 * lo + 0.5 * hi, 0.5 * hi - 0.5 * lo);
        let at_middle = f(middle);
        let (mut all, mut gauss) = (at_middle * MIDDLE[0], at_middle * MIDDLE[1]);
        for (x, weight, of_gauss) in HALF_RULE {
            let pair = f(middle - half * x) + f(middle + half * x);
            all += pair * weight;
            gauss += pair * of_gauss;
        }
        estimate.evaluations += 15;
        let value = all * half;
        size = size.max(estimate.value.abs().max_element() + value.abs().max_element());
        let difference = ((all - gauss) * half).abs().max_element();
        // Allow an interval an error in proportion to the square root of its length: errors of
        // different intervals seldom add up.
        let share = (half / (0.5 * b - 0.5 * a)).abs().sqrt();
        let done = difference <= tolerance * size * share
            || waiting + 2 > STACK
            || estimate.evaluations >= budget;
        if done {
            estimate.value += value;
            estimate.error += difference;
        } else {
            stack[waiting] = (middle, hi);
            stack[waiting + 1] = (lo, middle);
            waiting += 2;
        }
    }
    estimate.scaled(1.0)
}

impl Estimate {
    /// Multiplies by a number that is not negative; results that overflow become the bounds of
    /// `f64`.
    fn scaled(self, factor: f64) -> Self {
        let times = |x: f64| {
            let product = if x == 0.0 { 0.0 } else { x * factor };
            if product.is_infinite() {
                f64::MAX.copysign(product)
            } else {
                product
            }
        };
        // The error of an infinite sum is unknown.
        let error = if self.error.is_nan() {
            f64::MAX
        } else {
            times(self.error)
        };
        Self {
            value: DVec3::new(
                times(self.value.x),
                times(self.value.y),
                times(self.value.z),
            ),
            error,
            ..self
        }
    }
}

/// The model of a linear light in [`line()`]; see [`cylinder`](crate::cylinder) for both.
/// both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// A ribbon, without the height factor of its emitter: 1/length².
    Ribbon,
    /// A thin cylinder: 1/length.
    Cylinder,
}

/// Returns `∫ f(ω) max(0, n·p)/|p|⁴ dt` along a segment (for a cylinder times 2h): the light that a
/// reflection function f reflects of it. `f` takes unit directions ω towards the light and returns
/// 1/sr by channel.
///
/// **Method**: [`adaptive`] over the angle along the line, in which the smoothness of the integrand
/// depends on f alone. **Error**: the error of [`adaptive`].
///
/// ```
/// use linelit_shading::geometry::DVec3;
/// use linelit_shading::{quadrature, ribbon};
/// let (p0, p1, n) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(1.0, 0.0, 2.0), DVec3::Z);
/// let one = |_| DVec3::ONE;
/// let e = quadrature::line(p0, p1, n, quadrature::Model::Ribbon, one, 1e-12, 1000);
/// assert!((e.value.x / ribbon::line_integral(p0, p1, n) - 1.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn line(
    p0: DVec3,
    p1: DVec3,
    n: DVec3,
    model: Model,
    f: impl Fn(DVec3) -> DVec3,
    tolerance: f64,
    budget: u32,
) -> Estimate {
    let finite = p0.is_finite() && p1.is_finite() && n.is_finite();
    let Some(fan) = Fan::new(p0, p1, &[n], None).filter(|_| finite) else {
        return Estimate::default();
    };
    let cosines = [fan.cosine(0, 0), fan.cosine(0, 1)];
    let closeness = [1.0 / fan.radii[0], 1.0 / fan.radii[1]];
    let start = fan.ends[0] / fan.radii[0];
    let units = if model == Model::Ribbon { 2 } else { 1 };
    // A segment that points at the shading point is seen in one direction.
    if fan.sine <= 0.0 {
        let inverse = 0.5 * (closeness[0] + closeness[1]);
        let factor = if model == Model::Cylinder {
            0.0
        } else {
            nonnegative(fan.reach() * cosines[0] * inverse)
        };
        let flat = Estimate {
            value: f(start) * factor,
            error: 0.0,
            evaluations: 1,
        };
        return (0..units).fold(flat, |estimate, _| estimate.scaled(fan.unit));
    }
    // Integrate over the angle, and interpolate both factors from the ends.
    let tangent = fan.normal.cross(start);
    let factor = match model {
        Model::Cylinder => 2.0,
        Model::Ribbon => nonnegative(fan.reach() / fan.sine),
    };
    let along = |v: f64| {
        let (s, c) = sin_cos(v);
        let cosine = fan.cosine_at(cosines, v) * fan.cosine_at(closeness, v);
        f(start * c + tangent * s) * nonnegative(cosine)
    };
    let estimate = adaptive(along, 0.0, fan.angle, tolerance, budget).scaled(factor);
    // Multiply one after the other: the product of the units may overflow where the result does
    // not.
    (0..units).fold(estimate, |estimate, _| estimate.scaled(fan.unit))
}
