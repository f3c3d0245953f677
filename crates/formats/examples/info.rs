//! Prints what is in a scene: `cargo run --release --example info -- scene.pbrt [--strict]`.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a command-line program"
)]

use linelit_formats::LoadOptions;
use linelit_lights::Light;
use linelit_scene::Scene;
use std::collections::BTreeMap;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let mut options = LoadOptions::default();
    let mut path = None;
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--strict" => options.strict = true,
            _ => path = Some(argument),
        }
    }
    let Some(path) = path else {
        eprintln!("usage: info SCENE [--strict]");
        return ExitCode::from(2);
    };
    let start = Instant::now();
    match linelit_formats::load(&path, &options) {
        Ok(loaded) => {
            for warning in &loaded.warnings {
                eprintln!("{warning}");
            }
            println!("loaded in       {:.3} s", start.elapsed().as_secs_f64());
            print_scene(&loaded.scene);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn print_scene(scene: &Scene) {
    println!("triangles       {}", scene.triangles.len());
    println!("vertices        {}", scene.positions.len());
    println!("meshes          {}", scene.meshes.len());
    println!(
        "geometry        {:.1} MiB",
        scene.memory() as f64 / 1048576.0
    );
    if let Some((lo, hi)) = scene.bounds() {
        println!("bounds          {lo} to {hi}");
    }
    println!(
        "film            {} x {}",
        scene.film.width, scene.film.height
    );
    println!(
        "camera          {:?} at {}",
        scene.camera.projection,
        scene.camera.position()
    );
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for material in &scene.materials {
        *kinds.entry(material.kind.name()).or_default() += 1;
    }
    println!("materials       {kinds:?}");
    println!("lights          {}", scene.lights.len());
    for light in scene.lights.iter().take(20) {
        match &*light.light {
            Light::Area(area) => println!(
                "  area          {} corners, {:.6} square units facing {:.3}, {} triangles, power {:.6} W",
                area.polygon.vertices().len(),
                area.polygon.area(),
                area.polygon.normal(),
                light.triangles.len(),
                area.power(),
            ),
            Light::Linear(line) => println!(
                "  linear        {:.6} units long, power {:.6} W",
                line.segment.length(),
                line.power()
            ),
            other => println!("  {other:?}"),
        }
    }
}
