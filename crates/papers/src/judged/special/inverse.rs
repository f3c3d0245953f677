//! The inverse distribution function of projected solid angle along a line, and the largest error
//! that two steps of the iteration of Peters 2021 (§3.4) leave.

use linelit_elementary::{asin, atan2, pow, sin, sin_cos};
use linelit_samplers::{Sampler, SamplerKind};
use std::f64::consts::{FRAC_PI_2, PI};

/// Returns the antiderivative F of eq. 3 of Peters 2021 at an angle along the line, whose sine the
/// paper calls ω. `[ns, nt]` are the components of the normal along the line and towards it.
pub(crate) fn antiderivative([ns, nt]: [f64; 2], angle: f64) -> f64 {
    let (w, root) = sin_cos(angle);
    ns * w * w + nt * (root * w + angle)
}

/// Returns the angles between which an infinitely long line is above the horizon.
pub(crate) fn above([ns, nt]: [f64; 2]) -> [f64; 2] {
    // n_s ω + n_t √(1 − ω²) is the cosine of the angle from (n_s, n_t).
    let middle = atan2(ns, nt);
    [-FRAC_PI_2, FRAC_PI_2].map(|quarter| (middle + quarter).clamp(-FRAC_PI_2, FRAC_PI_2))
}

/// A line and a random number, as four numbers in [0, 1]: the rotation of the normal, both ends as
/// fractions of the angles above the horizon, and ξ as a fraction of the range between the guards.
type Case = [f64; 4];

/// The distance of the random number ξ from 0 and from 1 below which the iteration is not tried: ξ
/// is between the two guards `GUARD` and 1 − `GUARD`.
const GUARD: f64 = 1e-5;

/// Returns the error in ξ of the paper's iteration (algorithm 2 in `f64`) after some steps. `None`
/// if less than 10⁻⁷ of a whole line is left, where rounding would dominate.
fn backward_error([turn, from, to, xi]: Case, steps: u32) -> Option<f64> {
    // Decode the case: the normal, the ends of the line, and ξ.
    let xi = GUARD + xi * (1.0 - 2.0 * GUARD);
    let (ns, nt) = sin_cos(PI * (2.0 * turn - 1.0));
    let [low, high] = above([ns, nt]);
    let [first, last] = [from.min(to), from.max(to)].map(|share| low + share * (high - low));
    // Integrate from one end to the other.
    let value = |angle| antiderivative([ns, nt], angle);
    let (start, total) = (value(first), value(last) - value(first));
    if total < 1e-7 {
        return None;
    }
    // Start at a sine linear in ξ, and take steps of second order, which solve the quadratic of the
    // Taylor expansion.
    let [w0, w1] = [first, last].map(sin);
    let mut alpha = asin((w0 + xi * (w1 - w0)).clamp(-1.0, 1.0));
    for _ in 0..steps {
        let (ws, wt) = sin_cos(alpha);
        let n = ns * ws + nt * wt;
        let g = n * ws + nt * alpha - (start + xi * total);
        let g1 = 2.0 * n * wt;
        let g2 = 2.0 * (ns * wt - nt * ws) * wt - 2.0 * n * ws;
        let root = (g1 * g1 - 2.0 * g2 * g).max(0.0).sqrt();
        let sum = g1 + root.copysign(g1);
        let step = if sum.abs() > 0.0 { -2.0 * g / sum } else { 0.0 };
        alpha = (alpha + step).clamp(-FRAC_PI_2, FRAC_PI_2);
    }
    // Which ξ belongs to the angle found?
    Some(((value(alpha) - start) / total - xi).abs())
}

/// Returns the worst backward error after some steps: tries random cases, half of which have
/// numbers that are often very close to 0 or 1, and climbs from the worst ones.
pub(super) fn worst(cases: u32, steps: u32, seed: u64) -> f64 {
    const CLIMBS: usize = 64;
    const BLOCK: u32 = 1 << 12;
    let numbers = Sampler::new(SamplerKind::Independent, seed);
    // Map the lower half of the numbers to distances from 0 whose logarithm is uniform between 10⁻⁶
    // and 1, and the upper half to such distances from 1.
    let near_an_end = |u: f64| match u {
        u if u < 0.5 => pow(1e-6, 2.0 * u),
        u => 1.0 - pow(1e-6, 2.0 * u - 1.0),
    };
    // Try random cases, and remember the worst.
    let mut best: Vec<(f64, Case)> = Vec::new();
    for k in 0..cases {
        let at = |stream| {
            numbers
                .points([k / BLOCK, 0], stream, BLOCK)
                .get_2d(k % BLOCK)
        };
        let ([a, b], [c, d]) = (at(0), at(1));
        let case = [a, b, c, d].map(|u| if k % 2 == 0 { u } else { near_an_end(u) });
        let Some(error) = backward_error(case, steps) else {
            continue;
        };
        if best.len() < CLIMBS || best.last().is_some_and(|least| error > least.0) {
            best.push((error, case));
            best.sort_by(|a, b| b.0.total_cmp(&a.0));
            best.truncate(CLIMBS);
        }
    }
    // Climb from each of these.
    let tops = (1..)
        .zip(best)
        .map(|(k, from)| climb(from, steps, &numbers, k));
    tops.fold(0.0, f64::max)
}

/// Climbs from a case by random moves, which become shorter whenever none of 16 leads up, and
/// returns the error at the end.
fn climb(from: (f64, Case), steps: u32, numbers: &Sampler, stream: u32) -> f64 {
    let (mut error, mut case) = from;
    let (mut step, mut turn) = (0.1, 0);
    while step > 1e-9 {
        let before = error;
        let moves = [0, 1].map(|more| numbers.points([turn, 1], 2 * stream + more, 16));
        turn += 1;
        for k in 0..16 {
            let ([a, b], [c, d]) = (moves[0].get_2d(k), moves[1].get_2d(k));
            let delta = [a, b, c, d].map(|u| step * (2.0 * u - 1.0));
            let moved = [0, 1, 2, 3].map(|i| (case[i] + delta[i]).clamp(0.0, 1.0));
            let found = backward_error(moved, steps).unwrap_or(0.0);
            if found > error {
                (error, case) = (found, moved);
            }
        }
        if error <= before {
            step *= 0.7;
        }
    }
    error
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two steps are as precise as the paper says, one step is not, and three are still more
    /// precise.
    #[test]
    fn two_steps_are_enough() {
        let [one, two, three] = [1, 2, 3].map(|steps| worst(100_000, steps, 3));
        assert!(two < 1.585e-5, "{two}");
        assert!(two < 0.1 * one && three < 0.1 * two, "{one} {two} {three}");
    }
}
