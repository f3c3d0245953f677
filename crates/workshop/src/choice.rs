//! `bench choice`: whether `hybrid` is the best choice, by error × time over all other methods.
//!
//! A few pixels of each scene are estimated by all methods at each number of samples, twice; those
//! that come near the best of a cell again and again. The time of a pixel is that of the camera
//! ray and the light, plus its share of what the method prepares in a picture of the scene's own
//! resolution.

use crate::args::ChoiceArgs;
use crate::equal_time::{Curve, reference, settings};
use crate::figures::{processor, said};
use crate::speed::{Job, Programs};
use anyhow::{Context as _, Result};
use linelit_cli::output::Output;
use linelit_estimators::Technique;
use linelit_geometry::DVec3;
use linelit_integrator::{Estimator, Renderer, Settings, Workspace};
use linelit_scene::SceneDescription;
use linelit_scenes::{BuiltIn, Library};
use linelit_study::engine::{Contest, ContestPoint, CpuClock, Problem, contest};
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// Errors below this count as this: mean squared errors over the mean square of the reference.
const LEAST_ERROR: f64 = 1e-8;
/// The error of a method without noise: rounding.
const NO_NOISE: f64 = 1e-20;
/// A method without noise is a rival up to this multiple of the time of `hybrid`.
const PATIENCE: f64 = 1.25;
/// Methods within this factor of the best of a cell, measured twice, are measured again.
const NEAR: f64 = 2.0;
/// The error that a reference may add to the error measured by it, as a fraction of that.
const REFERENCE: f64 = 0.1;
/// The method that is judged, and the two that its time is held to.
const HYBRID: &str = "hybrid";
const LINES: &str = "line-analytic";
const POINTS: &str = "point-area[visibility=shaft]";
/// Seeds of the pictures whose errors are compared with an older program's.
const PICTURES: u64 = 4;
/// Renders in turns with it.
const RUNS: u32 = 3;

/// The pixels of a small picture as integrals.
struct Pixels<'r> {
    renderer: &'r Renderer<'r>,
    size: [u32; 2],
}

impl Problem for Pixels<'_> {
    type Settings = Settings;
    type Workspace = Workspace;

    fn integrals(&self) -> usize {
        self.size.iter().map(|side| *side as usize).product()
    }

    fn estimate(
        &self,
        settings: &Settings,
        samples: u32,
        seed: u64,
        integral: usize,
        workspace: &mut Workspace,
    ) -> DVec3 {
        let settings = Settings {
            samples,
            seed,
            show_lights: false,
            ..*settings
        };
        let integral = u32::try_from(integral).unwrap_or(0);
        let pixel = [integral % self.size[0], integral / self.size[0]];
        self.renderer.pixel(&settings, pixel, workspace)
    }
}

/// A scene at a number of samples.
#[derive(Clone, Debug, Serialize)]
struct Cell {
    scene: String,
    samples: u32,
    /// Error × time of `hybrid` over the least of the others'.
    ratio: f64,
    /// The method that has the least.
    rival: String,
    /// Microseconds a pixel and errors of `hybrid` and its rival.
    us_pixel: [f64; 2],
    mse: [f64; 2],
    /// Time of `hybrid` over the lesser of lines' and shaft points'.
    time_ratio: f64,
    /// Error × time of `hybrid` over an older program's.
    against: Option<f64>,
    /// Whether the reference adds too much to the errors measured by it.
    is_rough: bool,
}

/// Judges all scenes and prints the cells.
pub(crate) fn run(args: &ChoiceArgs, out: &mut Output) -> Result<()> {
    let programs = args.against.as_deref().map(Programs::new).transpose()?;
    let names: Vec<_> = match args.scenes.is_empty() {
        true => BuiltIn::ALL.iter().map(|scene| scene.name).collect(),
        false => args.scenes.iter().map(String::as_str).collect(),
    };
    if !args.json {
        writeln!(
            out,
            "{:20}{:>4}{:>10}{:>8}{:>8}  µs a pixel and error of hybrid, of its best rival",
            "scene", "N", "ratio", "time", "against"
        )?;
    }
    let mut cells = Vec::new();
    for name in names {
        let found = judge(name, args, programs.as_ref())?;
        if !args.json {
            found.iter().try_for_each(|cell| print(cell, out))?;
        }
        cells.extend(found);
    }
    let (date, processor) = (said(&["date", "+%F"]), processor());
    if args.json {
        let all = json!({"date": date, "processor": processor, "cells": cells});
        return Ok(writeln!(out, "{all}")?);
    }
    summary(
        "error x time over the best rival's",
        cells.iter().map(|c| c.ratio),
        out,
    )?;
    let times = cells.iter().map(|c| c.time_ratio);
    summary(
        "time over the lesser of lines' and shaft points'",
        times,
        out,
    )?;
    summary(
        "error x time over the older program's",
        cells.iter().filter_map(|c| c.against),
        out,
    )?;
    Ok(writeln!(out, "{date}, {processor}, one thread")?)
}

/// Prints how many ratios are good, their mean and the largest.
fn summary(what: &str, ratios: impl Iterator<Item = f64>, out: &mut Output) -> Result<()> {
    let ratios: Vec<_> = ratios.collect();
    if ratios.is_empty() {
        return Ok(());
    }
    let good = ratios.iter().filter(|ratio| **ratio <= PATIENCE).count();
    let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let worst = ratios.iter().copied().fold(0.0, f64::max);
    let count = ratios.len();
    Ok(writeln!(
        out,
        "{what}: {good} of {count} cells at most {PATIENCE}; geometric mean {mean:.3}, worst {worst:.2}"
    )?)
}

fn print(cell: &Cell, out: &mut Output) -> Result<()> {
    let against = cell
        .against
        .map_or_else(String::new, |ratio| format!("{ratio:.2}"));
    let [[us, rival_us], [mse, rival_mse]] = [cell.us_pixel, cell.mse];
    let rough = if cell.is_rough {
        "; the reference is rough"
    } else {
        ""
    };
    Ok(writeln!(
        out,
        "{:20}{:4}{:10.2}{:8.2}{against:>8}  {us:.2} {mse:.1e}, {rival_us:.2} {rival_mse:.1e} {}{rough}",
        Path::new(&cell.scene)
            .file_stem()
            .unwrap_or_default()
            .display(),
        cell.samples,
        cell.ratio,
        cell.time_ratio,
        cell.rival,
    )?)
}

/// All methods that the program lists; points by rays, and in shafts where they go there.
fn methods() -> Vec<Estimator> {
    let of = |technique: Technique| {
        let name = technique.name();
        let texts = [name.to_owned(), format!("{name}[visibility=shaft]")];
        let count = if name.starts_with("point") { 2 } else { 1 };
        texts
            .into_iter()
            .take(count)
            .filter_map(|text| text.parse().ok())
    };
    Technique::all().flat_map(of).collect()
}

/// Measures the cells of a scene.
fn judge(name: &str, args: &ChoiceArgs, programs: Option<&Programs>) -> Result<Vec<Cell>> {
    let mut scene = Library::default().load_lit(name)?.scene;
    let own_pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
    let size = [args.resolution.width, args.resolution.height];
    scene.set_resolution(size[0], size[1]);
    let renderer = Renderer::new(&scene);
    let pixels = Pixels {
        renderer: &renderer,
        size,
    };
    let (truth, rough) = reference(&pixels);
    // Measure all methods twice, and those near the best of a cell again and again.
    let mut entries: Vec<_> = methods()
        .into_iter()
        .map(|estimator| (settings(estimator), args.samples.0.clone()))
        .collect();
    let mut curves = Vec::new();
    for rounds in [2, args.rounds] {
        let what = Contest {
            entries,
            rounds,
            truth: truth.clone(),
        };
        curves = contest(&pixels, &what);
        entries = near(&curves, &args.samples.0);
    }
    // Add what they prepare, beyond the least that any of them does.
    let mut prepared: BTreeMap<String, f64> = BTreeMap::new();
    for curve in &curves {
        let estimator = &curve.settings.estimator;
        prepared.insert(estimator.to_string(), preparing(&scene, estimator));
    }
    let least = prepared.values().copied().fold(f64::INFINITY, f64::min);
    for curve in &mut curves {
        let seconds = prepared[&curve.settings.estimator.to_string()] - least;
        curve
            .points
            .iter_mut()
            .for_each(|p| p.time += seconds / own_pixels * 1e6);
    }
    // Judge the cells.
    let mut cells = Vec::new();
    for &samples in &args.samples.0 {
        let against = match programs {
            Some(programs) => Some(compare(programs, &pixels, (name, samples), &truth)?),
            None => None,
        };
        let cell = Cell {
            scene: name.to_owned(),
            against,
            ..cell(&curves, samples, rough)?
        };
        cells.push(cell);
    }
    Ok(cells)
}

/// The least seconds that a renderer of an estimator takes to build.
fn preparing(scene: &SceneDescription, estimator: &Estimator) -> f64 {
    let seconds = |_| {
        let clock = CpuClock::start();
        let renderer = Renderer::for_estimators(scene, [estimator]);
        let seconds = clock.seconds();
        drop(renderer);
        seconds
    };
    (0..3).map(seconds).fold(f64::INFINITY, f64::min)
}

/// The point of each curve at a number of samples.
fn at(curves: &[Curve], samples: u32) -> impl Iterator<Item = (String, &ContestPoint)> {
    curves.iter().filter_map(move |curve| {
        let point = curve.points.iter().find(|p| p.samples == samples)?;
        Some((curve.settings.estimator.to_string(), point))
    })
}

fn product(point: &ContestPoint) -> f64 {
    point.mse.max(LEAST_ERROR) * point.time
}

/// `hybrid` at a number of samples, and its rivals.
fn rivals(curves: &[Curve], samples: u32) -> Result<(&ContestPoint, Vec<(String, &ContestPoint)>)> {
    let (_, hybrid) = at(curves, samples)
        .find(|(name, _)| name == HYBRID)
        .context("hybrid")?;
    let is_rival = |(name, point): &(String, &ContestPoint)| {
        let is_late = point.mse < NO_NOISE && point.time > PATIENCE * hybrid.time;
        name != HYBRID && !is_late
    };
    Ok((hybrid, at(curves, samples).filter(is_rival).collect()))
}

/// The methods that are measured again, each at the numbers of samples where it is near the best
/// of those with noise, or has none and takes hardly longer than `hybrid`.
fn near(curves: &[Curve], counts: &[u32]) -> Vec<(Settings, Vec<u32>)> {
    let point = |name: &str, samples| Some(at(curves, samples).find(|(of, _)| of == name)?.1);
    let is_near = |name: &str, samples: u32| {
        let (Some(own), Some(hybrid)) = (point(name, samples), point(HYBRID, samples)) else {
            return false;
        };
        let noisy = at(curves, samples).filter(|(of, p)| of != HYBRID && p.mse >= NO_NOISE);
        let least = noisy.map(|(_, p)| product(p)).fold(f64::INFINITY, f64::min);
        [HYBRID, LINES, POINTS].contains(&name)
            || own.mse < NO_NOISE && own.time <= NEAR * hybrid.time
            || own.mse >= NO_NOISE && product(own) <= NEAR * least
    };
    let entry = |curve: &Curve| {
        let name = curve.settings.estimator.to_string();
        let counts = counts.iter().copied().filter(|n| is_near(&name, *n));
        (curve.settings, counts.collect::<Vec<_>>())
    };
    let entries = curves.iter().map(entry);
    entries.filter(|(_, counts)| !counts.is_empty()).collect()
}

/// Judges `hybrid` at a number of samples, by errors against a reference of a known error.
fn cell(curves: &[Curve], samples: u32, rough: f64) -> Result<Cell> {
    let (hybrid, rivals) = rivals(curves, samples)?;
    let best = rivals
        .iter()
        .min_by(|a, b| product(a.1).total_cmp(&product(b.1)));
    let (rival, best) = best.context("a rival")?;
    let held = at(curves, samples).filter(|(name, _)| [LINES, POINTS].contains(&&**name));
    let time = held
        .map(|(_, point)| point.time)
        .fold(f64::INFINITY, f64::min);
    let least = hybrid.mse.min(best.mse).max(LEAST_ERROR);
    Ok(Cell {
        scene: String::new(),
        samples,
        ratio: product(hybrid) / product(best),
        rival: rival.clone(),
        us_pixel: [hybrid.time, best.time],
        mse: [hybrid.mse, best.mse],
        time_ratio: hybrid.time / time,
        against: None,
        is_rough: rough > REFERENCE * least,
    })
}

/// Error × time of this tree's `hybrid` over an older program's: errors from small pictures, times
/// from large ones.
fn compare(
    programs: &Programs,
    pixels: &Pixels<'_>,
    (scene, samples): (&str, u32),
    truth: &[DVec3],
) -> Result<f64> {
    let job = Job {
        scene,
        estimator: HYBRID,
        samples,
        size: pixels.size,
        seed: 0,
    };
    let power: f64 = truth.iter().map(|v| v.length_squared()).sum();
    let mut errors = [0.0; 2];
    for (program, error) in errors.iter_mut().enumerate() {
        for seed in 0..PICTURES {
            let image = programs.picture(program, &Job { seed, ..job })?;
            let values = image
                .rgb
                .iter()
                .map(|rgb| DVec3::from_array(rgb.map(f64::from)));
            let squares = values.zip(truth).map(|(v, r)| (v - *r).length_squared());
            *error += squares.sum::<f64>() / (power * PICTURES as f64);
        }
    }
    let [own, other] = programs.in_turns(&job, RUNS)?;
    Ok(errors[0].max(LEAST_ERROR) / errors[1].max(LEAST_ERROR) * own / other)
}
