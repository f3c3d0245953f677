//! This bench measures nanoseconds per light and per sample of every technique, one by one and
//! batched.
#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented items"
)]

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Segment};
use linelit_lights::linear::{
    LineView, LinearSample, LinearSampler, LinearTechnique, LtcSampler, ProjectedLine,
};
use linelit_lights::{
    AngularLines, AreaSampler, Disk, DiskArea, DiskCone, ImportanceImage, LineSampler,
    LineTechnique, LinearPointTechnique, OffsetDensity, PointColumns, PointSample, PointTechnique,
    ProxySampler, SolidAngleSampler, Sphere, SphereCap, SphereCone, SphereProjected, TexturedLines,
    TexturedSampler,
};
use linelit_testkit::rng::golden_numbers;
use std::hint::black_box;
use std::time::Duration;

/// Shading points; a bench runs through them in turn.
const POINTS: usize = 256;

fn receivers() -> Vec<(DVec3, DVec3)> {
    let all = linelit_testkit::rng::receivers(POINTS).into_iter();
    all.map(|(x, n)| (x.into(), n.into())).collect()
}

/// A light as the papers count it: set-up and one sample.
fn per_light<T, R>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3, DVec3) -> Option<T>,
    sample: impl Fn(&T, f64, f64) -> R,
) {
    let points = receivers();
    let u = golden_numbers(POINTS);
    g.throughput(Throughput::Elements(POINTS as u64));
    g.bench_function(format!("{name}/light"), |b| {
        b.iter(|| {
            for (i, &(x, n)) in points.iter().enumerate() {
                let ready = new(black_box(x), black_box(n));
                black_box(ready.as_ref().map(|s| sample(s, u[i], u[POINTS - 1 - i])));
            }
        });
    });
}

/// Both.
fn both<T, R>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3, DVec3) -> Option<T>,
    sample: impl Fn(&T, f64, f64) -> R,
) {
    per_light(g, name, &new, &sample);
    per_sample(g, name, &new, &sample);
}

fn per_sample<T, R>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3, DVec3) -> Option<T>,
    sample: impl Fn(&T, f64, f64) -> R,
) {
    let ready: Vec<T> = receivers()
        .into_iter()
        .filter_map(|(x, n)| new(x, n))
        .collect();
    let u = golden_numbers(POINTS);
    g.throughput(Throughput::Elements(ready.len() as u64));
    g.bench_function(format!("{name}/sample"), |b| {
        b.iter(|| {
            for (i, s) in ready.iter().enumerate() {
                black_box(sample(s, black_box(u[i]), u[POINTS - 1 - i]));
            }
        });
    });
}

/// A sample by two random numbers.
fn by_two<T: PointTechnique>(s: &T, u: f64, v: f64) -> PointSample<T::Measure> {
    s.sample([u, v])
}

/// Sixteen samples at once.
fn batch<T>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3, DVec3) -> Option<T>,
    fill: impl Fn(&T, &[f64], &mut [LinearSample]),
) {
    let points = receivers().into_iter();
    let ready: Vec<T> = points.filter_map(|(x, n)| new(x, n)).collect();
    let u = &golden_numbers(POINTS)[..16];
    g.throughput(Throughput::Elements(16 * ready.len() as u64));
    g.bench_function(format!("{name}/batch of 16"), |b| {
        let mut out = [LinearSample::default(); 16];
        b.iter(|| {
            for s in &ready {
                fill(s, black_box(u), &mut out);
                black_box(&out);
            }
        });
    });
}

/// Samples side by side, 64 at a time.
fn columns<T: PointTechnique>(
    g: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    new: impl Fn(DVec3) -> T,
) {
    let ready: Vec<T> = receivers().into_iter().map(|(x, _)| new(x)).collect();
    let all = golden_numbers(128);
    let (u, rest) = all.as_chunks::<8>().0.split_at(8);
    let [mut x, mut y, mut z, mut pdf] = [[[0.0; 8]; 8]; 4];
    g.throughput(Throughput::Elements(64 * ready.len() as u64));
    g.bench_function(format!("{name}/columns"), |b| {
        b.iter(|| {
            for s in &ready {
                let out = PointColumns {
                    point: [&mut x, &mut y, &mut z],
                    pdf: &mut pdf,
                };
                s.sample_into([black_box(u), rest], out);
                black_box((&x, &y, &z, &pdf));
            }
        });
    });
}

fn linear(c: &mut Criterion) {
    let mut g = c.benchmark_group("linear");
    let light = Segment::new(DVec3::new(-1.0, 0.2, 1.0), DVec3::new(1.5, -0.3, 1.3));
    for technique in LinearTechnique::ALL {
        let new = |x, n| LinearSampler::new(technique, &light, x, n);
        both(&mut g, technique.name(), new, |s, u, _| s.sample(u));
        batch(&mut g, technique.name(), new, LinearSampler::sample_into);
    }
    let m = DMat3::from_cols(
        DVec3::new(0.3, 0.0, 0.1),
        DVec3::new(0.0, 0.2, 0.0),
        DVec3::new(-0.4, 0.0, 1.0),
    );
    let ltc = |x, n| LtcSampler::new(&light, x, n, m);
    both(&mut g, "ltc", ltc, |s, u, _| s.sample(u));
    let coarse = |x: DVec3, n: DVec3| {
        LineView::with_edge(light.p0 - x, light.p1 - x, light.vector(), Some(n))
            .and_then(ProjectedLine::of)
    };
    both(
        &mut g,
        "projected-solid-angle to 1.6e-5",
        coarse,
        |s, u, _| s.sample_coarse(u),
    );
    g.finish();
}

fn polygon(c: &mut Criterion) {
    let mut g = c.benchmark_group("quad");
    let quad = ConvexPolygon::parallelogram(
        DVec3::new(-0.5, -0.5, 1.0),
        DVec3::X,
        DVec3::new(0.0, 1.0, 0.3),
    )
    .expect("a quad");
    columns(&mut g, "area", |_| AreaSampler::new(&quad));
    columns(&mut g, "solid angle", |x| SolidAngleSampler::new(&quad, x));
    let area = AreaSampler::new(&quad);
    per_sample(
        &mut g,
        "area",
        |_, _| Some(area),
        |s, u, v| s.sample([u, v]),
    );
    both(
        &mut g,
        "solid angle",
        |x, _| Some(SolidAngleSampler::new(&quad, x)),
        |s, u, v| s.sample([u, v]),
    );
    both(
        &mut g,
        "proxy",
        |x, _| Some(ProxySampler::new(&quad, x)),
        |s, u, v| s.sample([u, v]),
    );
    let whole = [linelit_geometry::intervals::Interval::UNIT];
    let projected = |x, n| Some(AngularLines::by_projected_solid_angle(&quad, 0.0, x, n));
    both(&mut g, "projected solid angle", projected, |s, u, v| {
        s.point(&s.sample(u), &whole, v)
    });
    let solid = |x, _| Some(AngularLines::by_solid_angle(&quad, 0.0, x));
    both(&mut g, "lines by solid angle", solid, |s, u, _| s.sample(u));
    let lines = LineSampler::new(&quad, 0.7, OffsetDensity::Length);
    per_sample(
        &mut g,
        "lines by length",
        |_, _| Some(lines),
        |s, u, _| s.sample(u),
    );
    let warped = |x, _| Some(AngularLines::by_warped_solid_angle(&quad, 0.0, x));
    both(&mut g, "lines by warped solid angle", warped, |s, u, _| {
        s.sample(u)
    });
    g.finish();
}

fn round(c: &mut Criterion) {
    let mut g = c.benchmark_group("round");
    let disk = Disk {
        center: DVec3::Z,
        normal: DVec3::Z,
        radius: 0.5,
    };
    both(
        &mut g,
        "disk by area",
        |_, _| Some(DiskArea::new(&disk)),
        by_two,
    );
    both(
        &mut g,
        "disk by solid angle",
        |x, _| Some(DiskCone::new(&disk, x)),
        by_two,
    );
    let sphere = Sphere {
        center: DVec3::new(0.0, 0.0, 2.0),
        radius: 0.5,
    };
    both(
        &mut g,
        "sphere by area",
        |_, _| Some(SphereCap::whole(&sphere)),
        by_two,
    );
    both(
        &mut g,
        "sphere by visible area",
        |x, _| Some(SphereCap::visible(&sphere, x)),
        by_two,
    );
    both(
        &mut g,
        "sphere by solid angle",
        |x, _| Some(SphereCone::new(&sphere, x)),
        by_two,
    );
    both(
        &mut g,
        "sphere by projected solid angle",
        |x, n| SphereProjected::new(&sphere, x, n),
        by_two,
    );
    g.finish();
}

/// Images of 256 × 256 pixels.
fn texture(c: &mut Criterion) {
    const SIZE: usize = 256;
    let mut g = c.benchmark_group("texture");
    let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).expect("a quad");
    let values: Vec<f64> = (0..SIZE * SIZE)
        .map(|i| (i as f64 * 0.618_033_988_75).fract())
        .collect();
    let image = ImportanceImage::new(SIZE, SIZE, &values).expect("not black");
    let points = TexturedSampler::new(&quad, &image).expect("a quad");
    per_sample(
        &mut g,
        "points",
        |_, _| Some(points),
        |s, u, v| s.sample([u, v]),
    );
    let whole = [linelit_geometry::intervals::Interval::UNIT];
    for (name, angle) in [("edge", 0.0), ("at 40 degrees", 0.7)] {
        let lines = TexturedLines::new(&quad, &image, angle).expect("a quad");
        let new = |_, _| Some(&lines);
        per_sample(&mut g, &format!("lines along {name}"), new, |s, u, _| {
            s.sample(u)
        });
        let name = format!("points on lines along {name}");
        per_sample(&mut g, &name, new, |s, u, v| {
            s.point(&s.sample(u), &whole, v)
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

criterion_group! { name = benches; config = short(); targets = linear, polygon, round, texture }
criterion_main!(benches);
