//! One estimator at one number of samples, over all pixels and trials.

use super::CpuClock;
use linelit_geometry::DVec3;
use linelit_integrator::{Counts, Renderer, Settings, ShadingPoint, Workspace};
use rayon::prelude::*;
use std::time::Instant;

/// Pixels a thread takes at a time.
const CHUNK: usize = 8;

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
    /// Processor seconds over all threads, without any set-up.
    pub cpu_seconds: f64,
    /// Seconds on the wall.
    pub wall_seconds: f64,
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
}

/// The seed of a trial: seeds are hashed by the samplers, so neighbours are independent.
#[must_use]
const fn trial_seed(first: u64, trial: u32) -> u64 {
    first.wrapping_add((trial as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Runs a cell. The values do not depend on the number of threads.
#[must_use]
pub fn run_cell(renderer: &Renderer<'_>, targets: &Targets, cell: Cell) -> CellRun {
    let wall = Instant::now();
    let chunks: Vec<_> = targets
        .points
        .par_chunks(CHUNK)
        .map_init(Workspace::new, |workspace, chunk| {
            let clock = CpuClock::start();
            let values = run_chunk(renderer, chunk, cell, workspace);
            (values, clock.seconds(), workspace.take_counts())
        })
        .collect();
    let mut run = CellRun {
        cell,
        values: Vec::with_capacity(targets.points.len() * cell.trials as usize),
        cpu_seconds: 0.0,
        wall_seconds: wall.elapsed().as_secs_f64(),
        counts: Counts::default(),
    };
    for (values, seconds, counts) in chunks {
        run.values.extend(values);
        run.cpu_seconds += seconds;
        run.counts += counts;
    }
    run
}

fn run_chunk(
    renderer: &Renderer<'_>,
    chunk: &[([u32; 2], ShadingPoint)],
    cell: Cell,
    workspace: &mut Workspace,
) -> Vec<DVec3> {
    let mut values = Vec::with_capacity(chunk.len() * cell.trials as usize);
    for (pixel, point) in chunk {
        for trial in 0..cell.trials {
            let seed = trial_seed(cell.settings.seed, trial);
            let settings = Settings {
                seed,
                ..cell.settings
            };
            values.push(renderer.direct(&settings, point, *pixel, 0, workspace));
        }
    }
    values
}
