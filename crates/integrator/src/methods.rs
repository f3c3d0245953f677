//! Which methods an estimator uses for the lights of a scene on its materials.

use crate::probe::{RAYS, grid};
use crate::{Renderer, Settings, Workspace};
use linelit_bsdf::Reflection;
use linelit_estimators::{KnownKind, LightKind, MethodFacts, VisibilityBy};
use std::collections::BTreeSet;

/// The methods for lights of one kind, and of one estimator, on some materials.
#[derive(Clone, Debug, PartialEq)]
pub struct PairMethods {
    /// The kind of the lights.
    pub light: LightKind,
    /// The methods in words ([`Estimator::explain`](crate::Estimator::explain)).
    pub methods: String,
    /// The number of points that take the place of the closed form which the estimator is named
    /// for, if they do ([`Estimator::points_in_place`](crate::Estimator::points_in_place)).
    pub points_in_place: Option<u32>,
    /// The lights, by their number in the plan.
    pub lights: BTreeSet<usize>,
    /// The materials that one of them reaches, as indices into the scene's.
    pub materials: BTreeSet<u32>,
}

impl Renderer<'_> {
    /// The methods for each kind of light on each material, found at the surfaces that a grid of
    /// camera rays meets first and the lights that reach these. A material whose textures change
    /// what is known of its reflection may have several methods.
    #[must_use]
    pub fn methods(&self, settings: &Settings) -> Vec<PairMethods> {
        // Find which lights reach which materials.
        let lights = self.plan().lights_of(settings.spheres);
        let (mut pairs, mut workspace) = (BTreeSet::new(), Workspace::new());
        for point in grid(&self.world, 4 * RAYS, &mut workspace) {
            let counts = &mut workspace.direct.buffers.counts.plan;
            for (index, light) in lights.iter().enumerate() {
                if point.bsdf.is_black() || !light.source().reaches(&point, counts) {
                    continue;
                }
                let known = match light.profile {
                    None => KnownKind::of(&point.shading),
                    Some(_) => KnownKind::NOTHING,
                };
                pairs.insert((index, point.material, known));
            }
        }
        // Join the pairs for which the estimator uses the same methods.
        let mut rows: Vec<PairMethods> = Vec::new();
        for (index, material, known) in pairs {
            let planned = &lights[index];
            let light = LightKind::of(&planned.source());
            let estimator = planned.estimator.as_ref().unwrap_or(&settings.estimator);
            let facts = MethodFacts {
                occlusion: &planned.occlusion,
                skip: settings.skip,
                ask: match settings.share {
                    true => VisibilityBy::Shaft,
                    false => VisibilityBy::Rays,
                },
                ..MethodFacts::new(light, known, settings.samples)
            };
            let methods = estimator.explain(&facts);
            let same = |row: &&mut PairMethods| (row.light, &row.methods) == (light, &methods);
            match rows.iter_mut().find(same) {
                Some(row) => {
                    row.lights.insert(index);
                    row.materials.insert(material);
                }
                None => rows.push(PairMethods {
                    light,
                    methods,
                    points_in_place: estimator.points_in_place(&facts),
                    lights: [index].into(),
                    materials: [material].into(),
                }),
            }
        }
        rows
    }
}
