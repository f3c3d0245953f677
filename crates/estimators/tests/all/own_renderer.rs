//! A renderer of one's own: its own BSDF, lights and triangles, no scene and no files.
//!
//! What the same room is in a scene file, `crates/integrator/tests/all/own_renderer.rs` holds to
//! this.

use crate::renderer::radiance;
use linelit_geometry::DVec3;
use linelit_testkit::{chi2::sidak, ztest::critical_z};

const ESTIMATORS: [&str; 5] = [
    "point-area",
    "line-area",
    "exact",
    "hybrid",
    "line-solid-angle+point-bsdf",
];

/// Seeds of each estimate.
const TRIALS: u64 = 256;

/// The mean over seeds, and the square of its standard error.
fn mean(x: DVec3, estimator: &str) -> (DVec3, DVec3) {
    let values: Vec<DVec3> = (0..TRIALS)
        .map(|seed| radiance(x, estimator, 64, seed))
        .collect();
    let mean = values.iter().sum::<DVec3>() / TRIALS as f64;
    let square = |v: &DVec3| (*v - mean) * (*v - mean);
    let variance = values.iter().map(square).sum::<DVec3>() / (TRIALS - 1) as f64;
    (mean, variance / TRIALS as f64)
}

/// Every estimator gives the same light though the BSDF has no closed form: a z test over points,
/// estimators and channels at α = 0.01.
#[test]
fn estimators_agree_without_closed_forms() {
    let points = [DVec3::ZERO, DVec3::new(0.6, -0.2, 0.0)];
    let bound = critical_z(sidak(0.01, points.len() * ESTIMATORS.len() * 3));
    for x in points {
        let (want, expected) = mean(x, "point-solid-angle");
        assert!(want.min_element() > 0.01, "{want}");
        for estimator in ESTIMATORS {
            let (got, variance) = mean(x, estimator);
            let error = (variance + expected).map(f64::sqrt);
            let z = ((got - want) / error).abs().max_element();
            assert!(z < bound, "{estimator}: {got} for {want}, z {z}");
        }
    }
}
