//! This module lists the methods that an estimator uses for the lights of a scene on its materials,
//! for reports.

use crate::probe::{RAYS, grid};
use crate::{Renderer, Settings, Workspace};
use linelit_bsdf::Reflection;
use linelit_estimators::{KnownKind, LightKind, MethodFacts, VisibilityBy};
use std::collections::BTreeSet;

/// The methods that an estimator uses for lights of one kind on some materials.
#[derive(Clone, Debug, PartialEq)]
pub struct PairMethods {
    /// The kind of the lights.
    pub light: LightKind,
    /// The methods, described in words ([`Estimator::explain`](crate::Estimator::explain)).
    pub methods: String,
    /// The number of points that replace the closed form for which the estimator is named, if they
    /// do ([`Estimator::points_in_place`](crate::Estimator::points_in_place)).
    pub points_in_place: Option<u32>,
    /// The lights for which these methods are used, by their number in the plan.
    pub lights: BTreeSet<usize>,
    /// The materials that at least one of these lights reaches, as indices into the scene's
    /// materials.
    pub materials: BTreeSet<u32>,
}

impl Renderer<'_> {
    /// Finds the methods for each kind of light on each material. The materials are those of the
    /// surfaces that a grid of camera rays meets first, and the lights are those that reach these
    /// surfaces. A material may have several methods if its textures change what is known of its
    /// reflection.
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
