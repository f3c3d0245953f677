//! This bench measures nanoseconds per weight.

use criterion::{Criterion, criterion_group, criterion_main};
use linelit_mis::smoothing::{smoothed_balance, visible_interval};
use linelit_mis::{
    OptimalSystem, balance, balance_density, clamped_optimal, optimal_contribution, power,
};
use std::hint::black_box;

fn weights(c: &mut Criterion) {
    let (ns, ps) = ([3.0, 1.0], [0.7, 2.3]);
    let (ns4, ps4) = ([3.0, 1.0, 2.0, 2.0], [0.7, 2.3, 0.0, 11.0]);
    c.bench_function("balance of 2", |b| {
        b.iter(|| balance(&ns, black_box(&ps), 0))
    });
    c.bench_function("balance of 4", |b| {
        b.iter(|| balance(&ns4, black_box(&ps4), 0))
    });
    c.bench_function("balance density of 2", |b| {
        b.iter(|| balance_density(&ns, black_box(&ps)))
    });
    c.bench_function("power 2 of 2", |b| {
        b.iter(|| power(&ns, black_box(&ps), 2.0, 0))
    });
    c.bench_function("power 1.5 of 2", |b| {
        b.iter(|| power(&ns, black_box(&ps), 1.5, 0))
    });
    c.bench_function("clamped optimal of 2", |b| {
        b.iter(|| clamped_optimal(&[1.0, 0.4], &ns, black_box(&ps), 0.5, 0))
    });
    c.bench_function("optimal contribution of 2", |b| {
        b.iter(|| optimal_contribution(&[1.0, 0.4], &ns, black_box(&ps), 1.0, 0));
    });
    c.bench_function("smoothed balance of 2", |b| {
        b.iter(|| {
            let factor = visible_interval(black_box(0.3), 0.2, 0.9, 0.2, 0.1, 0.5);
            smoothed_balance(&ns, black_box(&ps), &[factor, 1.0], 0)
        });
    });
    let mut system = OptimalSystem::<4, 3>::new();
    for i in 1..50 {
        let x = 0.02 * f64::from(i);
        system.add(
            &ns4,
            &[1.0, 2.0 * x, 3.0 * x * x, 2.0 - 2.0 * x],
            [x, 1.0, x * x],
        );
    }
    c.bench_function("optimal α of 4, 3 channels", |b| {
        b.iter(|| black_box(&system).alphas())
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(100))
        .measurement_time(std::time::Duration::from_millis(300)).sample_size(20);
    targets = weights
}
criterion_main!(benches);
