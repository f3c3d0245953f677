//! One sample for all lights together (Shirley & Wang 1991, section 3).

use crate::renderer::Streams;
use crate::{PlannedLight, Settings, ShadingPoint, Workspace};
use linelit_estimators::streams::light_choice;
use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind};
use linelit_selection::{
    Cosines, Discrete, Estimated, LightTree, Picked, can_contribute, reflecting, unshadowed,
    unshadowed_at_center,
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
            LightTree::new(lights)
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
    /// Whose samples of the light these are, of the camera samples that picked it.
    pub block: Block,
}

/// Draws a light for each sample of a shading point; `workspace.drawn` then holds each light that
/// was picked, once.
pub(crate) fn draw(
    lights: &[PlannedLight],
    tables: &Tables,
    settings: &Settings,
    point: &ShadingPoint,
    streams: Streams,
    workspace: &mut Workspace,
) {
    let (x, n, wo) = (point.position, point.normal, point.outgoing);
    let numbers = Numbers::new(settings, streams);
    let Workspace { weights, drawn, .. } = workspace;
    drawn.clear();
    weights.resize(lights.len(), 0.0);
    match settings.lights {
        LightChoice::All => {}
        LightChoice::Uniform => numbers.pick_alike(drawn, |u| tables.uniform(lights)?.pick(u)),
        LightChoice::Power => numbers.pick_alike(drawn, |u| tables.power(lights)?.pick(u)),
        LightChoice::Tree => {
            let tree = tables.tree(lights);
            let light = |i: usize| &*lights[i].light;
            let cosines = Cosines::new(&point.bsdf, x, n, wo);
            let at = cosines.receiver();
            numbers.pick(drawn, |u| tree.pick(light, &at, u));
        }
        LightChoice::Estimate => {
            let at = reflecting(&point.bsdf, x, n, wo);
            let estimate = |i: usize| {
                let position = numbers.position(i);
                unshadowed(&lights[i].light, &at, position)
            };
            let possible = |i: usize| can_contribute(&lights[i].light, x, n);
            let table = Estimated::new(weights, estimate, possible);
            numbers.pick(drawn, |u| table.pick(u));
        }
        LightChoice::Exact => {
            let cosines = Cosines::new(&point.bsdf, x, n, wo);
            for (weight, light) in weights.iter_mut().zip(lights) {
                *weight = cosines.light(&light.light);
            }
            let table = Discrete::new(weights);
            numbers.pick(drawn, |u| table.as_ref()?.pick(u));
        }
        LightChoice::Centre => {
            let at = reflecting(&point.bsdf, x, n, wo);
            for (weight, light) in weights.iter_mut().zip(lights) {
                *weight = unshadowed_at_center(&light.light, &at);
            }
            let table = Discrete::new(weights);
            numbers.pick(drawn, |u| table.as_ref()?.pick(u));
        }
    }
    gather(drawn);
}

/// The random numbers that pick a light for each sample of a shading point.
struct Numbers {
    block: Block,
    count: u32,
    set: SampleSet,
    /// Points on lights that the choice looks at: the same for all camera samples, so that these
    /// pick by nearly the same probabilities.
    positions: SampleSet,
    /// Of several camera samples: where its numbers are among those of the others.
    turn: Option<f64>,
}

impl Numbers {
    fn new(settings: &Settings, streams: Streams) -> Self {
        let Streams { pixel, path, block } = streams;
        let (count, dimension) = (settings.samples.max(1), light_choice(path));
        let sampler = Sampler::new(settings.sampler, settings.seed);
        let independent = Sampler::new(SamplerKind::Independent, settings.seed);
        let is_spread = block != Block::WHOLE && !settings.sampler.is_progressive();
        let turn = || block.spread(independent.points(pixel, dimension, 1).get_1d(0));
        Self {
            block,
            count,
            set: sampler.block(pixel, dimension, count, block),
            positions: independent.points(pixel, dimension.wrapping_sub(1), 1),
            turn: is_spread.then(turn),
        }
    }

    fn position(&self, light: usize) -> [f64; 2] {
        self.positions
            .get_2d(u32::try_from(light).unwrap_or(u32::MAX))
    }

    /// Picks a light for each number, by probabilities that each shading point has of its own.
    fn pick(&self, drawn: &mut Vec<Drawn>, pick: impl Fn(f64) -> Option<Picked>) {
        self.picked(drawn, pick, |_, _| self.block);
    }

    /// The same by probabilities that all have in common: the samples of camera samples that pick
    /// a light as often are blocks of a pattern of their own.
    fn pick_alike(&self, drawn: &mut Vec<Drawn>, pick: impl Fn(f64) -> Option<Picked>) {
        self.picked(drawn, pick, |u, picked| {
            let Some(turn) = self.turn else {
                return self.block;
            };
            let before = u - picked.rest * picked.probability;
            let ends = [before.max(0.0), before + picked.probability];
            let marks = ends.map(|end| (end * f64::from(self.count)).fract());
            self.block.among(turn, marks)
        });
    }

    fn picked(
        &self,
        drawn: &mut Vec<Drawn>,
        pick: impl Fn(f64) -> Option<Picked>,
        block: impl Fn(f64, &Picked) -> Block,
    ) {
        drawn.extend((0..self.count).filter_map(|i| {
            let u = match self.turn {
                None => self.set.get_1d(i),
                Some(turn) => (f64::from(i) + turn) / f64::from(self.count),
            };
            let picked = pick(u)?;
            Some(Drawn {
                light: picked.index,
                count: 1,
                probability: picked.probability,
                block: block(u, &picked),
            })
        }));
    }
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
