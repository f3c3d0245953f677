#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod billen_figures;
mod billen_orders;
mod billen_table1;
mod peters_as_printed;
mod peters_diffuse;
mod peters_gloss;
mod peters_table1;
mod picture_study;
mod salesin;
mod shirley;

pub use picture_study::Context;

use anyhow::Result;
use linelit_study::report::Report;
use linelit_study::spec::StudySpec;

/// What a study of pictures and tables leaves.
#[derive(Debug, Default)]
pub struct Findings {
    /// The page, still without the command that repeats it.
    pub report: Report,
    /// Further files, by name: pictures as PNG, tables as text.
    pub files: Vec<(String, Vec<u8>)>,
    /// The numbers for a terminal, line by line.
    pub text: String,
    /// The same numbers as data.
    pub rows: serde_json::Value,
}

/// A study of a paper.
#[derive(Clone, Debug)]
pub enum Study {
    /// Errors over samples and time, with slopes.
    Convergence(Box<StudySpec>),
    /// Pictures and tables.
    Findings(fn(&Context<'_>) -> Result<Findings>),
}

/// The named studies, but for those that take a scene.
const NAMES: [&str; 10] = [
    "default",
    "billen-orders",
    "billen-table1",
    "billen-figures",
    "peters-fig1",
    "peters-fig4",
    "peters-fig6",
    "peters-fig7",
    "peters-table1",
    "shirley",
];

/// All named studies.
pub fn names() -> impl Iterator<Item = &'static str> {
    NAMES.into_iter().chain(salesin::NAMES)
}

/// Whether a study of this name may be given a scene of the user's own.
#[must_use]
pub fn takes_scene(name: &str) -> bool {
    salesin::NAMES.contains(&name)
}

/// The study of this name, on its own scene or on one that is given ([`takes_scene`]). `None` if
/// there is no such study, or it has no scene of its own and is given none.
#[must_use]
pub fn study(name: &str, scene: Option<&str>) -> Option<Study> {
    let convergence = |spec| Study::Convergence(Box::new(spec));
    Some(match name {
        "default" => convergence(default_study()),
        "billen-orders" => convergence(billen_orders::spec()),
        "billen-table1" => Study::Findings(billen_table1::run),
        "billen-figures" => Study::Findings(billen_figures::run),
        "peters-fig1" => Study::Findings(|c| peters_gloss::figure_1(c)?.findings("peters-fig1")),
        "peters-fig4" => Study::Findings(|c| peters_diffuse::figure_4(c)?.findings("peters-fig4")),
        "peters-fig6" => Study::Findings(|c| peters_diffuse::figure_6(c)?.findings("peters-fig6")),
        "peters-fig7" => Study::Findings(|c| peters_gloss::figure_7(c)?.findings("peters-fig7")),
        "peters-table1" => {
            Study::Findings(|c| peters_table1::table_1(c)?.findings("peters-table1"))
        }
        "shirley" => Study::Findings(|c| shirley::run(c)?.findings("shirley")),
        _ => convergence(salesin::spec(name, scene)?),
    })
}

/// [`StudySpec::default`], beside the orders that Billen & Dutré report for its scenes.
#[must_use]
pub fn default_study() -> StudySpec {
    StudySpec {
        papers: billen_orders::paper_orders(),
        ..StudySpec::default()
    }
}
