//! A program that computes irradiance by the Rust library, for `tests/test_same_bits.py`.
//! `points FOLDER METHOD:SAMPLES…` reads vertices, points and normals from files, writes the
//! irradiance to a file METHOD for each method, and prints the least time of a call with 10,000
//! points and of a call with one, for `benches/calls.py`.

#![allow(clippy::print_stdout, reason = "a program")]

mod common;

use common::{Folder, soup};
use linelit::{Estimator, Light, Scene};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (_, methods) = arguments.split_first().ok_or("no folder")?;
    let folder = Folder::of_arguments()?;
    // Read the scene and the points; vertices are `f32`, as in the test.
    let vertices = folder.singles("vertices")?;
    let (points, normals) = (folder.vectors("points")?, folder.vectors("normals")?);
    let faces = soup(vertices.len())?;
    let lamp = Light::rectangle(
        [-1.0, -1.0, 2.0],
        [0.0, 2.0, 0.0],
        [2.0, 0.0, 0.0],
        [3.0, 2.0, 1.0],
    )?;
    let bare = Scene::builder(&vertices, &faces).seed(3).build()?;
    let lit = bare.with_lights([lamp])?;
    for method in methods {
        // Compute the irradiance at all points.
        let (name, samples) = method.rsplit_once(':').ok_or("METHOD:SAMPLES")?;
        let estimator: Estimator = name.parse()?;
        let scene = lit.with_method(estimator, samples.parse()?)?;
        let mut found = vec![[0.0; 3]; points.len()];
        scene.irradiances(&points, &normals, &mut found)?;
        // Measure calls with many points, and calls with one.
        let mut few = vec![[0.0; 3]; points.len().min(10_000)];
        let many = least(9, || {
            scene.irradiances(&points[..few.len()], &normals[..few.len()], &mut few)
        })?;
        let each = least(9, || {
            let mut calls = (0..1000).map(|i| scene.irradiance(points[i], normals[i]).map(drop));
            calls.try_for_each(|call| call)
        })?;
        println!("{name} {many:e} {:e}", each / 1000.0);
        folder.write(name, found.as_flattened())?;
    }
    Ok(())
}

/// Returns the least time of `count` calls in seconds.
fn least<E>(count: u32, mut call: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut least = f64::INFINITY;
    for _ in 0..count {
        let begin = Instant::now();
        call()?;
        least = least.min(begin.elapsed().as_secs_f64());
    }
    Ok(least)
}
