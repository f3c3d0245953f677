//! A study in pieces, each computed by itself, anywhere and in any order.

use super::run::{Span, run_span};
use super::score::TrialSums;
use super::{
    Cell, CellRun, Counts, Design, Method, Problem, Reference, ReferencePart, Times, Truth,
};
use crate::tables::cpu_name;
use anyhow::{Result, bail};
use linelit_geometry::DVec3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A piece of a study, seconds of work at most where one estimate of an integral takes no longer.
///
/// All trials of an integral are in one unit, so that spreads over trials are those of the whole
/// study however it is cut: large measurements are cut by integrals.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// A round of the reference on some integrals.
    Reference {
        /// The number of the round.
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
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// The unit.
    pub unit: Unit,
    /// Guess of its processor seconds.
    pub seconds: f64,
}

/// The result of a unit of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// A part of a round of the reference.
    Reference(ReferencePart),
    /// The parts of measurements, one by one.
    Cells(Vec<CellPart>),
}

/// A part as bytes, from which [`from_bytes`] makes the same; or any other value.
#[must_use]
pub fn to_bytes(value: &impl Serialize) -> Vec<u8> {
    // Memory takes everything; bytes that are none would be refused.
    postcard::to_allocvec(value).unwrap_or_default()
}

/// The value that some bytes are of.
///
/// # Errors
/// If they are not those of such a value, or more than those.
pub fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) => bail!("bytes beyond a part"),
        Err(why) => bail!("not a part of this study: {why}"),
    }
}

/// Sums, times and counts of one measurement on some integrals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellPart {
    /// Number of integrals.
    pub(super) integrals: usize,
    pub(super) sums: TrialSums,
    pub(super) times: Times,
    pub(super) counts: Counts,
    /// The processor that was timed.
    pub(super) processor: String,
}

impl CellPart {
    /// Adds what was found on other integrals. Times on different processors are not added: those
    /// are not known then.
    pub(super) fn join(&mut self, other: Self) {
        self.integrals += other.integrals;
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
#[derive(Debug)]
pub struct Job<'a, P: Problem> {
    /// The problem.
    pub problem: &'a P,
    /// The values that errors are measured by.
    pub truth: &'a Truth<P::Settings>,
    /// The design of the study.
    pub design: &'a Design<P::Settings>,
}

/// The result of a few trials on a few integrals by a method at a number of samples.
struct Pilot {
    /// Mean over integrals and channels of the variance of one estimate.
    variance: f64,
    /// Seconds of all trials of all integrals, guessed.
    seconds: f64,
}

impl<P: Problem> Job<'_, P> {
    /// The units of a study: those of the reference first. The same on every machine: they follow
    /// from a pilot of a few trials on a few integrals, by its counters and not by clocks.
    #[must_use]
    pub fn units(&self) -> Vec<Planned> {
        let cells = || self.design.cells();
        let pilots: Vec<Pilot> = cells().map(|(m, n)| self.pilot(m, n)).collect();
        let mut units = self.reference_units(self.rounds(&pilots));
        let all = self.problem.integrals();
        let total: f64 = pilots.iter().map(|p| p.seconds).sum();
        let unit_seconds = UNIT_SECONDS.max(total / MOST_UNITS);
        for (k, ((method, _), pilot)) in cells().zip(&pilots).enumerate() {
            let cost = pilot.seconds.max(self.design.cell_seconds);
            for block in blocks(all, method.trials, cost / (2.0 * unit_seconds)) {
                // Neighbours that are not cut share a unit.
                let whole = block == (0..all);
                match units.last_mut() {
                    Some(Planned {
                        unit: Unit::Cells { cells, integrals },
                        seconds,
                    }) if whole && *integrals == block && *seconds + cost <= 1.5 * unit_seconds => {
                        cells.end = k + 1;
                        *seconds += cost;
                    }
                    _ => units.push(Planned {
                        seconds: cost * (block.len() as f64 / all.max(1) as f64),
                        unit: Unit::Cells {
                            cells: k..k + 1,
                            integrals: block,
                        },
                    }),
                }
            }
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
        let pilot = self.pilot(method, self.design.reference_samples());
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
        let all = self.problem.integrals();
        let cost = self.pilot(method, self.design.reference_samples()).seconds;
        let blocks = blocks(all, method.trials, cost / (2.0 * UNIT_SECONDS));
        let units = (0..rounds).flat_map(|round| {
            blocks.iter().map(move |integrals| Planned {
                seconds: cost * (integrals.len() as f64 / all.max(1) as f64),
                unit: Unit::Reference {
                    round,
                    integrals: integrals.clone(),
                },
            })
        });
        units.collect()
    }

    /// A guess of the processor seconds of one trial of all integrals, by a pilot.
    pub(crate) fn trial_seconds(&self, method: &Method<P::Settings>, samples: u32) -> f64 {
        self.pilot(method, samples).seconds / f64::from(method.trials)
    }

    fn pilot(&self, method: &Method<P::Settings>, samples: u32) -> Pilot {
        let all = self.problem.integrals();
        let count = all.min(PILOT_INTEGRALS);
        let span = Span {
            first: 0,
            step: (all / count.max(1)).max(1),
            count,
        };
        let cell = Cell {
            trials: PILOT_TRIALS,
            ..method.cell(samples, PILOT_SEED)
        };
        let run = run_span(self.problem, cell, span);
        let nothing = Reference::known(vec![DVec3::ZERO; all]);
        let estimates = f64::from(PILOT_TRIALS) * count as f64;
        let one = guess(&run.counts, samples, estimates) / estimates.max(1.0);
        Pilot {
            variance: TrialSums::of(&run, &nothing).score(count).variance,
            seconds: one * f64::from(method.trials) * all as f64,
        }
    }

    /// Computes a unit on the threads of the rayon pool that it is called in. `reference` is asked
    /// for by measurements alone. All but times is the same on every machine.
    ///
    /// # Errors
    /// Whatever `reference` fails with, and for a unit or a reference of another study.
    pub fn compute<'r>(
        &self,
        unit: &Unit,
        reference: impl FnOnce() -> Result<&'r Reference>,
    ) -> Result<Part> {
        let all = self.problem.integrals();
        match (unit, self.truth) {
            (Unit::Reference { round, integrals }, Truth::Computed(method))
                if integrals.end <= all =>
            {
                let samples = self.design.reference_samples();
                let integrals = integrals.clone();
                let part = ReferencePart::new(self.problem, method, samples, *round, integrals);
                Ok(Part::Reference(part))
            }
            (Unit::Cells { cells, integrals }, _)
                if integrals.end <= all && cells.end <= self.design.cells().len() =>
            {
                let reference = reference()?;
                if reference.values.len() != all {
                    bail!("the reference of another study");
                }
                Ok(Part::Cells(self.cells(cells, integrals, reference)))
            }
            _ => bail!("a unit of another study"),
        }
    }

    fn cells(
        &self,
        cells: &Range<usize>,
        integrals: &Range<usize>,
        reference: &Reference,
    ) -> Vec<CellPart> {
        let processor = cpu_name();
        let mut runs: Vec<(CellRun<P::Settings>, TrialSums)> = Vec::new();
        for (method, samples) in self.design.cells().skip(cells.start).take(cells.len()) {
            let cell = method.cell(samples, self.design.seed);
            let mut run = run_span(self.problem, cell, integrals.clone().into());
            let sums = TrialSums::of(&run, reference);
            run.values = Vec::new();
            runs.push((run, sums));
        }
        // Short ones are measured again and again, in turns; blocks are as long as they are.
        let mut known = integrals.len() < self.problem.integrals();
        while !known {
            known = true;
            for (run, _) in &mut runs {
                known &= run.time_again(self.problem, self.design.cell_seconds);
            }
        }
        let part = |(run, sums): (CellRun<P::Settings>, TrialSums)| CellPart {
            integrals: integrals.len(),
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
