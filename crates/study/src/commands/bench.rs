//! `bench equal-time`: who reaches an error first.

use crate::cli::BenchArgs;
use crate::engine::{Contest, Curve, Targets, contest};
use crate::scenes;
use anyhow::{Context, Result};
use linelit_integrator::{Estimator, Renderer};
use serde_json::json;

/// What is compared unless told: rays first; the last competes with all.
const ESTIMATORS: [&str; 7] = [
    "point-area",
    "point-solid-angle",
    "point-area[visibility=shaft]",
    "point-solid-angle[visibility=shaft]",
    "line-analytic",
    "exact",
    "hybrid",
];

/// Measured unless a scene is named.
const SCENES: [&str; 8] = [
    "grid-planes-small",
    "grid-planes-large",
    "triangle-soup-small",
    "triangle-soup-large",
    "cornell-box-small",
    "cornell-box-large",
    "colonnade-small",
    "colonnade-large",
];

/// Runs a benchmark.
///
/// # Errors
/// If a scene cannot be read.
pub fn run(args: &BenchArgs) -> Result<()> {
    let names: Vec<&str> = match &args.scene {
        Some(name) => vec![name],
        None => SCENES.to_vec(),
    };
    let mut rows = Vec::new();
    for name in names {
        let curves = measure(name, args)?;
        if args.json {
            rows.extend(json_rows(name, &curves));
        } else {
            print(name, &curves);
        }
    }
    if args.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    }
    Ok(())
}

fn default_estimators() -> Result<Vec<Estimator>> {
    let parsed = ESTIMATORS.map(|text| text.parse().context("a built-in name"));
    parsed.into_iter().collect()
}

fn measure(name: &str, args: &BenchArgs) -> Result<Vec<Curve>> {
    let mut scene = scenes::load(name, args.strict)?.scene;
    let side = args.pixels;
    scene.set_resolution(side * 4 / 3, side);
    let renderer = Renderer::new(&scene);
    let pixels: Vec<[u32; 2]> = (0..side)
        .flat_map(|y| (0..side * 4 / 3).map(move |x| [x, y]))
        .collect();
    let targets = Targets::find(&renderer, &pixels);
    let all = [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024];
    let estimators = match &args.estimators {
        Some(list) => list.0.clone(),
        None => default_estimators()?,
    };
    let entry = |estimator: &Estimator| {
        let most = if estimator.to_string().starts_with("point") {
            1024
        } else {
            256
        };
        let samples = all.into_iter().filter(|&n| n <= most).collect();
        (*estimator, samples)
    };
    let what = Contest {
        entries: estimators.iter().map(entry).collect(),
        rounds: args.rounds,
        reference: (1024, 16),
    };
    Ok(contest(&renderer, &targets, &what))
}

/// Whether an estimator shoots a ray for each sample.
fn is_rays(estimator: &Estimator) -> bool {
    matches!(estimator, Estimator::PointArea | Estimator::PointSolidAngle)
}

/// The hybrid's worst time to an error, divided by the best of the others' to the same, and where.
fn worst(curves: &[Curve]) -> Option<(f64, u32)> {
    let (hybrid, others) = curves.split_last()?;
    let ratio = |point: &crate::engine::ContestPoint| {
        let times = others.iter().filter_map(|curve| curve.time_to(point.mse));
        let best = times.reduce(f64::min)?;
        Some((point.time / best, point.samples))
    };
    let ratios = hybrid.points.iter().filter_map(ratio);
    ratios.max_by(|a, b| a.0.total_cmp(&b.0))
}

fn print(name: &str, curves: &[Curve]) {
    println!("{name}: microseconds a point and relative mean squared error");
    let counts: Vec<u32> = [1, 4, 16, 64, 256, 1024].to_vec();
    print!("{:38}", "samples");
    counts.iter().for_each(|n| print!("{n:>18}"));
    println!();
    for curve in curves {
        print!("{:38}", curve.estimator.to_string());
        for n in &counts {
            match curve.points.iter().find(|p| p.samples == *n) {
                Some(p) => print!("{:9.2} {:8.1e}", p.time, p.mse),
                None => print!("{:>18}", ""),
            }
        }
        println!();
    }
    for samples in [16, 64] {
        for rays in curves.iter().filter(|c| is_rays(&c.estimator)) {
            let Some(at) = rays.points.iter().find(|p| p.samples == samples) else {
                continue;
            };
            print!(
                "  in the time of {samples} rays by {} ({:.2} us), error less than theirs by:",
                rays.estimator, at.time
            );
            for curve in curves.iter().filter(|c| !is_rays(&c.estimator)) {
                if let Some(error) = curve.error_at(at.time) {
                    print!("  {} {:.1e}", curve.estimator, at.mse / error);
                }
            }
            println!();
        }
    }
    if let Some((ratio, samples)) = worst(curves) {
        println!(
            "  hybrid: at most {ratio:.2} of the best of the others' time to equal error (N = {samples})"
        );
    }
    println!();
}

fn json_rows(name: &str, curves: &[Curve]) -> Vec<serde_json::Value> {
    let (scene, light) = match name.rsplit_once('-') {
        Some((scene, light @ ("small" | "large"))) => (scene, light),
        _ => (name, ""),
    };
    let mut rows = Vec::new();
    for curve in curves {
        for p in &curve.points {
            rows.push(json!({
                "scene": scene,
                "light": light,
                "estimator": curve.estimator.to_string(),
                "samples": p.samples,
                "us_point": p.time,
                "mse": p.mse,
            }));
        }
    }
    rows
}
