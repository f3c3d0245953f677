//! `viewfactors`, at once or as a plan.

use super::{PlannedArgs, ReadArgs, SceneArgs};
use crate::words::{path_ending, tolerance};
use clap::Args;
use std::path::PathBuf;

pub(super) const VIEWFACTORS_EXAMPLES: &str = "\
Examples:
  linelit viewfactors city.vs3 -o city.npz
      the matrix for scipy.sparse.load_npz, with `error`, `sky` and `area`
  linelit viewfactors room.obj -o room.csv --tolerance 1e-6 --report report
  linelit viewfactors canyon.stl -o canyon.vf --sides 2
      as View3D writes it
  linelit plan viewfactors city.vs3 -o city-plan --rows 500
      for many machines, or to go on after Ctrl-C: then run and merge";

/// The endings of files of view factors.
pub(crate) const ENDINGS: &[&str] = &["csv", "npz", "txt", "vf"];

/// Everything that view factors depend on, beside the file of the facets.
#[derive(Args, Clone, Debug)]
pub struct FactorArgs {
    /// The sum of a row's errors, at most.
    #[arg(long, value_name = "ERROR", default_value_t = 1e-4, value_parser = tolerance)]
    pub tolerance: f64,
    /// Sides of a facet that send and receive: 1 is that from which the corners run
    /// counter-clockwise. Either side hides others.
    #[arg(long, value_name = "1|2", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub sides: u8,
}

/// `viewfactors`.
#[derive(Args, Debug)]
pub struct ViewFactorsArgs {
    /// File of facets: .vs3 (View3D), .stl, .obj or .ply; or a scene, whose triangles are the
    /// facets.
    pub facets: String,
    /// File to write: .csv (from, to, factor, error; from 0, and −1 is the sky), .npz
    /// (scipy.sparse), or .txt or .vf (View3D).
    #[arg(short, long, value_parser = path_ending(ENDINGS))]
    pub output: PathBuf,
    /// The options that factors depend on.
    #[command(flatten)]
    pub factors: FactorArgs,
    /// Folder for a report, too: sums, errors, and pictures of the matrix and of the sky's share.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Common flags.
    #[command(flatten)]
    pub common: SceneArgs,
}

/// `plan viewfactors`.
#[derive(Args, Debug)]
pub struct PlanViewFactorsArgs {
    /// File of facets, as `viewfactors` reads it.
    pub facets: String,
    /// The options that factors depend on.
    #[command(flatten)]
    pub factors: FactorArgs,
    /// Rows of a unit: what two units have in common is computed twice.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..))]
    pub rows: u32,
    /// The options for reading the file.
    #[command(flatten)]
    pub read: ReadArgs,
    /// The options of all kinds of plans.
    #[command(flatten)]
    pub planned: PlannedArgs,
}
