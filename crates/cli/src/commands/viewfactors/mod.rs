//! `linelit viewfactors`, at once or as a plan whose units are blocks of rows of the matrix.

mod mesh;
mod report;
mod write;

use super::threads::{bar, pool, pool_of};
use super::units::{check, refuse_picture_flags};
use super::{converge, image};
use crate::args::{
    ENDINGS, FactorArgs, MergeArgs, PlanViewFactorsArgs, PlannedArguments, UsageError,
    ViewFactorsArgs, given,
};
use crate::folder::OutputFolder;
use crate::inputs::{self, Sources};
use crate::output::Output;
use crate::program::TryAgain;
use crate::{interrupt, output::note};
use anyhow::{Context as _, Result, bail};
use clap::Parser as _;
use linelit_geometry::stop;
use linelit_plan::{BoxError, Folder, PlanError, Run, RunCounts, Task, Unit};
use linelit_study::engine::{from_bytes, to_bytes};
use linelit_viewfactors::files::Mesh;
use linelit_viewfactors::{Facets, Matrix, Plan, SparseRow};
use serde::{Deserialize, Serialize};
use std::convert::Infallible;
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;
use std::time::Instant;

/// The kind of plans of view factors.
pub(super) const VIEWFACTORS: &str = "viewfactors";

/// The estimated seconds of one thread for a pair of facets, within a factor of ten.
const PAIR_SECONDS: f64 = 2e-5;

/// The settings in a plan of view factors.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// The words of `viewfactors` that the numbers depend on.
    viewfactors: Vec<String>,
}

/// The work of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Work {
    /// Classifying all pairs of facets, which all rows need.
    Pairs,
    /// Computing a range of rows.
    Rows([usize; 2]),
}

/// The part of a unit of rows: the fields `indptr`, `indices`, `data`, `error` and `sky` of
/// [`Matrix`].
type Part = (Vec<usize>, Vec<u32>, Vec<f64>, Vec<f64>, Vec<f64>);

/// The facets of a file, and the options for their view factors.
pub(super) struct Factors {
    name: String,
    mesh: Mesh,
    facets: Facets,
    args: FactorArgs,
}

/// View factors with the data for reports about them.
struct Found {
    matrix: Matrix,
    /// The areas and emittances of the facets that send.
    areas: Vec<f64>,
    emittances: Vec<f64>,
    /// The numbers of pairs that do not face each other, that are hidden, that are clear, and that
    /// are partly hidden.
    pairs: [u64; 4],
}

impl Found {
    /// Returns the sum over the factors of a row of some numbers of each factor.
    fn sum_of(&self, numbers: &[f64], row: usize) -> f64 {
        let ends = &self.matrix.indptr[row..row + 2];
        // An empty sum by `sum` would be −0.
        numbers[ends[0]..ends[1]].iter().fold(0.0, |sum, x| sum + x)
    }

    /// Returns the sum of the errors of a row.
    fn error(&self, row: usize) -> f64 {
        self.sum_of(&self.matrix.error, row)
    }

    /// Returns the sum of the factors of a row.
    fn sum(&self, row: usize) -> f64 {
        self.sum_of(&self.matrix.data, row)
    }

    /// Returns the largest value over all rows.
    fn most(&self, of: impl Fn(&Self, usize) -> f64) -> f64 {
        let rows = (0..self.areas.len()).map(|row| of(self, row));
        rows.fold(0.0, f64::max)
    }
}

/// The files that a command writes.
struct Destination<'a> {
    path: &'a Path,
    report: Option<OutputFolder>,
    json: bool,
    start: Instant,
}

impl<'a> Destination<'a> {
    /// Tests that the files can be written, before the work begins.
    fn open(path: &'a Path, report: Option<&Path>, json: bool) -> Result<Self> {
        linelit_film::check_writable(path)?;
        Ok(Self {
            path,
            report: report.map(OutputFolder::open).transpose()?,
            json,
            start: Instant::now(),
        })
    }
}

/// Computes view factors and writes them.
pub fn run(args: &ViewFactorsArgs, out: &mut Output) -> Result<()> {
    let to = Destination::open(&args.output, args.report.as_deref(), args.common.json)?;
    // Read the facets.
    let mesh = mesh::read(&args.common.read.library(), &args.facets)?;
    let factors = Factors::new(&args.facets, mesh, &args.factors)?;
    // Compute the factors. A signal also ends the computation in the middle of a row, as rows may
    // be long.
    interrupt::watch().context("watching for signals")?;
    let pool = pool(&args.common)?;
    pool.broadcast(|_| drop(stop::ask(Some(Rc::new(interrupt::stopped)))));
    let found = stop::catch(|| pool.install(|| factors.at_once()));
    let found = found.unwrap_or_else(|stop::Stopped| Err(interrupted("").into()))?;
    factors.write(&found, to, out)
}

/// Returns the plan that `plan viewfactors` writes.
pub(super) fn plan(args: &PlanViewFactorsArgs) -> Result<linelit_plan::Plan> {
    // Read the facets.
    let sources = Sources::new(&args.read);
    let mesh = sources.read_by(&args.facets, |library| mesh::read(library, &args.facets))?;
    let factors = Factors::new(&args.facets, mesh, &args.factors)?;
    // Make a unit of the classification of all pairs, and one of each group of rows, which needs
    // it.
    let (rows, step) = (factors.mesh.senders, args.rows as usize);
    let row_seconds = PAIR_SECONDS * factors.facets.len() as f64;
    let work = |work: Work| serde_json::to_string(&work);
    let all = row_seconds * rows as f64;
    let mut units = vec![Unit::new("all pairs", 0.1 * all, work(Work::Pairs)?)];
    for first in (0..rows).step_by(step) {
        let end = rows.min(first.saturating_add(step));
        let (name, cost) = (
            format!("rows {first}..{end}"),
            row_seconds * (end - first) as f64,
        );
        units.push(Unit {
            needs: 0..1,
            ..Unit::new(name, cost, work(Work::Rows([first, end]))?)
        });
    }
    let settings = Settings {
        viewfactors: given::<PlannedArguments<FactorArgs>>()?,
    };
    sources.plan(
        VIEWFACTORS,
        &settings,
        std::slice::from_ref(&args.facets),
        units,
    )
}

/// Returns the error of a computation that a signal ended, `at` some row.
fn interrupted(at: &str) -> TryAgain {
    let goes_on = "`linelit plan viewfactors` makes what can be gone on with";
    TryAgain(format!("interrupted{at}, and nothing is kept: {goes_on}"))
}

impl Factors {
    /// Makes facets of a mesh, and warns if rounding moved their corners far.
    fn new(name: &str, mesh: Mesh, args: &FactorArgs) -> Result<Self> {
        let facets = mesh::facets(name, &mesh, args.sides)?;
        let rounding = facets.rounding();
        if rounding.is_coarse() {
            note(format_args!("warning: {name}: {rounding}"));
        }
        Ok(Self {
            name: name.to_owned(),
            facets,
            mesh,
            args: args.clone(),
        })
    }

    /// Returns the facets of a plan.
    pub(super) fn open(folder: &Folder) -> Result<Self> {
        let settings: Settings = serde_json::from_str(&folder.plan().settings)?;
        let again = PlannedArguments::<FactorArgs>::try_parse_from(settings.viewfactors)?;
        let mesh = inputs::open_by(folder, 0, &again.read, mesh::read)?;
        let name = folder.plan().inputs.first().map_or("", |input| &input.name);
        Self::new(name, mesh, &again.args)
    }

    /// Adds a row, without the columns of facets that only hide others.
    fn add(&self, matrix: &mut Matrix, mut row: SparseRow) {
        let senders = self.mesh.senders;
        let count = row.columns.partition_point(|k| (*k as usize) < senders);
        row.columns.truncate(count);
        row.values.truncate(count);
        row.errors.truncate(count);
        matrix.push(row);
    }

    /// Computes all rows on the threads of the current pool.
    fn at_once(&self) -> Result<Found> {
        let progress = bar("looking at all pairs");
        progress.enable_steady_tick(std::time::Duration::from_millis(500));
        let plan = self.facets.plan();
        let rows = self.mesh.senders;
        progress.set_message("rows");
        progress.set_length(rows as u64);
        let mut matrix = Matrix::default();
        let done = self
            .facets
            .rows_of(0..rows, self.args.tolerance, &plan, |row| {
                if interrupt::stopped() {
                    return Err(interrupted(&format!(" at row {} of {rows}", row.facet)));
                }
                progress.inc(1);
                self.add(&mut matrix, row);
                Ok(())
            });
        progress.finish_and_clear();
        done?;
        Ok(self.found(matrix, plan.pairs))
    }

    /// Returns the factors with the areas and emittances of their facets.
    fn found(&self, matrix: Matrix, pairs: [u64; 4]) -> Found {
        Found {
            matrix,
            areas: (0..self.mesh.senders)
                .map(|i| self.facets.area(i))
                .collect(),
            emittances: self.mesh.emittances.clone(),
            pairs,
        }
    }

    /// Computes the remaining units of a plan, one at a time on all threads.
    pub(super) fn run(&self, folder: &Folder, options: &Run<'_>) -> Result<RunCounts> {
        let work = works(folder)?;
        let pool = pool_of(options.threads)?;
        let options = Run {
            threads: 1,
            ..*options
        };
        Ok(linelit_plan::run(folder, &options, |task| {
            pool.install(|| self.compute(work[task.number() as usize], task))
        })?)
    }

    /// Computes a unit.
    fn compute(&self, work: Work, task: &Task<'_>) -> Result<Vec<u8>, BoxError> {
        // Classify all pairs.
        let Work::Rows([first, end]) = work else {
            let Plan { weights, pairs } = self.facets.plan();
            return Ok(to_bytes(&(weights, pairs)));
        };
        // Or compute rows from this classification.
        let (weights, pairs) = from_bytes::<(Vec<f64>, [u64; 4])>(&task.part(0)?)?;
        if weights.len() != self.facets.len() || first > end || end > self.mesh.senders {
            return Err("the plan is of other facets".into());
        }
        let mut matrix = Matrix::default();
        let plan = Plan { weights, pairs };
        let Ok(()) = self
            .facets
            .rows_of(first..end, self.args.tolerance, &plan, |row| {
                self.add(&mut matrix, row);
                Ok::<(), Infallible>(())
            });
        let Matrix {
            data,
            indices,
            indptr,
            error,
            sky,
        } = matrix;
        Ok(to_bytes(&(indptr, indices, data, error, sky)))
    }

    /// Puts the parts of a plan together.
    fn gather(&self, folder: &Folder) -> Result<Found> {
        let work = works(folder)?;
        let (mut pairs, mut all) = ([0; 4], Matrix::default());
        let missing = folder.read_all(|number, payload| {
            let added = match work[number as usize] {
                Work::Pairs => from_bytes::<(Vec<f64>, [u64; 4])>(&payload).map(|(_, p)| pairs = p),
                Work::Rows([first, end]) => from_bytes(&payload)
                    .and_then(|part| append(&mut all, part, first..end, self.mesh.senders)),
            };
            added.map_err(|error| PlanError::Work {
                number,
                name: folder.plan().units[number as usize].name.clone(),
                error: error.into(),
            })
        })?;
        check(folder, &missing)?;
        if all.sky.len() != self.mesh.senders {
            bail!("{}: the plan lacks rows", folder.path().display());
        }
        Ok(self.found(all, pairs))
    }

    /// Puts the parts of a plan together, and writes the factors.
    pub(super) fn merge(&self, folder: &Folder, args: &MergeArgs, out: &mut Output) -> Result<()> {
        let named = |path: &&Path| ENDINGS.iter().any(|ending| image::ends_in(path, ending));
        let Some(path) = args.output.as_deref().filter(named) else {
            let text = "merging view factors writes a file: -o FACTORS.csv, .npz, .txt or .vf";
            return Err(UsageError(text.to_owned()).into());
        };
        refuse_picture_flags(&args.file)?;
        let to = Destination::open(path, args.report.as_deref(), args.json)?;
        self.write(&self.gather(folder)?, to, out)
    }

    /// Writes the file and the report, and prints what they contain.
    fn write(&self, found: &Found, to: Destination<'_>, out: &mut Output) -> Result<()> {
        let path = to.path;
        write::write(path, found)?;
        let seconds = to.start.elapsed().as_secs_f64();
        if let Some(mut folder) = to.report {
            let mut report = report::page(self, found, seconds)?;
            report.command = converge::command();
            folder.add("report.html", report.render());
            let page = folder.path_of("report.html");
            folder.finish()?;
            note(format_args!("report: {}", page.display()));
        }
        // Print the numbers of facets, factors and pairs, and the largest errors.
        let (facets, factors) = (found.areas.len(), found.matrix.data.len());
        let [row_error, row_sum] = [found.most(Found::error), found.most(Found::sum)];
        let [facing, hidden, clear, partly] = found.pairs;
        let moved = self.facets.displacement();
        if to.json {
            let value = serde_json::json!({
                "scene": self.name,
                "output": path,
                "facets": facets,
                "obstructions": self.facets.len() - facets,
                "factors": factors,
                "pairs": {"facing": facing, "hidden": hidden, "clear": clear, "partly": partly},
                "row_error": row_error,
                "row_sum": row_sum,
                "displacement": moved,
                "seconds": seconds,
            });
            writeln!(out, "{value}")?;
            return Ok(());
        }
        writeln!(
            out,
            "{}: {facets} facets, {factors} factors in {seconds:.1} s\n\
             pairs: {facing} by facing, {hidden} hidden, {clear} clear, {partly} partly hidden\n\
             rows sum to {row_sum:.7} at most, with errors of {row_error:.1e} at most; rounding \
             moved corners by {moved:.1e} at most",
            path.display()
        )?;
        Ok(())
    }
}

/// Returns the work of a plan's units.
fn works(folder: &Folder) -> Result<Vec<Work>> {
    let work = folder
        .plan()
        .units
        .iter()
        .map(|u| serde_json::from_str(&u.work));
    let what = || format!("{}: no plan of view factors", folder.path().display());
    work.collect::<Result<_, _>>().with_context(what)
}

/// Appends the rows of a part. Fails unless they are exactly these rows and have this many columns.
fn append(all: &mut Matrix, part: Part, rows: Range<usize>, columns: usize) -> Result<()> {
    let (indptr, indices, data, error, sky) = part;
    let ends = [indptr.first(), indptr.last()] == [Some(&0), Some(&data.len())];
    let lengths = [indices.len(), error.len()] == [data.len(); 2];
    let fits = all.sky.len() == rows.start && sky.len() == rows.len();
    let is_whole = ends && indptr.is_sorted() && lengths && fits && indptr.len() == sky.len() + 1;
    if !is_whole || indices.iter().any(|k| *k as usize >= columns) {
        bail!(
            "its part does not hold what rows {}..{} do",
            rows.start,
            rows.end
        );
    }
    let before = all.data.len();
    all.indptr.extend(indptr[1..].iter().map(|k| before + k));
    all.indices.extend(indices);
    all.data.extend(data);
    all.error.extend(error);
    all.sky.extend(sky);
    Ok(())
}
