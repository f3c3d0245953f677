//! The noise that is to be expected of lines and of rays, by the visible parts of a few lines.
//!
//! A shading point sees a light past a dense shaft. Pilot lines through it, in one direction, say
//! which parts of each are visible, and what light comes from there:
//!
//! ```text
//!      █████░░░░███   Lines whose light changes from one to the next make noise of lines: by
//!      ████░░░░░███   their second differences, for 8, 16 and 32 lines. Cells of a grid of
//!      ███░░░░█████   rays, of which some lines see a part and others none, make noise of rays.
//! ```
//!
//! Both fall as powers of the number of samples. Lines are ahead from where they cross.

use linelit_elementary::{exp2, ln};
use linelit_geometry::intervals::Interval;

/// Lines of a shading point in each direction, in the middles of as many strata.
pub(crate) const PILOTS: usize = 32;

/// Numbers of lines whose noise is estimated: every fourth pilot line, every second, each.
const NUMBERS: [usize; 3] = [PILOTS / 4, PILOTS / 2, PILOTS];

/// Rays across and down whose noise is estimated.
const RAYS: usize = 8;

/// The number of shading points from which on the estimate is used.
const LEAST_POINTS: u32 = 8;

/// The power of their number by which stratified rays lose variance where edges cross their cells.
const ORDER_OF_RAYS: f64 = 1.5;

/// The variance of jittered rays over that of scrambled nets in penumbrae: measured, 1.3 to 1.9.
const NETS: f64 = 1.5;

/// The power of their number by which lines that share a walk take longer where they are fewer:
/// measured.
const DEARER_IF_FEW: f64 = 0.4;

/// The noise to be expected of lines and of rays towards one light, as some shading points see it.
///
/// Noise is the standard deviation of the mean. Square roots of it are summed over the points, so
/// that a few noisy points do not decide; only ratios of the sums have a meaning.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ExpectedNoise {
    /// The noise of [`NUMBERS`] of lines with slopes.
    lines: [f64; 3],
    /// The noise of [`RAYS`]² stratified rays.
    rays: f64,
    /// Shading points that see a part of the light.
    points: u32,
}

impl ExpectedNoise {
    /// Adds a shading point, by the light that each pilot line sends, and its visible parts.
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

    /// The number from which on lines, each of which takes as long as `rays` if there are
    /// [`PILOTS`], have less variance than rays in the same time; `None` if too little was seen.
    #[allow(clippy::cast_precision_loss, reason = "few")]
    pub(crate) fn lines_ahead_of_rays(&self, rays: f64) -> Option<f64> {
        let mut noises = self.lines.iter().chain([&self.rays]);
        let are_known = noises.all(|noise| *noise > 0.0 && noise.is_finite());
        if self.points < LEAST_POINTS || !are_known {
            return None;
        }
        // Logarithms of the variance of lines over that of rays in the same time.
        let ratios: [f64; 3] = std::array::from_fn(|k| {
            let number = NUMBERS[k] as f64;
            let dearer = DEARER_IF_FEW * ln(PILOTS as f64 / number);
            let rays = ln(number * rays / (RAYS * RAYS) as f64) + dearer;
            4.0 * ln(self.lines[k] / self.rays) + ORDER_OF_RAYS * rays + ln(NETS)
        });
        // Beyond as between the nearest two.
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

/// The sum of the squares of how far values are from the mean of those `step` before and behind,
/// for values that far from each other.
#[allow(clippy::cast_precision_loss, reason = "few")]
pub(crate) fn unevenness(values: &[f64; PILOTS], step: usize) -> f64 {
    let second = |v: &[f64]| (v[step] - 0.5 * (v[0] + v[2 * step])).powi(2);
    values.windows(2 * step + 1).map(second).sum::<f64>() / step as f64
}

/// The variance of the mean over so many lines with slopes: Σd²/(2 N²), of the second differences
/// d of N values.
///
/// A jump J between two lines has Σd² = J²/2, and N lines J²/(8 N²) of variance from it; noise
/// of variance σ² in each line 1.5 N σ², and they σ²/N to 1.5 σ²/N.
#[allow(clippy::cast_precision_loss, reason = "few")]
fn variance_of_lines(values: &[f64; PILOTS], number: usize) -> f64 {
    unevenness(values, PILOTS / number) / (2 * number * number) as f64
}

/// The variance of the mean over n = [`RAYS`]² stratified rays, drawn by the light that would come
/// where nothing hides it: M Σ m p (1 − p)/n, if M comes in all, and m from a cell of which the
/// share p is visible.
#[allow(clippy::cast_precision_loss, reason = "few")]
fn variance_of_rays<'v>(values: &[f64; PILOTS], parts: impl Fn(usize) -> &'v [Interval]) -> f64 {
    // Find what each line would send; lines that are wholly hidden do not say it.
    let mut unhidden = [0.0; PILOTS];
    for (i, (unhidden, value)) in unhidden.iter_mut().zip(values).enumerate() {
        let visible: f64 = parts(i).iter().map(Interval::length).sum();
        if visible > 0.0 {
            *unhidden = value / visible;
        }
    }
    let some = unhidden.iter().filter(|sent| **sent > 0.0);
    let mean = unhidden.iter().sum::<f64>() / some.count().max(1) as f64;
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

    /// The variance of the mean of a function over so many lines with slopes.
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

    /// What is expected is about twice what is measured of jumps, as much of corners, and half to
    /// two thirds of noise, which slopes add to; means over 60 functions are good to a tenth.
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

    /// Half planes with any edge, before a light that is brighter on one side: what is expected of
    /// rays that are drawn by brightness is what cells have of it, integrated finely; four lines in
    /// each tell it to an eighth.
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

    /// Where both fall as powers of their number, lines are ahead from where the powers cross.
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
            // Logarithms of up to ten, a few roundings each, four times over, times a slope of one.
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
