//! `bench speed`: how long the pictures of this tree take, compared with an older program's.
//!
//! Both programs render the same cells in turns with one thread, and report their seconds
//! themselves, so that neither start-up nor reading counts. Each picture is so large that it takes
//! at least a tenth of a second. The least time of all runs counts, as disturbances only make a run
//! longer.

use crate::args::SpeedArgs;
use crate::figures::{processor, said};
use anyhow::{Context as _, Result};
use linelit_cli::output::Output;
use linelit_film::Image;
use linelit_testkit::folder::Folder;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The scenes that are rendered, each with the least side of its square picture, in pixels.
const SCENES: [(&str, u32); 7] = [
    ("cornell-box-large", 256),
    ("grid-planes-large", 256),
    ("triangle-soup-small", 256),
    ("colonnade-large", 128),
    ("spheres", 256),
    ("plates", 128),
    ("cornell-box-line", 256),
];

/// The methods that are measured, each with its number of samples.
const METHODS: [(&str, u32); 7] = [
    ("point-area", 1),
    ("point-area", 16),
    ("line-analytic", 1),
    ("line-analytic", 16),
    ("exact", 1),
    ("hybrid", 1),
    ("hybrid", 16),
];

/// The scene and the method that are left out: with shafts as dense as in this scene, closed forms
/// take minutes.
const TOO_DENSE: (&str, &str) = ("colonnade-large", "exact");

/// The least time of a picture, in seconds; pictures that take less are enlarged.
const LEAST: f64 = 0.1;

/// A picture to render.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job<'a> {
    pub(crate) scene: &'a str,
    pub(crate) estimator: &'a str,
    pub(crate) samples: u32,
    pub(crate) size: [u32; 2],
    pub(crate) seed: u64,
}

/// The two programs that are compared, this tree's and another one, and the folder for their
/// pictures. Functions refer to the programs by the indices 0 and 1.
#[derive(Debug)]
pub(crate) struct Programs {
    paths: [PathBuf; 2],
    folder: Folder,
}

impl Programs {
    /// Finds this tree's program, which `cargo xtask` has built next to the workshop.
    pub(crate) fn new(other: &Path) -> Result<Self> {
        let own = std::env::current_exe().context("finding the program itself")?;
        let own = own.with_file_name(format!("linelit{}", std::env::consts::EXE_SUFFIX));
        Ok(Self {
            paths: [own, other.to_owned()],
            folder: Folder::new("bench"),
        })
    }

    /// Renders a picture by one of the programs, on one thread; returns the seconds of its
    /// rendering alone.
    fn seconds(&self, program: usize, job: &Job<'_>) -> Result<f64> {
        let [width, height] = job.size;
        let path = self.paths[program].display();
        let mut command = Command::new(&self.paths[program]);
        command.args(["render", job.scene, "--estimator", job.estimator]);
        command.args(["--resolution", &format!("{width}x{height}")]);
        command.args(["--samples", &job.samples.to_string()]);
        command.args(["--seed", &job.seed.to_string()]);
        command.args(["--threads", "1", "--hide-lights", "--json", "-o"]);
        let started = command.arg(self.file()).output();
        let output = started.with_context(|| format!("starting {path}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let last = text.lines().last().unwrap_or_default();
        let result: Value = serde_json::from_str(last).unwrap_or_default();
        result["render_seconds"].as_f64().with_context(|| {
            let noise = String::from_utf8_lossy(&output.stderr);
            format!("{path} rendered no picture of {}: {noise}", job.scene)
        })
    }

    /// Renders a picture by one of the programs, given by its index, and returns it.
    pub(crate) fn picture(&self, program: usize, job: &Job<'_>) -> Result<Image> {
        self.seconds(program, job)?;
        Ok(Image::read(&self.file())?)
    }

    fn file(&self) -> PathBuf {
        self.folder.join("picture.exr")
    }

    /// Returns the least time in seconds that each of the two programs takes for a picture, over
    /// `runs` runs in turns. The picture is enlarged until it takes a tenth of a second.
    pub(crate) fn in_turns(&self, job: &Job<'_>, runs: u32) -> Result<[f64; 2]> {
        // Enlarge the picture until the faster program takes long enough.
        let mut job = *job;
        loop {
            let seconds = self.seconds(1, &job)?.min(self.seconds(0, &job)?);
            if seconds >= LEAST {
                break;
            }
            let factor = (1.3 * LEAST / seconds.max(1e-4)).sqrt();
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "small"
            )]
            let enlarged = job
                .size
                .map(|side| (f64::from(side) * factor).ceil() as u32);
            job.size = enlarged;
        }
        // Time both programs in turns, and take the least time of each.
        let mut least = [f64::INFINITY; 2];
        for _ in 0..runs {
            for (program, least) in least.iter_mut().enumerate() {
                *least = least.min(self.seconds(program, &job)?);
            }
        }
        Ok(least)
    }
}

/// Renders all scenes by all methods, and prints the time of this tree's program divided by the
/// time of the other program.
pub(crate) fn run(args: &SpeedArgs, out: &mut Output) -> Result<()> {
    let programs = Programs::new(&args.against)?;
    let mut cells = Vec::new();
    if !args.json {
        write!(out, "{:20}", "")?;
        for (estimator, samples) in METHODS {
            write!(out, "{:>20}", format!("{estimator} {samples}"))?;
        }
        writeln!(out)?;
    }
    // Measure the cells, and print the rows of the table as they come.
    for (scene, side) in SCENES {
        let mut row = format!("{scene:20}");
        for (estimator, samples) in METHODS {
            if (scene, estimator) == TOO_DENSE {
                row += &format!("{:>20}", "–");
                continue;
            }
            let job = Job {
                scene,
                estimator,
                samples,
                size: [side; 2],
                seed: 0,
            };
            let [own, other] = programs.in_turns(&job, args.runs)?;
            row += &format!("{:>20}", format!("{:.3} ({own:.2} s)", own / other));
            cells.push((
                own / other,
                json!({
                    "scene": scene, "estimator": estimator, "samples": samples,
                    "seconds": own, "against_seconds": other,
                }),
            ));
        }
        if !args.json {
            writeln!(out, "{row}")?;
        }
    }
    sum_up(&cells, args, out)
}

/// Prints the mean and the worst ratio of times, or all ratios as JSON.
fn sum_up(cells: &[(f64, Value)], args: &SpeedArgs, out: &mut Output) -> Result<()> {
    let (date, processor) = (said(&["date", "+%F"]), processor());
    // Find the geometric mean and the worst of the ratios.
    let mean = (cells.iter().map(|(ratio, _)| ratio.ln()).sum::<f64>() / cells.len() as f64).exp();
    let (ratio, worst) = cells
        .iter()
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .context("there are cells")?;
    if args.json {
        let cells: Vec<_> = cells.iter().map(|(_, cell)| cell).collect();
        let all = json!({
            "date": date, "processor": processor, "against": args.against, "runs": args.runs,
            "geometric_mean": mean, "worst": ratio, "cells": cells,
        });
        writeln!(out, "{all}")?;
    } else {
        let against = args.against.display();
        writeln!(
            out,
            "geometric mean {mean:.3}, worst {ratio:.3} ({} {} {}); over {against}, the least of {} runs \
             in turns, one thread, {date}, {processor}",
            worst["scene"].as_str().unwrap_or_default(),
            worst["estimator"].as_str().unwrap_or_default(),
            worst["samples"],
            args.runs,
        )?;
    }
    Ok(())
}
