//! Prints what rays and lines cost on scene files, side by side with obvhs:
//! `cargo xtask bench visibility --scene PATH [--json] [--quick] [--light-name S|L]`.
//!
//! Each area light makes two rows: L is the light, S a tenth of it in its middle.
#![allow(clippy::print_stdout, reason = "a program that prints a table")]

use anyhow::Context;
use linelit_formats::LoadOptions;
use linelit_lights::Light;
use linelit_visibility::measure::{self, Options, value};
use std::{path::Path, time::Instant};

fn main() -> anyhow::Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let options = Options::parse(&args)?;
    let path = value(&args, "--scene").context("--scene PATH is needed")?;
    let start = Instant::now();
    let scenes = [load(Path::new(path))?];
    let clock = || start.elapsed().as_secs_f64();
    measure::report(&scenes, &options, &clock, &mut |text| println!("{text}"));
    Ok(())
}

fn load(path: &Path) -> anyhow::Result<measure::Scene> {
    let scene = linelit_formats::load(path, &LoadOptions::default())?.scene;
    let [width, height] = scene.camera.resolution().map(f64::from);
    let centre = scene.camera.ray(0.5 * width, 0.5 * height).direction;
    let top = scene.camera.ray(0.5 * width, 0.0).direction;
    let eye = scene.camera.position();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut out = measure::Scene {
        name: name.into_owned(),
        camera: (eye, eye + centre),
        tan_half_angle: (top / top.dot(centre) - centre / centre.length_squared()).length()
            * centre.length(),
        positions: scene.positions,
        triangles: scene.triangles,
        ..measure::Scene::default()
    };
    for (i, light) in scene.lights.iter().enumerate() {
        let Light::Area(area) = &*light.light else {
            continue;
        };
        let corners = area.polygon.vertices();
        let count = f64::from(u32::try_from(corners.len())?);
        let middle = corners.iter().copied().sum::<linelit_geometry::DVec3>() / count;
        let tenth = corners.iter().map(|v| middle + (*v - middle) * 0.1);
        let number = if i == 0 { String::new() } else { i.to_string() };
        out.lights.push((format!("S{number}"), tenth.collect()));
        out.lights.push((format!("L{number}"), corners.to_vec()));
    }
    anyhow::ensure!(!out.lights.is_empty(), "the scene has no polygonal light");
    Ok(out)
}
