//! A study in pieces, each computed by itself, anywhere and in any order.

use super::bytes::Broken;
use super::reference::{ReferencePart, Replicates, Values, round};
use super::score::TrialSums;
use super::study::{CellResult, Design, Results};
use super::window::Window;
use super::{Cell, CellRun, Counts, Method, Problem, Reference, Times, Truth, run_cell};
use crate::tables::{LeftOutRow, cpu_name};
use linelit_geometry::DVec3;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// A piece of a study, seconds of work at most where one estimate of an integral takes no longer.
///
/// All trials of an integral are in one unit, so that spreads over trials are those of the whole
/// study however it is cut: large measurements are cut by integrals.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// A round of the reference on some integrals.
    Reference {
        /// Which round.
        round: u32,
        /// The integrals.
        integrals: Range<usize>,
    },
    /// Measurements, timed in turns: all integrals of one or more, or some of one.
    Cells {
        /// Numbers of measurements, as [`Design::cells`] counts them.
        cells: Range<usize>,
        /// The integrals.
        integrals: Range<usize>,
    },
}

/// A unit, and a guess of the processor seconds that it takes: a function of the work counted in a
/// pilot, the same on every machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// The unit.
    pub unit: Unit,
    /// Guess of its processor seconds.
    pub seconds: f64,
}

/// What a unit of a study leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// Of a round of the reference.
    Reference(ReferencePart),
    /// Of measurements, one by one.
    Cells(Vec<CellPart>),
}

/// Sums, times and counts of one measurement on some integrals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellPart {
    pub(super) sums: TrialSums,
    pub(super) times: Times,
    pub(super) counts: Counts,
    /// The processor that was timed.
    pub(super) processor: String,
}

impl CellPart {
    /// Adds what was found on other integrals. Times on different processors are not added: those
    /// are not known then.
    fn join(&mut self, other: Self) {
        self.sums.join(&other.sums);
        self.counts += other.counts;
        if self.processor == other.processor {
            self.times.join(other.times);
        } else {
            self.processor = SEVERAL.to_owned();
            self.times = Times::default();
        }
    }
}

/// The name of the processor of what was measured on several.
const SEVERAL: &str = "several";

/// Seconds of work that a unit is made for.
const UNIT_SECONDS: f64 = 2.0;

/// Units that a problem is cut into at most, but for one of each measurement.
const MOST_UNITS: f64 = 1e5;

/// Estimates of a unit at most, so that they fit into memory (24 bytes each, and as many while they
/// are copied), but for those of one integral.
pub const BLOCK_ESTIMATES: usize = 1 << 22;

/// Integrals of the pilot, spread over all of them, and trials of each.
const PILOT_INTEGRALS: usize = 64;
const PILOT_TRIALS: u32 = 2;
const PILOT_SEED: u64 = 0x0911_0700_0911_0701;

/// A problem, what it is held to, and what is measured on it.
pub struct Job<'a, P: Problem> {
    /// The problem.
    pub problem: &'a P,
    /// The values that errors are measured by.
    pub truth: &'a Truth<P::Settings>,
    /// What is measured.
    pub design: &'a Design<P::Settings>,
}

impl<P: Problem> Clone for Job<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P: Problem> Copy for Job<'_, P> {}

impl<P: Problem> fmt::Debug for Job<'_, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("Job");
        out.field("cells", &self.design.cells().len());
        out.finish_non_exhaustive()
    }
}

/// What a few trials on a few integrals say of a method at a number of samples.
struct Pilot {
    /// Mean over integrals and channels of the variance of one estimate.
    variance: f64,
    /// Seconds of one estimate of one integral, guessed.
    seconds: f64,
}

impl<'a, P: Problem> Job<'a, P> {
    /// The units of a study: those of the reference first. The same on every machine: they follow
    /// from a pilot of a few trials on a few integrals, by its counters and not by clocks.
    #[must_use]
    pub fn units(&self) -> Vec<Planned> {
        let pilots: Vec<Pilot> = self
            .design
            .cells()
            .map(|(method, samples)| self.pilot(method, samples))
            .collect();
        let mut units = self.reference_units(self.rounds(&pilots));
        let integrals = self.problem.integrals();
        let cost = |(pilot, (method, _)): (&Pilot, (&Method<P::Settings>, u32))| {
            pilot.seconds * f64::from(method.trials) * integrals as f64
        };
        let costs: Vec<f64> = pilots.iter().zip(self.design.cells()).map(cost).collect();
        let unit_seconds = UNIT_SECONDS.max(costs.iter().sum::<f64>() / MOST_UNITS);
        let mut cells = 0..0;
        let mut seconds = 0.0;
        let group = |cells: &Range<usize>, seconds| Planned {
            unit: Unit::Cells {
                cells: cells.clone(),
                integrals: 0..integrals,
            },
            seconds,
        };
        for (k, ((method, _), cost)) in self.design.cells().zip(costs).enumerate() {
            let cost = cost.max(self.design.cell_seconds);
            let blocks = blocks(integrals, method.trials, cost / (2.0 * unit_seconds));
            let full = seconds + cost > 1.5 * unit_seconds || blocks.len() > 1;
            if full && !cells.is_empty() {
                units.push(group(&cells, seconds));
                (cells, seconds) = (k..k, 0.0);
            }
            if blocks.len() > 1 {
                units.extend(blocks.into_iter().map(|integrals| Planned {
                    seconds: cost * integrals.len() as f64 / self.problem.integrals() as f64,
                    unit: Unit::Cells {
                        cells: k..k + 1,
                        integrals,
                    },
                }));
                cells = k + 1..k + 1;
            } else {
                cells.end = k + 1;
                seconds += cost;
            }
        }
        if !cells.is_empty() {
            units.push(group(&cells, seconds));
        }
        units
    }

    /// Rounds of the reference, so many that its error should be below a twentieth of the smallest
    /// variance that the pilot found (a tenth is wanted, and a pilot is no more than a guess), and
    /// [`Design::reference_rounds`] at most.
    fn rounds(&self, pilots: &[Pilot]) -> u32 {
        let Truth::Computed(method) = self.truth else {
            return 0;
        };
        let samples = self.design.reference_samples();
        let pilot = self.pilot(method, samples);
        let noisy = pilots.iter().map(|p| p.variance).filter(|v| *v > 0.0);
        let smallest = noisy.fold(f64::INFINITY, f64::min);
        let wanted = pilot.variance / (0.05 * smallest * f64::from(method.trials));
        #[allow(clippy::cast_possible_truncation, reason = "saturates")]
        let rounds = wanted.ceil() as u32;
        rounds.clamp(1, self.design.reference_rounds.max(1))
    }

    /// The units of so many rounds of the reference; none for known values.
    #[must_use]
    pub fn reference_units(&self, rounds: u32) -> Vec<Planned> {
        let Truth::Computed(method) = self.truth else {
            return Vec::new();
        };
        let pilot = self.pilot(method, self.design.reference_samples());
        let integrals = self.problem.integrals();
        let cost = pilot.seconds * f64::from(method.trials) * integrals as f64;
        let blocks = blocks(integrals, method.trials, cost / (2.0 * UNIT_SECONDS));
        let units = (0..rounds).flat_map(|round| {
            let unit = move |integrals: &Range<usize>| Planned {
                seconds: pilot.seconds * f64::from(method.trials) * integrals.len() as f64,
                unit: Unit::Reference {
                    round,
                    integrals: integrals.clone(),
                },
            };
            blocks.iter().map(unit)
        });
        units.collect()
    }

    fn pilot(&self, method: &Method<P::Settings>, samples: u32) -> Pilot {
        let all = self.problem.integrals();
        let count = all.min(PILOT_INTEGRALS);
        let window = Window {
            problem: self.problem,
            first: 0,
            step: (all / count.max(1)).max(1),
            count,
        };
        let cell = Cell {
            settings: method.settings.clone(),
            samples,
            seed: PILOT_SEED,
            trials: PILOT_TRIALS,
        };
        let run = run_cell(&window, cell);
        let nothing = Reference::known(vec![DVec3::ZERO; count]);
        let score = TrialSums::of(&run, nothing.all()).score(count);
        let estimates = f64::from(PILOT_TRIALS) * count as f64;
        Pilot {
            variance: score.variance,
            seconds: guess(&run.counts, samples, estimates) / estimates.max(1.0),
        }
    }

    /// The reference from its parts, in the order of their units. Known values need none.
    ///
    /// # Panics
    /// If known values are not one for each integral.
    #[must_use]
    pub fn reference(&self, replicates: Replicates) -> Reference {
        match self.truth {
            Truth::Known(values) => {
                assert_eq!(
                    values.len(),
                    self.problem.integrals(),
                    "a value per integral"
                );
                Reference::known(values.clone())
            }
            Truth::Computed(method) => {
                let samples = self.design.reference_samples();
                replicates.reference(method, samples, self.problem.pixels())
            }
        }
    }

    /// Computes a unit on the threads of the rayon pool that it is called in. `reference` is asked
    /// for by measurements alone. All but times is the same on every machine.
    ///
    /// # Errors
    /// Whatever `reference` fails with, and [`Broken`] for a unit of another study.
    pub fn compute<'r, E: From<Broken>>(
        &self,
        unit: &Unit,
        reference: impl FnOnce() -> Result<&'r Reference, E>,
    ) -> Result<Part, E> {
        match (unit, self.truth) {
            (
                Unit::Reference {
                    round: k,
                    integrals,
                },
                Truth::Computed(method),
            ) if integrals.end <= self.problem.integrals() => {
                let samples = self.design.reference_samples();
                let part = round(self.problem, method, samples, *k, integrals.clone());
                Ok(Part::Reference(part))
            }
            (Unit::Cells { cells, integrals }, _)
                if integrals.end <= self.problem.integrals()
                    && cells.end <= self.design.cells().len() =>
            {
                let values = reference()?.of(integrals.clone());
                let values = values.ok_or(Broken("values of integrals"))?;
                Ok(Part::Cells(self.cells(
                    cells.clone(),
                    integrals.start,
                    values,
                )))
            }
            _ => Err(Broken("the same study").into()),
        }
    }

    fn cells(&self, cells: Range<usize>, first: usize, values: Values<'_>) -> Vec<CellPart> {
        let window = Window {
            problem: self.problem,
            first,
            step: 1,
            count: values.values.len(),
        };
        let processor = cpu_name();
        let mut runs: Vec<(CellRun<P::Settings>, TrialSums)> = Vec::new();
        for (method, samples) in self.design.cells().skip(cells.start).take(cells.len()) {
            let cell = Cell {
                settings: method.settings.clone(),
                samples,
                seed: self.design.seed,
                trials: method.trials,
            };
            let mut run = run_cell(&window, cell);
            let sums = TrialSums::of(&run, values);
            run.values = Vec::new();
            runs.push((run, sums));
        }
        // Short ones are measured again and again, in turns; blocks are as long as they are.
        let mut known = values.values.len() < self.problem.integrals();
        while !known {
            known = true;
            for (run, _) in &mut runs {
                known &= run.time_again(&window, self.design.cell_seconds);
            }
        }
        let part = |(run, sums): (CellRun<P::Settings>, TrialSums)| CellPart {
            sums,
            times: run.times,
            counts: run.counts,
            processor: processor.clone(),
        };
        runs.into_iter().map(part).collect()
    }
}

/// Cuts integrals into at least so many blocks, and so small that their estimates fit into memory.
fn blocks(integrals: usize, trials: u32, least: f64) -> Vec<Range<usize>> {
    let estimates = integrals.saturating_mul(trials as usize);
    #[allow(clippy::cast_possible_truncation, reason = "saturates, and is clamped")]
    let least = (least.ceil() as usize).max(estimates.div_ceil(BLOCK_ESTIMATES));
    let count = least.clamp(1, integrals.max(1));
    let edge = |k: usize| integrals / count * k + (integrals % count) * k / count;
    (0..count).map(|k| edge(k)..edge(k + 1)).collect()
}

/// Seconds of processor time for work that was counted, on one machine of 2026: within a factor of
/// three on the scenes of the default study.
fn guess(counts: &Counts, samples: u32, estimates: f64) -> f64 {
    let nanoseconds = 15.0 * counts.rays as f64
        + 15.0 * counts.line_queries as f64
        + 4.0 * counts.node_tests as f64
        + 11.0 * counts.triangle_tests as f64
        + 110.0 * counts.intervals as f64
        + 400.0 * counts.exact_tests as f64
        + (5.0 * f64::from(samples) + 200.0) * estimates;
    1e-9 * nanoseconds
}

/// The results of a study, put together from parts: the same bits whatever computed them, if the
/// parts are handed over in the order of their units. What is missing is left out.
pub struct Gathering<'a, P: Problem> {
    job: Job<'a, P>,
    replicates: Replicates,
    cells: Vec<Gathered>,
}

/// What was found of one measurement.
#[derive(Clone, Debug, Default)]
struct Gathered {
    part: Option<CellPart>,
    integrals: usize,
}

impl<P: Problem> fmt::Debug for Gathering<'_, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = f.debug_struct("Gathering");
        out.field("cells", &self.cells).finish_non_exhaustive()
    }
}

impl<'a, P: Problem> Gathering<'a, P> {
    /// Nothing yet.
    #[must_use]
    pub fn new(job: Job<'a, P>) -> Self {
        Self {
            job,
            replicates: Replicates::new(job.problem.integrals()),
            cells: vec![Gathered::default(); job.design.cells().len()],
        }
    }

    /// What the parts are of.
    #[must_use]
    pub const fn job(&self) -> Job<'a, P> {
        self.job
    }

    /// Adds a unit's part.
    pub fn add(&mut self, unit: &Unit, part: Part) {
        match (unit, part) {
            (Unit::Cells { cells, integrals }, Part::Cells(parts)) => {
                let own = self.cells.iter_mut().skip(cells.start);
                for (own, part) in own.zip(parts) {
                    own.integrals += integrals.len();
                    match &mut own.part {
                        Some(own) => own.join(part),
                        none => *none = Some(part),
                    }
                }
            }
            (_, Part::Reference(part)) => self.replicates.add(&part),
            (Unit::Reference { .. }, Part::Cells(_)) => {}
        }
    }

    /// The reference, once all its parts are there.
    ///
    /// # Panics
    /// If known values are not one for each integral.
    #[must_use]
    pub fn reference(&self) -> Reference {
        self.job.reference(self.replicates.clone())
    }

    /// The results; measurements that lack a part are left out.
    ///
    /// # Panics
    /// If known values are not one for each integral.
    #[must_use]
    pub fn results(self) -> Results {
        let Self {
            job,
            replicates,
            cells: gathered,
        } = self;
        let (problem, design) = (job.problem, job.design);
        let reference = job.reference(replicates);
        let (mut cells, mut left_out) = (Vec::new(), Vec::new());
        for ((method, samples), own) in design.cells().zip(gathered) {
            match own.part {
                Some(part) if own.integrals == problem.integrals() => cells.push(CellResult {
                    estimator: method.estimator.clone(),
                    sampler: method.sampler.clone(),
                    samples,
                    trials: method.trials,
                    score: part.sums.score(problem.pixels()),
                    times: part.times,
                    processor: part.processor,
                    counts: part.counts,
                }),
                _ => left_out.push(LeftOutRow {
                    scene: String::new(),
                    estimator: method.estimator.clone(),
                    sampler: method.sampler.clone(),
                    samples,
                }),
            }
        }
        let squares: f64 = reference.values.iter().map(|v| v.length_squared()).sum();
        Results {
            integrals: problem.integrals(),
            pixels: problem.pixels(),
            power: squares / (3.0 * problem.pixels().max(1) as f64),
            reference,
            cells,
            left_out,
        }
    }
}
