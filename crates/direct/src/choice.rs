//! One light at random is chosen here for each sample of a shading point (Shirley & Wang 1991,
//! section 3).

use crate::workspace::Drawn;
use crate::{Illumination, LightChoice, Luminaire, SampleNames, Settings, Workspace};
use linelit_estimators::ShadingPoint;
use linelit_estimators::streams::light_choice;
use linelit_lights::Light;
use linelit_samplers::{Block, SampleSet, Sampler, SamplerKind};
use linelit_selection::{
    Discrete, Estimated, LightTree, LtcReceiver, Picked, can_contribute, reflecting, unshadowed,
    unshadowed_at_center,
};

/// Chooses one of these lights for each sample of a shading point. Afterwards `workspace.drawn` has
/// each chosen light once, with its number of samples.
pub(crate) fn draw(
    lights: &[Luminaire],
    illumination: &Illumination<'_>,
    point: &ShadingPoint,
    names: SampleNames,
    workspace: &mut Workspace,
) {
    // Set up the random numbers of the choice, and tables from weights.
    let (settings, tables) = (&illumination.settings, &illumination.lights.tables);
    let (x, n, wo) = (point.position, point.normal, point.outgoing);
    let numbers = Numbers::new(settings, names);
    let light = |i: usize| &*lights[i].light;
    let weighted = |weight: &dyn Fn(&Light) -> f64| {
        let weights: Vec<f64> = lights.iter().map(|l| weight(&l.light)).collect();
        Discrete::new(&weights)
    };
    let Workspace { weights, drawn, .. } = workspace;
    drawn.clear();
    // Choose by tables that are the same for all shading points, or by weights at this point.
    match settings.lights {
        LightChoice::All => {}
        LightChoice::Uniform => {
            let table = tables.uniform.get_or_init(|| weighted(&|_| 1.0));
            numbers.pick(drawn, true, |u| table.as_ref()?.pick(u));
        }
        LightChoice::Power => {
            let power = |light: &Light| light.power().min(f64::MAX);
            let table = tables.power.get_or_init(|| weighted(&power));
            numbers.pick(drawn, true, |u| table.as_ref()?.pick(u));
        }
        LightChoice::Tree => {
            let all = lights.iter().map(|l| &*l.light);
            let tree = tables.tree.get_or_init(|| LightTree::new(all));
            let cosines = LtcReceiver::new(&point.bsdf, x, n, wo);
            let at = cosines.receiver();
            numbers.pick(drawn, false, |u| tree.pick(light, &at, u));
        }
        LightChoice::Estimate => {
            let at = reflecting(&point.bsdf, x, n, wo);
            let estimate = |i: usize| unshadowed(light(i), &at, numbers.position(i));
            weights.resize(lights.len(), 0.0);
            let table = Estimated::new(weights, estimate, |i| can_contribute(light(i), x, n));
            numbers.pick(drawn, false, |u| table.pick(u));
        }
        LightChoice::Exact => {
            let cosines = LtcReceiver::new(&point.bsdf, x, n, wo);
            let table = weighted(&|light| cosines.light(light));
            numbers.pick(drawn, false, |u| table.as_ref()?.pick(u));
        }
        LightChoice::Centre => {
            let at = reflecting(&point.bsdf, x, n, wo);
            let table = weighted(&|light| unshadowed_at_center(light, &at));
            numbers.pick(drawn, false, |u| table.as_ref()?.pick(u));
        }
    }
    // Join the samples that chose the same light, in the order of the lights.
    drawn.sort_unstable_by_key(|d| d.light);
    drawn.dedup_by(|later, first| {
        let same = later.light == first.light;
        first.count += if same { later.count } else { 0 };
        same
    });
}

/// The random numbers by which a light is chosen for each sample of a shading point.
struct Numbers {
    block: Block,
    count: u32,
    set: SampleSet,
    /// The numbers of the points on lights that the choice considers. They are the same for all
    /// camera samples of a pixel, so that these choose by nearly the same probabilities.
    positions: SampleSet,
    /// The offset of this camera sample's numbers, in [0, 1), if the pixel has several camera
    /// samples whose numbers are spread evenly.
    turn: Option<f64>,
}

impl Numbers {
    fn new(settings: &Settings<'_>, names: SampleNames) -> Self {
        let SampleNames { pixel, path, block } = names;
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

    /// The two random numbers of the point on a light that the choice considers.
    fn position(&self, light: usize) -> [f64; 2] {
        self.positions
            .get_2d(u32::try_from(light).unwrap_or(u32::MAX))
    }

    /// Chooses a light for each random number.
    ///
    /// `alike` says that all shading points choose by the same probabilities. Then those camera
    /// samples that choose a light equally often divide one pattern of that light among them.
    fn pick(&self, drawn: &mut Vec<Drawn>, alike: bool, pick: impl Fn(f64) -> Option<Picked>) {
        drawn.extend((0..self.count).filter_map(|i| {
            // Choose a light by the number of this sample.
            let u = match self.turn {
                None => self.set.get_1d(i),
                Some(turn) => (f64::from(i) + turn) / f64::from(self.count),
            };
            let picked = pick(u)?;
            // Find which camera samples choose this light equally often: the light's numbers are an
            // interval, and its two ends decide.
            let block = match self.turn {
                Some(turn) if alike => {
                    let before = u - picked.rest * picked.probability;
                    let ends = [before.max(0.0), before + picked.probability];
                    let marks = ends.map(|end| (end * f64::from(self.count)).fract());
                    self.block.among(turn, marks)
                }
                _ => self.block,
            };
            Some(Drawn {
                light: picked.index,
                count: 1,
                probability: picked.probability,
                block,
            })
        }));
    }
}
