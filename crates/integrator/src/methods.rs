//! What is done about the lights of a scene on its materials.

use crate::{Renderer, Settings, Workspace};
use linelit_bsdf::Reflection;
use linelit_estimators::{Known, LightKind, Method};
use std::collections::BTreeSet;

/// Camera rays across and down.
const RAYS: u32 = 32;

/// What is done about lights of one kind, and of one estimator, on some materials.
#[derive(Clone, Debug, PartialEq)]
pub struct PairMethods {
    /// The kind of the lights.
    pub light: LightKind,
    /// One method, or those of a combination.
    pub methods: Vec<Method>,
    /// The lights, by their number in the plan.
    pub lights: BTreeSet<usize>,
    /// The materials that one of them reaches, as indices into the scene's.
    pub materials: BTreeSet<u32>,
}

impl Renderer<'_> {
    /// What is done about each kind of light on each material, found at the surfaces that a grid of
    /// camera rays meets first and the lights that reach these. A material whose textures change
    /// what is known of its reflection may have several methods.
    #[must_use]
    pub fn methods(&self, settings: &Settings) -> Vec<PairMethods> {
        let film = &self.scene().film;
        let lights = self.plan().lights_of(settings.spheres);
        let mut workspace = Workspace::new();
        let along = |k: u32, size: u32| {
            let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * RAYS);
            u32::try_from(middle).unwrap_or(0)
        };
        let mut pairs = BTreeSet::new();
        for i in 0..RAYS * RAYS {
            let pixel = [along(i % RAYS, film.width), along(i / RAYS, film.height)];
            let point = self.shading_point(pixel, &mut workspace);
            let Some(point) = point.filter(|point| !point.bsdf.is_black()) else {
                continue;
            };
            let known = Known::of(&point);
            for (index, light) in lights.iter().enumerate() {
                let plan = &mut workspace.buffers.samples.plan;
                if light.source().reaches(&point, plan) {
                    pairs.insert((index, point.material, known));
                }
            }
        }
        let mut rows: Vec<PairMethods> = Vec::new();
        for (index, material, known) in pairs {
            let planned = &lights[index];
            let light = LightKind::of(&planned.source());
            let estimator = planned.estimator.as_ref().unwrap_or(&settings.estimator);
            let methods: Vec<_> = estimator.methods(light, known).collect();
            let same = |row: &&mut PairMethods| (row.light, &row.methods) == (light, &methods);
            match rows.iter_mut().find(same) {
                Some(row) => {
                    row.lights.insert(index);
                    row.materials.insert(material);
                }
                None => rows.push(PairMethods {
                    light,
                    methods,
                    lights: [index].into(),
                    materials: [material].into(),
                }),
            }
        }
        rows
    }
}
