//! This bench measures the microseconds per estimate of one polygon light on a diffuse floor, past
//! no triangles and past a dozen of them.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use linelit_estimators::bsdf::{Bsdf, Lambert};
use linelit_estimators::geometry::{ConvexPolygon, DVec3};
use linelit_estimators::lights::{AreaLight, Emission, Light};
use linelit_estimators::samplers::SamplerKind;
use linelit_estimators::visibility::Occluders;
use linelit_estimators::{Buffers, LightSource, Query, RandomNumbers, ShadingPoint, estimate};
use linelit_testkit::rng::SplitMix64;
use std::hint::black_box;
use std::time::Duration;

const ESTIMATORS: &str =
    "point-area line-area line-analytic exact hybrid line-solid-angle+point-bsdf";

/// Random triangles halfway between the origin and the light.
#[allow(clippy::cast_possible_truncation, reason = "corners are single")]
fn between(count: u32, rng: &mut SplitMix64) -> Occluders {
    let mut side = || rng.in_range(-0.3, 0.3) as f32;
    let vertices: Vec<_> = (0..3 * count).map(|_| [side(), side(), 1.0]).collect();
    let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Occluders::build(&vertices, &triangles)
}

fn estimates(c: &mut Criterion) {
    let corner = DVec3::new(-0.5, -0.5, 2.0);
    let polygon = ConvexPolygon::parallelogram(corner, DVec3::Y, DVec3::X).expect("a square");
    let emission = Emission::one_sided(DVec3::ONE);
    let light = Light::Area(AreaLight { polygon, emission });
    let albedo = DVec3::splat(0.5);
    let bsdf = Bsdf::Lambert(Lambert { albedo });
    let point = ShadingPoint::new(DVec3::ZERO, DVec3::Z, DVec3::Z, bsdf);
    let (source, mut buffers) = (LightSource::new(&light), Buffers::default());
    for triangles in [0, 12] {
        let occluders = between(triangles, &mut SplitMix64::new(1));
        let mut group = c.benchmark_group(format!("past {triangles} triangles"));
        group.measurement_time(Duration::from_millis(600));
        for (text, samples) in ESTIMATORS.split(' ').flat_map(|e| [(e, 1), (e, 16)]) {
            let estimator = text.parse().expect("an estimator");
            let numbers = RandomNumbers::new(SamplerKind::Sobol, 1, [0, 0], 0);
            let query = Query::new(&occluders, &source, &point, &estimator, numbers, samples);
            group.bench_function(BenchmarkId::new(text, samples), |b| {
                b.iter(|| black_box(estimate(black_box(&query), &mut buffers)));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, estimates);
criterion_main!(benches);
