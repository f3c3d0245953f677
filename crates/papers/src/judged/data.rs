//! The claims and what is measured for them, as `claims.toml` has them.

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

/// The claims, and what is measured for them.
static BOOK: LazyLock<Book> =
    LazyLock::new(|| Book::read(include_str!("../../claims.toml")).expect("claims.toml is read"));

/// The file of claims.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Book {
    /// Shading points on which estimators are measured side by side.
    pub(super) points: Vec<Points>,
    pub(crate) claims: Vec<Claim>,
}

/// Shading points of one scene or several, and the estimators that are measured on them.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Points {
    pub(super) name: String,
    /// Built-in scenes.
    pub(super) scenes: Vec<String>,
    /// Pixels across and down, but for the smallest form. Without it all
    /// pixels of the default study.
    pub(super) grid: Option<[u32; 2]>,
    /// Single pixels in place of the grid, each a view of its own.
    #[serde(default)]
    pub(super) spots: BTreeMap<String, [u32; 2]>,
    /// Only the points where points by projected solid angle have noise, which see a part of the
    /// light, or those where they have none.
    pub(super) only: Option<Only>,
    /// Estimators are timed in turns, for a tenth of a second each.
    #[serde(default)]
    pub(super) timed: bool,
    /// Errors are measured against many samples of what is best there.
    #[serde(default)]
    pub(super) reference: bool,
    /// The study that shows more of the same.
    #[serde(default)]
    pub(super) study: String,
    /// The sampler of cells that name no other.
    pub(super) sampler: Text<SamplerKind>,
    pub(super) samples: Vec<u32>,
    pub(super) trials: u32,
    pub(super) cells: BTreeMap<String, Cell>,
}

/// The shading points that are measured.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Only {
    Noisy,
    Calm,
}

/// An estimator and what it is measured with: its text alone, or a table.
#[derive(Clone, Debug, Deserialize)]
#[serde(from = "CellText")]
pub(super) struct Cell {
    pub(super) estimator: Text<Estimator>,
    pub(super) sampler: Option<Text<SamplerKind>>,
    pub(super) samples: Option<Vec<u32>>,
    pub(super) trials: Option<u32>,
    pub(super) lights: Option<Text<LightChoice>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum CellText {
    Estimator(Text<Estimator>),
    Whole(WholeCell),
}

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

/// A value that is read from its text.
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

/// A paper.
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
    /// A name that stays: records and results go by it.
    pub(super) id: String,
    pub(super) paper: Paper,
    /// Figure, table or section.
    pub(super) place: String,
    /// The claim, in our words.
    pub(super) says: String,
    /// The formula of the figure; without it the claim is not measurable here.
    pub(super) figure: Option<Formula>,
    /// The paper's figure or bound.
    #[serde(default)]
    pub(super) expect: Option<Expected>,
    /// The way in which the paper's figure was read.
    #[serde(default = "printed")]
    pub(super) read: String,
    /// Why the tolerance is what it is.
    #[serde(default)]
    pub(super) why: String,
    /// The verdict on record.
    pub(super) verdict: Verdict,
    /// Why it is not confirmed.
    #[serde(default)]
    pub(super) because: String,
    /// Another measurement, which shows that the reason holds.
    pub(super) check: Option<Check>,
}

fn printed() -> String {
    "printed".to_owned()
}

/// A measurement that a reason is checked by.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Check {
    pub(super) figure: Formula,
    pub(super) expect: Expected,
}

impl Points {
    /// The scenes and spots, as paths.
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

    /// The paths of a cell in all views.
    fn paths(&self, cell: &str) -> Vec<String> {
        let views = self.views().into_iter();
        views.map(|view| format!("{view}/{cell}")).collect()
    }
}

impl Book {
    /// Reads a book: an entry with `each` stands for one of each row, whose values take the places
    /// of `{column}` in its texts.
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

    /// Refuses a claim that asks for what nothing measures, and a cell that serves no claim.
    fn check_paths(&self) -> Result<()> {
        let asked: BTreeSet<&str> = self.claims.iter().flat_map(Claim::paths).collect();
        let paths = |p: &Points| {
            p.cells
                .keys()
                .flat_map(|cell| p.paths(cell))
                .collect::<Vec<_>>()
        };
        let measured: BTreeSet<String> = self.points.iter().flat_map(paths).collect();
        let special = |path: &str| ALL.iter().any(|(name, ..)| *name == group(path));
        let missing = asked
            .iter()
            .find(|path| !special(path) && !measured.contains(**path));
        ensure!(missing.is_none(), "nothing measures {missing:?}");
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

    /// The claims of the papers.
    pub(crate) fn own() -> &'static Self {
        &BOOK
    }

    /// The study that shows more of what a claim is about.
    pub(super) fn study(&self, claim: &Claim) -> &str {
        let Some(name) = claim.paths().next().map(group) else {
            return "";
        };
        let special = ALL.iter().find(|(special, ..)| *special == name);
        let points = self.points.iter().find(|p| p.name == name);
        special.map_or(points.map_or("", |p| &p.study), |(_, study, _)| study)
    }

    /// The claims of a study; of `claims` all.
    pub(crate) fn claims_of(&self, study: &str) -> impl Iterator<Item = &Claim> {
        let own = move |claim: &&Claim| study == "claims" || self.study(claim) == study;
        self.claims.iter().filter(own)
    }

    /// The orders that claims have, for tables of slopes.
    pub(crate) fn paper_orders(&self) -> Vec<PaperOrder> {
        let order = |claim: &Claim| {
            let Some(Expected::Figure { value, .. }) = claim.expect else {
                return None;
            };
            let path = claim.figure.as_ref()?.text().strip_prefix("order[")?;
            let path = path.strip_suffix(']')?;
            let points = self.points.iter().find(|p| p.name == group(path))?;
            let (view, cell) = path.rsplit_once('/')?;
            let (cell, view) = (points.cells.get(cell)?, view.strip_prefix(&points.name)?);
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

/// The name of the points or of the function that measures what has this path.
fn group(path: &str) -> &str {
    path.split('/').next().unwrap_or_default()
}

impl Claim {
    /// The paper and the place in it.
    pub(super) fn source(&self) -> String {
        format!("{}, {}", self.paper.citation(), self.place)
    }

    /// The paths that its figure and its check ask for.
    fn paths(&self) -> impl Iterator<Item = &str> {
        let check = self.check.iter().map(|check| &check.figure);
        let formulas = self.figure.iter().chain(check);
        formulas.flat_map(|formula| formula.asks().map(|(_, path)| path))
    }

    /// The names of the points and functions that it asks for.
    pub(super) fn groups(&self) -> impl Iterator<Item = &str> {
        self.paths().map(group)
    }
}

/// An entry without `each`; or its copies, one a row.
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
    let list = |name: &str| {
        let found = each.get(name).and_then(Value::as_array);
        found.with_context(|| format!("`each` has no `{name}`"))
    };
    let columns: Vec<&str> = list("columns")?.iter().filter_map(Value::as_str).collect();
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

/// Puts a row's values in their places: all of a text becomes the value itself.
fn fill(value: &mut Value, row: &[(String, &Value)]) {
    match value {
        Value::String(text) => {
            if let Some((_, whole)) = row.iter().find(|(place, _)| place == text) {
                *value = (*whole).clone();
                return;
            }
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
