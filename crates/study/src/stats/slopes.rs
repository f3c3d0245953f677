//! The order of convergence: the slope of the standard deviation over the number of samples, both
//! on logarithmic scales, and how sure one may be of it.

use super::student;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;

/// One number of samples with what its trials gave.
#[derive(Clone, Debug, PartialEq)]
pub struct SlopePoint {
    /// Samples N.
    pub samples: f64,
    /// The variance as each independent trial (seed) sees it, averaged over pixels: their mean is
    /// the variance of one estimate. Squared errors against an exact reference do as well.
    pub trial_variances: Vec<f64>,
}

/// Settings of the confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bootstrap {
    /// Resampled fits.
    pub resamples: u32,
    /// Seed of the resampling.
    pub seed: u64,
    /// Confidence, 0.95 for 95 %.
    pub confidence: f64,
}

impl Default for Bootstrap {
    /// 2000 resamples, 95 %.
    fn default() -> Self {
        Self {
            resamples: 2000,
            seed: 0x6c69_6e65,
            confidence: 0.95,
        }
    }
}

/// A fitted power law: the standard deviation is in proportion to N^`order`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Order {
    /// The exponent.
    pub order: f64,
    /// Lower end of its confidence interval.
    pub ci_low: f64,
    /// Upper end of its confidence interval.
    pub ci_high: f64,
    /// The smallest N that was fitted.
    pub n_min: f64,
    /// The largest.
    pub n_max: f64,
    /// Number of N that were fitted.
    pub points: usize,
    /// Squared residuals over their expectation, χ²/(points − 2): about one where a power law
    /// holds, well above where the curve bends in the range. NaN for two points.
    pub lack_of_fit: f64,
}

/// One point of the fit: ln N, ln sd and the standard error of ln sd.
#[derive(Clone, Copy, Debug)]
struct Logged {
    x: f64,
    y: f64,
    error: f64,
}

/// Fits what independent trials gave, with a bootstrap over the trials.
///
/// **Formula**: ln sd = ½ ln(mean of the trials' variances); weighted least squares over ln N. The
/// weights come from the trials' spread, halfway between each point's own and the common one (with
/// few trials a point's own spread is mostly luck, and low values come with small spreads). The
/// interval's ends are the quantiles of refits to resampled trials, their distance from the slope
/// widened by t(confidence, T − 1)/z(confidence)·√(T/(T − 1)) for T trials, without which intervals
/// from eight trials would cover too rarely.
/// Where all points have the same number of trials, whole trials are drawn (a seed may tie
/// neighbouring N together); else each point's alone.
/// **Domain**: points with at least two trials and a positive mean; `None` with fewer than two
/// distinct N. The same input gives the same interval on every machine.
///
/// ```
/// use linelit_study::stats::slopes::{Bootstrap, SlopePoint, fit_trials};
/// let point = |samples: f64| SlopePoint {
///     samples,
///     trial_variances: [0.9, 1.0, 1.1].map(|v| v / samples).to_vec(),
/// };
/// let order = fit_trials(&[point(1.0), point(4.0), point(16.0)], &Bootstrap::default()).unwrap();
/// assert!((order.order + 0.5).abs() < 1e-12);
/// ```
#[must_use]
pub fn fit_trials(points: &[SlopePoint], bootstrap: &Bootstrap) -> Option<Order> {
    let points: Vec<&SlopePoint> = points.iter().filter(|point| usable(point)).collect();
    let logged = log_points(points.iter().map(|point| moments(&point.trial_variances)))?;
    let logged = with_abscissae(&points, logged);
    let line = Line::through(&logged)?;
    let fewest = points
        .iter()
        .map(|point| point.trial_variances.len())
        .min()?;
    let mut slopes = resampled_slopes(&points, bootstrap);
    if slopes.is_empty() {
        return Some(line.order(&logged, f64::NAN, f64::NAN));
    }
    slopes.sort_by(f64::total_cmp);
    let trials = u32::try_from(fewest).unwrap_or(u32::MAX);
    let normal = student::quantile(bootstrap.confidence, 10_000);
    let widen = student::quantile(bootstrap.confidence, trials - 1) / normal
        * (f64::from(trials) / f64::from(trials - 1)).sqrt();
    let tail = 0.5 * (1.0 - bootstrap.confidence);
    let end = |q: f64| line.slope + widen * (quantile(&slopes, q) - line.slope);
    Some(line.order(&logged, end(tail), end(1.0 - tail)))
}

fn usable(point: &SlopePoint) -> bool {
    let mean = moments(&point.trial_variances).0;
    point.samples > 0.0 && point.trial_variances.len() >= 2 && mean > 0.0 && mean.is_finite()
}

/// Mean and squared standard error of the mean: Σ(v − mean)²/(n(n − 1)), in two passes.
pub(super) fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, square / (n * (n - 1.0)))
}

/// ln sd with shrunk errors; abscissae are filled in by [`with_abscissae`].
fn log_points(moments: impl Iterator<Item = (f64, f64)>) -> Option<Vec<Logged>> {
    let mut points = Vec::new();
    for (mean, square) in moments {
        if mean <= 0.0 || mean.is_nan() {
            return None;
        }
        // sd = √mean: its relative error is half that of the mean.
        points.push(Logged {
            x: 0.0,
            y: 0.5 * mean.ln(),
            error: 0.25 * square / (mean * mean),
        });
    }
    let common = points.iter().map(|point| point.error).sum::<f64>() / points.len() as f64;
    for point in &mut points {
        // Equal weights if the trials do not differ at all.
        let shrunk = 0.5 * (point.error + common);
        point.error = if shrunk > 0.0 {
            shrunk.sqrt()
        } else {
            f64::EPSILON
        };
    }
    Some(points)
}

fn with_abscissae(points: &[&SlopePoint], mut logged: Vec<Logged>) -> Vec<Logged> {
    for (point, logged) in points.iter().zip(&mut logged) {
        logged.x = point.samples.ln();
    }
    logged
}

fn resampled_slopes(points: &[&SlopePoint], bootstrap: &Bootstrap) -> Vec<f64> {
    let trials = points[0].trial_variances.len();
    let together = points
        .iter()
        .all(|point| point.trial_variances.len() == trials);
    let mut random = Pcg64Mcg::seed_from_u64(bootstrap.seed);
    let mut drawn = vec![0; trials];
    let mut slopes = Vec::with_capacity(bootstrap.resamples as usize);
    let mut values = Vec::new();
    for _ in 0..bootstrap.resamples {
        drawn.fill_with(|| random.random_range(0..trials));
        let resampled = points.iter().map(|point| {
            let all = &point.trial_variances;
            values.clear();
            if together {
                values.extend(drawn.iter().map(|&trial| all[trial]));
            } else {
                values.extend((0..all.len()).map(|_| all[random.random_range(0..all.len())]));
            }
            moments(&values)
        });
        let line =
            log_points(resampled).and_then(|logged| Line::through(&with_abscissae(points, logged)));
        slopes.extend(line.map(|line| line.slope));
    }
    slopes
}

/// Quantile of sorted values, linear between order statistics.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let along = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    #[allow(clippy::cast_possible_truncation, reason = "an index below the length")]
    let below = along as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (along - below as f64) * (sorted[above] - sorted[below])
}

/// A weighted least-squares line.
#[derive(Clone, Copy, Debug)]
struct Line {
    slope: f64,
    chi_square: f64,
}

impl Line {
    fn through(points: &[Logged]) -> Option<Self> {
        let weight = |point: &Logged| 1.0 / (point.error * point.error);
        let total: f64 = points.iter().map(weight).sum();
        let mean = |value: fn(&Logged) -> f64| {
            points
                .iter()
                .map(|point| weight(point) * value(point))
                .sum::<f64>()
                / total
        };
        let (mean_x, mean_y) = (mean(|point| point.x), mean(|point| point.y));
        let spread: f64 = points
            .iter()
            .map(|p| weight(p) * (p.x - mean_x).powi(2))
            .sum();
        // One abscissa (or none, where `total` is zero and the means are NaN) has no slope.
        let extent = points
            .iter()
            .fold(0.0_f64, |a, p| a.max((p.x - mean_x).abs()));
        if extent.is_nan() || extent <= 8.0 * f64::EPSILON * mean_x.abs() || points.len() < 2 {
            return None;
        }
        let along: f64 = points
            .iter()
            .map(|p| weight(p) * (p.x - mean_x) * (p.y - mean_y))
            .sum();
        let slope = along / spread;
        let residual = |p: &Logged| p.y - mean_y - slope * (p.x - mean_x);
        let chi_square = points.iter().map(|p| weight(p) * residual(p).powi(2)).sum();
        Some(Self { slope, chi_square })
    }

    fn order(&self, points: &[Logged], ci_low: f64, ci_high: f64) -> Order {
        let freedom = points.len() - 2;
        let end = |pick: fn(f64, f64) -> f64, start: f64| {
            points.iter().map(|point| point.x).fold(start, pick)
        };
        Order {
            order: self.slope,
            ci_low,
            ci_high,
            n_min: round_whole(end(f64::min, f64::INFINITY).exp()),
            n_max: round_whole(end(f64::max, f64::NEG_INFINITY).exp()),
            points: points.len(),
            lack_of_fit: if freedom == 0 {
                f64::NAN
            } else {
                self.chi_square / freedom as f64
            },
        }
    }
}

/// exp(ln N) is N within a few ulps: whole numbers come back whole.
fn round_whole(n: f64) -> f64 {
    let whole = n.round();
    if (n - whole).abs() <= 64.0 * f64::EPSILON * n {
        whole
    } else {
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::normal;

    const COUNTS: [f64; 5] = [4.0, 16.0, 64.0, 256.0, 1024.0];

    /// Trials of an estimator whose variance is N^(2·order), each seen over `pixels` pixels: a mean
    /// of that many χ² variables.
    fn trials(random: &mut Pcg64Mcg, order: f64, trials: usize, pixels: usize) -> Vec<SlopePoint> {
        COUNTS
            .iter()
            .map(|&samples| {
                let variance = samples.powf(2.0 * order);
                let trial = |random: &mut Pcg64Mcg| {
                    let sum: f64 = (0..pixels).map(|_| normal(random).powi(2)).sum();
                    variance * sum / pixels as f64
                };
                let trial_variances = (0..trials).map(|_| trial(random)).collect();
                SlopePoint {
                    samples,
                    trial_variances,
                }
            })
            .collect()
    }

    /// How often 95 % intervals hold the truth, over `studies` synthetic studies.
    fn coverage(count: usize, pixels: usize, studies: u32) -> (f64, f64) {
        let mut random = Pcg64Mcg::seed_from_u64(11);
        let (mut covered, mut sum) = (0_u32, 0.0);
        for _ in 0..studies {
            let points = trials(&mut random, -1.25, count, pixels);
            let bootstrap = Bootstrap {
                resamples: 400,
                ..Bootstrap::default()
            };
            let order = fit_trials(&points, &bootstrap).unwrap();
            covered += u32::from(order.ci_low <= -1.25 && -1.25 <= order.ci_high);
            sum += order.order;
        }
        (
            f64::from(covered) / f64::from(studies),
            sum / f64::from(studies),
        )
    }

    #[test]
    fn a_power_law_is_found_exactly() {
        for order in [-0.5, -0.75, -1.0, -1.5] {
            let points = COUNTS.map(|samples| SlopePoint {
                samples,
                trial_variances: [8.0, 9.0, 10.0]
                    .map(|v| v * samples.powf(2.0 * order))
                    .to_vec(),
            });
            let fit = fit_trials(&points, &Bootstrap::default()).unwrap();
            // Slope of logs up to ln 1024 ≈ 7, each within ε·7, over a spread of the same size.
            assert!(
                (fit.order - order).abs() < 32.0 * f64::EPSILON,
                "{}",
                fit.order
            );
            // The same trials are drawn at all N: no refit is off by more than rounding.
            assert!((fit.ci_high - fit.ci_low).abs() < 1e-12, "{fit:?}");
            assert!(fit.lack_of_fit < 1e-20);
            assert_eq!(
                (fit.n_min.to_bits(), fit.n_max.to_bits()),
                (4_f64.to_bits(), 1024_f64.to_bits())
            );
        }
    }

    #[test]
    fn intervals_cover_as_often_as_they_say() {
        // Binomial with p = 0.95 over 1000 studies: standard deviation 0.0069. Between 0.92 (4.3 of
        // them) and 0.99: bootstrap intervals from so few trials need not be exact, yet must not be
        // useless either way. Found: 0.943, 0.940, 0.949.
        for (count, pixels) in [(8, 20), (8, 200), (30, 50)] {
            let (rate, mean) = coverage(count, pixels, 1000);
            assert!(
                (0.92..0.99).contains(&rate),
                "{count} trials, {pixels} pixels: {rate}"
            );
            // ln of a mean of n·T·p χ²'s is biased alike at every N: the slope is not. Its standard
            // error: √(2/(T·p))/2 over √Σ(x − x̄)² = 4.4, over √1000 studies; five of them.
            let spread = 0.5 * (2.0 / (count * pixels) as f64).sqrt() / 4.38 / 1000_f64.sqrt();
            assert!(
                (mean + 1.25).abs() < 5.0 * spread,
                "{count}, {pixels}: {mean}"
            );
        }
    }

    #[test]
    fn a_bend_shows_as_lack_of_fit() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut points = trials(&mut random, -1.0, 20, 400);
        let straight = fit_trials(&points, &Bootstrap::default()).unwrap();
        for point in &mut points {
            // A floor that the largest N runs into.
            point.trial_variances.iter_mut().for_each(|v| *v += 1e-5);
        }
        let bent = fit_trials(&points, &Bootstrap::default()).unwrap();
        assert!(straight.lack_of_fit < 6.0, "{}", straight.lack_of_fit);
        assert!(bent.lack_of_fit > 50.0, "{}", bent.lack_of_fit);
    }

    #[test]
    fn the_same_input_gives_the_same_interval() {
        let points = trials(&mut Pcg64Mcg::seed_from_u64(1), -0.75, 8, 50);
        let once = fit_trials(&points, &Bootstrap::default()).unwrap();
        let again = fit_trials(&points, &Bootstrap::default()).unwrap();
        assert_eq!(format!("{once:?}"), format!("{again:?}"));
        let other = fit_trials(
            &points,
            &Bootstrap {
                seed: 2,
                ..Bootstrap::default()
            },
        )
        .unwrap();
        assert!((once.ci_low - other.ci_low).abs() > 0.0);
        // 2000 resamples: a 2.5 % quantile is good to about 4 % of the interval's half width.
        let half_width = 0.5 * (once.ci_high - once.ci_low);
        assert!((once.ci_low - other.ci_low).abs() < 0.25 * half_width);
    }

    #[test]
    fn points_without_variance_are_left_out() {
        let mut points = trials(&mut Pcg64Mcg::seed_from_u64(9), -0.5, 8, 100);
        points[4].trial_variances = vec![0.0; 8];
        points[3].trial_variances[2] = f64::NAN;
        let order = fit_trials(&points, &Bootstrap::default()).unwrap();
        assert_eq!((order.points, order.n_max.to_bits()), (3, 64_f64.to_bits()));
        assert!(fit_trials(&points[..1], &Bootstrap::default()).is_none());
        assert!(fit_trials(&[], &Bootstrap::default()).is_none());
        let same = [points[0].clone(), points[0].clone()];
        assert!(fit_trials(&same, &Bootstrap::default()).is_none());
    }

    #[test]
    fn different_numbers_of_trials_are_resampled_apart() {
        let mut points = trials(&mut Pcg64Mcg::seed_from_u64(21), -1.0, 12, 300);
        points[0].trial_variances.truncate(5);
        let order = fit_trials(&points, &Bootstrap::default()).unwrap();
        assert!(order.ci_low < -1.0 && -1.0 < order.ci_high, "{order:?}");
    }
}
