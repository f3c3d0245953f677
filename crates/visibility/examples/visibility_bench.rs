//! Prints what rays and lines cost on the built-in scenes, side by side with obvhs.
//!
//! `visibility_bench [--json] [--quick] [--scene NAME]
//!  [--triangles FILE --light "x,y,z x,y,z …" --eye x,y,z --target x,y,z --tan T]
//!  [--only N [--repeat K] [--avx2]]`
//!
//! A triangle file holds nine little-endian `f32` a triangle. `--only N` prints no table: it
//! answers N lines a point (N = 0: eight rays a point) K times, for profilers.
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "a program that prints a table of averages"
)]

use linelit_geometry::DVec3;
use linelit_visibility::{
    InstructionSet, Occluders,
    measure::{self, Rivals, Scene, Workload},
};
use std::time::Instant;

/// The work counters are taken with the first.
const LINES: [usize; 5] = [16, 1, 4, 64, 256];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let flag = |name: &str| args.iter().any(|a| a == name);
    let value = |name: &str| {
        let at = args.iter().position(|a| a == name)?;
        args.get(at + 1).cloned()
    };
    let mut scenes = vec![measure::grid(), measure::soup(), measure::colonnade()];
    if let Some(file) = value("--triangles") {
        scenes = vec![load(&file, &value)];
    }
    if let Some(name) = value("--scene") {
        scenes.retain(|s| s.name == name);
    }
    let number = |name: &str| value(name).map(|v| v.parse().expect("a number"));
    let only_lines = number("--only").map(|n| (n, number("--repeat").unwrap_or(1)));
    let mut rows = Vec::new();
    for scene in &scenes {
        run(
            scene,
            (flag("--quick"), flag("--json"), flag("--avx2")),
            value("--light-name"),
            only_lines,
            &mut rows,
        );
    }
    if flag("--json") {
        println!("[\n{}\n]", rows.join(",\n"));
    }
}

fn run(
    scene: &Scene,
    (quick, json, avx2): (bool, bool, bool),
    only: Option<String>,
    only_lines: Option<(usize, usize)>,
    rows: &mut Vec<String>,
) {
    let start = Instant::now();
    let mut occluders = Occluders::build(&scene.positions, &scene.triangles);
    let build = start.elapsed().as_secs_f64();
    if avx2 {
        occluders = occluders.limited_to(InstructionSet::Avx2);
    }
    let rivals = only_lines
        .is_none()
        .then(|| Rivals::build(&scene.positions, &scene.triangles));
    let side = if quick { 24 } else { 48 };
    let view = scene.view(side * 4 / 3, side);
    if !json {
        let bytes = occluders.memory() as f64 / occluders.triangle_count() as f64;
        println!(
            "{}: {} triangles, built in {build:.2} s, {bytes:.0} bytes a triangle",
            scene.name,
            occluders.triangle_count()
        );
    }
    let all = measure::shading_points(&occluders, &view, 2e-5);
    for (name, light) in &scene.lights {
        if only.as_ref().is_some_and(|o| o != name) {
            continue;
        }
        let normal = (light[1] - light[0]).cross(light[2] - light[0]);
        // Points on the light's side that see the light's front, below a light in the ceiling.
        let points: Vec<DVec3> = all
            .iter()
            .copied()
            .filter(|p| normal.dot(*p - light[0]).abs() > 1e-4 * normal.length())
            .collect();
        let work = Workload {
            positions: &scene.positions,
            triangles: &scene.triangles,
            light,
            exclude: 0..0,
            points: &points,
        };
        if let Some((n, repeat)) = only_lines {
            measure::repeat(&occluders, &work, n, repeat);
            continue;
        }
        let clock = || start.elapsed().as_secs_f64();
        let rounds = if quick { 7 } else { 15 };
        let t = measure::time(&occluders, rivals.as_ref(), &work, &LINES, rounds, &clock);
        report(scene, name, points.len(), &t, json, rows);
    }
}

fn report(
    scene: &Scene,
    light: &str,
    points: usize,
    t: &measure::Timings,
    json: bool,
    rows: &mut Vec<String>,
) {
    let mut lines = t.lines.clone();
    lines.sort_by_key(|l| l.0);
    if json {
        for (n, ns, ratio) in lines {
            rows.push(format!(
                "  {{\"scene\": \"{}\", \"light\": \"{light}\", \"lines\": {n}, \"ns_line\": {ns:.2}, \
                 \"ns_ray\": {:.2}, \"ratio\": {ratio:.4}, \"ns_ray_bvh2\": {:.2}, \
                 \"ns_ray_cwbvh\": {:.2}}}",
                scene.name, t.ray, t.bvh2, t.cwbvh
            ));
        }
        return;
    }
    let c = &t.counters;
    let share = |n: u64| 100.0 * n as f64 / c.shafts as f64;
    println!(
        "  {light}: ray {:.0} ns (Bvh2 {:.0}, CwBvh {:.0}: {:.2}×), hit {:.0} %; {points} points: \
         {:.0} % empty, {:.0} % blocked, {:.0} % partial, {:.0} % dense; per partial shaft {:.1} \
         candidates; per shaft {:.0} boxes, {:.0} triangles; visible {:.4}",
        t.ray,
        t.bvh2,
        t.cwbvh,
        t.bvh2.min(t.cwbvh) / t.ray,
        100.0 * t.hit_share,
        share(c.empty_shafts),
        share(c.blocked_shafts),
        share(c.partial_shafts),
        share(c.dense_shafts),
        c.candidates as f64 / c.partial_shafts.max(1) as f64,
        c.node_tests as f64 / c.shafts as f64,
        c.triangle_tests as f64 / c.shafts as f64,
        t.visible_share,
    );
    for ((n, ns, ratio), (_, points)) in lines.iter().zip({
        let mut p = t.shaft_points.clone();
        p.sort_by_key(|p| p.0);
        p
    }) {
        println!(
            "     N = {n:3}: {ns:9.1} ns/line, {ratio:7.3} rays; shaft-shared point {points:8.1} ns"
        );
    }
}

/// A scene from a file of triangles.
fn load(file: &str, value: &dyn Fn(&str) -> Option<String>) -> Scene {
    let bytes = std::fs::read(file).expect("the triangle file can be read");
    let vector = |text: &str| {
        let mut parts = text.split(',').map(|p| p.parse().expect("a number"));
        let mut next = || parts.next().expect("three numbers");
        DVec3::new(next(), next(), next())
    };
    let need = |name: &str| value(name).unwrap_or_else(|| panic!("{name} is needed"));
    let mut scene = Scene {
        name: value("--name").unwrap_or_else(|| "file".into()),
        camera: (vector(&need("--eye")), vector(&need("--target"))),
        tan_half_angle: need("--tan").parse().expect("a number"),
        ..Scene::default()
    };
    let floats: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect();
    scene.positions = floats.as_chunks::<3>().0.to_vec();
    let count = u32::try_from(scene.positions.len() / 3).expect("fewer than 2^32 triangles");
    scene.triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let light: Vec<DVec3> = need("--light").split(' ').map(vector).collect();
    let centre = light.iter().sum::<DVec3>() / light.len() as f64;
    let small = light.iter().map(|v| centre + (*v - centre) * 0.1).collect();
    scene.lights = vec![("S".into(), small), ("L".into(), light)];
    scene
}
