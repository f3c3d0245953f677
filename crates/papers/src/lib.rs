#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::unwrap_used))]

mod drawings;
mod figures;
mod judged;
mod measured;

pub use figures::{Page, processor_seconds, studies, study, takes_scene};

use indicatif::ProgressBar;
use linelit_scenes::Library;
use linelit_study::report::Report;
use linelit_study::scene_study::StudySpec;

/// The result of a page of claims and drawings: the page itself, files and numbers.
#[derive(Debug, Default)]
pub struct Findings {
    /// The page, without the command that repeats it.
    pub report: Report,
    /// Further files, by name: pictures as PNG, tables as text.
    pub files: Vec<(String, Vec<u8>)>,
    /// The numbers for a terminal, line by line.
    pub text: String,
    /// The findings as data.
    pub rows: serde_json::Value,
    /// The contradictions to the recorded verdicts. If there are any, the study has failed, though
    /// its page is complete.
    pub failures: Vec<String>,
}

/// A study of a paper.
#[derive(Clone, Debug)]
pub enum Study {
    /// Errors over samples and time, with orders of convergence and possibly pictures.
    Convergence(Box<StudySpec>),
    /// Judged claims of a paper, and drawings.
    Findings(Page),
}

/// The settings of a page of claims and drawings.
#[derive(Debug)]
pub struct Context<'a> {
    /// The reader of scenes.
    pub library: Library,
    /// The first seed.
    pub seed: u64,
    /// Whether every step runs at the smallest size, for tests.
    pub smallest: bool,
    /// Whether measurements that have a quick form run in full.
    pub full: bool,
    /// The largest side of a picture, in pixels.
    pub most_side: u32,
    /// The progress bar.
    pub progress: &'a ProgressBar,
}

impl Context<'_> {
    /// Returns the side of a picture that should have this side: a few pixels if everything runs at
    /// the smallest size.
    fn side(&self, full: u32) -> u32 {
        let most = if self.smallest { 8 } else { self.most_side };
        full.min(most)
    }
}

/// Returns the study that `converge` runs if none is named.
///
/// ```
/// assert!(linelit_papers::default_study().duel.is_some());
/// ```
#[must_use]
pub fn default_study() -> StudySpec {
    match study("default", None) {
        Some(Study::Convergence(spec)) => *spec,
        _ => StudySpec::default(),
    }
}
