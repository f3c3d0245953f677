//! The units of a study: pieces that can be computed separately, anywhere and in any order, and
//! whose parts add up to the same bits.
//!
//! A pilot of a few trials on a few integrals counts the work of each measurement. From these
//! counts, not from clocks, follow the units, so that every machine finds the same ones.

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

/// A piece of a study. It takes at most some seconds, unless a single estimate of an integral takes
/// longer.
///
/// All trials of an integral are in one unit, so that spreads over trials do not depend on how the
/// study is cut: large measurements are cut by integrals.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// One round of the reference on some integrals.
    Reference {
        /// The index of the round, from 0.
        round: u32,
        /// The integrals.
        integrals: Range<usize>,
    },
    /// Measurements that are timed in turns: several measurements of all integrals, or one
    /// measurement of all or some integrals.
    Cells {
        /// The indices of the measurements in the order of [`Design::cells`].
        cells: Range<usize>,
        /// The integrals.
        integrals: Range<usize>,
    },
}

/// A unit and an estimate of the processor time that it takes, which follows from the work counted
/// in a pilot run and is the same on every machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// The unit.
    pub unit: Unit,
    /// The estimate of the unit's processor time, in seconds.
    pub seconds: f64,
}

/// The result of a unit of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// A part of one round of the reference.
    Reference(ReferencePart),
    /// The parts of the unit's measurements, one by one.
    Cells(Vec<CellPart>),
}

/// Serializes a part, or any other value, to bytes from which [`from_bytes`] restores it.
#[must_use]
pub fn to_bytes(value: &impl Serialize) -> Vec<u8> {
    // Serialization into memory cannot fail; if it did, `from_bytes` would refuse the empty bytes.
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Restores a value from the bytes that [`to_bytes`] made of it.
///
/// # Errors
/// If the bytes do not represent such a value, or if there are more of them.
pub fn from_bytes<T: DeserializeOwned>(bytes: &[u8]) -> Result<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) => bail!("bytes beyond a part"),
        Err(why) => bail!("not a part of this study: {why}"),
    }
}

/// The sums, times and counts of one measurement on some integrals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellPart {
    /// The number of integrals.
    pub(super) integrals: usize,
    pub(super) sums: TrialSums,
    pub(super) times: Times,
    pub(super) counts: Counts,
    /// The name of the processor on which the part was timed.
    pub(super) processor: String,
}

impl CellPart {
    /// Adds the part of other integrals. Times on different processors are not added: the time of
    /// the whole is then unknown.
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

/// The processor's name for a measurement that was timed on several processors.
const SEVERAL: &str = "several";

/// The processor time, in seconds, that units should take: longer measurements are cut into several
/// units, and shorter ones share a unit.
const UNIT_SECONDS: f64 = 2.0;

/// The largest number of units of a problem, in addition to one for each measurement.
const MOST_UNITS: f64 = 1e5;

/// The largest number of estimates of a unit, so that they fit into memory (24 bytes each, and as
/// many again while they are copied). A unit of a single integral may have more.
pub const BLOCK_ESTIMATES: usize = 1 << 22;

/// The largest number of integrals of a pilot; they are at equal steps over all integrals.
const PILOT_INTEGRALS: usize = 64;
/// The number of trials of each integral of a pilot.
const PILOT_TRIALS: u32 = 2;
/// The seed of the first trial of a pilot.
const PILOT_SEED: u64 = 0x0911_0700_0911_0701;

/// A problem, its true values, and the design of what is measured on it.
#[derive(Debug)]
pub struct Job<'a, P: Problem> {
    /// The problem.
    pub problem: &'a P,
    /// The values that errors are measured by.
    pub truth: &'a Truth<P::Settings>,
    /// The design of the study.
    pub design: &'a Design<P::Settings>,
}

/// The result of a few trials on a few integrals, by one method at one number of samples.
struct Pilot {
    /// The mean over integrals and channels of the variance of one estimate.
    variance: f64,
    /// The estimated seconds of all trials of all integrals.
    seconds: f64,
}

impl<P: Problem> Job<'_, P> {
    /// Returns the units of a study, the reference's first. They are the same on every machine, as
    /// they follow from the counters of a pilot run of a few trials on a few integrals, and not
    /// from clocks.
    #[must_use]
    pub fn units(&self) -> Vec<Planned> {
        // Run the pilots, and let the reference come first.
        let cells = || self.design.cells();
        let pilots: Vec<Pilot> = cells().map(|(m, n)| self.pilot(m, n)).collect();
        let mut units = self.reference_units(self.rounds(&pilots));
        // Make units longer than usual where there would be too many of them.
        let all = self.problem.integrals();
        let total: f64 = pilots.iter().map(|p| p.seconds).sum();
        let unit_seconds = UNIT_SECONDS.max(total / MOST_UNITS);
        // Cut each measurement by integrals if it is long, and let neighbours share a unit if they
        // are short.
        for (k, ((method, _), pilot)) in cells().zip(&pilots).enumerate() {
            let cost = pilot.seconds.max(self.design.cell_seconds);
            for block in blocks(all, method.trials, cost / (2.0 * unit_seconds)) {
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

    /// Returns the number of rounds of the reference, at most [`Design::reference_rounds`]: as many
    /// as should make its error less than a twentieth of the smallest variance that the pilots
    /// found. A tenth is required; the factor of two allows for the uncertainty of a pilot.
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

    /// Returns the units of this many rounds of the reference; none if the values are known.
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

    /// Returns an estimate, by a pilot, of the processor time of one trial of all integrals, in
    /// seconds.
    pub(crate) fn trial_seconds(&self, method: &Method<P::Settings>, samples: u32) -> f64 {
        self.pilot(method, samples).seconds / f64::from(method.trials)
    }

    /// Runs a pilot of a method: a few trials of integrals at equal steps.
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

    /// Computes a unit on the threads of the rayon pool in which it is called. Only measurements
    /// call `reference`. Everything except times is the same on every machine.
    ///
    /// # Errors
    /// If `reference` fails, or the unit or the reference belongs to another study.
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
                // A round of the reference on these integrals.
                let samples = self.design.reference_samples();
                let integrals = integrals.clone();
                let part = ReferencePart::new(self.problem, method, samples, *round, integrals);
                Ok(Part::Reference(part))
            }
            (Unit::Cells { cells, integrals }, _)
                if integrals.end <= all && cells.end <= self.design.cells().len() =>
            {
                // Measurements, scored against the reference.
                let reference = reference()?;
                if reference.values.len() != all {
                    bail!("the reference of another study");
                }
                Ok(Part::Cells(self.cells(cells, integrals, reference)))
            }
            _ => bail!("a unit of another study"),
        }
    }

    /// Measures a range of cells on some integrals.
    fn cells(
        &self,
        cells: &Range<usize>,
        integrals: &Range<usize>,
        reference: &Reference,
    ) -> Vec<CellPart> {
        // Estimate and score each cell; the estimates themselves are dropped at once.
        let processor = cpu_name();
        let mut runs: Vec<(CellRun<P::Settings>, TrialSums)> = Vec::new();
        for (method, samples) in self.design.cells().skip(cells.start).take(cells.len()) {
            let cell = method.cell(samples, self.design.seed);
            let mut run = run_span(self.problem, cell, integrals.clone().into());
            let sums = TrialSums::of(&run, reference);
            run.values = Vec::new();
            runs.push((run, sums));
        }
        // Time short cells again and again, in turns, until each has been measured for long enough.
        // Blocks of a larger measurement are long already.
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

/// Cuts integrals into at least `least` blocks, and into more where the estimates of a block would
/// not fit into memory.
fn blocks(integrals: usize, trials: u32, least: f64) -> Vec<Range<usize>> {
    let estimates = integrals.saturating_mul(trials as usize);
    #[allow(clippy::cast_possible_truncation, reason = "saturates, and is clamped")]
    let least = (least.ceil() as usize).max(estimates.div_ceil(BLOCK_ESTIMATES));
    let count = least.clamp(1, integrals.max(1));
    let edge = |k: usize| integrals / count * k + (integrals % count) * k / count;
    (0..count).map(|k| edge(k)..edge(k + 1)).collect()
}

/// Returns an estimate of the processor time, in seconds, of the counted work on one machine of
/// 2026. It is within a factor of three on the scenes of the default study.
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
