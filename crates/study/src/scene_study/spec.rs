//! The specification of a convergence study of scenes: which scenes, estimators, samplers and
//! pictures it has.

use crate::engine::{CELL_SECONDS, Design, Method, REFERENCE_ROUNDS};
use crate::pixels::{Pixels, Resolution};
use crate::record::PaperOrder;
use crate::tables::StudyRecord;
use linelit_estimators::{LineBy, PointDensity};
use linelit_integrator::{Estimator, LightChoice, Settings, Spheres};
use linelit_samplers::SamplerKind;

/// The specification of a convergence study of scenes.
#[derive(Clone, Debug)]
pub struct StudySpec {
    /// The title of the report.
    pub title: String,
    /// The scenes, by file or name.
    pub scenes: Vec<String>,
    /// The estimators.
    pub estimators: Vec<Estimator>,
    /// The samplers.
    pub samplers: Vec<SamplerKind>,
    /// The numbers of samples, ascending.
    pub samples: Vec<u32>,
    /// The number of independent trials of each measurement.
    pub trials: u32,
    /// The number of trials with the independent sampler, if it differs from `trials`. The order of
    /// this sampler is known to be −1/2, so that it shows how well the study measures orders.
    pub independent_trials: Option<u32>,
    /// The pixels to measure.
    pub pixels: Pixels,
    /// The seconds for the whole study; measurements that do not fit are left out.
    pub time_budget: Option<f64>,
    /// The first seed.
    pub seed: u64,
    /// The strategies for selecting lights. Each estimator is measured with each.
    pub lights: Vec<LightChoice>,
    /// The representation of emissive spheres and disks.
    pub spheres: Spheres,
    /// Whether the plan may skip work (`Settings::skip`).
    pub skip: bool,
    /// The orders of the standard deviation that papers report, for the table of slopes.
    pub papers: Vec<PaperOrder>,
    /// Single pixels that are studied one by one, in place of `pixels`.
    pub spots: Vec<Spot>,
    /// Pictures to render of each scene.
    pub gallery: Option<Gallery>,
    /// Two pictures of each scene that take the same time, one by points and one by lines.
    pub duel: Option<Duel>,
    /// The largest number of rounds of a reference, of four replicates each.
    pub reference_rounds: u32,
    /// The least processor time, in seconds, for which each estimator, sampler and number of
    /// samples is measured.
    pub cell_seconds: f64,
    /// The longer side of the picture of a scene, in pixels.
    pub picture_side: u32,
}

/// A pixel with a name.
#[derive(Clone, Debug)]
pub struct Spot {
    /// The name of the view in tables, which follows the name of the scene.
    pub label: String,
    /// The pixel.
    pub pixel: [u32; 2],
}

/// Pictures by several estimators, side by side.
#[derive(Clone, Debug)]
pub struct Gallery {
    /// The width in pixels.
    pub width: u32,
    /// The height in pixels.
    pub height: u32,
    /// The cost of each picture.
    pub budget: Budget,
    /// The samplers, each with each estimator and choice of lights.
    pub samplers: Vec<SamplerKind>,
    /// The estimators.
    pub estimators: Vec<Estimator>,
    /// The number of rounds of the reference, of four replicates each.
    pub reference_rounds: u32,
}

/// Two pictures that take the same time, under a slider: the best lines of the study, and its best
/// points with as many samples as fit.
#[derive(Clone, Copy, Debug)]
pub struct Duel {
    /// The longer side, in pixels.
    pub side: u32,
    /// The number of lines at each shading point and light.
    pub samples: u32,
}

/// The limit on the cost of a picture.
#[derive(Clone, Copy, Debug)]
pub enum Budget {
    /// The samples at each shading point and light.
    Samples(u32),
    /// The processor seconds.
    Seconds(f64),
}

impl StudySpec {
    /// Returns the views of all scenes, in order: one for each scene, or one for each spot of each
    /// scene.
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

    /// Shrinks the study to the least size, for tests: two numbers of samples, two trials, few
    /// pixels, references of one round, times of two passes, and pictures of the size of a
    /// thumbnail.
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

    /// Returns the methods that are measured on each scene, with samples and limits.
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

    /// Returns the settings of each estimator with each choice of lights and each sampler.
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

    /// Returns the settings of the pictures of a gallery, in order.
    pub(super) fn pictures(&self, gallery: &Gallery) -> Vec<Settings> {
        self.methods(&gallery.estimators, &gallery.samplers)
    }

    /// Returns the name of an estimator, with the choice of lights where there are several.
    pub(super) fn name(&self, settings: &Settings) -> String {
        let Settings {
            estimator, lights, ..
        } = settings;
        match self.lights.len() {
            1 => estimator.to_string(),
            _ => format!("{estimator}, lights={lights}"),
        }
    }

    /// Creates the study's record without results; `command` is the command that repeats the study.
    #[must_use]
    pub fn record(&self, command: String) -> StudyRecord {
        // Describe the settings for the report.
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

    /// Returns the number of trials with a sampler.
    #[must_use]
    pub fn trials_of(&self, sampler: SamplerKind) -> u32 {
        match (sampler, self.independent_trials) {
            (SamplerKind::Independent, Some(trials)) => trials,
            _ => self.trials,
        }
    }
}

/// Returns a method named after its estimator and sampler, with four trials, as many as a round of
/// a reference has.
pub(super) fn method(settings: Settings) -> Method<Settings> {
    Method {
        estimator: settings.estimator.to_string(),
        sampler: settings.sampler.to_string(),
        trials: 4,
        settings,
    }
}

/// Joins the texts of a list by commas.
fn joined<T: ToString>(list: &[T]) -> String {
    let texts: Vec<String> = list.iter().map(ToString::to_string).collect();
    texts.join(",")
}

impl Default for StudySpec {
    /// Returns the default study: points, lines and closed forms by three sampling patterns on two
    /// scenes, in about a minute on two cores.
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

/// A scene with the pixels of it that are studied together.
#[derive(Clone, Debug)]
pub struct View {
    /// The scene, by file or name.
    pub scene: String,
    /// The label of the results.
    pub label: String,
    /// The pixels.
    pub pixels: Pixels,
    /// Whether the gallery is rendered for this view.
    pub with_gallery: bool,
}
