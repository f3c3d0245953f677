//! The contents of `claims.toml`: the claims of the papers, and the shading points and estimators
//! that are measured for them.

use super::formula::Formula;
use super::special::ALL;
use super::verdict::{Expected, Verdict};
use anyhow::{Context as _, Result, bail, ensure};
use linelit_estimators::Estimator;
use linelit_integrator::LightChoice;
use linelit_samplers::SamplerKind;
use linelit_study::record::PaperOrder;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::LazyLock;
use toml::{Table, Value};

/// The contents of `claims.toml`: the claims of the papers, and the shading points and estimators
/// that are measured for them.
static BOOK: LazyLock<Book> =
    LazyLock::new(|| Book::read(include_str!("../../claims.toml")).expect("claims.toml is read"));

/// The contents of a file of claims.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Book {
    /// The shading points on which estimators are measured side by side.
    pub(super) points: Vec<Points>,
    pub(crate) claims: Vec<Claim>,
}

/// The shading points of one scene or several, and the estimators that are measured on them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Points {
    pub(super) name: String,
    /// The names of built-in scenes.
    pub(super) scenes: Vec<String>,
    /// The width and height of the grid of pixels, 64 × 64 by default. The smallest effort uses
    /// fewer.
    pub(super) grid: Option<[u32; 2]>,
    /// Single pixels in place of the grid, each measured separately.
    #[serde(default)]
    pub(super) spots: BTreeMap<String, [u32; 2]>,
    /// Restricts the points to those where estimates by projected solid angle have noise, because a
    /// part of the light is hidden, or to those where they have none.
    pub(super) only: Option<Only>,
    /// Whether estimators are timed, in turns and for a tenth of a second each.
    #[serde(default)]
    pub(super) timed: bool,
    /// Whether the errors at these shading points are measured against many samples of the method
    /// that is best for them.
    #[serde(default)]
    pub(super) reference: bool,
    /// The named study that shows more about these shading points.
    #[serde(default)]
    pub(super) study: String,
    /// The sampler of the cells that name no other.
    pub(super) sampler: Text<SamplerKind>,
    pub(super) samples: Vec<u32>,
    pub(super) trials: u32,
    pub(super) cells: BTreeMap<String, Cell>,
}

/// The shading points that are measured: those with noise, or those without.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Only {
    Noisy,
    Calm,
}

/// An estimator and the settings it is measured with, written as its text alone or as a table.
#[derive(Clone, Debug, Deserialize)]
#[serde(from = "CellText")]
pub(super) struct Cell {
    pub(super) estimator: Text<Estimator>,
    pub(super) sampler: Option<Text<SamplerKind>>,
    pub(super) samples: Option<Vec<u32>>,
    pub(super) trials: Option<u32>,
    pub(super) lights: Option<Text<LightChoice>>,
}

/// The two notations of a cell.
#[derive(Deserialize)]
#[serde(untagged)]
enum CellText {
    Estimator(Text<Estimator>),
    Whole(WholeCell),
}

/// A cell that is written as a table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WholeCell {
    estimator: Text<Estimator>,
    sampler: Option<Text<SamplerKind>>,
    samples: Option<Vec<u32>>,
    trials: Option<u32>,
    lights: Option<Text<LightChoice>>,
}

impl From<CellText> for Cell {
    fn from(text: CellText) -> Self {
        match text {
            CellText::Estimator(estimator) => Self {
                estimator,
                sampler: None,
                samples: None,
                trials: None,
                lights: None,
            },
            CellText::Whole(w) => Self {
                estimator: w.estimator,
                sampler: w.sampler,
                samples: w.samples,
                trials: w.trials,
                lights: w.lights,
            },
        }
    }
}

/// A value in `claims.toml` that is parsed from a string.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(
    try_from = "String",
    bound = "T: std::str::FromStr, T::Err: fmt::Display"
)]
pub(crate) struct Text<T>(pub(crate) T);

impl<T: std::str::FromStr> TryFrom<String> for Text<T>
where
    T::Err: fmt::Display,
{
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
            .map(Self)
            .map_err(|e: T::Err| format!("`{text}`: {e}"))
    }
}

/// A paper, by its first author.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Paper {
    Billen,
    Salesin,
    Peters,
    Shirley,
}

impl Paper {
    pub(super) const ALL: [Self; 4] = [Self::Billen, Self::Salesin, Self::Peters, Self::Shirley];

    /// Returns the authors and year, as reports cite them.
    pub(super) const fn citation(self) -> &'static str {
        match self {
            Self::Billen => "Billen & Dutré 2016",
            Self::Salesin => "Salesin & Jarosz 2019",
            Self::Peters => "Peters 2021",
            Self::Shirley => "Shirley & Wang 1991",
        }
    }
}

/// A claim of a paper.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Claim {
    /// The permanent name of the claim, by which records and results refer to it.
    pub(super) id: String,
    pub(super) paper: Paper,
    /// The figure, table or section of the paper.
    pub(super) place: String,
    /// The claim, in our words.
    pub(super) says: String,
    /// The formula of the number that is measured; without it the claim cannot be measured here.
    pub(super) figure: Option<Formula>,
    /// The paper's number or bound.
    #[serde(default)]
    pub(super) expect: Option<Expected>,
    /// How the paper's number was read: printed, or from a plot.
    #[serde(default = "printed")]
    pub(super) read: String,
    /// The reason for the tolerance.
    #[serde(default)]
    pub(super) why: String,
    /// The recorded verdict.
    pub(super) verdict: Verdict,
    /// The reason why the claim is not confirmed.
    #[serde(default)]
    pub(super) because: String,
    /// Another measurement, which checks that reason.
    pub(super) check: Option<Check>,
}

/// Returns the default of [`Claim::read`]: the paper prints the number.
fn printed() -> String {
    "printed".to_owned()
}

/// A measurement that checks the reason why a claim is not confirmed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Check {
    pub(super) figure: Formula,
    pub(super) expect: Expected,
}

impl Points {
    /// Returns the paths of all scenes and spots.
    fn views(&self) -> Vec<String> {
        let scene = |name: &String| match self.scenes.len() {
            1 => self.name.clone(),
            _ => format!("{}/{name}", self.name),
        };
        let spots = |path: String| match self.spots.is_empty() {
            true => vec![path],
            false => self
                .spots
                .keys()
                .map(|spot| format!("{path}/{spot}"))
                .collect(),
        };
        self.scenes.iter().map(scene).flat_map(spots).collect()
    }

    /// Returns the paths of a cell in all scenes and spots.
    fn paths(&self, cell: &str) -> Vec<String> {
        let views = self.views().into_iter();
        views.map(|view| format!("{view}/{cell}")).collect()
    }
}

impl Book {
    /// Reads a file of claims. An entry with `each` represents one entry for each row of it, whose
    /// values replace `{column}` in the entry's texts.
    pub(super) fn read(text: &str) -> Result<Self> {
        let mut whole: Table = text.parse()?;
        for part in ["points", "claims"] {
            let Some(Value::Array(entries)) = whole.get_mut(part) else {
                bail!("`{part}` is missing");
            };
            let mut all = Vec::new();
            for entry in std::mem::take(entries) {
                all.extend(expand(entry)?);
            }
            *entries = all;
        }
        let book: Self = whole.try_into()?;
        book.check()?;
        Ok(book)
    }

    /// Refuses a file with claims whose fields do not fit together: every claim that is not
    /// confirmed needs a reason, and if it was measured, a check of that reason.
    fn check(&self) -> Result<()> {
        let mut ids = BTreeSet::new();
        for claim in &self.claims {
            let id = &claim.id;
            ensure!(ids.insert(id), "the claim `{id}` is there twice");
            ensure!(
                claim.figure.is_some() == claim.expect.is_some(),
                "`{id}`: a figure and what is expected of it go together"
            );
            let explained = !claim.verdict.needs_reason() || !claim.because.is_empty();
            ensure!(explained, "`{id}` is {} without a reason", claim.verdict);
            if claim.figure.is_some() && claim.verdict.needs_reason() {
                let check = claim.check.as_ref();
                let check = check.with_context(|| format!("the reason of `{id}` has no check"))?;
                let own = claim.figure.as_ref();
                ensure!(
                    own != Some(&check.figure),
                    "`{id}` is checked by its own figure"
                );
            }
        }
        self.check_paths()
    }

    /// Refuses a claim that needs a cell which is not measured, and a cell that no claim needs.
    fn check_paths(&self) -> Result<()> {
        // Find the paths that claims need and the paths that are measured.
        let asked: BTreeSet<&str> = self.claims.iter().flat_map(Claim::paths).collect();
        let paths = |p: &Points| {
            p.cells
                .keys()
                .flat_map(|cell| p.paths(cell))
                .collect::<Vec<_>>()
        };
        let measured: BTreeSet<String> = self.points.iter().flat_map(paths).collect();
        // Each needed path is measured, by a cell or by a function of its own.
        let special = |path: &str| ALL.iter().any(|(name, ..)| *name == group(path));
        let missing = asked
            .iter()
            .find(|path| !special(path) && !measured.contains(**path));
        ensure!(missing.is_none(), "nothing measures {missing:?}");
        // Each cell is needed in some scene or spot.
        for points in &self.points {
            let is_asked = |path: String| asked.contains(path.as_str());
            let idle = |cell: &&String| !points.paths(cell).into_iter().any(is_asked);
            let idle = points.cells.keys().find(idle);
            ensure!(
                idle.is_none(),
                "{}: no claim asks for {idle:?}",
                points.name
            );
        }
        Ok(())
    }

    /// Returns the claims of the papers.
    pub(crate) fn own() -> &'static Self {
        &BOOK
    }

    /// Returns the name of the study that shows more about a claim; empty if there is none.
    pub(super) fn study(&self, claim: &Claim) -> &str {
        let Some(name) = claim.paths().next().map(group) else {
            return "";
        };
        let special = ALL.iter().find(|(special, ..)| *special == name);
        let points = self.points.iter().find(|p| p.name == name);
        special.map_or(points.map_or("", |p| &p.study), |(_, study, _)| study)
    }

    /// Returns the claims of a study; the study `claims` has all.
    pub(crate) fn claims_of(&self, study: &str) -> impl Iterator<Item = &Claim> {
        let own = move |claim: &&Claim| study == "claims" || self.study(claim) == study;
        self.claims.iter().filter(own)
    }

    /// Returns the orders of convergence that claims state, for tables of slopes. Only a claim
    /// whose formula is the order of a single cell counts.
    pub(crate) fn paper_orders(&self) -> Vec<PaperOrder> {
        let order = |claim: &Claim| {
            let Some(Expected::Figure { value, .. }) = claim.expect else {
                return None;
            };
            // Split the formula `order[points/scene or spot/cell]`.
            let path = claim.figure.as_ref()?.text().strip_prefix("order[")?;
            let path = path.strip_suffix(']')?;
            let points = self.points.iter().find(|p| p.name == group(path))?;
            let (view, cell) = path.rsplit_once('/')?;
            let (cell, view) = (points.cells.get(cell)?, view.strip_prefix(&points.name)?);
            // Name the scene as studies do.
            let parts = view.split('/').filter(|part| !part.is_empty());
            let scene = points.scenes.first().filter(|_| points.scenes.len() == 1);
            let labels: Vec<&str> = scene.map(String::as_str).into_iter().chain(parts).collect();
            Some(PaperOrder {
                scene: labels.join(", "),
                estimator: cell.estimator.0.to_string(),
                sampler: cell.sampler.unwrap_or(points.sampler).0.to_string(),
                order: value,
                source: claim.source(),
            })
        };
        self.claims.iter().filter_map(order).collect()
    }
}

/// Returns the first component of a path: the name of an entry of points, or of a function that
/// measures.
fn group(path: &str) -> &str {
    path.split('/').next().unwrap_or_default()
}

impl Claim {
    /// Returns the paper and the place in it.
    pub(super) fn source(&self) -> String {
        format!("{}, {}", self.paper.citation(), self.place)
    }

    /// Returns the paths that the claim's formula and check need.
    fn paths(&self) -> impl Iterator<Item = &str> {
        let check = self.check.iter().map(|check| &check.figure);
        let formulas = self.figure.iter().chain(check);
        formulas.flat_map(|formula| formula.asks().map(|(_, path)| path))
    }

    /// Returns the names of the entries of points, and of the functions, that the claim needs.
    pub(super) fn groups(&self) -> impl Iterator<Item = &str> {
        self.paths().map(group)
    }
}

/// Returns an entry without `each`, or its copies, one for each row of `each`.
fn expand(entry: Value) -> Result<Vec<Value>> {
    let Value::Table(mut table) = entry else {
        bail!("an entry is a table");
    };
    let Some(each) = table.remove("each") else {
        return Ok(vec![Value::Table(table)]);
    };
    let Value::Table(each) = each else {
        bail!("`each` is a table of columns and rows");
    };
    // Read the columns.
    let list = |name: &str| {
        let found = each.get(name).and_then(Value::as_array);
        found.with_context(|| format!("`each` has no `{name}`"))
    };
    let columns: Vec<&str> = list("columns")?.iter().filter_map(Value::as_str).collect();
    // Copy the entry for each row.
    let copy = |row: &Value| {
        let row = row.as_array().context("a row is a list")?;
        ensure!(
            row.len() == columns.len(),
            "a row of {} for {columns:?}",
            row.len()
        );
        let row: Vec<(String, &Value)> = columns
            .iter()
            .zip(row)
            .map(|(column, value)| (format!("{{{column}}}"), value))
            .collect();
        let mut copy = Value::Table(table.clone());
        fill(&mut copy, &row);
        Ok(copy)
    };
    list("rows")?.iter().map(copy).collect()
}

/// Replaces `{column}` by a row's values. A text that consists only of `{column}` becomes the value
/// itself, whatever its type.
fn fill(value: &mut Value, row: &[(String, &Value)]) {
    match value {
        Value::String(text) => {
            // The whole text is a column: take the value with its type.
            if let Some((_, whole)) = row.iter().find(|(place, _)| place == text) {
                *value = (*whole).clone();
                return;
            }
            // Otherwise insert the values' texts.
            for (place, part) in row {
                let part = match part {
                    Value::String(part) => part.clone(),
                    Value::Float(part) => part.to_string(),
                    part => format!("{part:?}"),
                };
                *text = text.replace(place, &part);
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|v| fill(v, row)),
        Value::Table(table) => {
            for (key, mut value) in std::mem::take(table) {
                fill(&mut value, row);
                let mut key = Value::String(key);
                fill(&mut key, row);
                if let Value::String(key) = key {
                    table.insert(key, value);
                }
            }
        }
        _ => (),
    }
}
