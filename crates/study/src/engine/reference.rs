//! The reference that estimates are scored against, and how wrong it is itself.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::{Cell, CellRun, Targets, run_cell};
use linelit_estimators::{LineBy, Points};
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, ShadingPoint};
use linelit_samplers::SamplerKind;
use std::time::{Duration, Instant};

/// The seed of references is far from that of any trial.
const REFERENCE_SEED: u64 = 0x5EED_0F7E_FE7E_4CE5;
/// Independent replicates in one round.
const ROUND: u32 = 4;

/// Reference radiance of each shading point.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The mean over all replicates, per point.
    pub values: Vec<DVec3>,
    /// Mean squared error of `values`, from the spread of the replicates: the average over points
    /// and channels, over all pixels.
    pub mse: f64,
    /// The estimator.
    pub estimator: Estimator,
    /// Samples in each replicate.
    pub samples: u32,
    /// Replicates.
    pub replicates: u32,
}

impl Reference {
    /// Zero everywhere: for scores that need no reference.
    #[must_use]
    pub fn black(points: usize) -> Self {
        Self {
            values: vec![DVec3::ZERO; points],
            mse: 0.0,
            estimator: Estimator::analytic(),
            samples: 0,
            replicates: 0,
        }
    }
}

/// Line samples, `samples` to a replicate, until the error of their mean
/// is below `target` or `limit` has passed. At least one round is run.
#[must_use]
pub fn reference(
    renderer: &Renderer<'_>,
    targets: &Targets,
    samples: u32,
    target: f64,
    limit: Duration,
) -> Reference {
    let start = Instant::now();
    let estimator = estimator(targets);
    let mut rounds: Vec<CellRun> = Vec::new();
    loop {
        let seed = REFERENCE_SEED.wrapping_add(rounds.len() as u64 * 0x0123_4567_89AB_CDEF);
        let settings = Settings {
            estimator,
            sampler: SamplerKind::Stratified,
            samples,
            seed,
            ..Settings::default()
        };
        rounds.push(run_cell(
            renderer,
            targets,
            Cell {
                settings,
                trials: ROUND,
            },
        ));
        let reference = merge(&rounds, targets, (estimator, samples));
        if reference.mse <= target || start.elapsed() > limit {
            return reference;
        }
    }
}

/// Closed forms along lines where every material has them, else lines and BSDF samples combined.
fn estimator(targets: &Targets) -> Estimator {
    let closed = |(_, point): &([u32; 2], ShadingPoint)| point.has_closed_form();
    if targets.points.iter().all(closed) {
        return Estimator::analytic();
    }
    Estimator::lines(LineBy::SolidAngle).with(Points::bsdf())
}

fn merge(
    rounds: &[CellRun],
    targets: &Targets,
    (estimator, samples): (Estimator, u32),
) -> Reference {
    let replicates = ROUND * u32::try_from(rounds.len()).unwrap_or(u32::MAX);
    let r = f64::from(replicates);
    let mut values = Vec::with_capacity(targets.points.len());
    let mut total = 0.0;
    for point in 0..targets.points.len() {
        let all = || rounds.iter().flat_map(|run| run.trials_of(point));
        let mean = all().copied().sum::<DVec3>() / r;
        let square: f64 = all().map(|v| (*v - mean).length_squared()).sum();
        total += square / (3.0 * (r - 1.0) * r);
        values.push(mean);
    }
    #[allow(clippy::cast_precision_loss, reason = "pixels fit 53 bits")]
    let pixels = targets.pixels.max(1) as f64;
    Reference {
        values,
        mse: total / pixels,
        estimator,
        samples,
        replicates,
    }
}
