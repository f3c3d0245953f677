//! The results of a study, put together from the parts of its units. Come here to run a whole study
//! in one process ([`measure`]) or to gather what several have computed ([`Gathering`]).

#[cfg(doc)]
use super::Design;
use super::reference::Replicates;
use super::units::{CellPart, Job, Part, Planned, Unit};
use super::{Method, Problem, Reference, Score, Truth};
use crate::tables::{LeftOutRow, ResultRow};
use anyhow::Context as _;

/// The errors and times of all methods on one problem.
#[derive(Clone, Debug)]
pub struct Results {
    /// The number of integrals.
    pub integrals: usize,
    /// The number of pixels, which sums of errors are divided by ([`Problem::pixels`]).
    pub pixels: usize,
    /// The reference.
    pub reference: Reference,
    /// The mean over pixels and channels of the square of the reference, which squared errors are
    /// relative to.
    pub power: f64,
    /// All measurements, in the order of [`Design::cells`].
    pub cells: Vec<CellResult>,
    /// The measurements of which a part is missing. The name of the scene is still empty.
    pub left_out: Vec<LeftOutRow>,
}

/// The error and time of one method at one number of samples.
#[derive(Clone, Debug)]
pub struct CellResult {
    /// The row of the tables. The names of the scene and of the pixels are still empty.
    pub row: ResultRow,
    /// The errors, trial by trial.
    pub score: Score,
}

impl CellResult {
    /// Computes the errors from the sums of `part`, which must cover all integrals. Sums over
    /// integrals are divided by a number of `pixels`.
    fn new<S>(part: CellPart, method: &Method<S>, samples: u32, pixels: usize) -> Self {
        let (score, counts) = (part.sums.score(pixels), part.counts);
        // Make the row of the tables; whoever adds it to a record names the scene and the pixels.
        let row = ResultRow {
            scene: String::new(),
            pixels: String::new(),
            estimator: method.estimator.clone(),
            sampler: method.sampler.clone(),
            samples,
            trials: method.trials,
            mse: score.mse,
            mse_stderr: score.mse_stderr,
            mrse: score.mrse,
            variance: score.variance,
            bias: score.bias,
            bias_stderr: score.bias_stderr,
            cpu_seconds: part.times.seconds(),
            cpu_error: part.times.error(),
            wall_seconds: part.times.wall_seconds(),
            rays: counts.rays,
            line_queries: counts.line_queries,
            node_tests: counts.node_tests,
            triangle_tests: counts.triangle_tests,
            intervals: counts.intervals,
            processor: part.processor,
        };
        Self { row, score }
    }
}

/// A collection of parts that become the results of a study. The results have the same bits
/// wherever the parts were computed, if the parts are added in the order of their units.
/// Measurements of which a part is missing are left out.
#[derive(Debug)]
pub struct Gathering<'a, P: Problem> {
    /// The job that the parts belong to.
    pub job: Job<'a, P>,
    replicates: Vec<Replicates>,
    cells: Vec<Option<CellPart>>,
}

impl<'a, P: Problem> Gathering<'a, P> {
    /// Creates an empty collection for the job.
    #[must_use]
    pub fn new(job: Job<'a, P>) -> Self {
        Self {
            replicates: vec![Replicates::default(); job.problem.integrals()],
            cells: vec![None; job.design.cells().len()],
            job,
        }
    }

    /// Adds the part that a unit computed.
    pub fn add(&mut self, unit: &Unit, part: Part) {
        match (unit, part) {
            (Unit::Cells { cells, .. }, Part::Cells(parts)) => {
                for (own, part) in self.cells.iter_mut().skip(cells.start).zip(parts) {
                    match own {
                        Some(own) => own.join(part),
                        none => *none = Some(part),
                    }
                }
            }
            (_, Part::Reference(part)) => part.add_to(&mut self.replicates),
            (Unit::Reference { .. }, Part::Cells(_)) => {}
        }
    }

    /// Returns the reference. A computed one is complete once all its parts were added; known
    /// values need no parts.
    ///
    /// # Panics
    /// If there is not one known value for each integral.
    #[must_use]
    pub fn reference(&self) -> Reference {
        let (problem, samples) = (self.job.problem, self.job.design.reference_samples());
        match self.job.truth {
            Truth::Known(values) => {
                assert_eq!(values.len(), problem.integrals(), "a value per integral");
                Reference::known(values.clone())
            }
            Truth::Computed(method) => {
                Reference::new(&self.replicates, method, samples, problem.pixels())
            }
        }
    }

    /// Returns the results; measurements of which a part is missing are left out.
    ///
    /// # Panics
    /// If there is not one known value for each integral.
    #[must_use]
    pub fn results(self) -> Results {
        let reference = self.reference();
        let problem = self.job.problem;
        let (integrals, pixels) = (problem.integrals(), problem.pixels());
        let (mut cells, mut left_out) = (Vec::new(), Vec::new());
        // A cell is complete if its parts cover all integrals.
        for ((method, samples), own) in self.job.design.cells().zip(self.cells) {
            match own.filter(|part| part.integrals == integrals) {
                Some(part) => cells.push(CellResult::new(part, method, samples, pixels)),
                None => left_out.push(LeftOutRow {
                    scene: String::new(),
                    estimator: method.estimator.clone(),
                    sampler: method.sampler.clone(),
                    samples,
                }),
            }
        }
        let squares: f64 = reference.values.iter().map(|v| v.length_squared()).sum();
        Results {
            integrals,
            pixels,
            power: squares / (3.0 * pixels.max(1) as f64),
            reference,
            cells,
            left_out,
        }
    }
}

/// Measures all methods on a problem by computing the units of [`Job::units`] one after the other,
/// on the threads of the rayon pool in which it is called.
///
/// The error of a computed reference is below a tenth of the smallest variance found, as far as a
/// pilot run can predict and [`Design::reference_rounds`] allows; variances that are only rounding
/// ([`Score::variance`]) do not count. Only times depend on the number of threads.
///
/// # Panics
/// If there is not one known value for each integral.
pub fn measure<P: Problem>(job: Job<'_, P>) -> Results {
    let mut gathering = Gathering::new(job);
    let mut reference = None;
    for Planned { unit, .. } in gathering.job.units() {
        if matches!(unit, Unit::Cells { .. }) {
            reference.get_or_insert_with(|| gathering.reference());
        }
        let known = || reference.as_ref().context("the reference comes first");
        // The job computes all of its own units: it refuses only units of other studies.
        if let Ok(part) = gathering.job.compute(&unit, known) {
            gathering.add(&unit, part);
        }
    }
    gathering.results()
}
