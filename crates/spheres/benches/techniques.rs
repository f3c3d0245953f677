//! Nanoseconds per light and per sample of every technique.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use linelit_geometry::DVec3;
use linelit_lights::{Disk, PointTechnique, Sphere};
use linelit_spheres::{DiskArea, DiskCone, SphereCap, SphereCone, SphereProjected};
use linelit_testkit::rng::{golden_numbers, receivers};
use std::hint::black_box;
use std::time::Duration;

/// Shading points; a bench runs through them in turn.
const POINTS: usize = 256;

/// A light as the papers count it, set-up and one sample, and a sample alone.
fn technique<T: PointTechnique>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3, DVec3) -> Option<T>,
) {
    let points: Vec<(DVec3, DVec3)> = receivers(POINTS)
        .into_iter()
        .map(|(x, n)| (x.into(), n.into()))
        .collect();
    let u = golden_numbers(POINTS);
    let numbers = |i: usize| [black_box(u[i]), u[POINTS - 1 - i]];
    g.throughput(Throughput::Elements(POINTS as u64));
    g.bench_function(format!("{name}/light"), |b| {
        b.iter(|| {
            for (i, &(x, n)) in points.iter().enumerate() {
                let ready = new(black_box(x), black_box(n));
                black_box(ready.as_ref().map(|s| s.sample(numbers(i))));
            }
        });
    });
    let ready: Vec<T> = points.iter().filter_map(|&(x, n)| new(x, n)).collect();
    g.throughput(Throughput::Elements(ready.len() as u64));
    g.bench_function(format!("{name}/sample"), |b| {
        b.iter(|| {
            for (i, s) in ready.iter().enumerate() {
                black_box(s.sample(numbers(i)));
            }
        });
    });
}

fn round(c: &mut Criterion) {
    let mut g = c.benchmark_group("round");
    let disk = Disk {
        center: DVec3::Z,
        normal: DVec3::Z,
        radius: 0.5,
    };
    technique(&mut g, "disk by area", |_, _| Some(DiskArea::new(&disk)));
    technique(&mut g, "disk by solid angle", |x, _| {
        Some(DiskCone::new(&disk, x))
    });
    let sphere = Sphere {
        center: DVec3::new(0.0, 0.0, 2.0),
        radius: 0.5,
    };
    technique(&mut g, "sphere by area", |_, _| {
        Some(SphereCap::whole(&sphere))
    });
    technique(&mut g, "sphere by visible area", |x, _| {
        Some(SphereCap::visible(&sphere, x))
    });
    technique(&mut g, "sphere by solid angle", |x, _| {
        Some(SphereCone::new(&sphere, x))
    });
    technique(&mut g, "sphere by projected solid angle", |x, n| {
        SphereProjected::new(&sphere, x, n)
    });
    g.finish();
}

fn short() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .sample_size(20)
}

criterion_group! { name = benches; config = short(); targets = round }
criterion_main!(benches);
