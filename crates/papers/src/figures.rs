//! The named studies, as `figures.toml` has them.

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

/// All figures.
static FIGURES: LazyLock<Vec<Figure>> = LazyLock::new(|| {
    let file: Result<File, _> = toml::from_str(include_str!("../figures.toml"));
    file.unwrap_or_else(|e| panic!("figures.toml: {e}")).figures
});

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    figures: Vec<Figure>,
}

/// A named study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Figure {
    name: String,
    /// The content of the figure, in a line.
    about: String,
    /// Processor seconds.
    seconds: f64,
    /// A study of convergence; without it the figure is a page of claims.
    study: Option<Described>,
    /// The drawing on the page of claims, by its name.
    drawing: Option<String>,
}

/// A study of convergence: missing settings are those of [`StudySpec::default`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Described {
    title: Option<String>,
    scenes: Option<Vec<String>>,
    /// Whether a scene of the user's own may take the place of its scenes.
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

/// Pictures, by the estimators and samplers of the study if none are given.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedGallery {
    size: [u32; 2],
    samples: Option<u32>,
    seconds: Option<f64>,
    estimators: Option<Vec<Text<Estimator>>>,
    samplers: Option<Vec<Text<SamplerKind>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DescribedDuel {
    side: u32,
    samples: u32,
}

/// The values of texts; those of another list if there are none.
fn values<T: Copy>(texts: Option<&Vec<Text<T>>>, other: &[T]) -> Vec<T> {
    texts.map_or_else(
        || other.to_vec(),
        |texts| texts.iter().map(|t| t.0).collect(),
    )
}

impl Described {
    fn spec(&self) -> StudySpec {
        let base = StudySpec::default();
        let grid = |[width, height]: [u32; 2]| Pixels::Grid(Resolution { width, height });
        let spot = |(label, pixel): (&String, &[u32; 2])| Spot {
            label: label.clone(),
            pixel: *pixel,
        };
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
        spec.gallery = self.gallery.as_ref().map(|gallery| gallery.of(&spec));
        spec
    }
}

impl DescribedGallery {
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

/// A page of the claims that name it, perhaps with a drawing.
#[derive(Clone, Copy, Debug)]
pub struct Page {
    name: &'static str,
    about: &'static str,
    drawing: Option<Drawing>,
}

impl Page {
    /// Measures and judges the claims, and draws.
    ///
    /// # Errors
    /// If a scene cannot be read.
    pub fn run(&self, context: &Context<'_>) -> Result<Findings> {
        let mut title = self.about.to_owned();
        if let Some(first) = title.get_mut(..1) {
            first.make_ascii_uppercase();
        }
        let mut found = judged::run(context, self.name, &title)?;
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

fn find(name: &str) -> Option<&'static Figure> {
    FIGURES.iter().find(|figure| figure.name == name)
}

/// The names of all named studies, and what each shows, in a line.
pub fn studies() -> impl Iterator<Item = (&'static str, &'static str)> {
    let named = |figure: &'static Figure| (figure.name.as_str(), figure.about.as_str());
    FIGURES.iter().map(named)
}

/// Whether a study of this name may be given a scene of the user's own.
#[must_use]
pub fn takes_scene(name: &str) -> bool {
    let described = find(name).and_then(|figure| figure.study.as_ref());
    described.is_some_and(|study| study.takes_scene)
}

/// The study of this name, on its own scene or on one that is given ([`takes_scene`]). `None` if
/// there is no such study, or it has no scene of its own and is given none.
#[must_use]
pub fn study(name: &str, scene: Option<&str>) -> Option<Study> {
    let figure = find(name)?;
    let Some(described) = &figure.study else {
        let drawing = figure.drawing.as_deref();
        return Some(Study::Findings(Page {
            name: &figure.name,
            about: &figure.about,
            drawing: drawing.map(|name| drawings::find(name).expect("figures.toml is read")),
        }));
    };
    let mut spec = described.spec();
    let takes = described.takes_scene;
    if let Some(scene) = scene.filter(|scene| takes && spec.scenes != [*scene]) {
        spec.scenes = vec![scene.to_owned()];
        spec.spots.clear();
    }
    (!spec.scenes.is_empty()).then(|| Study::Convergence(Box::new(spec)))
}

/// Processor seconds that a named study took, all its threads together; of one that is given a
/// scene, with that of its own or, for want of one, `cornell-box-large`. `None` of no study.
#[must_use]
pub fn processor_seconds(study: &str) -> Option<f64> {
    find(study).map(|figure| figure.seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every study is read, and every paper's order that stands on a view of `salesin-fig5` finds
    /// its estimator there.
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
