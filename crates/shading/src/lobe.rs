//! This module integrates a power-of-cosine lobe along a fan of directions.
//!
//! The lobe has one highest point on the arc; the integral is split there into two panels, in each
//! of which the lobe falls monotonically from its start. A panel is cut where the lobe is
//! negligible (the window), so that the number of nodes does not depend on the exponent:
//!
//! ```text
//!          ╭─╮                variable: t = tan(x/2), x the angle from the peak
//!        ╱  │  ╲              lobe: (cos x − τ sin x)ᵏ, τ the slope at the start
//!   ____╱   │   ╲_______
//!      ├────┼────┤            two panels within the window
//! ```

use crate::fan::Fan;
use crate::gauss::{
    FEW_NODES, FEW_WEIGHTS, NARROW, NODE, NODES, WEIGHT, atanh_ratio, atanh_ratio_narrow,
    exp_bounded,
};
use linelit_elementary::{atan2, cos, exp, hypot, ln, ln_1p, pow, sin, tan};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{DVec3, predicates};
use linelit_simd::{Isa, Lanes, One, Simd, dispatch};

/// The depth at which a panel ends: the integrand there is below e⁻⁴⁰ of its peak.
const DEPTH: f64 = 40.0;

/// The smallest exponent for which a lobe is smooth enough for the quadrature rule even at its
/// horizon.
pub(crate) const SMOOTH: f64 = 6.0;

/// If the cosines with the axis are below this number, only powers of less than 140 do not
/// underflow. Times 140, the rounding errors of the values at the ends are 1e-13, while the errors
/// of directions, divided by the cosine, could be of any size.
const LOW: f64 = 1e-2;

/// An arc whose sine is at most this is treated as a point, since the squares of slopes divided by
/// its sine would overflow.
const POINT: f64 = 1e-100;

/// A piece of the arc that starts at the lobe's highest point on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    /// The tangent of half the panel's width.
    pub(crate) half_tan: f64,
    /// The slope τ ≥ 0 at the start: the lobe falls like cos x − τ sin x.
    pub(crate) slope: f64,
    /// The values of the two other factors at the start and at the end.
    pub(crate) factors: [[f64; 2]; 2],
}

/// Returns the integral of the product of the fan's functions, with the lobe's (the last) to the
/// power `k`, over dt and after division by |p|^(4 + k): `(1/h) ∫ Π (kᵢ·ω) (axis·ω)ᵏ dφ`.
pub(crate) fn integrate(fan: &Fan<3>, axis: DVec3, k: f64) -> f64 {
    let [sum, half] = over_sine(fan, axis, k);
    nonnegative((fan.reach() * sum * half) * half)
}

/// Returns `(1/sin δ) ∫ Π (kᵢ·ω) (axis·ω)ᵏ dφ` over the fan's angle δ as two factors, the second of
/// which counts twice: its square may underflow, or its product with others.
fn over_sine(fan: &Fan<3>, axis: DVec3, k: f64) -> [f64; 2] {
    let [z0, z1] = [fan.cosine(2, 0), fan.cosine(2, 1)];
    // Treat a fan without extent.
    if fan.sine <= POINT && fan.angle < 1.0 {
        // All points are in one direction, in which a factor (like 1/|p|) may still change
        // linearly.
        let ends = |i: usize| [fan.cosine(i, 0), fan.cosine(i, 1)];
        let ([a0, a1], [b0, b1]) = (ends(0), ends(1));
        if (z1 - z0).abs() * k > f64::EPSILON * 64.0 * z0.max(z1) {
            return fall([z0, z1], [[a0, a1], [b0, b1]], k);
        }
        let flat = (2.0 * (a0 * b0 + a1 * b1) + (a0 * b1 + a1 * b0)) / 6.0;
        return [flat, half_power(log_cosine(fan, axis, 0, z0), k)];
    }
    // If both ends are close to the lobe's horizon, their values are more accurate than the
    // tangents.
    let low = z0 + z1 < fan.sine.max(LOW);
    let rise = |end: usize| {
        if low {
            let [here, there] = if end == 0 { [z0, z1] } else { [z1, z0] };
            (there - here * cos(fan.angle)) / fan.sine
        } else {
            fan.slope(axis, end)
        }
    };
    // Find the highest point of the lobe on the arc.
    let towards = rise(0);
    let centre = atan2(towards, z0);
    let inside = centre > 0.0 && centre < fan.angle;
    let (start, log_peak) = if inside {
        (centre, log_in_plane(fan, axis, hypot(z0, towards)))
    } else if centre <= 0.0 {
        (0.0, log_cosine(fan, axis, 0, z0))
    } else {
        (fan.angle, log_cosine(fan, axis, 1, z1))
    };
    // Integrate from the highest point towards both ends.
    let mut sum = 0.0;
    if start < fan.angle {
        let slope = if inside {
            0.0
        } else {
            (-towards / z0).max(0.0)
        };
        sum += side(fan, start, fan.angle - start, slope, k, 1.0);
    }
    if start > 0.0 {
        let slope = if inside {
            0.0
        } else {
            (-rise(1) / z1).max(0.0)
        };
        sum += side(fan, start, start, slope, k, -1.0);
    }
    [sum / fan.sine, half_power(log_peak, k)]
}

/// Integrates a lobe along ends that have the same direction by rounding. Close to its horizon the
/// lobe may still change, linearly.
#[cold]
fn fall([z0, z1]: [f64; 2], factors: [[f64; 2]; 2], k: f64) -> [f64; 2] {
    let peak = z0.max(z1);
    let rough = k < SMOOTH && k.fract() != 0.0;
    let sum: f64 = (0..NODES)
        .map(|i| {
            // Integrate from the lower end; for a small power that is not an integer, in the eighth
            // root.
            let (s, weight) = if rough {
                let seventh = NODE[i].powi(7);
                (seventh * NODE[i], 8.0 * seventh * WEIGHT[i])
            } else {
                (NODE[i], WEIGHT[i])
            };
            let at = |[a, b]: [f64; 2]| {
                let [low, high] = if z0 < z1 { [a, b] } else { [b, a] };
                low * (1.0 - s) + high * s
            };
            weight * at(factors[0]) * at(factors[1]) * pow(at([z0, z1]) / peak, k)
        })
        .sum();
    [sum, half_power(ln(peak), k)]
}

/// Returns exp(k log/2); 1 for k = 0, even if the logarithm is infinite.
fn half_power(log: f64, k: f64) -> f64 {
    if k > 0.0 { exp(0.5 * k * log) } else { 1.0 }
}

/// Returns the integral from `start` over `width`, towards larger (`sign` 1) or smaller arc angles.
fn side(fan: &Fan<3>, start: f64, width: f64, slope: f64, k: f64, sign: f64) -> f64 {
    let window = window(k, slope);
    if k < SMOOTH && k.fract() != 0.0 {
        let horizon = atan2(1.0, slope);
        if horizon - width < width {
            let split = 0.5 * width;
            return panel_sum(fan, start, split, slope, sign, k)
                + near_horizon(fan, start, [split, width], horizon, k, sign);
        }
    }
    panel_sum(fan, start, width.min(window), slope, sign, k)
}

/// Returns a bound on the angle from its peak within which a lobe is above e⁻⁴⁰ of the peak, from
/// (ln cos)″ ≤ −1.
pub(crate) fn window(k: f64, slope: f64) -> f64 {
    let steep = k * slope;
    2.0 * DEPTH / (steep + (steep * steep + 2.0 * k * DEPTH).sqrt())
}

/// Integrates one panel that starts at `start`, in the direction of `sign`.
fn panel_sum(fan: &Fan<3>, start: f64, width: f64, slope: f64, sign: f64, k: f64) -> f64 {
    let far = if sign > 0.0 { fan.angle - start } else { start };
    // Meet an end of the arc exactly.
    let v = if width < far {
        start + sign * width
    } else {
        start + sign * far
    };
    let (near, far) = (fan.weights(start), fan.weights(v));
    let factor = |i: usize| {
        let ends = [fan.cosine(i, 0), fan.cosine(i, 1)];
        [near, far].map(|w| w[0] * ends[0] + w[1] * ends[1])
    };
    let half_tan = tan(0.5 * width);
    Panel {
        half_tan,
        slope,
        factors: [factor(0), factor(1)],
    }
    .sum(k)
}

impl Panel {
    /// Returns ∫ Π factors (cos x − τ sin x)ᵏ dx. With t = tan(x/2) everything except the power is
    /// rational, and cos x − τ sin x = (1 − q)/(1 + q) with q = t (t + τ)/(1 − τ t).
    fn sum(&self, k: f64) -> f64 {
        let end = self.half_tan;
        let last = end * (end + self.slope) / (1.0 - self.slope * end);
        if (0.0..=0.2).contains(&last) {
            2.0 * end * full_rule(Isa::best(), self, k)
        } else {
            self.sum_wide(k)
        }
    }

    /// Returns the sum times e^offset by the short rule, for windows that end at e⁻²⁷.
    #[inline]
    pub(crate) fn short_sum(&self, k: f64, offset: f64) -> f64 {
        let end = self.half_tan;
        let (over, under) = (end * (end + self.slope), 1.0 - self.slope * end);
        if over <= 0.2 * under {
            let sum = if over <= NARROW * under {
                short_rule::<true>(Isa::best(), self, k, offset)
            } else {
                short_rule::<false>(Isa::best(), self, k, offset)
            };
            2.0 * end * sum
        } else {
            self.sum_wide(k) * exp(offset)
        }
    }

    /// Returns a factor at the node s of [0, 1], times 1 + t²; it is a sum of terms that are not
    /// negative.
    #[inline(always)]
    fn factor<L: Lanes>(&self, l: L, i: usize, s: L::D) -> L::D {
        let (one, end) = (l.dsplat(1.0), l.dsplat(self.half_tan));
        (one - s) * (end * (end * s) + 1.0) * self.factors[i][0]
            + s * (end * end + 1.0) * self.factors[i][1]
    }

    /// Returns the factors at a rule's nodes times the weights, and q, eight nodes to a register.
    #[inline(always)]
    fn nodes<S: Simd, const N: usize>(&self, l: S, rule: [&[f64]; 2]) -> [[S::D; N]; 2] {
        let one = l.dsplat(1.0);
        // Compute the denominators, and divide once for two quotients.
        let [mut round, mut fall, mut both] = [[one; N]; 3];
        let [nodes, weights] = rule.map(|numbers| numbers.as_chunks().0);
        for i in 0..N {
            let t = l.dload(&nodes[i]) * self.half_tan;
            (round[i], fall[i]) = (t * t + 1.0, one - t * self.slope);
            // This is the inverse of the product of both denominators.
            both[i] = one / (round[i] * fall[i]);
        }
        let both = l.abreast(both);
        let mut result = [both; 2];
        // Compute the factors and q from it.
        for i in 0..N {
            let s = l.dload(&nodes[i]);
            let t = s * self.half_tan;
            let inverse = fall[i] * both[i];
            let value = self.factor(l, 0, s) * inverse * inverse;
            result[0][i] = l.dload(&weights[i]) * (value * (self.factor(l, 1, s) * inverse));
            result[1][i] = t * (t + self.slope) * round[i] * both[i];
        }
        result
    }

    /// Returns the sum with the library's functions, for wide panels (small exponents).
    fn sum_wide(&self, k: f64) -> f64 {
        let mut terms = [0.0; NODES];
        for (j, term) in terms.iter_mut().enumerate() {
            let s = NODE[j];
            let t = self.half_tan * s;
            let inverse = 1.0 / (1.0 + t * t);
            let fall = (-2.0 * t * (t + self.slope) * inverse).max(-1.0);
            let value = inverse * (self.factor(One, 0, s) * inverse);
            let value = value * (self.factor(One, 1, s) * inverse);
            *term = WEIGHT[j] * value * power(fall, k);
        }
        2.0 * self.half_tan * total(&terms)
    }
}

/// Returns (1 + fall)ᵏ; 1 for k = 0.
fn power(fall: f64, k: f64) -> f64 {
    if k > 0.0 { exp(k * ln_1p(fall)) } else { 1.0 }
}

/// Returns the sum in a fixed order of pairs, which is the same for every vector width.
#[inline(always)]
fn total(terms: &[f64; NODES]) -> f64 {
    let mut lanes = [0.0; 8];
    for i in 0..8 {
        lanes[i] = terms[i] + (terms[i + 8] + terms[i + 16]);
    }
    ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5]))
        + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7]))
}

/// Computes the sum of the full rule for [`Panel::sum`], in the order of [`total`].
#[inline(always)]
fn full_kernel<S: Simd>(s: S, panel: &Panel, k: f64) -> f64 {
    let [mut terms, mut depths] = panel.nodes::<S, 3>(s, [&NODE, &WEIGHT]);
    for q in &mut depths {
        *q = *q * (-2.0 * k) * atanh_ratio::<S>(*q);
    }
    for (term, depth) in terms.iter_mut().zip(s.abreast(depths)) {
        *term = *term * exp_bounded::<S, false>(s, depth);
    }
    s.dsum(terms[0] + (terms[1] + terms[2]))
}

/// Computes the sum of the short rule, times e^offset. `SLIM` says that q is at most [`NARROW`].
#[inline(always)]
fn short_kernel<S: Simd, const SLIM: bool>(s: S, panel: &Panel, k: f64, offset: f64) -> f64 {
    let [mut terms, mut depths] = panel.nodes::<S, 2>(s, [&FEW_NODES, &FEW_WEIGHTS]);
    for q in &mut depths {
        let ratio = if SLIM {
            atanh_ratio_narrow::<S>(*q)
        } else {
            atanh_ratio::<S>(*q)
        };
        *q = *q * (-2.0 * k) * ratio + offset;
    }
    for (term, depth) in terms.iter_mut().zip(s.abreast(depths)) {
        *term = *term * exp_bounded::<S, true>(s, depth);
    }
    s.dsum(terms[0] + terms[1])
}

dispatch! {
    fn full_rule = full_kernel(panel: &Panel, k: f64) -> f64
}
dispatch! {
    fn short_rule<const SLIM: bool> = short_kernel(panel: &Panel, k: f64, offset: f64) -> f64
}

/// Returns the integral over `piece` of a lobe that ends at `horizon` like (horizon − x)ᵏ, with a
/// small k that is not an integer. The substitution horizon − x = y⁸ makes the integrand smooth.
fn near_horizon(fan: &Fan<3>, start: f64, piece: [f64; 2], horizon: f64, k: f64, sign: f64) -> f64 {
    let root = |x: f64| pow((horizon - x).max(0.0), 0.125);
    let (y1, y0) = (root(piece[0]), root(piece[1]));
    let peak = sin(horizon);
    let mut sum = 0.0;
    for j in 0..NODES {
        let y = y0 + (y1 - y0) * NODE[j];
        let seventh = y.powi(7);
        let gap = seventh * y;
        let v = start + sign * (horizon - gap);
        let mut value = 8.0 * seventh * pow(sin(gap) / peak, k);
        for i in 0..2 {
            value *= fan.cosine_at([fan.cosine(i, 0), fan.cosine(i, 1)], v);
        }
        sum += WEIGHT[j] * value;
    }
    sum * (y1 - y0)
}

/// Returns the logarithm of the length of the axis' part in the plane of the fan.
fn log_in_plane(fan: &Fan<3>, axis: DVec3, length: f64) -> f64 {
    let off = predicates::dot(axis, fan.normal);
    near_one(axis, off * off, length)
}

/// Returns ln(axis·ω) at an end.
fn log_cosine(fan: &Fan<3>, axis: DVec3, end: usize, cosine: f64) -> f64 {
    let w = fan.ends[end] / fan.radii[end];
    near_one(axis, predicates::cross(axis, w).length_squared(), cosine)
}

/// Returns ln z with z² = |axis|² − lost. If z is near one, it is computed from 1 − z², so that the
/// error of k ln z is of the order of ε k sin and not ε k.
fn near_one(axis: DVec3, lost: f64, z: f64) -> f64 {
    if z > 0.7 && z < 1.4 {
        0.5 * ln_1p(excess_over_one(axis) - lost)
    } else {
        ln(z)
    }
}

/// Returns |v|² − 1, exactly rounded or nearly.
fn excess_over_one(v: DVec3) -> f64 {
    let (p0, e0) = predicates::two_product(v.x, v.x);
    let (p1, e1) = predicates::two_product(v.y, v.y);
    let (p2, e2) = predicates::two_product(v.z, v.z);
    let (s0, r0) = predicates::two_sum(p0, -1.0);
    let (s1, r1) = predicates::two_sum(s0, p1);
    let (s2, r2) = predicates::two_sum(s1, p2);
    s2 + ((r0 + r1 + r2) + (e0 + e1 + e2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_simd::InstructionSet;
    use linelit_testkit::rng::SplitMix64;

    #[test]
    fn panels_have_the_same_bits_on_every_instruction_set() {
        let mut rng = SplitMix64::new(5);
        for _ in 0..2000 {
            let mut random = || rng.next_f64();
            let panel = Panel {
                half_tan: 0.3 * random(),
                slope: random(),
                factors: [[random(), random()], [random(), random()]],
            };
            let k = 10f64.powf(5.0 * random());
            let offset = -50.0 * random();
            let results: Vec<[u64; 3]> = InstructionSet::ALL
                .into_iter()
                .map(Isa::detect)
                .map(|isa| {
                    [
                        full_rule(isa, &panel, k),
                        short_rule::<false>(isa, &panel, k, offset),
                        short_rule::<true>(isa, &panel, k, offset),
                    ]
                    .map(f64::to_bits)
                })
                .collect();
            assert!(results.iter().all(|r| *r == results[0]), "{panel:?} {k}");
        }
    }
}
