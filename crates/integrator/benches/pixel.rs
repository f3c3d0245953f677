//! This bench measures the microseconds per pixel of a row through the middle of built-in scenes,
//! from the camera ray to the radiance.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use linelit_geometry::DVec3;
use linelit_integrator::{Renderer, Settings, Workspace};
use linelit_scenes::Library;
use std::hint::black_box;
use std::time::Duration;

/// The number of pixels across and down.
const SIDE: u32 = 64;

fn pixels(c: &mut Criterion) {
    for name in ["cornell-box-large", "triangle-soup-large"] {
        let mut scene = Library::default().load(name).expect("a scene").scene;
        scene.set_resolution(SIDE, SIDE);
        let renderer = Renderer::new(&scene);
        let mut group = c.benchmark_group(name);
        group.throughput(Throughput::Elements(SIDE.into()));
        for estimator in ["line-area", "exact", "hybrid", "point-area"] {
            for samples in [1, 16] {
                let settings = Settings {
                    estimator: estimator.parse().expect("an estimator"),
                    samples,
                    ..Settings::default()
                };
                let (mut row, mut workspace) = ([DVec3::ZERO; SIDE as usize], Workspace::new());
                renderer.row(&settings, [0, SIDE / 2], &mut row, &mut workspace);
                assert_ne!(row, [DVec3::ZERO; SIDE as usize], "the row is dark");
                group.bench_function(BenchmarkId::new(estimator, samples), |b| {
                    b.iter(|| {
                        let first = black_box([0, SIDE / 2]);
                        renderer.row(&settings, first, &mut row, &mut workspace);
                        black_box(&row);
                    });
                });
            }
        }
        group.finish();
    }
}

fn short() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .sample_size(20)
}

criterion_group! { name = benches; config = short(); targets = pixels }
criterion_main!(benches);
