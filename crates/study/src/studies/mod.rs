//! What is measured: the default study, the papers' studies, and studies of the user's own.

mod billen_figures;
mod billen_orders;
mod billen_table1;
mod exhibition;
mod peters_diffuse;
mod peters_gloss;
mod peters_table1;
mod salesin;
mod shirley;

pub use billen_figures::{Figure, run as billen_figures};
pub use billen_table1::{Row as Table1Row, run as billen_table1, text as billen_table1_text};
pub use exhibition::{Context, Exhibition, Row};

use crate::cli::{ConvergeArgs, Pixels, Resolution, UsageError};
use crate::engine::{CELL_SECONDS, View};
use anyhow::Result;
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
    /// Processor seconds that each estimator, pattern and number of samples is measured for at least.
    pub cell_seconds: f64,
}

/// The longest that the reference of a study may take beyond its first round, unless told.
const REFERENCE_LIMIT: Duration = Duration::from_secs(60);

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
    fn shrink(&mut self) {
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

/// The named studies, but for those of one paper.
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

/// What `converge` was asked for.
#[derive(Clone, Debug)]
pub enum Study {
    /// Errors over samples and time, with slopes.
    Convergence(Box<StudySpec>),
    /// Billen & Dutré's Table 1.
    BillenTable1,
    /// Billen & Dutré's Figs. 2, 3 and 5.
    BillenFigures,
    /// Pictures and tables, by the name of the study.
    Exhibition(&'static str, fn(&Context<'_>) -> Result<Exhibition>),
}

/// The study that the command line names, with its flags applied.
///
/// # Errors
/// A [`UsageError`] if a study is named beside scenes, or lacks one.
pub fn resolve(args: &ConvergeArgs) -> Result<Study> {
    if let [name, scene @ ..] = args.what.as_slice()
        && salesin::NAMES.contains(&name.as_str())
    {
        return salesin_study(name, scene, args);
    }
    let named = args.what.iter().any(|w| NAMES.contains(&w.as_str()));
    if named && args.what.len() > 1 {
        return Err(usage(format!(
            "name one study, or any number of scenes, not both: {}",
            args.what.join(" ")
        )));
    }
    let mut spec = match args.what.first().map(String::as_str) {
        None | Some("default") => default_study(),
        Some("billen-orders") => billen_orders::spec(),
        Some("billen-table1") => return Ok(Study::BillenTable1),
        Some("billen-figures") => return Ok(Study::BillenFigures),
        Some("peters-fig1") => return Ok(Study::Exhibition("peters-fig1", peters_gloss::figure_1)),
        Some("peters-fig4") => {
            return Ok(Study::Exhibition("peters-fig4", peters_diffuse::figure_4));
        }
        Some("peters-fig6") => {
            return Ok(Study::Exhibition("peters-fig6", peters_diffuse::figure_6));
        }
        Some("peters-fig7") => return Ok(Study::Exhibition("peters-fig7", peters_gloss::figure_7)),
        Some("peters-table1") => {
            return Ok(Study::Exhibition("peters-table1", peters_table1::table_1));
        }
        Some("shirley") => return Ok(Study::Exhibition("shirley", shirley::run)),
        Some(_) => StudySpec {
            scenes: args.what.clone(),
            ..default_study()
        },
    };
    apply_flags(&mut spec, args);
    Ok(Study::Convergence(Box::new(spec)))
}

/// A figure of Salesin & Jarosz, on its own scene or on one that is given.
fn salesin_study(name: &str, scene: &[String], args: &ConvergeArgs) -> Result<Study> {
    if scene.len() > 1 {
        let scenes = scene.join(" ");
        return Err(usage(format!("`{name}` takes one scene at most: {scenes}")));
    }
    let Some(mut spec) = salesin::spec(name, scene.first().map(String::as_str)) else {
        return Err(usage(format!(
            "`{name}` needs a scene: converge {name} SCENE.pbrt"
        )));
    };
    apply_flags(&mut spec, args);
    if args.pixels.is_some() {
        spec.spots.clear();
    }
    Ok(Study::Convergence(Box::new(spec)))
}

fn usage(what: String) -> anyhow::Error {
    UsageError(what).into()
}

fn apply_flags(spec: &mut StudySpec, args: &ConvergeArgs) {
    if args.smallest {
        spec.shrink();
    }
    if let Some(list) = &args.estimators {
        spec.estimators.clone_from(&list.0);
    }
    if let Some(list) = &args.samplers {
        spec.samplers.clone_from(&list.0);
    }
    if let Some(counts) = &args.samples {
        spec.samples.clone_from(&counts.0);
    }
    if let Some(trials) = args.trials {
        spec.trials = trials;
        spec.independent_trials = None;
    }
    if let Some(pixels) = &args.pixels {
        spec.pixels.clone_from(pixels);
    }
    spec.time_budget = args.time_budget.or(spec.time_budget);
    spec.seed = args.seed;
    spec.lights = args.lights;
}

/// Points and lines by three patterns on two scenes, in about a minute on two cores.
fn default_study() -> StudySpec {
    StudySpec {
        title: "Points and lines: direct light from area lights".to_owned(),
        scenes: vec![
            "grid-planes-large".to_owned(),
            "cornell-box-large".to_owned(),
        ],
        estimators: [
            "point-area",
            "point-solid-angle",
            "line-area",
            "line-analytic",
        ]
        .iter()
        .filter_map(|name| name.parse().ok())
        .collect(),
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
        papers: billen_orders::paper_orders(),
        spots: Vec::new(),
        gallery: None,
        reference_limit: REFERENCE_LIMIT,
        cell_seconds: CELL_SECONDS,
    }
}
