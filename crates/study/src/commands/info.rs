//! `linelit info`.

use crate::cli::InfoArgs;
use crate::scenes;
use anyhow::Result;
use linelit_integrator::Plan;
use linelit_lights::Light;
use linelit_scene::Scene;

/// Says what is in a scene.
///
/// # Errors
/// If the scene cannot be read.
pub fn run(args: &InfoArgs) -> Result<()> {
    let loaded = scenes::load(&args.scene, args.common.strict)?;
    let scene = &loaded.scene;
    let value = describe(scene, &args.scene, loaded.warnings.len());
    if args.common.json {
        println!("{value}");
    } else {
        print_table(&value);
    }
    Ok(())
}

fn describe(scene: &Scene, name: &str, warnings: usize) -> serde_json::Value {
    let plan = Plan::new(scene);
    let kinds = |want: fn(&Light) -> bool| scene.lights.iter().filter(|l| want(&l.light)).count();
    let power: f64 = scene.lights.iter().map(|l| l.light.power()).sum();
    let bounds = scene
        .bounds()
        .map(|(lo, hi)| [lo.to_array(), hi.to_array()]);
    serde_json::json!({
        "scene": scenes::short_name(name),
        "triangles": scene.triangles.len(),
        "vertices": scene.positions.len(),
        "materials": scene.materials.len(),
        "lights": scene.lights.len(),
        "area lights": kinds(|l| matches!(l, Light::Area(_))),
        "linear lights": kinds(|l| matches!(l, Light::Linear(_))),
        "power (W)": power,
        "memory of the geometry (bytes)": scene.memory(),
        "bounds": bounds,
        "resolution": [scene.film.width, scene.film.height],
        "warnings": warnings,
        "plan: lights dropped because they emit nothing": plan.dark_lights(),
    })
}

fn print_table(value: &serde_json::Value) {
    if let Some(map) = value.as_object() {
        for (key, value) in map {
            println!("{key:>48}  {value}");
        }
    }
}
