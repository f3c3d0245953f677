//! What a convergence study of scenes is made of.

use crate::engine::{CELL_SECONDS, Design, Method, REFERENCE_ROUNDS};
use crate::pixels::{Pixels, Resolution};
use crate::record::PaperOrder;
use crate::tables::StudyRecord;
use linelit_estimators::{LineBy, PointDensity};
use linelit_integrator::{Estimator, LightChoice, Settings, Spheres};
use linelit_samplers::SamplerKind;

/// A convergence study of scenes.
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
    /// Seconds for all of the study: what does not fit is left out.
    pub time_budget: Option<f64>,
    /// First seed.
    pub seed: u64,
    /// The strategies for selecting lights: each with each estimator.
    pub lights: Vec<LightChoice>,
    /// Representation of emissive spheres and disks.
    pub spheres: Spheres,
    /// Whether the plan may skip work (`Settings::skip`).
    pub skip: bool,
    /// Orders of the standard deviation that a paper reports, for the table of slopes.
    pub papers: Vec<PaperOrder>,
    /// Single pixels to look at one by one, in place of `pixels`.
    pub spots: Vec<Spot>,
    /// Pictures to render of each scene.
    pub gallery: Option<Gallery>,
    /// Points and lines for the same time, of each scene.
    pub duel: Option<Duel>,
    /// The most rounds of a reference, of four replicates each.
    pub reference_rounds: u32,
    /// Processor seconds that each estimator, pattern and number of samples is measured for at
    /// least.
    pub cell_seconds: f64,
    /// Pixels on the longer side of the picture of a scene.
    pub picture_side: u32,
}

/// A pixel with a name.
#[derive(Clone, Debug)]
pub struct Spot {
    /// Name of the view in tables, behind that of the scene.
    pub label: String,
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
    /// Cost of each picture.
    pub budget: Budget,
    /// The patterns, each with each estimator and choice of lights.
    pub samplers: Vec<SamplerKind>,
    /// The estimators.
    pub estimators: Vec<Estimator>,
    /// Rounds of the reference, of four replicates each.
    pub reference_rounds: u32,
}

/// Two pictures for the same time under a slider: the best points of the study, as many as fit, and
/// its best lines.
#[derive(Clone, Copy, Debug)]
pub struct Duel {
    /// Pixels on the longer side.
    pub side: u32,
    /// Lines at each shading point and light.
    pub samples: u32,
}

/// Limit of the cost of a picture.
#[derive(Clone, Copy, Debug)]
pub enum Budget {
    /// Samples at each shading point and light.
    Samples(u32),
    /// Processor seconds.
    Seconds(f64),
}

impl StudySpec {
    /// The views of all scenes, in order.
    #[must_use]
    pub fn views(&self) -> Vec<View> {
        let views = self.scenes.iter().flat_map(|scene| {
            let name = crate::short_name(scene);
            let view = |label, pixels, with_gallery| View {
                scene: scene.clone(),
                label,
                pixels,
                with_gallery,
            };
            if self.spots.is_empty() {
                return vec![view(name, self.pixels.clone(), true)];
            }
            let spots = self.spots.iter().enumerate().map(|(k, spot)| {
                let label = format!("{name}, {}", spot.label);
                view(label, Pixels::List(vec![spot.pixel]), k == 0)
            });
            spots.collect()
        });
        views.collect()
    }

    /// Shrinks the study to the least size: two numbers of samples, two trials, few pixels,
    /// references of one round, times of two passes, and pictures as large as a thumbnail.
    pub fn shrink(&mut self) {
        self.samples.truncate(2);
        self.trials = 2;
        self.independent_trials = None;
        self.pixels = Pixels::Grid(Resolution {
            width: 4,
            height: 4,
        });
        self.reference_rounds = 1;
        self.cell_seconds = 0.0;
        self.picture_side = 16;
        if let Some(duel) = &mut self.duel {
            (duel.side, duel.samples) = (8, 1);
        }
        if let Some(gallery) = &mut self.gallery {
            (gallery.width, gallery.height) = (8, 8);
            gallery.reference_rounds = 1;
            if let Budget::Seconds(seconds) = &mut gallery.budget {
                *seconds = 0.01;
            }
        }
    }

    /// The methods that are measured on each scene.
    #[must_use]
    pub fn design(&self) -> Design<Settings> {
        let methods = self.methods(&self.estimators, &self.samplers);
        let method = |settings: Settings| Method {
            estimator: self.name(&settings),
            trials: self.trials_of(settings.sampler),
            ..method(settings)
        };
        Design {
            seed: self.seed,
            reference_rounds: self.reference_rounds,
            cell_seconds: self.cell_seconds,
            ..Design::new(
                methods.into_iter().map(method).collect(),
                self.samples.clone(),
            )
        }
    }

    /// Each estimator with each choice of lights and each pattern.
    fn methods(&self, estimators: &[Estimator], samplers: &[SamplerKind]) -> Vec<Settings> {
        let mut all = Vec::new();
        for &estimator in estimators {
            for &lights in &self.lights {
                all.extend(samplers.iter().map(|&sampler| Settings {
                    estimator,
                    lights,
                    sampler,
                    spheres: self.spheres,
                    skip: self.skip,
                    ..Settings::default()
                }));
            }
        }
        all
    }

    /// The pictures of a gallery, in order.
    pub(super) fn pictures(&self, gallery: &Gallery) -> Vec<Settings> {
        self.methods(&gallery.estimators, &gallery.samplers)
    }

    /// The name of an estimator, with the choice of lights where there are several.
    pub(super) fn name(&self, settings: &Settings) -> String {
        let Settings {
            estimator, lights, ..
        } = settings;
        match self.lights.len() {
            1 => estimator.to_string(),
            _ => format!("{estimator}, lights={lights}"),
        }
    }

    /// A record without results; `command` is the one that repeats the study.
    #[must_use]
    pub fn record(&self, command: String) -> StudyRecord {
        let budget = self.time_budget.map(|s| format!("{s} s"));
        let pixels = if self.spots.is_empty() {
            self.pixels.to_string()
        } else {
            Pixels::List(self.spots.iter().map(|spot| spot.pixel).collect()).to_string()
        };
        let trials = match self.independent_trials {
            Some(more) => format!("{}, {more} of independent", self.trials),
            None => self.trials.to_string(),
        };
        let settings = [
            ("pixels", pixels),
            ("samples", joined(&self.samples)),
            ("samplers", joined(&self.samplers)),
            ("estimators", joined(&self.estimators)),
            ("trials", trials),
            ("lights", joined(&self.lights)),
            ("spheres", self.spheres.to_string()),
            ("skip", self.skip.to_string()),
            ("time budget", budget.unwrap_or_default()),
        ];
        StudyRecord {
            command,
            seed: self.seed,
            settings: settings.map(|(k, v)| (k.to_owned(), v)).into(),
            ..StudyRecord::new(&self.title)
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

/// A method by the names of its estimator and pattern; of one round of four trials, which is what
/// references are made of.
pub(super) fn method(settings: Settings) -> Method<Settings> {
    Method {
        estimator: settings.estimator.to_string(),
        sampler: settings.sampler.to_string(),
        trials: 4,
        settings,
    }
}

fn joined<T: ToString>(list: &[T]) -> String {
    let texts: Vec<String> = list.iter().map(ToString::to_string).collect();
    texts.join(",")
}

impl Default for StudySpec {
    /// Points, lines and closed forms by three patterns on two scenes, in about a minute on two
    /// cores.
    fn default() -> Self {
        Self {
            title: "Points and lines: direct light from area lights".to_owned(),
            scenes: vec![
                "grid-planes-large".to_owned(),
                "cornell-box-large".to_owned(),
            ],
            estimators: vec![
                Estimator::points(PointDensity::Area),
                Estimator::points(PointDensity::SolidAngle),
                Estimator::lines(LineBy::Area),
                Estimator::analytic(),
                Estimator::exact(),
                Estimator::hybrid(),
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
            lights: vec![LightChoice::All],
            spheres: Spheres::default(),
            skip: true,
            papers: Vec::new(),
            spots: Vec::new(),
            gallery: None,
            duel: None,
            reference_rounds: REFERENCE_ROUNDS,
            cell_seconds: CELL_SECONDS,
            picture_side: 320,
        }
    }
}

/// A scene and those of its pixels that are studied.
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
