//! `bench choice`: whether `hybrid` is the best choice, by error × time over all other methods.
//!
//! A few pixels of each scene are estimated by all methods at each number of samples, twice;
//! methods whose error × time is near the best of a cell (a scene at a number of samples) are
//! measured again and again. The time of a pixel is the time of its camera ray and its light, plus
//! the time that the method takes to prepare the scene, divided by the number of pixels of a
//! picture of the scene's own resolution.

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

/// The least error in products of error × time; smaller errors are replaced by this number. Errors
/// are mean squared errors over the mean square of the reference.
const LEAST_ERROR: f64 = 1e-8;
/// The error, relative to the mean square of the reference, below which a method counts as one
/// without noise: the error is then only rounding.
const NO_NOISE: f64 = 1e-20;
/// The largest time of a method without noise, as a multiple of the time of `hybrid`, up to which
/// it counts as a rival. A ratio of `hybrid` to its rival up to this number counts as good.
const PATIENCE: f64 = 1.25;
/// The factor within which a method's error × time must be of the best of a cell, according to two
/// measurements, so that the method is measured again.
const NEAR: f64 = 2.0;
/// The largest error of a reference, as a fraction of the errors that are measured by it; cells
/// with a larger error are marked as rough.
const REFERENCE: f64 = 0.1;
/// The method that is judged.
const HYBRID: &str = "hybrid";
/// The method by lines whose time the time of `hybrid` is compared with.
const LINES: &str = "line-analytic";
/// The method by points whose time the time of `hybrid` is compared with.
const POINTS: &str = "point-area[visibility=shaft]";
/// The number of pictures, with different seeds, over which errors are averaged for the comparison
/// with an older program.
const PICTURES: u64 = 4;
/// The number of times that each program renders a picture, in turns, for the comparison of times.
const RUNS: u32 = 3;

/// The problem that is measured: the pixels of a small picture, as integrals.
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
    /// The error × time of `hybrid`, divided by the least error × time of the other methods.
    ratio: f64,
    /// The method with the least error × time of the others, the rival.
    rival: String,
    /// The time of a pixel in microseconds, by `hybrid` and by its rival.
    us_pixel: [f64; 2],
    /// The mean squared error over the mean square of the reference, by `hybrid` and by its rival.
    mse: [f64; 2],
    /// The time of `hybrid`, divided by the lesser of the times of lines and of points in a shaft.
    time_ratio: f64,
    /// The error × time of `hybrid`, divided by the error × time of an older program's `hybrid`, if
    /// there is one to compare with.
    against: Option<f64>,
    /// Whether the error of the reference is more than [`REFERENCE`] of the errors measured by it.
    is_rough: bool,
}

/// Judges all scenes and prints the cells.
pub(crate) fn run(args: &ChoiceArgs, out: &mut Output) -> Result<()> {
    let programs = args.against.as_deref().map(Programs::new).transpose()?;
    // Judge the scenes, and print their cells as they come.
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
    // Print all cells as JSON, or how good the ratios are.
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

/// Prints how many ratios are at most [`PATIENCE`], and their geometric mean and maximum.
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

/// Returns all methods that the program lists. Methods by points are in the list twice: with
/// visibility by rays, and by shafts where that is possible.
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
    // Add the time that each method takes to prepare the scene, beyond the least of all methods, to
    // the time of a pixel.
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

/// Returns the time, in seconds, that building a renderer for an estimator takes: the least of
/// three measurements.
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

/// Returns, for each curve that was measured at this number of samples, the name of its estimator
/// and its point there.
fn at(curves: &[Curve], samples: u32) -> impl Iterator<Item = (String, &ContestPoint)> {
    curves.iter().filter_map(move |curve| {
        let point = curve.points.iter().find(|p| p.samples == samples)?;
        Some((curve.settings.estimator.to_string(), point))
    })
}

fn product(point: &ContestPoint) -> f64 {
    point.mse.max(LEAST_ERROR) * point.time
}

/// Returns the measurement of `hybrid` at a number of samples, and its rivals with their names: all
/// other methods, except those without noise that take much longer.
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

/// Returns the methods that are measured again, each with the numbers of samples at which it is. A
/// method with noise is measured again where its error × time is within [`NEAR`] of the best, and a
/// method without noise where its time is within [`NEAR`] of the time of `hybrid`.
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

/// Judges `hybrid` at a number of samples. `rough` is the relative mean squared error of the
/// reference.
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

/// Returns the error × time of this tree's `hybrid`, divided by the error × time of an older
/// program's. Errors are measured on small pictures, times on large ones.
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
    // Average the errors of small pictures with several seeds.
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
    // Time both programs, and compare error × time.
    let [own, other] = programs.in_turns(&job, RUNS)?;
    Ok(errors[0].max(LEAST_ERROR) / errors[1].max(LEAST_ERROR) * own / other)
}
