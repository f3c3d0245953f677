//! Error against time on one thread: which estimator reaches an error first.
#![allow(clippy::disallowed_methods, reason = "compares times")]

use super::Problem;
use crate::stats::least;
use crate::stats::metrics::MRSE_EPSILON;
use linelit_geometry::DVec3;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;
use std::time::Instant;

/// The most integrals that are timed together: so many that the clock takes no time.
const CHUNK: usize = 16;

/// Samples that are timed together at most, but for those of one integral: so few that the system
/// seldom interrupts them.
const TOGETHER: u32 = 256;

/// One estimator at one number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Samples of an estimate.
    pub samples: u32,
    /// Microseconds per integral, undisturbed.
    pub time: f64,
    /// Mean squared error over integrals, channels and rounds, divided by the mean square of the
    /// reference.
    pub mse: f64,
    /// Mean over integrals, channels and rounds of the squared error divided by the square of the
    /// reference there and [`MRSE_EPSILON`].
    pub mrse: f64,
}

/// An estimator's error over time.
#[derive(Clone, Debug)]
pub struct Curve<S> {
    /// The estimator.
    pub settings: S,
    /// The measurements of the method, in ascending order of samples.
    pub points: Vec<Point>,
}

impl<S> Curve<S> {
    /// The time to a given error: between two points along the straight line in logarithms; `None`
    /// if no point reaches it. Towards a point without error but rounding nothing is interpolated.
    #[must_use]
    pub fn time_to(&self, mse: f64) -> Option<f64> {
        least(self.points.iter().map(|p| [p.mse, p.time]), mse)
    }
}

/// The estimators of a contest, and the values that they are held to.
#[derive(Clone, Debug)]
pub struct Contest<S> {
    /// Estimators and the numbers of samples each is run with.
    pub entries: Vec<(S, Vec<u32>)>,
    /// Number of rounds. The time of a chunk is the least of all rounds, the error their mean.
    pub rounds: u32,
    /// The integrals' values, which errors are measured by.
    pub truth: Vec<DVec3>,
}

/// One estimator and number of samples while it is measured.
struct Lane<'a, S> {
    settings: &'a S,
    samples: u32,
    least: Vec<f64>,
    square: f64,
    relative: f64,
}

/// Runs all entries in alternation on this thread.
///
/// # Panics
/// If the known values are not one for each integral.
#[must_use]
pub fn contest<P: Problem>(problem: &P, what: &Contest<P::Settings>) -> Vec<Curve<P::Settings>> {
    assert_eq!(
        what.truth.len(),
        problem.integrals(),
        "a value per integral"
    );
    let mut workspace = P::Workspace::default();
    let mut lanes = Vec::new();
    for (settings, samples) in &what.entries {
        lanes.extend(samples.iter().map(|&samples| Lane {
            settings,
            samples,
            least: vec![f64::INFINITY; problem.integrals().div_ceil(chunk(samples))],
            square: 0.0,
            relative: 0.0,
        }));
    }
    for round in 0..u64::from(what.rounds) {
        // In another order each time, lest what follows a long lane of another estimator always
        // find the caches full of that.
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

/// Number of integrals that are timed together.
fn chunk(samples: u32) -> usize {
    ((TOGETHER / samples.max(1)) as usize).clamp(1, CHUNK)
}

/// Estimates all integrals once, timing each chunk.
fn run<P: Problem>(
    problem: &P,
    lane: &mut Lane<'_, P::Settings>,
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
        // An estimator without error takes its time, whatever is asked.
        let exact = curve(&[(3.0, 1e-24)]);
        assert!(near(exact.time_to(1e-2), 3.0));
        assert!(near(exact.time_to(1e-20), 3.0));
    }
}
