//! One estimator at one number of samples, over all pixels and trials.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::CpuClock;
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, Settings, ShadingPoint, Workspace};
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;

/// Pixels a thread takes at a time: so many that reading the clock takes none.
const CHUNK: usize = 16;

/// Processor seconds of a pass at least, where there is work for as much: what is timed at once.
/// Many readings of the clock fit into it, and few interruptions.
const PASS_SECONDS: f64 = 0.01;

/// Processor seconds that a cell is measured for, unless told.
pub const CELL_SECONDS: f64 = 0.1;

/// The shading points of a study: found once, estimated many times.
#[derive(Debug)]
pub struct Targets {
    /// The pixels with something to shade, and where their rays meet the scene.
    pub points: Vec<([u32; 2], ShadingPoint)>,
    /// All pixels asked for.
    pub pixels: usize,
}

impl Targets {
    /// Shoots one ray through the centre of each pixel.
    #[must_use]
    pub fn find(renderer: &Renderer<'_>, pixels: &[[u32; 2]]) -> Self {
        let found: Vec<_> = pixels
            .par_chunks(64)
            .map_init(Workspace::new, |workspace, chunk| {
                let shade = |&pixel: &[u32; 2]| {
                    renderer
                        .shading_point(pixel, workspace)
                        .map(|point| (pixel, point))
                };
                chunk.iter().filter_map(shade).collect::<Vec<_>>()
            })
            .collect();
        Self {
            points: found.into_iter().flatten().collect(),
            pixels: pixels.len(),
        }
    }
}

/// What is run: settings (their seed is the first trial's) and a number of trials.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Estimator, pattern, samples, first seed.
    pub settings: Settings,
    /// Independent trials.
    pub trials: u32,
}

/// What a run gave.
#[derive(Clone, Debug)]
pub struct CellRun {
    /// What was run.
    pub cell: Cell,
    /// Estimates: `values[point * trials + trial]`.
    pub values: Vec<DVec3>,
    /// What the trials took, without any set-up.
    pub times: Times,
    /// What was counted.
    pub counts: Counts,
}

impl CellRun {
    /// The estimates of one point, trial by trial.
    #[must_use]
    pub fn trials_of(&self, point: usize) -> &[DVec3] {
        let n = self.cell.trials as usize;
        &self.values[point * n..(point + 1) * n]
    }

    /// Runs the cell again, only for its time, for as long as a pass takes; nothing once it has
    /// been measured for `enough` seconds and twice. To be called in turns with other cells, so
    /// that each is measured in good and in bad times of the machine. Whether the time is known
    /// now.
    pub fn time_again(&mut self, renderer: &Renderer<'_>, targets: &Targets, enough: f64) -> bool {
        if self.times.total() >= enough && self.times.passes.len() > 1 {
            return true;
        }
        let whole = self.times.seconds() * f64::from(self.cell.trials);
        let repeats = times_into(PASS_SECONDS, whole);
        let pass = pass(renderer, targets, self.cell, 0..self.cell.trials, repeats);
        self.times
            .add(&pass, f64::from(self.cell.trials) * f64::from(repeats));
        false
    }
}

/// How long passes over all points took.
#[derive(Clone, Debug, Default)]
pub struct Times {
    passes: Vec<PassTime>,
}

#[derive(Clone, Copy, Debug)]
struct PassTime {
    trials: f64,
    cpu: f64,
    wall: f64,
}

impl Times {
    fn add(&mut self, pass: &Pass, trials: f64) {
        self.passes.push(PassTime {
            trials,
            cpu: pass.cpu,
            wall: pass.wall,
        });
    }

    fn total(&self) -> f64 {
        self.passes.iter().map(|p| p.cpu).sum()
    }

    fn mean(&self, of: fn(&PassTime) -> f64) -> f64 {
        let trials: f64 = self.passes.iter().map(|p| p.trials).sum();
        self.passes.iter().map(of).sum::<f64>() / trials
    }

    /// Processor seconds of one trial over all threads: the mean of all passes.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.mean(|p| p.cpu)
    }

    /// Seconds on the wall of one trial.
    #[must_use]
    pub fn wall_seconds(&self) -> f64 {
        self.mean(|p| p.wall)
    }

    /// Standard deviation of [`Times::seconds`] over passes, in seconds: how far a pass of its own,
    /// 10 ms or more, is from the mean. NaN for one pass, which says nothing of it.
    ///
    /// It is not divided by the root of the number of passes: what disturbs a shared machine lasts
    /// longer than a pass, and would make the mean's error too small.
    #[must_use]
    pub fn error(&self) -> f64 {
        let mean = self.seconds();
        let n = self.passes.len() as f64;
        let square = |p: &PassTime| (p.cpu / p.trials - mean).powi(2);
        (self.passes.iter().map(square).sum::<f64>() / (n - 1.0)).sqrt()
    }
}

/// The seed of a trial: seeds are hashed by the samplers, so neighbours are independent.
#[must_use]
const fn trial_seed(first: u64, trial: u32) -> u64 {
    first.wrapping_add((trial as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// How many times something fits into some seconds, at least once.
fn times_into(seconds: f64, one: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, and is positive"
    )]
    let times = (seconds / one.max(1e-9)).ceil() as u32;
    times.max(1)
}

/// Runs a cell. The values do not depend on the number of threads, nor on how the trials are
/// timed: in passes over all points, of so many trials that each takes a while.
#[must_use]
pub fn run_cell(renderer: &Renderer<'_>, targets: &Targets, cell: Cell) -> CellRun {
    let n = cell.trials as usize;
    let mut run = CellRun {
        cell,
        values: vec![DVec3::ZERO; targets.points.len() * n],
        times: Times::default(),
        counts: Counts::default(),
    };
    let mut first = 0;
    let mut group = 1;
    while first < cell.trials {
        let trials = first..cell.trials.min(first.saturating_add(group));
        let taken = trials.len();
        let pass = pass(renderer, targets, cell, trials.clone(), 1);
        let rows = run.values.chunks_exact_mut(n);
        for (row, values) in rows.zip(pass.values.chunks_exact(taken)) {
            row[first as usize..][..taken].copy_from_slice(values);
        }
        run.counts += pass.counts;
        // The first pass warms up: it counts where it is long enough for that not to show, or
        // there is no other.
        if first > 0 || pass.cpu >= PASS_SECONDS || cell.trials == 1 {
            run.times.add(&pass, f64::from(trials.end - trials.start));
        }
        group = times_into(PASS_SECONDS, pass.cpu / taken as f64);
        first = trials.end;
    }
    run
}

/// Some trials of all points.
struct Pass {
    /// `values[point * trials + trial]`, of the last repetition.
    values: Vec<DVec3>,
    cpu: f64,
    wall: f64,
    counts: Counts,
}

fn pass(
    renderer: &Renderer<'_>,
    targets: &Targets,
    cell: Cell,
    trials: Range<u32>,
    repeats: u32,
) -> Pass {
    let wall = Instant::now();
    let chunks: Vec<_> = targets
        .points
        .par_chunks(CHUNK)
        .map_init(Workspace::new, |workspace, chunk| {
            let mut values = Vec::with_capacity(chunk.len() * trials.len());
            let clock = CpuClock::start();
            for _ in 0..repeats {
                values.clear();
                run_chunk(
                    renderer,
                    chunk,
                    cell,
                    trials.clone(),
                    workspace,
                    &mut values,
                );
            }
            (values, clock.seconds(), workspace.take_counts())
        })
        .collect();
    let mut pass = Pass {
        values: Vec::with_capacity(targets.points.len() * trials.len()),
        cpu: 0.0,
        wall: wall.elapsed().as_secs_f64(),
        counts: Counts::default(),
    };
    for (values, seconds, counts) in chunks {
        pass.values.extend(values);
        pass.cpu += seconds;
        pass.counts += counts;
    }
    pass
}

fn run_chunk(
    renderer: &Renderer<'_>,
    chunk: &[([u32; 2], ShadingPoint)],
    cell: Cell,
    trials: Range<u32>,
    workspace: &mut Workspace,
    values: &mut Vec<DVec3>,
) {
    for (pixel, point) in chunk {
        for trial in trials.clone() {
            let seed = trial_seed(cell.settings.seed, trial);
            let settings = Settings {
                seed,
                ..cell.settings
            };
            values.push(renderer.direct(&settings, point, *pixel, 0, workspace));
        }
    }
}
