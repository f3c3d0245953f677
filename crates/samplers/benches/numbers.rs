//! This bench measures nanoseconds per number, with the set-up of a set divided among its samples,
//! in the order in which an integrator draws them.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use linelit_samplers::hash::{mix, unit_f64};
use linelit_samplers::{Block, Sampler, SamplerKind};
use rand::Rng;
use rand_pcg::Pcg32;
use std::hint::black_box;

fn sets(c: &mut Criterion) {
    for (name, two_dimensional) in [("1d", false), ("2d", true)] {
        let mut group = c.benchmark_group(name);
        for kind in SamplerKind::ALL {
            for count in [1_u32, 16, 256, 4096] {
                let sampler = Sampler::new(kind, 1);
                group.throughput(Throughput::Elements(u64::from(count)));
                let mut pixel = 0;
                group.bench_function(BenchmarkId::new(kind.name(), count), |b| {
                    b.iter(|| {
                        pixel += 1;
                        let set = sampler.points([pixel, 3], 0, black_box(count));
                        if two_dimensional {
                            set.iter_2d().map(|[x, y]| x + y).sum::<f64>()
                        } else {
                            set.iter_1d().sum::<f64>()
                        }
                    });
                });
            }
        }
        group.finish();
    }
}

/// Points of a whole set side by side.
fn columns(c: &mut Criterion) {
    let mut group = c.benchmark_group("2d columns");
    for kind in SamplerKind::ALL {
        for count in [8_u32, 64] {
            let set = Sampler::new(kind, 1).points([3, 4], 0, count);
            let [mut x, mut y] = [0, 1].map(|_| vec![0.0; count as usize]);
            group.throughput(Throughput::Elements(u64::from(count)));
            group.bench_function(BenchmarkId::new(kind.name(), count), |b| {
                b.iter(|| {
                    black_box(&set).fill_2d(0, [&mut x, &mut y]);
                    black_box((&x, &y));
                });
            });
        }
    }
    group.finish();
}

/// One of the blocks of a pattern.
fn blocks(c: &mut Criterion) {
    let mut group = c.benchmark_group("2d blocks");
    for kind in SamplerKind::ALL {
        for (of, count) in [(64, 1), (60, 1), (4, 16)] {
            let sampler = Sampler::new(kind, 1);
            group.throughput(Throughput::Elements(u64::from(count)));
            let mut index = 0;
            group.bench_function(
                BenchmarkId::new(kind.name(), format!("{of} x {count}")),
                |b| {
                    b.iter(|| {
                        index += 1;
                        let set = sampler.block([3, 4], 0, black_box(count), Block::new(index, of));
                        let [mut x, mut y] = [[0.0; 16]; 2];
                        set.fill_2d(0, [&mut x[..count as usize], &mut y]);
                        black_box((x, y));
                    });
                },
            );
        }
    }
    group.finish();
}

/// What stood to choice for `independent` and `sobol` (docs/decisions/002-random-numbers.md).
fn refused(c: &mut Criterion) {
    let mut group = c.benchmark_group("2d, refused");
    for count in [16_u32, 256] {
        group.throughput(Throughput::Elements(u64::from(count)));
        let mut seed = 0;
        group.bench_function(BenchmarkId::new("rand_pcg, advanced", count), |b| {
            b.iter(|| {
                seed += 1;
                let nth = |i: u32| {
                    let mut rng = Pcg32::new(mix(seed), seed);
                    rng.advance(4 * u64::from(i));
                    unit_f64(rng.next_u64()) + unit_f64(rng.next_u64())
                };
                (0..black_box(count)).map(nth).sum::<f64>()
            });
        });
        let mut seed = 0;
        group.bench_function(BenchmarkId::new("sobol_burley", count), |b| {
            b.iter(|| {
                seed += 1;
                let nth = |i| [0, 1].map(|d| f64::from(sobol_burley::sample(i, d, seed)));
                (0..black_box(count))
                    .map(nth)
                    .map(|[x, y]| x + y)
                    .sum::<f64>()
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(100))
        .measurement_time(std::time::Duration::from_millis(300)).sample_size(20);
    targets = sets, columns, blocks, refused
}
criterion_main!(benches);
