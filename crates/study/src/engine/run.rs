//! One estimator at one number of samples: all integrals and trials are estimated in parallel, and
//! timed in passes long enough for the clock.
#![allow(clippy::disallowed_methods, reason = "says how long it took")]

use super::times::PassTime;
use super::{Counts, CpuClock, Problem, Times};
use linelit_geometry::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::time::Instant;

/// The number of integrals that a thread estimates between two readings of the clock. With this
/// many, reading the clock takes a negligible part of the time.
const CHUNK: usize = 16;

/// The least processor time of a timed pass, in seconds, where there is enough work. In this time
/// many readings of the clock fit, and few interruptions.
const PASS_SECONDS: f64 = 0.01;

/// The default processor time, in seconds, for which a cell is measured.
pub const CELL_SECONDS: f64 = 0.1;

/// One estimator at one number of samples, in independent trials.
#[derive(Clone, Copy, Debug)]
pub struct Cell<S> {
    /// The settings that [`Problem::estimate`] is called with.
    pub settings: S,
    /// The number of samples of an estimate.
    pub samples: u32,
    /// The seed of the first trial.
    pub seed: u64,
    /// The number of independent trials.
    pub trials: u32,
}

/// A range of a problem's integrals: the `count` integrals with the indices `first`, `first +
/// step`, `first + 2 step`, ….
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) first: usize,
    pub(super) step: usize,
    pub(super) count: usize,
}

impl From<Range<usize>> for Span {
    fn from(integrals: Range<usize>) -> Self {
        Self {
            first: integrals.start,
            step: 1,
            count: integrals.len(),
        }
    }
}

/// The estimates, times and counts of a [`Cell`].
#[derive(Clone, Debug)]
pub struct CellRun<S> {
    /// The cell that was run.
    pub cell: Cell<S>,
    /// The integrals that the cell was run on.
    pub(super) span: Span,
    /// The estimates: `values[integral * trials + trial]`.
    pub values: Vec<DVec3>,
    /// The times of the trials, without set-up.
    pub times: Times,
    /// The work of all trials.
    pub counts: Counts,
}

impl<S> CellRun<S> {
    /// Returns the estimates of one integral, trial by trial.
    #[must_use]
    pub fn trials_of(&self, integral: usize) -> &[DVec3] {
        let n = self.cell.trials as usize;
        &self.values[integral * n..(integral + 1) * n]
    }

    /// Times the cell once more, for about as long as a pass takes, unless it has been measured in
    /// at least two passes and for `enough` seconds. Returns whether that was already so.
    ///
    /// Call it in turns with other cells, so that each is measured both while the machine is quiet
    /// and while it is busy.
    pub fn time_again(&mut self, problem: &impl Problem<Settings = S>, enough: f64) -> bool {
        let (seconds, passes) = self.times.total();
        if seconds >= enough && passes > 1 {
            return true;
        }
        let whole = self.times.seconds() * f64::from(self.cell.trials);
        let repeats = times_into(PASS_SECONDS, whole);
        let pass = pass(problem, &self.cell, self.span, 0..self.cell.trials, repeats);
        self.times.add(pass.time);
        false
    }
}

/// Returns the seed of a trial. Samplers hash their seeds, so that neighbouring seeds are
/// independent.
#[must_use]
const fn trial_seed(first: u64, trial: u32) -> u64 {
    first.wrapping_add((trial as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Returns how many times work that takes `one` seconds fits into `seconds`; at least 1.
fn times_into(seconds: f64, one: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "saturates, and is positive"
    )]
    let times = (seconds / one.max(1e-9)).ceil() as u32;
    times.max(1)
}

/// Runs a cell on all integrals. The trials are timed in passes over all integrals, each of as many
/// trials as take 10 ms together. The values depend neither on these passes nor on the number of
/// threads.
#[must_use]
pub fn run_cell<P: Problem>(problem: &P, cell: Cell<P::Settings>) -> CellRun<P::Settings> {
    run_span(problem, cell, (0..problem.integrals()).into())
}

/// Runs a cell on some integrals.
pub(super) fn run_span<P: Problem>(
    problem: &P,
    cell: Cell<P::Settings>,
    span: Span,
) -> CellRun<P::Settings> {
    let n = cell.trials as usize;
    let mut run = CellRun {
        values: vec![DVec3::ZERO; span.count * n],
        times: Times::default(),
        counts: Counts::default(),
        cell,
        span,
    };
    // Run the trials in groups: one trial first, then as many as fill a pass by the time found.
    let mut first = 0;
    let mut group = 1;
    while first < run.cell.trials {
        let trials = first..run.cell.trials.min(first.saturating_add(group));
        let taken = trials.len();
        let pass = pass(problem, &run.cell, span, trials.clone(), 1);
        // Store the estimates of the group.
        let rows = run.values.chunks_exact_mut(n);
        for (row, values) in rows.zip(pass.values.chunks_exact(taken)) {
            row[first as usize..][..taken].copy_from_slice(values);
        }
        run.counts += pass.counts;
        // Add the time of the group. The first pass warms up the caches: it counts only if it is
        // long enough for that not to matter, or if there is no other.
        if first > 0 || pass.time.cpu >= PASS_SECONDS || n == 1 {
            run.times.add(pass.time);
        }
        group = times_into(PASS_SECONDS, pass.time.cpu / taken as f64);
        first = trials.end;
    }
    run
}

/// The estimates, time and work of some trials of all integrals of a span.
struct TimedPass {
    /// The estimates `values[integral * trials + trial]`, of the last repetition.
    values: Vec<DVec3>,
    time: PassTime,
    counts: Counts,
}

/// Runs some trials of all integrals of a span, `repeats` times.
fn pass<P: Problem>(
    problem: &P,
    cell: &Cell<P::Settings>,
    span: Span,
    trials: Range<u32>,
    repeats: u32,
) -> TimedPass {
    let wall = Instant::now();
    // Estimate the integrals chunk by chunk in parallel, each thread with its own clock.
    let chunks: Vec<_> = (0..span.count.div_ceil(CHUNK))
        .into_par_iter()
        .map_init(P::Workspace::default, |workspace, chunk| {
            let places = chunk * CHUNK..span.count.min((chunk + 1) * CHUNK);
            let mut values = Vec::with_capacity(places.len() * trials.len());
            let clock = CpuClock::start();
            for _ in 0..repeats {
                values.clear();
                for k in places.clone() {
                    let integral = span.first + k * span.step;
                    values.extend(trials.clone().map(|trial| {
                        let seed = trial_seed(cell.seed, trial);
                        problem.estimate(&cell.settings, cell.samples, seed, integral, workspace)
                    }));
                }
            }
            (values, clock.seconds(), problem.take_counts(workspace))
        })
        .collect();
    // Join the chunks in order. Processor time is the sum over threads, wall time is measured once.
    let mut pass = TimedPass {
        values: Vec::with_capacity(span.count * trials.len()),
        time: PassTime {
            trials: f64::from(trials.end - trials.start) * f64::from(repeats),
            cpu: 0.0,
            wall: wall.elapsed().as_secs_f64(),
        },
        counts: Counts::default(),
    };
    for (values, seconds, counts) in chunks {
        pass.values.extend(values);
        pass.time.cpu += seconds;
        pass.counts += counts;
    }
    pass
}
