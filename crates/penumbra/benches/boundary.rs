//! Measures the microseconds per boundary of the part of a square that random triangles leave
//! visible.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use linelit_penumbra::{Penumbra, Point};
use linelit_testkit::rng::SplitMix64;
use std::hint::black_box;
use std::time::Duration;

const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// Triangles at random positions, smaller if there are more, so that together they cover about a
/// quarter of the square.
fn triangles(count: u32, rng: &mut SplitMix64) -> Vec<[Point; 3]> {
    let size = f64::from(count).sqrt().recip();
    let mut triangle = || {
        let [x, y] = [0; 2].map(|_| rng.next_f64());
        [0; 3].map(|_| [x, y].map(|at| at + size * rng.in_range(-1.0, 1.0)))
    };
    (0..count).map(|_| triangle()).collect()
}

fn boundaries(c: &mut Criterion) {
    let mut group = c.benchmark_group("boundary");
    group.measurement_time(Duration::from_millis(600));
    let mut penumbra = Penumbra::default();
    for count in [4, 32, 128] {
        let mut rng = SplitMix64::new(count.into());
        let sets: Vec<_> = (0..64).map(|_| triangles(count, &mut rng)).collect();
        let mut sets = sets.iter().cycle();
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| {
                let set = sets.next().expect("they go on for ever");
                let edges = penumbra.boundary(black_box(&SQUARE), set.iter().copied());
                black_box(edges.len())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, boundaries);
criterion_main!(benches);
