//! The order of convergence: the slope of the standard deviation over the number of samples, both
//! on logarithmic scales, with a confidence interval.
//!
//! A line is fitted by weighted least squares. Its interval comes from a jackknife over trials
//! (refits without each trial in turn), so that it holds even if a seed makes errors at
//! neighbouring numbers of samples similar.

use super::student;
use linelit_elementary::ln;
use serde::Serialize;

/// The variances that independent trials found at one number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct SlopePoint {
    /// The number of samples, called N in the docs of this module.
    pub samples: f64,
    /// The variance according to each independent trial (seed), averaged over pixels. The mean of
    /// these is the variance of one estimate. Squared errors against an exact reference may be
    /// given instead.
    pub trial_variances: Vec<f64>,
}

/// The least number of trials for which an interval is reported. With four, t(95 %, 3) = 3.2 makes
/// it so wide that it is of no use, and it still depends on the trials being normal.
pub const LEAST_TRIALS: usize = 5;

/// A fitted power law: the standard deviation is proportional to N^`order`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Order {
    /// The exponent.
    pub order: f64,
    /// The lower end of the confidence interval of `order`; NaN with fewer than [`LEAST_TRIALS`]
    /// trials.
    pub ci_low: f64,
    /// The upper end of the confidence interval of `order`; NaN with fewer than [`LEAST_TRIALS`]
    /// trials.
    pub ci_high: f64,
    /// The smallest number of samples N that the line was fitted to.
    pub n_min: f64,
    /// The largest number of samples N that the line was fitted to.
    pub n_max: f64,
    /// The number of points that the line was fitted to, each at its own number of samples N.
    #[serde(skip)]
    pub points: usize,
    /// The squared residuals over their expectation, χ²/(points − 2): about one where a power law
    /// holds, well above one where the curve bends within the range. NaN for two points.
    pub lack_of_fit: f64,
    /// The slope between the last two N with its standard error, if the curve bends. It is `None`
    /// where the slopes between neighbouring N are all within their intervals of `order`, where the
    /// residuals are no larger than expected, and with fewer than [`LEAST_TRIALS`] trials.
    #[serde(skip)]
    pub last: Option<[f64; 2]>,
}

/// A point of the fit: `x` = ln N, `y` = ln sd, and the standard error of `y`.
#[derive(Clone, Copy, Debug)]
struct Logged {
    x: f64,
    y: f64,
    error: f64,
}

/// Fits the order of convergence to the variances of independent trials, with an interval of this
/// confidence (0.95 for 95 %).
///
/// **Formula**, with N the number of samples, T the number of trials, and sd the standard
/// deviation: ln sd = ½ ln(mean of the trials' variances); weighted least squares over ln N. The
/// weights come from the trials' spread, halfway between each point's own and the common one (with
/// few trials a point's own spread is mostly chance, and low values come with small spreads). The
/// interval is ± t(confidence, T − 1) times the jackknife's standard error: of T refits without one
/// trial each, √((T − 1)/T · Σ(slope − mean)²). Where all points have the same number of trials,
/// whole trials are left out (a seed may make neighbouring N similar); otherwise each point's
/// trials are left out separately, and T − 1 is the fewest trials of any point less one.
///
/// **Domain**: points with at least two trials and a positive mean; `None` with fewer than two
/// distinct N. With fewer than [`LEAST_TRIALS`] trials there is no interval.
///
/// **Coverage** of 95 % intervals by simulation: 94 to 96 % from 5, 8 and 30 trials over many
/// pixels (the tests describe them), 96.2 % from 8 trials of skewed errors if these are to nine
/// tenths the same at all N; for one pixel, whose squared error is a χ² of one degree, up to 98 %
/// if trials make all N similar.
///
/// ```
/// use linelit_study::stats::slopes::{SlopePoint, fit_trials};
/// let point = |samples: f64| SlopePoint {
///     samples,
///     trial_variances: [0.8, 0.9, 1.0, 1.1, 1.2].map(|v| v / samples).to_vec(),
/// };
/// let order = fit_trials(&[point(1.0), point(4.0), point(16.0)], 0.95).unwrap();
/// assert!((order.order + 0.5).abs() < 1e-12);
/// ```
#[must_use]
pub fn fit_trials(points: &[SlopePoint], confidence: f64) -> Option<Order> {
    // Fit the line through all points.
    let mut points: Vec<&SlopePoint> = points.iter().filter(|point| usable(point)).collect();
    points.sort_by(|a, b| a.samples.total_cmp(&b.samples));
    let all = logged(&points, |_| None)?;
    let line = Line::through(&all)?;
    // The half width of the interval of any slope that is computed from the points.
    let fewest = points.iter().map(|p| p.trial_variances.len()).min()?;
    let freedom = u32::try_from(fewest - 1).unwrap_or(u32::MAX);
    let half = |confidence, slope: &dyn Fn(&[Logged]) -> f64| match fewest < LEAST_TRIALS {
        true => f64::NAN,
        false => student::quantile(confidence, freedom) * standard_error(&points, slope),
    };
    // Does the curve bend? Compare the slope between each pair of neighbours with the slope of all.
    let steps = points.len() - 1;
    let is_off = |k: usize| {
        let bend = |p: &[Logged]| slope(&p[k..k + 2]) - slope(p);
        // By Bonferroni's correction, a straight line seems to bend at some pair as often as one
        // interval fails to cover.
        bend(&all).abs() > half(1.0 - (1.0 - confidence) / steps as f64, &bend)
    };
    // Put the results together.
    let last = |p: &[Logged]| slope(&p[steps - 1..]);
    let half = half(confidence, &slope);
    let lack_of_fit = match points.len() - 2 {
        0 => f64::NAN,
        freedom => line.chi_square / freedom as f64,
    };
    let is_bent = lack_of_fit > 1.0 && (0..steps).any(is_off);
    Some(Order {
        order: line.slope,
        ci_low: line.slope - half,
        ci_high: line.slope + half,
        n_min: points[0].samples,
        n_max: points[points.len() - 1].samples,
        points: points.len(),
        lack_of_fit,
        last: is_bent.then(|| [last(&all), standard_error(&points, &last)]),
    })
}

/// Returns whether a point can be used for the fit: the point has at least two trials and a
/// positive mean.
fn usable(point: &SlopePoint) -> bool {
    let mean = moments(&point.trial_variances).0;
    point.samples > 0.0 && point.trial_variances.len() >= 2 && mean > 0.0 && mean.is_finite()
}

/// Returns the mean and the squared standard error of the mean, Σ(v − mean)²/(n(n − 1)), in two
/// passes.
pub(super) fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, square / (n * (n - 1.0)))
}

/// Returns ln N (N is the number of samples) and ln sd (the standard deviation) of each point, with
/// the standard errors of all points drawn halfway to their mean. `left_out` names the trial of
/// each point that is left out, if any. `None` if a point has no positive mean.
fn logged(
    points: &[&SlopePoint],
    left_out: impl Fn(usize) -> Option<usize>,
) -> Option<Vec<Logged>> {
    let mut logged = Vec::new();
    for (k, point) in points.iter().enumerate() {
        let mut values = point.trial_variances.clone();
        if let Some(trial) = left_out(k) {
            values.remove(trial);
        }
        let (mean, square) = moments(&values);
        if mean <= 0.0 || mean.is_nan() {
            return None;
        }
        // sd = √mean, so that its relative error is half the error of the mean.
        logged.push(Logged {
            x: ln(point.samples),
            y: 0.5 * ln(mean),
            error: 0.25 * square / (mean * mean),
        });
    }
    // Draw each point's error halfway to the common one.
    let common = logged.iter().map(|point| point.error).sum::<f64>() / logged.len() as f64;
    for point in &mut logged {
        let shrunk = 0.5 * (point.error + common);
        // If the trials do not differ at all, give all points equal weights.
        point.error = if shrunk > 0.0 {
            shrunk.sqrt()
        } else {
            f64::EPSILON
        };
    }
    Some(logged)
}

/// Returns the jackknife's standard error of a slope, √((T − 1)/T · Σ(slope − mean)²) over the
/// slopes without each of T trials; NaN if there is no slope without some trial.
fn standard_error(points: &[&SlopePoint], slope: &dyn Fn(&[Logged]) -> f64) -> f64 {
    let count = |point: &SlopePoint| point.trial_variances.len();
    let alike = points.iter().all(|point| count(point) == count(points[0]));
    let variance = |own: usize| {
        let trials = 0..count(points[own]);
        let without = |trial| logged(points, |k| (alike || k == own).then_some(trial));
        let slopes = trials.map(|trial| without(trial).map_or(f64::NAN, |p| slope(&p)));
        let slopes: Vec<f64> = slopes.collect();
        let fewer = slopes.len() as f64 - 1.0;
        moments(&slopes).1 * fewer * fewer
    };
    let groups = if alike { 1 } else { points.len() };
    (0..groups).map(variance).sum::<f64>().sqrt()
}

/// A line fitted by weighted least squares: its slope and the weighted sum of its squared
/// residuals.
#[derive(Clone, Copy, Debug)]
struct Line {
    slope: f64,
    chi_square: f64,
}

/// Returns the slope of the line through points; NaN if they have none.
fn slope(points: &[Logged]) -> f64 {
    Line::through(points).map_or(f64::NAN, |line| line.slope)
}

impl Line {
    /// Fits a line; `None` if the points do not have two distinct abscissae.
    fn through(points: &[Logged]) -> Option<Self> {
        let weight = |point: &Logged| 1.0 / (point.error * point.error);
        let sum = |value: &dyn Fn(&Logged) -> f64| -> f64 {
            points.iter().map(|p| weight(p) * value(p)).sum()
        };
        let total: f64 = points.iter().map(weight).sum();
        let (mean_x, mean_y) = (sum(&|p| p.x) / total, sum(&|p| p.y) / total);
        let spread = sum(&|p| (p.x - mean_x).powi(2));
        // One abscissa (or none, where `total` is zero and the means are NaN) has no slope.
        let distances = points.iter().map(|p| (p.x - mean_x).abs());
        let extent = distances.fold(0.0, f64::max);
        if extent.is_nan() || extent <= 8.0 * f64::EPSILON * mean_x.abs() || points.len() < 2 {
            return None;
        }
        let along = |p: &Logged| weight(p) * (p.x - mean_x) * (p.y - mean_y);
        let slope = points.iter().map(along).sum::<f64>() / spread;
        let residual = |p: &Logged| p.y - mean_y - slope * (p.x - mean_x);
        let chi_square = sum(&|p| residual(p).powi(2));
        Some(Self { slope, chi_square })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::normal;
    use rand::SeedableRng as _;
    use rand_pcg::Pcg64Mcg;

    const COUNTS: [f64; 5] = [4.0, 16.0, 64.0, 256.0, 1024.0];

    /// The distribution of a trial's squared error, for a variance of one.
    #[derive(Clone, Copy, Debug)]
    enum Seen {
        /// The mean of this many χ² variables of one degree: normal errors of as many pixels.
        Pixels(u32),
        /// exp(z/2 − 1/8) of a normal z: more often far above than below.
        Skewed,
    }

    fn one(random: &mut Pcg64Mcg, seen: Seen) -> f64 {
        match seen {
            Seen::Pixels(n) => {
                let sum: f64 = (0..n).map(|_| normal(random).powi(2)).sum();
                sum / f64::from(n)
            }
            Seen::Skewed => (0.5 * normal(random) - 0.125).exp(),
        }
    }

    /// Simulates trials of an estimator whose variance is N^(2·order). A fraction of each trial's
    /// variance is the same at all N.
    fn tied_trials(
        random: &mut Pcg64Mcg,
        order: f64,
        trials: usize,
        (seen, tied): (Seen, f64),
    ) -> Vec<SlopePoint> {
        let shared: Vec<f64> = (0..trials).map(|_| one(random, seen)).collect();
        let point = |&samples: &f64| SlopePoint {
            samples,
            trial_variances: shared
                .iter()
                .map(|shared| tied * shared + (1.0 - tied) * one(random, seen))
                .map(|seen| seen * samples.powf(2.0 * order))
                .collect(),
        };
        COUNTS.iter().map(point).collect()
    }

    fn trials(random: &mut Pcg64Mcg, order: f64, trials: usize, pixels: u32) -> Vec<SlopePoint> {
        tied_trials(random, order, trials, (Seen::Pixels(pixels), 0.0))
    }

    #[test]
    fn a_power_law_is_found_exactly() {
        for order in [-0.5, -0.75, -1.0, -1.5] {
            let points = COUNTS.map(|samples| SlopePoint {
                samples,
                trial_variances: [8.0, 8.5, 9.0, 9.5, 10.0]
                    .map(|v| v * samples.powf(2.0 * order))
                    .to_vec(),
            });
            let fit = fit_trials(&points, 0.95).unwrap();
            // Slope of logs up to ln 1024 ≈ 7, each within ε·7, over a spread of the same size.
            assert!(
                (fit.order - order).abs() < 32.0 * f64::EPSILON,
                "{}",
                fit.order
            );
            // The same trials are left out at all N: no refit is off by more than rounding.
            assert!((fit.ci_high - fit.ci_low).abs() < 1e-12, "{fit:?}");
            assert!(fit.lack_of_fit < 1e-20);
            assert_eq!(
                (fit.n_min.to_bits(), fit.n_max.to_bits()),
                (4_f64.to_bits(), 1024_f64.to_bits())
            );
        }
    }

    /// Counts how many 95 % intervals contain the true order: 94 to 96 %, with a margin of three
    /// and a half standard deviations of 0.0034 (a binomial over 4000 studies). At most the
    /// remaining fraction of fits may be reported as bent, since these lines are straight.
    #[test]
    #[allow(clippy::print_stdout, reason = "the figures, by --nocapture")]
    fn intervals_cover_as_often_as_they_say() {
        const STUDIES: u32 = 4000;
        let mut random = Pcg64Mcg::seed_from_u64(11);
        let room = 3.5 * (0.95 * 0.05 / f64::from(STUDIES)).sqrt();
        for seen in [Seen::Pixels(20), Seen::Skewed] {
            for (count, tied) in [
                (5, 0.0),
                (8, 0.0),
                (8, 0.5),
                (8, 0.9),
                (30, 0.0),
                (30, 0.5),
                (30, 0.9),
            ] {
                let (mut covered, mut bent) = (0, 0);
                for _ in 0..STUDIES {
                    let points = tied_trials(&mut random, -1.25, count, (seen, tied));
                    let fit = fit_trials(&points, 0.95).unwrap();
                    covered += u32::from(fit.ci_low <= -1.25 && -1.25 <= fit.ci_high);
                    bent += u32::from(fit.last.is_some());
                }
                let [rate, bent] = [covered, bent].map(|n| f64::from(n) / f64::from(STUDIES));
                let what = format!("{count} trials, {seen:?}, {tied} tied: {rate:.4}, {bent:.4}");
                println!("{what}");
                assert!((rate - 0.95).abs() < 0.01 + room, "{what}");
                assert!(bent < 0.05 + 0.01 + room, "{what}");
            }
        }
    }

    /// The ln of a mean of χ² variables has the same bias at every N, so that the slope has none.
    #[test]
    fn slopes_are_right_in_the_mean() {
        let (studies, count, pixels) = (1000_u32, 8, 20);
        let mut random = Pcg64Mcg::seed_from_u64(12);
        let slope = |_| {
            let points = trials(&mut random, -1.25, count, pixels);
            fit_trials(&points, 0.95).unwrap().order
        };
        let mean = (0..studies).map(slope).sum::<f64>() / f64::from(studies);
        // Standard error: √(2/(T·p))/2 over √Σ(x − x̄)² = 4.4, over √1000 studies; five of them.
        let spread = 0.5 * (2.0 / f64::from(8 * pixels)).sqrt() / 4.38 / f64::from(studies).sqrt();
        assert!((mean + 1.25).abs() < 5.0 * spread, "{mean}");
    }

    #[test]
    fn few_trials_have_no_interval() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        for count in 2..7 {
            let fit = fit_trials(&trials(&mut random, -0.5, count, 50), 0.95).unwrap();
            assert!(fit.order.is_finite());
            let told = fit.ci_low < fit.order && fit.order < fit.ci_high;
            assert_eq!(told, count >= 5, "{fit:?}");
            assert_eq!(fit.ci_low.is_nan() && fit.ci_high.is_nan(), !told);
        }
    }

    #[test]
    fn a_bend_shows_as_lack_of_fit_and_by_the_last_slope() {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let mut points = trials(&mut random, -1.0, 20, 400);
        let straight = fit_trials(&points, 0.95).unwrap();
        let mut kinked = points.clone();
        // A tenth more in the middle leaves the fit, the first step and the last as they are.
        kinked[2].trial_variances.iter_mut().for_each(|v| *v *= 1.2);
        assert!(fit_trials(&kinked, 0.95).unwrap().last.is_some());
        for point in &mut points {
            // The error has a floor, which the largest N reaches.
            point.trial_variances.iter_mut().for_each(|v| *v += 1e-5);
        }
        let bent = fit_trials(&points, 0.95).unwrap();
        assert!(straight.lack_of_fit < 6.0, "{}", straight.lack_of_fit);
        assert!(bent.lack_of_fit > 50.0, "{}", bent.lack_of_fit);
        // ½ ln((1024⁻² + 1e-5)/(256⁻² + 1e-5))/ln 4, and of 8000 squares √(2/8000)/2 = .0079 for
        // each sd, of which the floor has no part: √((.604 · .0079)² + (.087 · .0079)²)/ln 4.
        let [slope, error] = bent.last.unwrap();
        assert!((slope + 0.3014).abs() < 5.0 * 0.0035, "{slope}");
        // The jackknife's own error with 19 degrees of freedom is 16 %; five of them.
        assert!((error / 0.0035 - 1.0).abs() < 0.8, "{error}");
    }

    #[test]
    fn points_without_variance_are_left_out() {
        let mut points = trials(&mut Pcg64Mcg::seed_from_u64(9), -0.5, 8, 100);
        points[4].trial_variances = vec![0.0; 8];
        points[3].trial_variances[2] = f64::NAN;
        let order = fit_trials(&points, 0.95).unwrap();
        assert_eq!((order.points, order.n_max.to_bits()), (3, 64_f64.to_bits()));
        assert!(fit_trials(&points[..1], 0.95).is_none());
        assert!(fit_trials(&[], 0.95).is_none());
        let same = [points[0].clone(), points[0].clone()];
        assert!(fit_trials(&same, 0.95).is_none());
    }

    #[test]
    fn different_numbers_of_trials_are_left_out_apart() {
        let mut points = trials(&mut Pcg64Mcg::seed_from_u64(21), -1.0, 12, 300);
        points[0].trial_variances.truncate(5);
        let order = fit_trials(&points, 0.95).unwrap();
        assert!(order.ci_low < -1.0 && -1.0 < order.ci_high, "{order:?}");
    }
}
