//! This module predicts the noise of lines and of rays past a dense shaft, from the visible parts
//! of a few pilot lines. `hybrid` uses the prediction to decide between lines and rays.
//!
//! Pilot lines in one direction go through the shaft of a shading point. For each line we know its
//! visible parts and the light that comes from them:
//!
//! ```text
//!      █████░░░░███   The noise of lines comes from light that changes from one line to the next:
//!      ████░░░░░███   their second differences predict it for 8, 16 and 32 lines. The noise of
//!      ███░░░░█████   rays comes from cells of a grid of rays that are visible in part, as some
//!                     lines show.
//! ```
//!
//! Both variances fall as powers of the number of samples. Where these powers cross is the number
//! of lines from which on lines have less noise than rays in the same time.

use linelit_elementary::{exp2, ln};
use linelit_geometry::intervals::Interval;

/// The number of lines of a shading point in each direction, in the middles of as many strata.
pub(crate) const PILOTS: usize = 32;

/// The numbers of lines for which noise is predicted, by every fourth pilot line, every second one,
/// and each.
const NUMBERS: [usize; 3] = [PILOTS / 4, PILOTS / 2, PILOTS];

/// The number of rays across, and down, for which noise is predicted.
const RAYS: usize = 8;

/// The least number of shading points for which the prediction is used.
const LEAST_POINTS: u32 = 8;

/// The power of their number by which the variance of stratified rays falls where edges cross
/// cells.
const ORDER_OF_RAYS: f64 = 1.5;

/// The variance of jittered rays divided by the variance of scrambled nets in penumbrae: measured,
/// 1.3 to 1.9.
const NETS: f64 = 1.5;

/// The power of their number by which each of the lines that share a traversal takes longer if
/// there are fewer of them: measured.
const DEARER_IF_FEW: f64 = 0.4;

/// The predicted noise of lines and of rays towards one light, as some shading points see it.
///
/// Noise is the standard deviation of the mean. Square roots of it are summed over the shading
/// points, so that a few noisy points do not dominate. Only ratios of the sums have a meaning.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ExpectedNoise {
    /// The noise of these [`NUMBERS`] of lines with slopes as control variates.
    lines: [f64; 3],
    /// The noise of [`RAYS`]² stratified rays.
    rays: f64,
    /// The number of shading points that see a part of the light.
    points: u32,
}

impl ExpectedNoise {
    /// Adds a shading point, given the light that each pilot line sends and its visible parts.
    pub(crate) fn add<'v>(
        &mut self,
        values: &[f64; PILOTS],
        parts: impl Fn(usize) -> &'v [Interval],
    ) {
        if values.iter().all(|value| *value <= 0.0) {
            return;
        }
        self.points += 1;
        for (noise, number) in self.lines.iter_mut().zip(NUMBERS) {
            *noise += variance_of_lines(values, number).sqrt().sqrt();
        }
        self.rays += variance_of_rays(values, parts).sqrt().sqrt();
    }

    /// The number of lines from which on lines have less variance than rays in the same time, where
    /// each line takes as long as `rays` rays if there are [`PILOTS`] lines. `None` if too few
    /// points were seen.
    #[allow(clippy::cast_precision_loss, reason = "few")]
    pub(crate) fn lines_ahead_of_rays(&self, rays: f64) -> Option<f64> {
        let mut noises = self.lines.iter().chain([&self.rays]);
        let are_known = noises.all(|noise| *noise > 0.0 && noise.is_finite());
        if self.points < LEAST_POINTS || !are_known {
            return None;
        }
        // Find the logarithms of the variance of lines over the variance of rays in the same time,
        // for each number of lines.
        let ratios: [f64; 3] = std::array::from_fn(|k| {
            let number = NUMBERS[k] as f64;
            let dearer = DEARER_IF_FEW * ln(PILOTS as f64 / number);
            let rays = ln(number * rays / (RAYS * RAYS) as f64) + dearer;
            4.0 * ln(self.lines[k] / self.rays) + ORDER_OF_RAYS * rays + ln(NETS)
        });
        // Find where the ratio is one, along the straight line through the nearest two.
        let k = usize::from(ratios[1] > 0.0);
        let falls = ratios[k] - ratios[k + 1];
        Some(if falls > 0.0 {
            NUMBERS[k] as f64 * exp2(ratios[k] / falls)
        } else if ratios[k] > 0.0 {
            f64::INFINITY
        } else {
            0.0
        })
    }
}

/// The sum of the squared differences between each value and the mean of the two values `step`
/// before and behind it, divided by `step`: an average over `step` interleaved subsequences, each
/// of which holds every `step`th value.
#[allow(clippy::cast_precision_loss, reason = "few")]
pub(crate) fn unevenness(values: &[f64; PILOTS], step: usize) -> f64 {
    let second = |v: &[f64]| (v[step] - 0.5 * (v[0] + v[2 * step])).powi(2);
    values.windows(2 * step + 1).map(second).sum::<f64>() / step as f64
}

/// The variance of the mean over `number` lines with slopes: Σd²/(2 N²), for the second differences
/// d of N values.
///
/// This formula is a compromise. A jump J between two lines has Σd² = J²/2, and causes a variance
/// of J²/(8 N²) in the mean of N lines. Noise of variance σ² in each line has Σd² = 1.5 N σ², and
/// causes a variance of σ²/N to 1.5 σ²/N.
#[allow(clippy::cast_precision_loss, reason = "few")]
fn variance_of_lines(values: &[f64; PILOTS], number: usize) -> f64 {
    unevenness(values, PILOTS / number) / (2 * number * number) as f64
}

/// The variance of the mean over n = [`RAYS`]² stratified rays in proportion to the unshadowed
/// light: M Σ m p (1 − p)/n, where M is all unshadowed light, m the part of it from a cell, and p
/// the fraction of that part that is visible.
#[allow(clippy::cast_precision_loss, reason = "few")]
fn variance_of_rays<'v>(values: &[f64; PILOTS], parts: impl Fn(usize) -> &'v [Interval]) -> f64 {
    // Find what each line would send if nothing hid it; a line that is wholly hidden does not show
    // it.
    let mut unhidden = [0.0; PILOTS];
    for (i, (unhidden, value)) in unhidden.iter_mut().zip(values).enumerate() {
        let visible: f64 = parts(i).iter().map(Interval::length).sum();
        if visible > 0.0 {
            *unhidden = value / visible;
        }
    }
    let some = unhidden.iter().filter(|sent| **sent > 0.0);
    let mean = unhidden.iter().sum::<f64>() / some.count().max(1) as f64;
    // Add up the variances of the cells, each of which some lines of a column cross.
    let mut sum = 0.0;
    for (column, sent) in unhidden.chunks_exact(PILOTS / RAYS).enumerate() {
        let all: f64 = sent.iter().sum();
        let first = column * sent.len();
        for row in 0..RAYS {
            let [low, high] = [row, row + 1].map(|at| at as f64 / RAYS as f64);
            let within = |part: &Interval| (part.hi.min(high) - part.lo.max(low)).max(0.0);
            let seen = |i: usize| parts(i).iter().map(within).sum::<f64>() * RAYS as f64;
            let lines = (first..).zip(sent);
            let seen: f64 = lines.map(|(i, sent)| sent * seen(i)).sum();
            if seen > 0.0 {
                sum += seen * (1.0 - seen / all).max(0.0);
            }
        }
    }
    mean * sum / (PILOTS * RAYS * RAYS * RAYS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pilot_lines::middle;
    use linelit_samplers::{Sampler, SamplerKind, Slopes};
    use linelit_testkit::rng::SplitMix64;
    use linelit_testkit::ztest::Welford;

    /// The measured variance of the mean of a function over this many lines with slopes.
    fn measured(f: impl Fn(f64) -> f64, number: usize) -> f64 {
        let sampler = Sampler::new(SamplerKind::Stratified, 3);
        let mut offsets = Slopes::default();
        let mut mean = |pixel| {
            let set = sampler.points([pixel, 0], 0, u32::try_from(number).expect("few"));
            offsets.set(&set, true);
            offsets.iter().map(|(u, share)| share * f(u)).sum::<f64>() / number as f64
        };
        (0..400).map(&mut mean).collect::<Welford>().variance()
    }

    /// The predicted variance is about twice the measured one for jumps, about equal for corners,
    /// and half to two thirds of it for noise, which slopes increase. Means over 60 functions are
    /// good to a tenth.
    #[test]
    fn noise_of_lines_is_expected() {
        let mut random = SplitMix64::new(9);
        for number in NUMBERS {
            let (mut expected, mut real) = ([0.0; 3], [0.0; 3]);
            for _ in 0..60 {
                let at = random.in_range(0.2, 0.8);
                let seed = random.next_u64();
                let noise = |u: f64| SplitMix64::new(seed ^ u.to_bits()).next_f64();
                let shapes: [&dyn Fn(f64) -> f64; 3] =
                    [&|u| f64::from(u < at), &|u| (u - at).max(0.0), &noise];
                for (k, f) in shapes.iter().enumerate() {
                    let values = std::array::from_fn(|i| f(middle(i, PILOTS)));
                    expected[k] += variance_of_lines(&values, number);
                    real[k] += measured(f, number);
                }
            }
            for (k, (expected, real)) in expected.iter().zip(real).enumerate() {
                let ratio = expected / real;
                let bounds = [1.8..2.4, 0.8..1.1, 0.45..0.75];
                assert!(bounds[k].contains(&ratio), "{number}, {k}: {ratio}");
            }
        }
    }

    /// For half planes with any edge, before a light that is brighter on one side, the prediction
    /// is compared with the variance of rays in each cell, integrated finely. Four lines in each
    /// cell give it to an eighth.
    #[test]
    fn noise_of_rays_is_expected() {
        let mut random = SplitMix64::new(10);
        let (mut expected, mut real) = (0.0, 0.0);
        for _ in 0..200 {
            let [a, b] = [0; 2].map(|_| random.in_range(-1.0, 1.0));
            let middle_at = random.in_range(0.3, 0.7) * (a + b);
            let sent = |u: f64| 1.0 + 3.0 * u;
            let is_visible = |u: f64, v: f64| a * u + b * v < middle_at;
            let part = |u: f64| {
                let place = ((middle_at - a * u) / b).clamp(0.0, 1.0);
                let (lo, hi) = if b > 0.0 { (0.0, place) } else { (place, 1.0) };
                [Interval::new(lo, hi)]
            };
            let parts: [[Interval; 1]; PILOTS] = std::array::from_fn(|i| part(middle(i, PILOTS)));
            let values = std::array::from_fn(|i| sent(middle(i, PILOTS)) * parts[i][0].length());
            expected += variance_of_rays(&values, |i| &parts[i]);
            const FINE: usize = 40;
            for cell in 0..RAYS * RAYS {
                let (mut m, mut seen) = (0.0, 0.0);
                for k in 0..FINE * FINE {
                    let u = ((cell % RAYS) as f64 + middle(k % FINE, FINE)) / RAYS as f64;
                    let v = ((cell / RAYS) as f64 + middle(k / FINE, FINE)) / RAYS as f64;
                    m += sent(u);
                    seen += f64::from(is_visible(u, v)) * sent(u);
                }
                let n = (RAYS * RAYS * FINE * FINE) as f64;
                real += 2.5 * (m / n) * (seen / m) * (1.0 - seen / m) / (RAYS * RAYS) as f64;
            }
        }
        let ratio = expected / real;
        assert!((0.9..1.1).contains(&ratio), "{ratio}");
    }

    /// If both variances are powers of the number of samples, the result is where the powers cross.
    #[test]
    fn lines_are_ahead_where_variances_cross() {
        for (size, order, cost) in [(0.3, 2.0, 5.0), (40.0, 2.5, 20.0), (1e3, 3.5, 60.0)] {
            let of_lines = |n: f64| size * n.powf(-order);
            let of_rays = |n: f64| 0.7 * n.powf(-ORDER_OF_RAYS) / NETS;
            let noises = ExpectedNoise {
                lines: NUMBERS.map(|n| 9.0 * of_lines(n as f64).powf(0.25)),
                rays: 9.0 * (of_rays((RAYS * RAYS) as f64) * NETS).powf(0.25),
                points: LEAST_POINTS,
            };
            let n = noises.lines_ahead_of_rays(cost).expect("known");
            let rays = n * cost * (PILOTS as f64 / n).powf(DEARER_IF_FEW);
            let ratio = of_lines(n) / of_rays(rays);
            // The logarithms are at most ten and have a few roundings each, times four, times a
            // slope of one.
            assert!((ratio - 1.0).abs() < 1e-12, "{n}: {ratio}");
            let few = ExpectedNoise {
                points: LEAST_POINTS - 1,
                ..noises
            };
            assert_eq!(few.lines_ahead_of_rays(cost), None);
        }
        let never = ExpectedNoise {
            lines: [1.0; 3],
            rays: 0.1,
            points: LEAST_POINTS,
        };
        assert_eq!(never.lines_ahead_of_rays(9.0), Some(f64::INFINITY));
    }
}
