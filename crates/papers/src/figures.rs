//! The named studies of `figures.toml`: convergence studies of scenes, and pages of claims and
//! drawings.

use crate::drawings::{self, Drawing};
use crate::judged::data::{Book, Text};
use crate::{Context, Findings, Study, judged};
use anyhow::{Context as _, Result, ensure};
use linelit_estimators::Estimator;
use linelit_integrator::LightChoice;
use linelit_samplers::SamplerKind;
use linelit_study::pixels::{Pixels, Resolution};
use linelit_study::scene_study::{Budget, Duel, Gallery, Spot, StudySpec};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// All named studies of `figures.toml`.
static FIGURES: LazyLock<Vec<Figure>> = LazyLock::new(|| {
    let file: Result<File, _> = toml::from_str(include_str!("../figures.toml"));
    file.unwrap_or_else(|e| panic!("figures.toml: {e}")).figures
});

/// The contents of `figures.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    figures: Vec<Figure>,
}

/// A named study: a study of convergence, or a page of claims.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    name: String,
    /// A description of what the study shows, in one line.
    about: String,
    /// The processor seconds that the study took, all threads together.
    seconds: f64,
    /// The study of convergence; if there is none, the figure is a page of claims.
    study: Option<Described>,
    /// The name of the drawing on the page of claims, if there is one.
    drawing: Option<String>,
}

/// The description of a study of convergence. Missing settings are taken from
/// [`StudySpec::default`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Described {
    title: Option<String>,
    scenes: Option<Vec<String>>,
    /// Whether a scene that the user names may replace the study's own scenes.
    #[serde(default)]
    takes_scene: bool,
    estimators: Option<Vec<Text<Estimator>>>,
    samplers: Option<Vec<Text<SamplerKind>>>,
    lights: Option<Vec<Text<LightChoice>>>,
    samples: Option<Vec<u32>>,
    trials: Option<u32>,
    independent_trials: Option<u32>,
    grid: Option<[u32; 2]>,
    #[serde(default)]
    spots: BTreeMap<String, [u32; 2]>,
    skip: Option<bool>,
    gallery: Option<DescribedGallery>,
    duel: Option<DescribedDuel>,
}

/// The description of a gallery of pictures. Missing estimators and samplers are taken from the
/// study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedGallery {
    size: [u32; 2],
    samples: Option<u32>,
    seconds: Option<f64>,
    estimators: Option<Vec<Text<Estimator>>>,
    samplers: Option<Vec<Text<SamplerKind>>>,
}

/// The description of two pictures for the same time: the longer side, and the number of lines.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedDuel {
    side: u32,
    samples: u32,
}

/// Returns the values of a list of texts, or another list if there are no texts.
fn values<T: Copy>(texts: Option<&Vec<Text<T>>>, other: &[T]) -> Vec<T> {
    texts.map_or_else(
        || other.to_vec(),
        |texts| texts.iter().map(|t| t.0).collect(),
    )
}

impl Described {
    /// Returns the specification of the study.
    fn spec(&self) -> StudySpec {
        let base = StudySpec::default();
        let grid = |[width, height]: [u32; 2]| Pixels::Grid(Resolution { width, height });
        let spot = |(label, pixel): (&String, &[u32; 2])| Spot {
            label: label.clone(),
            pixel: *pixel,
        };
        // Take each setting that is described, and the others from the default.
        let mut spec = StudySpec {
            title: self.title.clone().unwrap_or(base.title),
            scenes: self.scenes.clone().unwrap_or(base.scenes),
            estimators: values(self.estimators.as_ref(), &base.estimators),
            samplers: values(self.samplers.as_ref(), &base.samplers),
            lights: values(self.lights.as_ref(), &base.lights),
            samples: self.samples.clone().unwrap_or(base.samples),
            trials: self.trials.unwrap_or(base.trials),
            independent_trials: self.independent_trials,
            pixels: self.grid.map_or(base.pixels, grid),
            spots: self.spots.iter().map(spot).collect(),
            skip: self.skip.unwrap_or(base.skip),
            papers: Book::own().paper_orders(),
            duel: self.duel.as_ref().map(|duel| Duel {
                side: duel.side,
                samples: duel.samples,
            }),
            ..StudySpec::default()
        };
        // The gallery's defaults are the study's settings.
        spec.gallery = self.gallery.as_ref().map(|gallery| gallery.of(&spec));
        spec
    }
}

impl DescribedGallery {
    /// Returns the gallery of a study.
    fn of(&self, spec: &StudySpec) -> Gallery {
        let [width, height] = self.size;
        let seconds = self.seconds.map(Budget::Seconds);
        Gallery {
            width,
            height,
            budget: seconds.unwrap_or(Budget::Samples(self.samples.unwrap_or(1))),
            samplers: values(self.samplers.as_ref(), &spec.samplers),
            estimators: values(self.estimators.as_ref(), &spec.estimators),
            reference_rounds: 4,
        }
    }
}

/// A page of the claims that refer to a named study, possibly with a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    name: &'static str,
    about: &'static str,
    drawing: Option<Drawing>,
}

impl Page {
    /// Measures and judges the claims, and draws the drawing.
    ///
    /// # Errors
    /// If a scene cannot be read.
    pub fn run(&self, context: &Context<'_>) -> Result<Findings> {
        // Judge the claims under a capitalized title.
        let mut title = self.about.to_owned();
        if let Some(first) = title.get_mut(..1) {
            first.make_ascii_uppercase();
        }
        let mut found = judged::run(context, self.name, &title)?;
        // Put the drawing first, and its pictures into files.
        if let Some(draw) = self.drawing {
            let section = draw(context).context(self.name)?;
            for (number, picture) in (1..).zip(&section.pictures) {
                let file = format!("{}-{number}.png", self.name);
                found.text += &format!("{file}: {}\n", picture.caption);
                found.files.push((file, picture.png.clone()));
            }
            let plots = section.plots.iter();
            plots.for_each(|plot| found.text += &format!("{}\n", plot.caption));
            found.report.sections.insert(0, section);
        }
        ensure!(!found.report.sections.is_empty(), "an empty page");
        Ok(found)
    }
}

/// Returns the named study of this name.
fn find(name: &str) -> Option<&'static Figure> {
    FIGURES.iter().find(|figure| figure.name == name)
}

/// Returns the names of all named studies, and a line about each.
pub fn studies() -> impl Iterator<Item = (&'static str, &'static str)> {
    let named = |figure: &'static Figure| (figure.name.as_str(), figure.about.as_str());
    FIGURES.iter().map(named)
}

/// Returns whether a study of this name can be run on a scene that the user names.
#[must_use]
pub fn takes_scene(name: &str) -> bool {
    let described = find(name).and_then(|figure| figure.study.as_ref());
    described.is_some_and(|study| study.takes_scene)
}

/// Returns the study of this name, on its own scene or, if it accepts one ([`takes_scene`]), on a
/// given scene. `None` if there is no such study, or if it has no scene of its own and is given
/// none.
#[must_use]
pub fn study(name: &str, scene: Option<&str>) -> Option<Study> {
    let figure = find(name)?;
    // A figure without a study is a page of claims.
    let Some(described) = &figure.study else {
        let drawing = figure.drawing.as_deref();
        return Some(Study::Findings(Page {
            name: &figure.name,
            about: &figure.about,
            drawing: drawing.map(|name| drawings::find(name).expect("figures.toml is read")),
        }));
    };
    // Replace the scenes by the given one.
    let mut spec = described.spec();
    let takes = described.takes_scene;
    if let Some(scene) = scene.filter(|scene| takes && spec.scenes != [*scene]) {
        spec.scenes = vec![scene.to_owned()];
        spec.spots.clear();
    }
    (!spec.scenes.is_empty()).then(|| Study::Convergence(Box::new(spec)))
}

/// Returns the processor seconds that a named study took, all threads together; `None` if there is
/// no such study. A study that accepts a scene was measured with its own, or with
/// `cornell-box-large` if it has none.
#[must_use]
pub fn processor_seconds(study: &str) -> Option<f64> {
    find(study).map(|figure| figure.seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every study can be read, and every order that a paper reports for a view of `salesin-fig5`
    /// belongs to an estimator of that study.
    #[test]
    fn all_figures_are_understood() {
        for figure in FIGURES.iter() {
            let found = study(&figure.name, Some("x.pbrt")).unwrap();
            match found {
                Study::Convergence(spec) => assert!(!spec.views().is_empty()),
                Study::Findings(page) => assert!(
                    page.drawing.is_some()
                        || page.name == "claims"
                        || Book::own().claims_of(page.name).count() > 0,
                    "{}",
                    page.name
                ),
            }
        }
        assert!(study("salesin-fig9", None).is_none());
        assert!(study("no-study", None).is_none());
        let Some(Study::Convergence(spec)) = study("salesin-fig5", None) else {
            panic!("a study of convergence");
        };
        let views = spec.views();
        let own = spec.papers.iter().filter(|p| p.scene == views[0].label);
        let known = |p: &&linelit_study::record::PaperOrder| {
            let mut all = spec.estimators.iter();
            all.any(|e| e.to_string() == p.estimator)
        };
        assert!(own.clone().count() >= 2 && own.clone().all(|p| known(&p)));
    }
}
