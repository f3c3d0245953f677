//! This bench measures nanoseconds for each integral, for ordinary, grazing and degenerate input,
//! one by one and batched.
#![allow(
    missing_docs,
    reason = "criterion's macros make undocumented functions"
)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use linelit_geometry::{DVec3, Segment};
use linelit_shading::{batch, cylinder, phong, phong_polygon, polygon, ribbon, solid_angle};
use linelit_testkit::rng::SplitMix64;
use std::hint::black_box;

const COUNT: usize = 1024;

/// Segments over a floor (normal +z): as a light overhead shows them, near the horizon, or crossing
/// it and pointing at the shading point.
fn segments(kind: &str) -> Vec<Segment> {
    let mut rng = SplitMix64::new(11);
    let mut v = |a: f64, b: f64| rng.in_range(a, b);
    (0..COUNT)
        .map(|_| match kind {
            "ordinary" => {
                let p = DVec3::new(v(-2.0, 2.0), v(-2.0, 2.0), v(1.0, 3.0));
                Segment::new(p, p + DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), 0.0))
            }
            "grazing" => {
                let p = DVec3::new(v(1.0, 2.0), v(-2.0, 2.0), v(-1e-6, 1e-6));
                Segment::new(p, p + DVec3::new(0.0, v(-1.0, 1.0), v(-1e-6, 1e-6)))
            }
            _ => {
                let p = DVec3::new(v(-1.0, 1.0), v(-1.0, 1.0), v(0.0, 1.0));
                Segment::new(p, p * v(-3.0, 3.0) + DVec3::new(v(-1e-9, 1e-9), 0.0, 0.0))
            }
        })
        .collect()
}

fn lines(c: &mut Criterion) {
    let n = DVec3::Z;
    let axis = DVec3::new(0.2, 0.1, 0.9).normalize();
    for kind in ["ordinary", "grazing", "degenerate"] {
        let input = segments(kind);
        let mut group = c.benchmark_group(format!("line/{kind}"));
        group
            .throughput(Throughput::Elements(COUNT as u64))
            .sample_size(30);
        let mut scalar = |name: &str, f: &dyn Fn(&Segment) -> f64| {
            group.bench_function(name, |b| {
                b.iter(|| black_box(&input).iter().map(f).sum::<f64>())
            });
        };
        scalar("cylinder", &|s| cylinder::irradiance(s.p0, s.p1, n));
        for k in [10.0, 1e3, 1e5] {
            scalar(&format!("phong/{k}"), &|s| {
                phong::ribbon(s.p0, s.p1, n, axis, k)
            });
        }
        group.bench_function("ribbon", |b| {
            b.iter(|| {
                black_box(&input)
                    .iter()
                    .map(|s| ribbon::line_integral(s.p0, s.p1, n))
                    .sum::<f64>()
            });
        });
        let mut out = vec![0.0; COUNT];
        group.bench_function("ribbon/batch", |b| {
            b.iter(|| batch::ribbons(black_box(&input), n, black_box(&mut out)));
        });
        group.finish();
    }
}

fn polygons(c: &mut Criterion) {
    let mut group = c.benchmark_group("polygon");
    let axis = DVec3::new(0.2, 0.1, 0.9).normalize();
    for (name, half, height) in [("near", 1.0, 1.0), ("far", 0.01, 3.0), ("cut", 2.0, 0.0)] {
        let turn = if height > 0.0 { DVec3::Y } else { DVec3::Z };
        let quad = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::X * (half * x) + turn * (half * y) + DVec3::new(0.3, 0.8, height));
        group.bench_with_input(BenchmarkId::new("lambert", name), &quad, |b, q| {
            b.iter(|| polygon::irradiance(black_box(q), DVec3::Z));
        });
        group.bench_with_input(BenchmarkId::new("solid_angle", name), &quad, |b, q| {
            b.iter(|| solid_angle::polygon(black_box(q)));
        });
        for k in [10.0, 200.0, 5000.0] {
            let phong = BenchmarkId::new(format!("phong {k}"), name);
            group.bench_with_input(phong, &quad, |b, q| {
                b.iter(|| phong_polygon::irradiance(black_box(q), DVec3::Z, axis, k));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, lines, polygons);
criterion_main!(benches);
