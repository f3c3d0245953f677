//! Prints what rays and lines cost on the built-in scenes, side by side with obvhs.
//!
//! `visibility_bench [--json] [--quick] [--name NAME] [--light-name S|L] [--avx2]
//!  [--triangles FILE --light "x,y,z x,y,z …" --eye x,y,z --target x,y,z --tan T]
//!  [--only N [--repeat K]] [--verify N]`
//!
//! A triangle file holds nine little-endian `f32` a triangle; scene files are for
//! `cargo xtask bench visibility --scene PATH`. `--only N` prints no table: it answers N lines a
//! point (N = 0: eight rays a point) K times, for profilers. `--verify N` compares N lines of each
//! light with brute force instead.
#![allow(
    clippy::print_stdout,
    clippy::cast_precision_loss,
    reason = "a program that prints a table of averages"
)]

use linelit_geometry::DVec3;
use linelit_visibility::measure::{self, Options, Scene, value};
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let mut scenes = vec![measure::grid(), measure::soup(), measure::colonnade()];
    if let Some(file) = value(&args, "--triangles") {
        scenes = vec![load(file, &args)];
    } else if let Some(name) = value(&args, "--name") {
        scenes.retain(|s| s.name == name);
    }
    let options = Options::parse(&args).expect("numbers");
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    measure::report(&scenes, &options, &clock, &mut |text| println!("{text}"));
}

/// A scene from a file of triangles.
fn load(file: &str, args: &[String]) -> Scene {
    let bytes = std::fs::read(file).expect("the triangle file can be read");
    let vector = |text: &str| {
        let mut parts = text.split(',').map(|p| p.parse().expect("a number"));
        let mut next = || parts.next().expect("three numbers");
        DVec3::new(next(), next(), next())
    };
    let need = |name: &str| value(args, name).unwrap_or_else(|| panic!("{name} is needed"));
    let mut scene = Scene {
        name: value(args, "--name").unwrap_or("file").into(),
        camera: (vector(need("--eye")), vector(need("--target"))),
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
