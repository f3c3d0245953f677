//! This bench measures nanoseconds per choice of one light among many.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{AreaLight, Emission, Light};
use linelit_selection::{Discrete, LightTree, diffuse};
use linelit_testkit::rng::{golden_numbers, receivers};
use std::hint::black_box;
use std::time::Duration;

/// Shading points; a bench runs through them in turn.
const POINTS: usize = 256;

fn choice(c: &mut Criterion) {
    let mut g = c.benchmark_group("choice");
    for count in [100_u32, 1_000, 10_000, 100_000] {
        let lights: Vec<Light> = (0..count)
            .map(|i| {
                let at = |k: f64| (f64::from(i) * k).fract() * 10.0 - 5.0;
                let o = DVec3::new(at(0.618_034), at(0.754_877), 2.0 + 0.1 * at(0.569_84));
                let polygon = ConvexPolygon::parallelogram(o, 0.01 * DVec3::Y, 0.01 * DVec3::X)
                    .expect("a quad");
                Light::Area(AreaLight {
                    polygon,
                    emission: Emission::one_sided(DVec3::ONE),
                })
            })
            .collect();
        let points = receivers(POINTS);
        let u = golden_numbers(POINTS);
        g.throughput(Throughput::Elements(POINTS as u64));
        let tree = LightTree::new(&lights);
        g.bench_function(format!("tree/{count}"), |b| {
            b.iter(|| {
                for (i, &(x, n)) in points.iter().enumerate() {
                    let (x, n) = (x.into(), n.into());
                    black_box(tree.pick(|i| &lights[i], &diffuse(x, n), black_box(u[i])));
                }
            });
        });
        let table = Discrete::by_power(&lights).expect("power");
        g.bench_function(format!("power/{count}"), |b| {
            b.iter(|| {
                for &u in &u {
                    black_box(table.pick(black_box(u)));
                }
            });
        });
    }
    g.finish();
}

fn short() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .sample_size(20)
}

criterion_group! { name = benches; config = short(); targets = choice, choice }
criterion_main!(benches);
