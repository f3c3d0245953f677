#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod billen_figures;
mod billen_growth;
mod billen_orders;
mod billen_origin;
mod billen_table1;
mod billen_time;
mod costs;
mod judged;
mod measured;
mod peters_diffuse;
mod peters_gloss;
mod peters_inverse;
mod peters_table1;
mod picture_study;
mod salesin;
mod salesin_gain;
mod salesin_rays;
mod salesin_weights;
mod shirley;
mod shirley_advice;

pub use costs::processor_seconds;
pub use picture_study::Context;

use anyhow::Result;
use linelit_study::report::Report;
use linelit_study::scene_study::{Duel, StudySpec};

/// Page, files and numbers of a study of pictures and tables.
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
    /// What differs from what is on record, if anything is: the study has failed, though its page
    /// is whole.
    pub failures: Vec<String>,
}

/// A study of a paper.
#[derive(Clone, Debug)]
pub enum Study {
    /// Errors over samples and time, with slopes.
    Convergence(Box<StudySpec>),
    /// Pictures and tables, and what makes them.
    Findings(fn(&Context<'_>) -> Result<Findings>),
}

/// A study's name, what it shows in a line, and how it is made.
type NamedStudy = (&'static str, &'static str, fn() -> Study);

/// The named studies, but for those that take a scene.
const STUDIES: [NamedStudy; 18] = [
    (
        "default",
        "points and lines on two scenes, three patterns: how fast errors fall",
        || convergence(default_study()),
    ),
    (
        "claims",
        "every claim of the four papers: expected, measured, and a verdict",
        || Study::Findings(judged::run),
    ),
    (
        "billen-orders",
        "orders of convergence beside the paper's (Billen & Dutré 2016, Figs. 9 and 13)",
        || convergence(billen_orders::spec()),
    ),
    (
        "billen-table1",
        "time and tests of 1024 lines a point (Billen & Dutré 2016, Table 1)",
        || Study::Findings(billen_table1::run),
    ),
    (
        "billen-figures",
        "pictures of orientations, offset densities and numbers of lines (Figs. 2, 3, 5)",
        || Study::Findings(billen_figures::run),
    ),
    (
        "billen-growth",
        "visibility of lines in growing scenes, its share of the time (Billen & Dutré 2016, §6.2)",
        || Study::Findings(|c| billen_growth::run(c)?.findings("billen-growth")),
    ),
    (
        "billen-origin",
        "lines through a common origin beside parallel ones (Billen & Dutré 2016, §8)",
        || Study::Findings(|c| billen_origin::run(c)?.findings("billen-origin")),
    ),
    (
        "billen-time",
        "points and lines for the same time, by pattern (Billen & Dutré 2016, Figs. 8 and 12)",
        || Study::Findings(|c| billen_time::run(c)?.findings("billen-time")),
    ),
    (
        "peters-fig1",
        "gloss under a long linear light, by four heuristics of MIS (Peters 2021, Fig. 1)",
        || Study::Findings(|c| peters_gloss::figure_1(c)?.findings("peters-fig1")),
    ),
    (
        "peters-fig3",
        "inverting projected solid angle, and two steps towards it (Peters 2021, Fig. 3)",
        || Study::Findings(|c| peters_inverse::run(c)?.findings("peters-fig3")),
    ),
    (
        "peters-fig4",
        "backward errors, as printed in single precision and ours (Peters 2021, Fig. 4)",
        || Study::Findings(|c| peters_diffuse::figure_4(c)?.findings("peters-fig4")),
    ),
    (
        "peters-fig6",
        "a diffuse room by every technique for linear lights (Peters 2021, Fig. 6)",
        || Study::Findings(|c| peters_diffuse::figure_6(c)?.findings("peters-fig6")),
    ),
    (
        "peters-fig7",
        "white and blue noise, independent and jittered uniformly (Peters 2021, Fig. 7)",
        || Study::Findings(|c| peters_gloss::figure_7(c)?.findings("peters-fig7")),
    ),
    (
        "peters-table1",
        "cost per light and per sample of every technique (Peters 2021, Table 1)",
        || Study::Findings(|c| peters_table1::table_1(c)?.findings("peters-table1")),
    ),
    (
        "salesin-fig4",
        "weights of BSDF samples over a light, smoothed and not (Salesin & Jarosz 2019, Fig. 4)",
        || Study::Findings(|c| salesin_weights::run(c)?.findings("salesin-fig4")),
    ),
    (
        "salesin-fig7-gain",
        "what smoothing gains at the paper's terms, by roughness (Salesin & Jarosz 2019, Fig. 7)",
        || Study::Findings(|c| salesin_gain::run(c)?.findings("salesin-fig7-gain")),
    ),
    (
        "salesin-rays",
        "equal time with one sample a camera ray (Salesin & Jarosz 2019, Figs. 1, 8 to 11)",
        || Study::Findings(|c| salesin_rays::run(c)?.findings("salesin-rays")),
    ),
    (
        "shirley",
        "many luminaires: one shadow ray for all, spheres, a light tree (Shirley & Wang 1991)",
        || Study::Findings(|c| shirley::run(c)?.findings("shirley")),
    ),
];

fn convergence(spec: StudySpec) -> Study {
    Study::Convergence(Box::new(spec))
}

/// The names of all named studies, and what each shows, in a line.
pub fn studies() -> impl Iterator<Item = (&'static str, &'static str)> {
    let own = STUDIES.into_iter().map(|(name, about, _)| (name, about));
    own.chain(salesin::studies())
}

/// Whether a study of this name may be given a scene of the user's own.
#[must_use]
pub fn takes_scene(name: &str) -> bool {
    salesin::studies().any(|(n, _)| n == name)
}

/// The study of this name, on its own scene or on one that is given ([`takes_scene`]). `None` if
/// there is no such study, or it has no scene of its own and is given none.
#[must_use]
pub fn study(name: &str, scene: Option<&str>) -> Option<Study> {
    match STUDIES.into_iter().find(|study| study.0 == name) {
        Some((.., study)) => Some(study()),
        None => salesin::spec(name, scene).map(convergence),
    }
}

/// [`StudySpec::default`] with pictures for the same time, beside the orders that Billen & Dutré
/// report for its scenes.
#[must_use]
pub fn default_study() -> StudySpec {
    StudySpec {
        papers: billen_orders::paper_orders(),
        duel: Some(Duel {
            side: 256,
            samples: 16,
        }),
        ..StudySpec::default()
    }
}
