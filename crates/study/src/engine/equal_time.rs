//! Error against time on one thread: come here to find out which of several estimators reaches a
//! given error first.
#![allow(clippy::disallowed_methods, reason = "compares times")]

use super::Problem;
use crate::stats::least;
use crate::stats::metrics::MRSE_EPSILON;
use linelit_geometry::DVec3;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;
use std::time::Instant;

/// The largest number of integrals that are timed together, as a chunk. With this many, reading the
/// clock takes a negligible part of the time.
const CHUNK: usize = 16;

/// The largest number of samples, over all integrals of a chunk, that are timed together (unless a
/// single integral has more). Chunks are this short so that the operating system seldom interrupts
/// one.
const TOGETHER: u32 = 256;

/// The measured error and time of one estimator at one number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The number of samples of an estimate.
    pub samples: u32,
    /// The mean time of an integral in microseconds, by the fastest round of each chunk.
    pub time: f64,
    /// The squared error summed over channels and averaged over integrals and rounds, divided by
    /// the mean squared length of the true values.
    pub mse: f64,
    /// The mean, over integrals, channels and rounds, of the squared error divided by the sum of
    /// the squared true value and [`MRSE_EPSILON`].
    pub mrse: f64,
}

/// The error of an estimator as a function of its time.
#[derive(Clone, Debug)]
pub struct Curve<S> {
    /// The estimator.
    pub settings: S,
    /// The measurements, in ascending order of samples.
    pub points: Vec<Point>,
}

impl<S> Curve<S> {
    /// Returns the least time in microseconds in which the estimator reaches a mean squared error
    /// of `mse`, or `None` if it never does.
    ///
    /// Between two measurements the time is interpolated along a straight line in logarithms,
    /// unless the better of them has no error but rounding: then its own time is returned.
    #[must_use]
    pub fn time_to(&self, mse: f64) -> Option<f64> {
        least(self.points.iter().map(|p| [p.mse, p.time]), mse)
    }
}

/// The estimators to compare, and the true values that their errors are measured by.
#[derive(Clone, Debug)]
pub struct Contest<S> {
    /// The estimators, each with the numbers of samples that it is run with.
    pub entries: Vec<(S, Vec<u32>)>,
    /// The number of rounds. The time of a chunk of integrals is the least over all rounds, and the
    /// error is the mean over all rounds.
    pub rounds: u32,
    /// The true value of each integral.
    pub truth: Vec<DVec3>,
}

/// The running sums of an entry, which is one estimator at one number of samples, while the entry
/// is measured: the least time of each chunk, and the squared and relative squared errors.
struct EntrySums<'a, S> {
    settings: &'a S,
    samples: u32,
    least: Vec<f64>,
    square: f64,
    relative: f64,
}

/// Measures all entries in turns on the calling thread, and returns a curve for each.
///
/// # Panics
/// If there is not one true value for each integral.
#[must_use]
pub fn contest<P: Problem>(problem: &P, what: &Contest<P::Settings>) -> Vec<Curve<P::Settings>> {
    assert_eq!(
        what.truth.len(),
        problem.integrals(),
        "a value per integral"
    );
    // Make empty sums, called a lane here, for each estimator and each of its numbers of samples.
    let mut workspace = P::Workspace::default();
    let mut lanes = Vec::new();
    for (settings, samples) in &what.entries {
        lanes.extend(samples.iter().map(|&samples| EntrySums {
            settings,
            samples,
            least: vec![f64::INFINITY; problem.integrals().div_ceil(chunk(samples))],
            square: 0.0,
            relative: 0.0,
        }));
    }
    // Estimate all integrals by all lanes, round by round. The order of the lanes changes from
    // round to round, so that no lane always finds the caches as one particular other lane left
    // them.
    for round in 0..u64::from(what.rounds) {
        let mut order: Vec<usize> = (0..lanes.len()).collect();
        order.shuffle(&mut Pcg64Mcg::seed_from_u64(round));
        for k in order {
            let lane = &mut lanes[k];
            let values = run(problem, lane, round, &mut workspace);
            for (v, r) in values.iter().zip(&what.truth) {
                let square = (*v - *r) * (*v - *r);
                lane.square += square.element_sum();
                lane.relative += (square / (*r * *r + MRSE_EPSILON)).element_sum();
            }
        }
    }
    // Divide the sums, and hand the points back to the estimators that they belong to.
    let (count, rounds) = (problem.integrals() as f64, f64::from(what.rounds));
    let power: f64 = what.truth.iter().map(|v| v.length_squared()).sum();
    let mut points = lanes.into_iter().map(|lane| Point {
        samples: lane.samples,
        time: lane.least.iter().sum::<f64>() * 1e6 / count,
        mse: lane.square / (power.max(f64::MIN_POSITIVE) * rounds),
        mrse: lane.relative / (3.0 * count * rounds),
    });
    let mut curves = Vec::new();
    for (settings, samples) in &what.entries {
        curves.push(Curve {
            settings: settings.clone(),
            points: points.by_ref().take(samples.len()).collect(),
        });
    }
    curves
}

/// Returns the number of integrals that are timed together when each has this many samples.
fn chunk(samples: u32) -> usize {
    ((TOGETHER / samples.max(1)) as usize).clamp(1, CHUNK)
}

/// Estimates all integrals once, and lowers the least time of each chunk where this round was
/// faster.
fn run<P: Problem>(
    problem: &P,
    lane: &mut EntrySums<'_, P::Settings>,
    seed: u64,
    workspace: &mut P::Workspace,
) -> Vec<DVec3> {
    let mut values = Vec::with_capacity(problem.integrals());
    for least in &mut lane.least {
        let start = Instant::now();
        let end = (values.len() + chunk(lane.samples)).min(problem.integrals());
        for integral in values.len()..end {
            values.push(problem.estimate(lane.settings, lane.samples, seed, integral, workspace));
        }
        *least = least.min(start.elapsed().as_secs_f64());
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve<()> {
        let point = |&(time, mse): &(f64, f64)| Point {
            samples: 1,
            time,
            mse,
            mrse: mse,
        };
        Curve {
            settings: (),
            points: points.iter().map(point).collect(),
        }
    }

    #[test]
    fn times_to_errors_are_interpolated() {
        let c = curve(&[(1.0, 1e-2), (10.0, 1e-4)]);
        let near = |got: Option<f64>, want: f64| (got.unwrap() / want - 1.0).abs() < 1e-12;
        assert!(near(c.time_to(1e-3), 10f64.sqrt()));
        assert!(c.time_to(1e-5).is_none());
        // The time of an estimator without error does not depend on the error to reach.
        let exact = curve(&[(3.0, 1e-24)]);
        assert!(near(exact.time_to(1e-2), 3.0));
        assert!(near(exact.time_to(1e-20), 3.0));
    }
}
