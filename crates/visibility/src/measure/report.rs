//! The table of `cargo xtask bench visibility`.

use super::{Rivals, Scene, Timings, Workload, repeat, shading_points, time, verify};
use crate::{InstructionSet, LightCorners, Occluders};
use linelit_geometry::DVec3;
use std::fmt::Write;

/// The work counters are taken with the first.
const LINES: [usize; 5] = [16, 1, 4, 64, 256];

/// What to measure and how to print it.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Fewer points and rounds.
    pub quick: bool,
    /// Objects instead of a table.
    pub json: bool,
    /// AVX2 at the most.
    pub avx2: bool,
    /// Only this light.
    pub light: Option<String>,
    /// No table, but the bare work for a profiler: lines a point, and how many times.
    pub only: Option<(usize, usize)>,
    /// No table, but this many lines of each light compared with brute force.
    pub verify: Option<usize>,
}

impl Options {
    /// From a program's arguments.
    ///
    /// # Errors
    /// If a number is none.
    pub fn parse(args: &[String]) -> Result<Self, std::num::ParseIntError> {
        let flag = |name: &str| args.iter().any(|a| a == name);
        let number = |name: &str| value(args, name).map(str::parse).transpose();
        let times = number("--repeat")?.unwrap_or(1);
        Ok(Self {
            quick: flag("--quick"),
            json: flag("--json"),
            avx2: flag("--avx2"),
            light: value(args, "--light-name").map(str::to_owned),
            only: number("--only")?.map(|n| (n, times)),
            verify: number("--verify")?,
        })
    }
}

/// What follows an option.
#[must_use]
pub fn value<'a>(args: &'a [String], name: &str) -> Option<&'a str> {
    let at = args.iter().position(|a| a == name)?;
    args.get(at + 1).map(String::as_str)
}

/// Measures scenes and hands each part of the report to `print`; `now` gives seconds.
pub fn report(
    scenes: &[Scene],
    options: &Options,
    now: &dyn Fn() -> f64,
    print: &mut dyn FnMut(&str),
) {
    let mut rows = Vec::new();
    for scene in scenes {
        run(scene, options, now, print, &mut rows);
    }
    if options.json {
        print(&format!("[\n{}\n]", rows.join(",\n")));
    }
}

#[allow(clippy::cast_precision_loss, reason = "counts")]
fn run(
    scene: &Scene,
    options: &Options,
    now: &dyn Fn() -> f64,
    print: &mut dyn FnMut(&str),
    rows: &mut Vec<String>,
) {
    let start = now();
    let mut occluders = Occluders::build(&scene.positions, &scene.triangles);
    let build = now() - start;
    if options.avx2 {
        occluders = occluders.limited_to(InstructionSet::Avx2);
    }
    let rivals = (options.only.is_none() && options.verify.is_none())
        .then(|| Rivals::build(&scene.positions, &scene.triangles));
    let side = if options.quick { 24 } else { 48 };
    let view = scene.view(side * 4 / 3, side);
    let bytes = occluders.memory() as f64 / occluders.triangle_count().max(1) as f64;
    if !options.json {
        print(&format!(
            "{}: {} triangles, built in {build:.3} s, {bytes:.0} bytes a triangle, {:?}",
            scene.name,
            occluders.triangle_count(),
            occluders.instruction_set(),
        ));
    }
    let all = shading_points(&occluders, &view, 2e-5);
    let linear = scene.lights.last().map(|(_, light)| across(light));
    let linear = linear.map(|ends| ("linear".to_owned(), ends.to_vec()));
    for (name, light) in scene.lights.iter().chain(&linear) {
        if options.light.as_ref().is_some_and(|o| o != name) {
            continue;
        }
        let (u, v) = match (&light[..], scene.lights.last()) {
            // Seen from where the light that it crosses is.
            ([_, _], Some((_, area))) => (area[1] - area[0], area[2] - area[0]),
            _ => (light[1] - light[0], light[2] - light[0]),
        };
        let normal = u.cross(v);
        // Not those in the light's plane.
        let off = |p: &DVec3| normal.dot(*p - light[0]).abs() > 1e-4 * normal.length();
        let points: Vec<DVec3> = all.iter().copied().filter(off).collect();
        let Some(corners) = LightCorners::new(light) else {
            continue;
        };
        let work = Workload {
            positions: &scene.positions,
            triangles: &scene.triangles,
            light: corners,
            exclude: 0..0,
            points: &points,
        };
        if let Some((n, times)) = options.only {
            repeat(&occluders, &work, n, times);
            continue;
        }
        if let Some(least) = options.verify {
            let v = verify(&occluders, &work, least);
            print(&format!(
                "  {name}: {} lines ({} of dense shafts) against brute force: largest difference \
                 of a visible fraction {:.1e}, {} misclassified",
                v.lines, v.dense, v.largest, v.misclassified
            ));
            continue;
        }
        let rounds = if options.quick { 7 } else { 15 };
        // A linear light has one line.
        let lines = if light.len() == 2 { &[1] } else { &LINES[..] };
        let mut t = time(&occluders, rivals.as_ref(), &work, lines, rounds, now);
        t.lines.sort_by_key(|l| l.0);
        t.shaft_points.sort_by_key(|p| p.0);
        if options.json {
            rows.extend(t.lines.iter().map(|&(n, ns, ratio)| {
                format!(
                    "  {{\"scene\": \"{}\", \"light\": \"{name}\", \"lines\": {n}, \
                     \"ns_line\": {ns:.2}, \"ns_ray\": {:.2}, \"ratio\": {ratio:.4}, \
                     \"ns_ray_bvh2\": {:.2}, \"ns_ray_cwbvh\": {:.2}, \
                     \"bytes_per_triangle\": {bytes:.1}, \"build_seconds\": {build:.4}}}",
                    scene.name, t.ray, t.bvh2, t.cwbvh
                )
            }));
        } else {
            print(&table(name, points.len(), &t));
        }
    }
}

/// A linear light along the middle of a light.
fn across(light: &[DVec3]) -> [DVec3; 2] {
    let last = light.len() - 1;
    [
        (light[0] + light[1]) * 0.5,
        (light[last] + light[last.saturating_sub(1)]) * 0.5,
    ]
}

/// One light's part of the table.
#[allow(clippy::cast_precision_loss, reason = "counts")]
fn table(light: &str, points: usize, t: &Timings) -> String {
    let c = &t.counters;
    let share = |n: u64| 100.0 * n as f64 / c.shafts.max(1) as f64;
    let mut text = format!(
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
        c.node_tests as f64 / c.shafts.max(1) as f64,
        c.triangle_tests as f64 / c.shafts.max(1) as f64,
        t.visible_share,
    );
    for (&(n, ns, ratio), (_, points)) in t.lines.iter().zip(&t.shaft_points) {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n     N = {n:3}: {ns:9.1} ns/line, {ratio:7.3} rays; shaft-shared point {points:8.1} ns"
        );
    }
    text
}
