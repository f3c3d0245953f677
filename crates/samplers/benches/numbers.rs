//! Nanoseconds per number: the set-up of a set shared among its samples, as an integrator would
//! draw them.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use linelit_samplers::{JointSobol, Sampler, SamplerKind};
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
    c.bench_function("joint sobol, 1 number", |b| {
        let set = JointSobol::new(1, [2, 3], 0);
        let mut i = 0_u16;
        b.iter(|| {
            i = i.wrapping_add(1);
            set.get(i, black_box(5))
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(100))
        .measurement_time(std::time::Duration::from_millis(300)).sample_size(20);
    targets = sets
}
criterion_main!(benches);
