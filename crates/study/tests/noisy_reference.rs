//! Errors against a reference that is as noisy as the estimates that are compared with it.

use linelit_geometry::DVec3;
use linelit_study::engine::{Design, Job, Method, Problem, Results, Truth, measure};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Values from 1 to 2, estimated with normal noise whose standard deviation falls with the root of
/// the samples. Another key gives another study.
struct Noise {
    key: u64,
}

const COLOUR: DVec3 = DVec3::new(1.0, 0.5, 2.0);
const INTEGRALS: usize = 60;

fn value(k: usize) -> f64 {
    1.0 + k as f64 / INTEGRALS as f64
}

impl Problem for Noise {
    /// The standard deviation of one sample.
    type Settings = f64;
    type Workspace = ();

    fn integrals(&self) -> usize {
        INTEGRALS
    }

    fn estimate(&self, sigma: &f64, n: u32, seed: u64, k: usize, (): &mut ()) -> DVec3 {
        let mut random = Pcg64Mcg::seed_from_u64(seed ^ (self.key << 32) ^ (k as u64) << 16);
        let (u, v): (f64, f64) = (random.random(), random.random());
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos();
        COLOUR * (value(k) + sigma * normal / f64::from(n).sqrt())
    }
}

fn method(trials: u32, settings: f64) -> Method<f64> {
    Method {
        estimator: "noise".to_owned(),
        sampler: "independent".to_owned(),
        trials,
        settings,
    }
}

/// Standard deviations of one sample, in a study and in its reference: over 4 samples and over 4
/// replicates of 256 both means have the same variance, 0.0025.
const SIGMA: f64 = 0.1;
const REFERENCE_SIGMA: f64 = 1.6;
const VARIANCE: f64 = SIGMA * SIGMA / 4.0;

/// Runs a study with this many trials of a method with this standard deviation.
fn study(key: u64, trials: u32, sigma: f64) -> Results {
    let design = Design {
        reference_rounds: 1,
        cell_seconds: 0.0,
        ..Design::new(vec![method(trials, sigma)], vec![4])
    };
    measure(Job {
        problem: &Noise { key },
        truth: &Truth::Computed(method(4, REFERENCE_SIGMA)),
        design: &design,
    })
}

/// Returns the mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (square / (n * (n - 1.0))).sqrt())
}

const STUDIES: u64 = 400;

/// The mean over many studies is the true error, without the error of the reference.
#[test]
fn the_references_own_error_is_taken_off() {
    let studies: Vec<Results> = (0..STUDIES).map(|key| study(key, 8, SIGMA)).collect();
    let score = |of: fn(&Results) -> f64| mean(&studies.iter().map(of).collect::<Vec<f64>>());
    let colour = COLOUR.length_squared() / 3.0;
    let relative = |k| VARIANCE / f64::powi(value(k), 2);
    let mrse = (0..INTEGRALS).map(relative).sum::<f64>() / INTEGRALS as f64;
    // 4.5 standard errors of the mean of 400: α ≈ 7e-6. What the MRSE is wrong by, s² over the
    // square of the value, is 0.0025 of it at most, and a standard error 0.01 of it.
    let (got, error) = score(|r| r.cells[0].score.mse);
    let want = colour * VARIANCE;
    assert!((got - want).abs() < 4.5 * error, "{got} ± {error}, {want}");
    let (got, error) = score(|r| r.cells[0].score.mrse);
    assert!((got - mrse).abs() < 4.5 * error, "{got} ± {error}, {mrse}");
    // The reference's error is as large as the measured one, and would be noticed.
    let (own, _) = score(|r| r.reference.mse);
    assert!(own > 0.9 * want && own > 20.0 * error, "{own}");
}

/// The standard error covers all of the error: mean errors divided by it have variance one.
#[test]
fn the_standard_error_knows_of_the_reference() {
    // With 64 trials, a fifth of it comes from the spread over trials, so that the t-distribution
    // of that, of variance 63/61, does not show.
    let z = |key| {
        let score = &study(key, 64, SIGMA).cells[0].score;
        let want = COLOUR.length_squared() / 3.0 * VARIANCE;
        let trials = mean(&score.trial_mse).1;
        let error = score.mse - want;
        [error / score.mse_stderr, error / trials].map(|z| z * z)
    };
    let squares: Vec<[f64; 2]> = (0..STUDIES).map(z).collect();
    let mean = |k: usize| squares.iter().map(|s| s[k]).sum::<f64>() / STUDIES as f64;
    // The mean of 400 χ²₁ has a standard error of √(2/400) = 0.071; 4.5 of them: α ≈ 7e-6.
    assert!((mean(0) - 1.0).abs() < 4.5 * 0.071, "{}", mean(0));
    // The spread over trials does not include the error that all trials share.
    assert!(mean(1) > 4.0, "{}", mean(1));
}

/// Biases divided by their standard errors have variance one. This also holds for a method without
/// noise, which differs from the reference only by the reference's error.
#[test]
fn the_standard_error_of_a_bias_knows_of_the_reference() {
    for (sigma, trials) in [(0.0, 8), (SIGMA, 64)] {
        let z = |key| {
            let score = &study(key, trials, sigma).cells[0].score;
            score.bias / score.bias_stderr
        };
        let squares: Vec<f64> = (0..STUDIES).map(|key| z(key).powi(2)).collect();
        // The mean of 400 χ²₁ has a standard error of √(2/400) = 0.071; 4.5 of them: α ≈ 7e-6.
        // Replicates know the error of the reference with 60 · 3 degrees of freedom, the trials
        // their own with 63: a variance of at most 63/61 in place of 1 does not show.
        let got = mean(&squares).0;
        assert!((got - 1.0).abs() < 4.5 * 0.071, "{sigma}: {got}");
    }
}

/// Two closed forms differ by rounding, which does not count as a bias of many standard errors.
#[test]
fn rounding_is_no_bias() {
    let problem = Noise { key: 1 };
    let last_digit = |k| COLOUR * (value(k) * (1.0 + f64::EPSILON));
    let design = Design {
        cell_seconds: 0.0,
        ..Design::new(vec![method(4, 0.0)], vec![1])
    };
    let results = measure(Job {
        problem: &problem,
        truth: &Truth::Known((0..INTEGRALS).map(last_digit).collect()),
        design: &design,
    });
    let score = &results.cells[0].score;
    assert!(score.variance <= 0.0 && score.bias < 0.0);
    let z = score.bias / score.bias_stderr;
    assert!(z.abs() < 1e-3, "{z}");
}

/// An error far below the reference's is reported as 0, and its standard error bounds it.
#[test]
fn what_the_reference_cannot_tell_is_zero() {
    let tiny = |key| {
        let results = study(key, 4, 1e-3);
        let score = &results.cells[0].score;
        assert!(score.mse >= 0.0 && score.mrse >= 0.0);
        // √(2 · 4/5 · 60) · 0.0025 / 60 of the square of a colour, if s⁴ is what it is on average.
        let share = score.mse_stderr / results.reference.mse;
        assert!(share > 0.08 && share < 0.5, "{share}");
        score.mse <= 0.0
    };
    let zeros = (0..100).filter(|key| tiny(*key)).count();
    // About every other one (a little more: χ² leans to small values): 50 ± 5; five of those.
    assert!((25..=80).contains(&zeros), "{zeros}");
}
