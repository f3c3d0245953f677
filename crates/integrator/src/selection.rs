//! One sample for all lights together (Shirley & Wang 1991, section 3).

use crate::{PlannedLight, Settings, ShadingPoint, Workspace};
use linelit_estimators::streams::light_choice;
use linelit_samplers::{SampleSet, Sampler, SamplerKind};
use linelit_selection::{
    Cosines, Discrete, Estimated, Importance, LightTree, Picked, can_contribute, reflecting,
    unshadowed, unshadowed_at_center,
};
use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// Which lights a shading point samples: all of them, or for each sample one, with the probability
/// αᵢ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightChoice {
    /// `all`: as many samples of each light.
    #[default]
    All,
    /// `one:uniform`: αᵢ = 1/N.
    Uniform,
    /// `one:power`: αᵢ by the emitted power.
    Power,
    /// `one:estimate`: αᵢ by the unshadowed light that the BSDF reflects from a random point of
    /// each light, with a floor for every light that can contribute (Shirley & Wang's rule). Its
    /// cost grows with the lights.
    Estimate,
    /// `one:exact`: αᵢ by the unshadowed light of each light in closed form, the BSDF as linearly
    /// transformed cosines: what the others try to be. Its cost grows with the lights.
    Exact,
    /// `one:centre`: αᵢ by the unshadowed light of each light's centre, without the rule. **Wrong**
    /// where a light's centre is below the horizon and other parts of it are not: it makes the
    /// bands of Shirley & Wang's Fig. 10, and is here to show them.
    Centre,
    /// `tree`: αᵢ by a hierarchy of the lights, each group a blurred light under those cosines. Its
    /// cost grows with the logarithm of the number of lights.
    Tree,
}

/// The names, as the command line lists them.
const CHOICES: [(&str, LightChoice); 7] = [
    ("all", LightChoice::All),
    ("one:uniform", LightChoice::Uniform),
    ("one:power", LightChoice::Power),
    ("one:estimate", LightChoice::Estimate),
    ("one:exact", LightChoice::Exact),
    ("one:centre", LightChoice::Centre),
    ("tree", LightChoice::Tree),
];

impl fmt::Display for LightChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = CHOICES.iter().find(|(_, choice)| choice == self);
        f.pad(found.map_or("all", |(name, _)| name))
    }
}

impl FromStr for LightChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = CHOICES.iter().find(|(name, _)| *name == text);
        found.map(|(_, choice)| *choice).ok_or_else(|| {
            let names = CHOICES.map(|(name, _)| name).join(", ");
            format!("lights `{text}`; expected one of {names}")
        })
    }
}

/// The tables that do not depend on the shading point, made when first asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    uniform: OnceLock<Option<Discrete>>,
    power: OnceLock<Option<Discrete>>,
    tree: OnceLock<LightTree>,
}

impl Tables {
    fn uniform(&self, lights: &[PlannedLight]) -> Option<&Discrete> {
        let table = || Discrete::uniform(lights.len());
        self.uniform.get_or_init(table).as_ref()
    }

    fn power(&self, lights: &[PlannedLight]) -> Option<&Discrete> {
        let table = || {
            let power = |l: &PlannedLight| l.light.power().min(f64::MAX);
            let weights: Vec<f64> = lights.iter().map(power).collect();
            Discrete::new(&weights)
        };
        self.power.get_or_init(table).as_ref()
    }

    fn tree(&self, lights: &[PlannedLight]) -> &LightTree {
        self.tree.get_or_init(|| {
            let lights = lights.iter().map(|l| &*l.light);
            LightTree::new(lights, Importance::default())
        })
    }
}

/// A light that some of the samples have picked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drawn {
    /// Index into the plan's lights.
    pub light: usize,
    /// Number of samples that picked it.
    pub count: u32,
    /// αᵢ.
    pub probability: f64,
}

/// Draws a light for each sample of a shading point; `workspace.drawn` then holds each light that
/// was picked, once.
pub(crate) fn draw(
    lights: &[PlannedLight],
    tables: &Tables,
    settings: &Settings,
    point: &ShadingPoint,
    (pixel, repetition): ([u32; 2], u32),
    workspace: &mut Workspace,
) {
    let (x, n, wo) = (point.position, point.normal, point.outgoing);
    let count = settings.samples.max(1);
    let dimension = light_choice(repetition);
    let numbers = Sampler::new(settings.sampler, settings.seed).points(pixel, dimension, count);
    let Workspace { weights, drawn, .. } = workspace;
    drawn.clear();
    weights.resize(lights.len(), 0.0);
    match settings.lights {
        LightChoice::All => {}
        LightChoice::Uniform => pick_all(drawn, &numbers, |u| tables.uniform(lights)?.pick(u)),
        LightChoice::Power => pick_all(drawn, &numbers, |u| tables.power(lights)?.pick(u)),
        LightChoice::Tree => {
            let tree = tables.tree(lights);
            let light = |i: usize| &*lights[i].light;
            let cosines = Cosines::new(&point.bsdf, x, n, wo);
            let at = cosines.receiver();
            pick_all(drawn, &numbers, |u| tree.pick(light, &at, u));
        }
        LightChoice::Estimate => {
            let positions = Sampler::new(SamplerKind::Independent, settings.seed).points(
                pixel,
                dimension.wrapping_sub(1),
                1,
            );
            let at = reflecting(&point.bsdf, x, n, wo);
            let estimate = |i: usize| {
                let position = positions.get_2d(u32::try_from(i).unwrap_or(u32::MAX));
                unshadowed(&lights[i].light, &at, position)
            };
            let possible = |i: usize| can_contribute(&lights[i].light, x, n);
            let table = Estimated::new(weights, estimate, possible);
            pick_all(drawn, &numbers, |u| table.pick(u));
        }
        LightChoice::Exact => {
            let cosines = Cosines::new(&point.bsdf, x, n, wo);
            for (weight, light) in weights.iter_mut().zip(lights) {
                *weight = cosines.light(&light.light);
            }
            let table = Discrete::new(weights);
            pick_all(drawn, &numbers, |u| table.as_ref()?.pick(u));
        }
        LightChoice::Centre => {
            let at = reflecting(&point.bsdf, x, n, wo);
            for (weight, light) in weights.iter_mut().zip(lights) {
                *weight = unshadowed_at_center(&light.light, &at);
            }
            let table = Discrete::new(weights);
            pick_all(drawn, &numbers, |u| table.as_ref()?.pick(u));
        }
    }
    gather(drawn);
}

/// Picks a light for each number of a set.
fn pick_all(drawn: &mut Vec<Drawn>, numbers: &SampleSet, pick: impl Fn(f64) -> Option<Picked>) {
    drawn.extend(numbers.iter_1d().filter_map(pick).map(|picked| Drawn {
        light: picked.index,
        count: 1,
        probability: picked.probability,
    }));
}

/// Joins what picked the same light; in the order of the lights.
fn gather(drawn: &mut Vec<Drawn>) {
    drawn.sort_unstable_by_key(|d| d.light);
    drawn.dedup_by(|later, first| {
        let same = later.light == first.light;
        first.count += if same { later.count } else { 0 };
        same
    });
}
