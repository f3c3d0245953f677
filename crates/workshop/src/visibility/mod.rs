//! `bench visibility`: compares the costs of rays and lines, by our hierarchy and by obvhs's.

mod measure;
mod rivals;

use crate::args::VisibilityArgs;
use anyhow::Result;
use linelit_cli::output::Output;
use linelit_geometry::DVec3;
use linelit_scenes::VisibilityScene;
use linelit_visibility::{LightCorners, Occluders};
use measure::{Timings, Workload, shading_points, time};
use rivals::Rivals;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::time::Instant;

/// The numbers of lines for each shading point. Work is counted with the first of these numbers.
const LINES: [u32; 5] = [16, 1, 4, 64, 256];

/// The scenes that are measured by default.
const SCENES: [&str; 3] = [
    "grid-planes-large",
    "triangle-soup-large",
    "colonnade-large",
];

/// The distance, in units of the scene, by which a shading point is moved off its surface.
const OFFSET: f64 = 2e-5;

/// Measures the costs of rays and lines on one scene or on all.
pub(crate) fn run(args: &VisibilityArgs, out: &mut Output) -> Result<()> {
    let names = match &args.scene {
        Some(name) => vec![name.as_str()],
        None => SCENES.to_vec(),
    };
    let mut all = Vec::new();
    for name in names {
        let scene = VisibilityScene::load(&args.read.library(), name)?;
        rows(&scene, args, out, &mut all)?;
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&all)?)?;
    }
    Ok(())
}

/// Measures all lights of a scene, and prints their times or adds them to `found`.
fn rows(
    scene: &VisibilityScene,
    args: &VisibilityArgs,
    out: &mut Output,
    found: &mut Vec<Value>,
) -> Result<()> {
    // Build the hierarchies.
    let start = Instant::now();
    let occluders = Occluders::build(&scene.positions, &scene.triangles);
    let build = start.elapsed().as_secs_f64();
    let rivals = Rivals::build(&scene.positions, &scene.triangles);
    let (side, rounds) = if args.quick { (24, 7) } else { (48, 15) };
    let bytes = occluders.memory() as f64 / occluders.triangle_count().max(1) as f64;
    if !args.json {
        writeln!(
            out,
            "{}: {} triangles, built in {build:.3} s, {bytes:.0} bytes a triangle, {:?}",
            scene.name,
            occluders.triangle_count(),
            occluders.instruction_set(),
        )?;
    }
    // Find the shading points and the lights.
    let all = shading_points(&occluders, &scene.view(side * 4 / 3, side), OFFSET);
    let across = |(_, light): &(String, Vec<DVec3>)| ("linear".to_owned(), across(light).into());
    let linear = scene.lights.last().map(across);
    let only = args.light_name.as_ref();
    let lights = scene.lights.iter().chain(&linear);
    // Time each light from the points outside its plane.
    for (name, light) in lights.filter(|light| only.is_none_or(|only| *only == light.0)) {
        let crossed = scene.lights.last().map(|(_, area)| &area[..]);
        let points = beside(light, crossed, &all);
        let Some(corners) = LightCorners::new(light) else {
            continue;
        };
        let work = Workload {
            light: corners,
            points: &points,
        };
        // A linear light has only one line.
        let lines = if light.len() == 2 { &[1] } else { &LINES[..] };
        let mut t = time(&occluders, &rivals, &work, lines, rounds);
        t.shared.sort_by_key(|row| row.count);
        if args.json {
            found.extend(t.shared.iter().map(|row| {
                json!({
                    "scene": scene.name, "light": name, "lines": row.count, "ns_line": row.line,
                    "ns_ray": t.ray, "ratio": row.in_rays, "ns_ray_bvh2": t.bvh2,
                    "ns_ray_cwbvh": t.cwbvh, "bytes_per_triangle": bytes,
                    "build_seconds": build,
                })
            }));
        } else {
            writeln!(out, "{}", table(name, points.len(), &t))?;
        }
    }
    Ok(())
}

/// Returns the points that are not in the plane of a light. For a linear light, this is the plane
/// of the polygonal light that it crosses.
fn beside(light: &[DVec3], crossed: Option<&[DVec3]>, points: &[DVec3]) -> Vec<DVec3> {
    let polygon = crossed.filter(|_| light.len() == 2).unwrap_or(light);
    let normal = (polygon[1] - polygon[0]).cross(polygon[2] - polygon[0]);
    let off = |p: &DVec3| normal.dot(*p - light[0]).abs() > 1e-4 * normal.length();
    points.iter().copied().filter(off).collect()
}

/// Returns the two ends of a linear light across a polygonal light, from the midpoint of its first
/// edge to the midpoint of its last edge but one.
fn across(light: &[DVec3]) -> [DVec3; 2] {
    let last = light.len() - 1;
    [
        (light[0] + light[1]) * 0.5,
        (light[last] + light[last.saturating_sub(1)]) * 0.5,
    ]
}

/// Returns the text about one light.
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
    for row in &t.shared {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n     N = {:3}: {:9.1} ns/line, {:7.3} rays; shaft-shared point {:8.1} ns",
            row.count, row.line, row.in_rays, row.point
        );
    }
    text
}
