//! Measures queries for lines and rays from shading points of built-in scenes: ordinary points,
//! grazing points, and points without occluders.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use linelit_geometry::{DVec3, Margins};
use linelit_scenes::{Library, VisibilityScene, stratified_lines};
use linelit_visibility::{
    AlphaMask, AlphaTexels, Fan, LightCorners, Occluders, Ray, Scratch, ShaftQuery, VisibleLines,
};
use std::{hint::black_box, sync::Arc};

/// Where the camera's rays hit the scene, offset from the surface towards the eye.
fn shading_points(occluders: &Occluders, scene: &VisibilityScene) -> Vec<DVec3> {
    let mut scratch = Scratch::new();
    let meet = |&[origin, direction]: &[DVec3; 2]| {
        let ray = Ray {
            origin,
            direction,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let hit = occluders.closest_hit(&ray, &mut scratch)?;
        Some(origin + direction * (hit.t - 2e-5))
    };
    scene.view(16, 12).iter().filter_map(meet).collect()
}

fn lines(c: &mut Criterion) {
    for name in [
        "triangle-soup-large",
        "grid-planes-large",
        "colonnade-large",
    ] {
        let scene = VisibilityScene::load(&Library::default(), name).unwrap();
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let empty = Occluders::build(&[], &[]);
        let points = shading_points(&occluders, &scene);
        let grazing: Vec<DVec3> = scene.lights[0]
            .1
            .iter()
            .map(|v| *v + DVec3::new(1.0, -1e-3, 0.5))
            .collect();
        for (light_name, light) in &scene.lights {
            let mut group = c.benchmark_group(format!("{name} {light_name}"));
            for (what, occluders, points) in [
                ("ordinary", &occluders, &points),
                ("grazing", &occluders, &grazing),
                ("empty", &empty, &points),
            ] {
                for n in [1, 16, 64] {
                    let lines = stratified_lines(light, n, &mut || 0.37);
                    let mut scratch = Scratch::new();
                    let mut out = VisibleLines::new();
                    group.bench_function(BenchmarkId::new(what, n), |b| {
                        b.iter(|| {
                            for &point in points {
                                let query =
                                    ShaftQuery::new(point, LightCorners::new(light).unwrap());
                                occluders
                                    .shaft(query, &mut scratch)
                                    .visible(&lines, &mut out);
                                black_box(&out);
                            }
                        });
                    });
                }
            }
            group.finish();
        }
    }
}

/// Measures rays towards a light, one by one and as fans of several sizes; and camera rays of
/// neighbours.
fn rays(c: &mut Criterion) {
    for name in [
        "cornell-box-large",
        "grid-planes-large",
        "triangle-soup-large",
        "colonnade-large",
    ] {
        let scene = VisibilityScene::load(&Library::default(), name).unwrap();
        let occluders = Occluders::build(&scene.positions, &scene.triangles);
        let points = shading_points(&occluders, &scene);
        let light = &scene.lights[0].1;
        let mut group = c.benchmark_group(format!("{name} rays"));
        for n in [1, 8, 16, 64] {
            let mut next = 0.0_f64;
            let mut random = || {
                next = (next + 0.618_033_988_749_895).fract();
                next
            };
            let lines = stratified_lines(light, n, &mut random);
            let targets: Vec<DVec3> = lines.iter().map(|line| line.at(random())).collect();
            let mut scratch = Scratch::new();
            group.bench_function(BenchmarkId::new("fan", n), |b| {
                b.iter(|| {
                    for &point in &points {
                        let to: Vec<DVec3> = targets.iter().map(|target| *target - point).collect();
                        let fan = occluders.shadow_rays(point, &to, Margins::DEFAULT);
                        black_box(occluders.any_hits(&fan, &(0..0), &mut scratch));
                    }
                });
            });
        }
        let view = scene.view(64, 48);
        let directions: Vec<DVec3> = view.iter().map(|ray| ray[1]).collect();
        let fan = Fan {
            origin: view[0][0],
            directions: &directions,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let (mut scratch, mut hits) = (Scratch::new(), Vec::new());
        group.bench_function("camera", |b| {
            b.iter(|| occluders.closest_hits(&fan, &mut hits, &mut scratch));
        });
        group.bench_function("camera one by one", |b| {
            b.iter(|| {
                for &direction in &directions {
                    let ray = Ray::new(fan.origin, direction);
                    black_box(occluders.closest_hit(&ray, &mut scratch));
                }
            });
        });
        group.finish();
    }
}

/// Measures what holes cost: the same triangles, solid and with a mask.
fn holes(c: &mut Criterion) {
    let scene = VisibilityScene::load(&Library::default(), "triangle-soup-large").unwrap();
    let own = Occluders::build(&scene.positions, &scene.triangles);
    let points = shading_points(&own, &scene);
    let texels = AlphaTexels::new(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
    let uv = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]];
    let mask = AlphaMask::new(Arc::new(texels), vec![uv; scene.triangles.len()]).unwrap();
    let masked = Occluders::default().with_holes(own.clone(), Arc::new(mask));
    let (_, light) = &scene.lights[0];
    let lines = stratified_lines(light, 16, &mut || 0.37);
    let mut group = c.benchmark_group("holes");
    for (what, occluders) in [("solid", own), ("masked", masked)] {
        let (mut scratch, mut out) = (Scratch::new(), VisibleLines::new());
        group.bench_function(what, |b| {
            b.iter(|| {
                for &point in &points {
                    let query = ShaftQuery::new(point, LightCorners::new(light).unwrap());
                    occluders
                        .shaft(query, &mut scratch)
                        .visible(&lines, &mut out);
                    black_box(&out);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, lines, rays, holes);
criterion_main!(benches);
