//! Rays and shafts on the built-in soup and grid: ordinary points, grazing points, no occluder.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use linelit_geometry::DVec3;
use linelit_visibility::{
    LightCorners, Occluders, Scratch, VisibleLines,
    measure::{self, Workload},
};
use std::hint::black_box;

fn lines(c: &mut Criterion) {
    for scene in [measure::soup(), measure::grid()] {
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let empty = Occluders::build(&[], &[]);
        let points = measure::shading_points(&occluders, &scene.view(16, 12), 2e-5);
        let grazing: Vec<DVec3> = scene.lights[0]
            .1
            .iter()
            .map(|v| *v + DVec3::new(1.0, -1e-3, 0.5))
            .collect();
        for (name, light) in &scene.lights {
            let mut group = c.benchmark_group(format!("{} {name}", scene.name));
            for (what, occluders, points) in [
                ("ordinary", &occluders, &points),
                ("grazing", &occluders, &grazing),
                ("empty", &empty, &points),
            ] {
                let work = Workload {
                    positions: &scene.positions,
                    triangles: &scene.triangles,
                    light: LightCorners::new(light).unwrap(),
                    exclude: 0..0,
                    points,
                };
                for n in [1, 16, 64] {
                    let lines = measure::stratified_lines(light, n, &mut || 0.37);
                    let mut scratch = Scratch::new();
                    let mut out = VisibleLines::new();
                    group.bench_function(BenchmarkId::new(what, n), |b| {
                        b.iter(|| {
                            black_box(measure::trace_lines(
                                occluders,
                                &work,
                                &lines,
                                &mut scratch,
                                &mut out,
                            ))
                        });
                    });
                }
            }
            group.finish();
        }
    }
}

criterion_group!(benches, lines);
criterion_main!(benches);
