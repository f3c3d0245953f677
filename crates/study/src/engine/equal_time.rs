//! Error against time on one thread: which estimator reaches an error first.
#![allow(clippy::disallowed_methods, reason = "compares times")]

use super::Targets;
use crate::stats::metrics::MRSE_EPSILON;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, ShadingPoint, Workspace};
use linelit_samplers::SamplerKind;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64Mcg;
use std::time::Instant;

/// The most shading points that are timed together: so many that the clock takes no time.
const CHUNK: usize = 16;

/// Samples that are timed together at most, but for those of one shading point: so few that the
/// system seldom interrupts them.
const TOGETHER: u32 = 256;

/// The seed of the reference is far from that of any round.
const REFERENCE_SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;

/// Below this relative mean squared error there is only rounding.
const NO_ERROR: f64 = 1e-18;

/// One estimator at one number of samples.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Light samples per shading point and light.
    pub samples: u32,
    /// Microseconds per shading point, undisturbed.
    pub time: f64,
    /// Mean squared error over points, channels and rounds, divided by the mean square of the
    /// reference.
    pub mse: f64,
    /// Mean over points, channels and rounds of the squared error divided by the square of the
    /// reference there and [`MRSE_EPSILON`].
    pub mrse: f64,
}

/// An estimator's error over time.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The estimator.
    pub estimator: Estimator,
    /// In ascending order of samples.
    pub points: Vec<Point>,
}

impl Curve {
    /// The error at a given time: between two points along the straight line in logarithms; the
    /// last point's beyond all of them, `None` before the first. Towards a point without error
    /// (`NO_ERROR`) nothing is interpolated.
    #[must_use]
    pub fn error_at(&self, time: f64) -> Option<f64> {
        self.points.first().filter(|p| p.time <= time)?;
        let within = self
            .points
            .windows(2)
            .filter(|w| w[0].time <= time && time < w[1].time && w[1].mse > NO_ERROR)
            .map(|w| between((w[0].time, w[0].mse), (w[1].time, w[1].mse), time));
        let passed = self.points.iter().filter(|p| p.time <= time).map(|p| p.mse);
        within.chain(passed).reduce(f64::min)
    }

    /// The time to a given error; `None` if no point reaches it.
    #[must_use]
    pub fn time_to(&self, mse: f64) -> Option<f64> {
        let within = self
            .points
            .windows(2)
            .filter(|w| w[0].mse > mse && mse >= w[1].mse && w[0].time < w[1].time)
            .filter(|w| w[1].mse > NO_ERROR)
            .map(|w| between((w[0].mse, w[0].time), (w[1].mse, w[1].time), mse));
        let reached = self.points.iter().filter(|p| p.mse <= mse).map(|p| p.time);
        within.chain(reached).reduce(f64::min)
    }
}

/// y at x on the straight line in logarithms through two points.
fn between((x0, y0): (f64, f64), (x1, y1): (f64, f64), x: f64) -> f64 {
    let tiny = 1e-60;
    let [x0, y0, x1, y1, x] = [x0, y0, x1, y1, x].map(|v| v.max(tiny).ln());
    (y0 + (y1 - y0) * (x - x0) / (x1 - x0)).exp()
}

/// What is measured.
#[derive(Clone, Debug)]
pub struct Contest {
    /// Estimators and the numbers of samples each is run with.
    pub entries: Vec<(Estimator, Vec<u32>)>,
    /// How often each is run: the time of a chunk is the least of all rounds, the error the mean.
    pub rounds: u32,
    /// What errors are measured by.
    pub truth: Truth,
}

/// What errors are measured by.
#[derive(Clone, Debug)]
pub enum Truth {
    /// `exact` where nothing is sampled; elsewhere the mean of so many trials (the second number)
    /// of so many lines (the first).
    Computed(u32, u32),
    /// One value a point.
    Given(Vec<DVec3>),
}

/// One estimator and number of samples while it is measured.
struct Lane {
    settings: Settings,
    least: Vec<f64>,
    square: f64,
    relative: f64,
}

/// Runs all entries in alternation on this thread; the set-up of the scene is not timed.
#[must_use]
pub fn contest(renderer: &Renderer<'_>, targets: &Targets, what: &Contest) -> Vec<Curve> {
    let mut workspace = Workspace::new();
    let points = &targets.points;
    let reference = match &what.truth {
        Truth::Computed(lines, trials) => {
            computed(renderer, points, (*lines, *trials), &mut workspace)
        }
        Truth::Given(values) => values.clone(),
    };
    let power: f64 = reference.iter().map(|v| v.length_squared()).sum();
    let mut lanes: Vec<Lane> = Vec::new();
    for (estimator, samples) in &what.entries {
        lanes.extend(samples.iter().map(|&samples| Lane {
            settings: settings(*estimator, samples, 0),
            least: vec![f64::INFINITY; points.len().div_ceil(chunk(samples))],
            square: 0.0,
            relative: 0.0,
        }));
    }
    for round in 0..what.rounds {
        // In another order each time, lest what follows a long lane of another estimator always
        // find the caches full of that.
        let mut order: Vec<usize> = (0..lanes.len()).collect();
        order.shuffle(&mut Pcg64Mcg::seed_from_u64(u64::from(round)));
        for k in order {
            let lane = &mut lanes[k];
            lane.settings.seed = u64::from(round);
            let values = run(renderer, points, lane, &mut workspace);
            for (v, r) in values.iter().zip(&reference) {
                let square = (*v - *r) * (*v - *r);
                lane.square += square.element_sum();
                lane.relative += (square / (*r * *r + MRSE_EPSILON)).element_sum();
            }
        }
    }
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let count = points.len() as f64;
    let scale = power.max(f64::MIN_POSITIVE) * f64::from(what.rounds);
    let mut lanes = lanes.into_iter();
    let curve = |(estimator, samples): &(Estimator, Vec<u32>)| Curve {
        estimator: *estimator,
        points: lanes
            .by_ref()
            .take(samples.len())
            .map(|lane| Point {
                samples: lane.settings.samples,
                time: lane.least.iter().sum::<f64>() * 1e6 / count,
                mse: lane.square / scale,
                mrse: lane.relative / (3.0 * count * f64::from(what.rounds)),
            })
            .collect(),
    };
    what.entries.iter().map(curve).collect()
}

fn settings(estimator: Estimator, samples: u32, seed: u64) -> Settings {
    Settings {
        estimator,
        sampler: SamplerKind::Stratified,
        samples,
        seed,
        ..Settings::default()
    }
}

/// How many points are timed together.
fn chunk(samples: u32) -> usize {
    ((TOGETHER / samples.max(1)) as usize).clamp(1, CHUNK)
}

/// All points once, each chunk timed.
fn run(
    renderer: &Renderer<'_>,
    points: &[([u32; 2], ShadingPoint)],
    lane: &mut Lane,
    workspace: &mut Workspace,
) -> Vec<DVec3> {
    let mut values = Vec::with_capacity(points.len());
    let chunks = points.chunks(chunk(lane.settings.samples));
    for (chunk, least) in chunks.zip(&mut lane.least) {
        let start = Instant::now();
        for (pixel, point) in chunk {
            values.push(renderer.direct(&lane.settings, point, *pixel, 0, workspace));
        }
        *least = least.min(start.elapsed().as_secs_f64());
    }
    values
}

/// Exact where that is possible, else the mean over trials of many lines.
fn computed(
    renderer: &Renderer<'_>,
    points: &[([u32; 2], ShadingPoint)],
    (lines, trials): (u32, u32),
    workspace: &mut Workspace,
) -> Vec<DVec3> {
    let exact = Estimator::exact();
    let value = |(pixel, point): &([u32; 2], ShadingPoint)| {
        workspace.take_counts();
        let first = settings(exact, lines, REFERENCE_SEED);
        let mut sum = renderer.direct(&first, point, *pixel, 0, workspace);
        if workspace.take_counts().plan.exact_fallbacks == 0 {
            return sum;
        }
        for trial in 1..trials {
            let next = settings(exact, lines, REFERENCE_SEED + u64::from(trial));
            sum += renderer.direct(&next, point, *pixel, 0, workspace);
        }
        sum / f64::from(trials)
    };
    points.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let point = |&(time, mse): &(f64, f64)| Point {
            samples: 1,
            time,
            mse,
            mrse: mse,
        };
        Curve {
            estimator: Estimator::points(linelit_estimators::PointBy::Area),
            points: points.iter().map(point).collect(),
        }
    }

    #[test]
    fn curves_are_read_both_ways() {
        let c = curve(&[(1.0, 1e-2), (10.0, 1e-4)]);
        let near = |got: Option<f64>, want: f64| (got.unwrap() / want - 1.0).abs() < 1e-12;
        assert!(near(c.error_at(10f64.sqrt()), 1e-3));
        assert!(near(c.time_to(1e-3), 10f64.sqrt()));
        assert!(c.error_at(0.5).is_none());
        assert!(c.time_to(1e-5).is_none());
        assert!(near(c.error_at(100.0), 1e-4));
        // An estimator without error takes its time, whatever is asked.
        let exact = curve(&[(3.0, 1e-24)]);
        assert!(near(exact.time_to(1e-2), 3.0));
        assert!(near(exact.time_to(1e-20), 3.0));
    }
}
