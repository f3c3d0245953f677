//! `bench mis`: what it costs to know the density of one technique at another's samples.

use super::scenes;
use crate::args::BenchArgs;
use anyhow::{Context, Result, bail};
use linelit_cli::output::{Output, OutputError};
use linelit_cli::words::SampleCounts;
use linelit_integrator::{Counts, Estimator, Renderer, Settings, Workspace};
use linelit_study::pixels::Resolution;
use linelit_study::scene_study::{Targets, all_pixels};
use serde_json::json;
use std::hint::black_box;
use std::time::Instant;

/// What is measured unless told: two to six techniques.
const MIXES: [&str; 5] = [
    "line-solid-angle+point-bsdf",
    "line-solid-angle+point-solid-angle",
    "line-solid-angle[orientation=spread:2]",
    "line-solid-angle[orientation=spread:2]+point-solid-angle+point-bsdf",
    "line-solid-angle[orientation=spread:4]+point-solid-angle+point-bsdf",
];

/// Points timed together.
const CHUNK: usize = 16;

/// What one mix costs per shading point: with a traversal for each line and point, of samples and
/// of densities, as published; and with one shaft that answers them all.
struct Cost {
    /// Microseconds.
    time: [f64; 2],
    /// Rays and shafts.
    traversals: [f64; 2],
    /// Densities of line techniques at others' samples.
    densities: f64,
}

impl Cost {
    /// Nanoseconds a question, be it what is visible of a line or whether a point is; drawing the
    /// sample, its light, densities and weight are included.
    fn per_question(&self) -> [f64; 2] {
        self.time.map(|time| 1e3 * time / self.traversals[0])
    }
}

/// Prints the table.
pub(super) fn run(args: &BenchArgs, out: &mut Output) -> Result<()> {
    let samples = match &args.samples {
        Some(SampleCounts(list)) => list[0],
        None => 16,
    };
    let mixes = match &args.estimators {
        Some(list) => list.0.clone(),
        None => {
            let parsed = MIXES.map(|text| text.parse().context("a built-in name"));
            parsed.into_iter().collect::<Result<Vec<Estimator>>>()?
        }
    };
    let mut rows = Vec::new();
    for name in scenes(args) {
        let mut scene = args.read.library().load_lit(name)?.scene;
        let Resolution { width, height } = args.resolution;
        scene.set_resolution(width, height);
        let renderer = Renderer::new(&scene);
        let targets = Targets::find(&renderer, &all_pixels(width, height));
        if !args.json {
            writeln!(
                out,
                "{name}, N = {samples}; per shading point, one traversal a question | one shaft"
            )?;
        }
        for mix in &mixes {
            if mix.alone().is_some() {
                bail!("`{mix}` is no combination");
            }
            let cost = measure(&targets, mix, samples, args.rounds);
            if args.json {
                rows.push(json!({
                    "scene": name, "estimator": mix.to_string(), "samples": samples,
                    "densities": cost.densities,
                    "traversals_apart": cost.traversals[0], "traversals_shared": cost.traversals[1],
                    "us_apart": cost.time[0], "us_shared": cost.time[1],
                    "ns_question_apart": cost.per_question()[0], "ns_question_shared": cost.per_question()[1],
                }));
            } else {
                print(mix, &cost, out)?;
            }
        }
    }
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&rows)?)?;
    }
    Ok(())
}

fn print(mix: &Estimator, cost: &Cost, out: &mut Output) -> Result<(), OutputError> {
    let [apart, shared] = cost.per_question();
    writeln!(
        out,
        "  {:70} {:5.1} densities, traversals {:5.1} | {:4.2}, us {:6.2} | {:5.2}, ns a question {:5.0} | {:4.0}",
        mix.to_string(),
        cost.densities,
        cost.traversals[0],
        cost.traversals[1],
        cost.time[0],
        cost.time[1],
        apart,
        shared,
    )
}

/// Runs both ways in alternation; each chunk's time is the least of all rounds.
fn measure(targets: &Targets<'_>, mix: &Estimator, samples: u32, rounds: u32) -> Cost {
    let mut workspace = Workspace::new();
    let chunks = targets.points.len().div_ceil(CHUNK);
    let mut least = [(); 2].map(|()| vec![f64::INFINITY; chunks]);
    let mut counts = [Counts::default(); 2];
    for seed in 0..rounds {
        for (k, share) in [false, true].into_iter().enumerate() {
            let settings = Settings {
                estimator: *mix,
                samples,
                seed: u64::from(seed),
                share,
                ..Settings::default()
            };
            workspace.take_counts();
            for (chunk, least) in targets.points.chunks(CHUNK).zip(&mut least[k]) {
                let start = Instant::now();
                for (pixel, point) in chunk {
                    black_box(
                        targets
                            .renderer
                            .direct(&settings, point, *pixel, 0, &mut workspace),
                    );
                }
                *least = least.min(start.elapsed().as_secs_f64());
            }
            counts[k] += workspace.take_counts();
        }
    }
    let per_point = |n: u64| n as f64 / (targets.points.len() as f64 * f64::from(rounds));
    let points = targets.points.len() as f64;
    Cost {
        time: least.map(|chunks| chunks.iter().sum::<f64>() * 1e6 / points),
        traversals: counts.map(|c| per_point(c.visibility.rays + c.visibility.shafts)),
        densities: per_point(counts[1].plan.density_lines),
    }
}
