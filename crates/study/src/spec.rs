//! What a convergence study is made of.

use crate::engine::CELL_SECONDS;
use crate::pixels::{Pixels, Resolution};
use linelit_estimators::{LineBy, PointBy};
use linelit_integrator::{Estimator, LightChoice};
use linelit_samplers::SamplerKind;
use std::time::Duration;

/// A convergence study.
#[derive(Clone, Debug)]
pub struct StudySpec {
    /// Title of the report.
    pub title: String,
    /// Scenes, by file or name.
    pub scenes: Vec<String>,
    /// Estimators.
    pub estimators: Vec<Estimator>,
    /// Patterns.
    pub samplers: Vec<SamplerKind>,
    /// Samples, ascending.
    pub samples: Vec<u32>,
    /// Independent trials of each.
    pub trials: u32,
    /// Trials of the independent pattern, where more are wanted: its order is known to be −1/2, so
    /// it is the one that shows how well the study measures.
    pub independent_trials: Option<u32>,
    /// Pixels.
    pub pixels: Pixels,
    /// Seconds after which no more samples are added.
    pub time_budget: Option<f64>,
    /// First seed.
    pub seed: u64,
    /// Which lights a shading point samples.
    pub lights: LightChoice,
    /// Whether the plan may skip (see `Settings::skip`).
    pub skip: bool,
    /// Orders of the standard deviation that a paper reports, for the table of slopes.
    pub papers: Vec<PaperOrder>,
    /// Single pixels to look at one by one, in place of `pixels`.
    pub spots: Vec<Spot>,
    /// Pictures to render of each scene.
    pub gallery: Option<Gallery>,
    /// The longest that a reference may take beyond its first round.
    pub reference_limit: Duration,
    /// Processor seconds that each estimator, pattern and number of samples is measured for at
    /// least.
    pub cell_seconds: f64,
}

/// The longest that the reference of a study may take beyond its first round, unless told.
pub const REFERENCE_LIMIT: Duration = Duration::from_secs(60);

/// A pixel with a name.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// What it stands for.
    pub label: &'static str,
    /// The pixel.
    pub pixel: [u32; 2],
}

/// Pictures by several estimators, side by side.
#[derive(Clone, Debug)]
pub struct Gallery {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// What each picture may cost.
    pub budget: Budget,
    /// The pattern.
    pub sampler: SamplerKind,
    /// The estimators.
    pub estimators: Vec<Estimator>,
    /// The longest that the reference may take beyond its first round.
    pub reference_limit: Duration,
}

/// What a picture may cost.
#[derive(Clone, Copy, Debug)]
pub enum Budget {
    /// Samples at each shading point and light.
    Samples(u32),
    /// Processor seconds.
    Seconds(f64),
}

impl StudySpec {
    /// What is looked at, in order.
    #[must_use]
    pub fn views(&self) -> Vec<View> {
        let mut views = Vec::new();
        for scene in &self.scenes {
            let name = crate::short_name(scene);
            if self.spots.is_empty() {
                views.push(View {
                    scene: scene.clone(),
                    label: name,
                    pixels: self.pixels.clone(),
                    with_gallery: true,
                });
                continue;
            }
            for (k, spot) in self.spots.iter().enumerate() {
                views.push(View {
                    scene: scene.clone(),
                    label: format!("{name}, {}", spot.label),
                    pixels: Pixels::List(vec![spot.pixel]),
                    with_gallery: k == 0,
                });
            }
        }
        views
    }

    /// The same steps at the smallest size: two numbers of samples, two trials, few pixels,
    /// references of one round, and times of two passes.
    pub fn shrink(&mut self) {
        self.samples.truncate(2);
        self.trials = 2;
        self.independent_trials = None;
        self.pixels = Pixels::Grid(Resolution {
            width: 4,
            height: 4,
        });
        self.reference_limit = Duration::ZERO;
        self.cell_seconds = 0.0;
        if let Some(gallery) = &mut self.gallery {
            (gallery.width, gallery.height) = (8, 8);
            gallery.reference_limit = Duration::ZERO;
            if let Budget::Seconds(seconds) = &mut gallery.budget {
                *seconds = 0.01;
            }
        }
    }

    /// Trials of a pattern.
    #[must_use]
    pub fn trials_of(&self, sampler: SamplerKind) -> u32 {
        match (sampler, self.independent_trials) {
            (SamplerKind::Independent, Some(trials)) => trials,
            _ => self.trials,
        }
    }
}

/// An order of convergence that a paper reports.
#[derive(Clone, Debug)]
pub struct PaperOrder {
    /// Our scene.
    pub scene: String,
    /// Our estimator, as it prints itself.
    pub estimator: &'static str,
    /// The pattern.
    pub sampler: SamplerKind,
    /// The order of the standard deviation.
    pub order: f64,
    /// Where it stands.
    pub source: &'static str,
}

impl Default for StudySpec {
    /// Points and lines by three patterns on two scenes, in about a minute on two cores.
    fn default() -> Self {
        Self {
            title: "Points and lines: direct light from area lights".to_owned(),
            scenes: vec![
                "grid-planes-large".to_owned(),
                "cornell-box-large".to_owned(),
            ],
            estimators: vec![
                Estimator::points(PointBy::Area),
                Estimator::points(PointBy::SolidAngle),
                Estimator::lines(LineBy::Area),
                Estimator::analytic(),
            ],
            samplers: vec![
                SamplerKind::Independent,
                SamplerKind::Stratified,
                SamplerKind::Sobol,
            ],
            samples: vec![1, 4, 16, 64, 256],
            trials: 16,
            independent_trials: None,
            pixels: Pixels::Grid(Resolution {
                width: 64,
                height: 64,
            }),
            time_budget: None,
            seed: 1,
            lights: LightChoice::All,
            skip: true,
            papers: Vec::new(),
            spots: Vec::new(),
            gallery: None,
            reference_limit: REFERENCE_LIMIT,
            cell_seconds: CELL_SECONDS,
        }
    }
}

/// Where a study looks: a scene, and which of its pixels.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene, by file or name.
    pub scene: String,
    /// The name under which results stand.
    pub label: String,
    /// The pixels.
    pub pixels: Pixels,
    /// Whether the gallery is rendered here.
    pub with_gallery: bool,
}
