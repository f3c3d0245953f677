//! The lights that a scene, and those that a shading point, needs.

use crate::{LightChoice, Spheres};
use linelit_estimators::{
    EmissionTexture, Estimator, LightSource, OcclusionStats, Technique, Weights,
};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{ImportanceImage, Light, Profile, TexturedSampler};
use linelit_scene::{Scene, SceneLight};
use linelit_selection::{Discrete, LightTree};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A light that can contribute to some point of the scene.
#[derive(Clone, Debug)]
pub struct PlannedLight {
    /// Index of the light in the scene: it names the light's sample dimensions.
    pub index: u32,
    /// The light, the scene's own.
    pub light: Arc<Light>,
    /// The light's own triangles, which never block it.
    pub triangles: Range<u32>,
    /// Emission of an area light by position, if not the same everywhere.
    pub texture: Option<PlannedTexture>,
    /// The factor of the emission of an area light by direction.
    pub profile: Option<Arc<Profile>>,
    /// The estimator of this light, if it has one of its own.
    pub estimator: Option<Estimator>,
    /// Whether it is sampled for itself where one of the other lights is picked for each sample.
    pub is_apart: bool,
    /// The light's usual occlusion, which chooses the strategy of `hybrid`.
    pub occlusion: OcclusionStats,
}

impl PlannedLight {
    /// The light as estimators take it.
    #[must_use]
    pub fn source(&self) -> LightSource<'_, PlannedTexture> {
        LightSource {
            light: &self.light,
            triangles: self.triangles.clone(),
            texture: self.texture.as_ref(),
            profile: self.profile.as_deref(),
            occlusion: self.occlusion,
        }
    }
}

/// Emission of an area light of a scene by position, as estimators ask for it.
#[derive(Clone, Debug)]
pub struct PlannedTexture(Arc<linelit_scene::EmissionTexture>);

impl EmissionTexture for PlannedTexture {
    fn radiance(&self, on_light: DVec3) -> DVec3 {
        self.0.radiance(on_light)
    }

    fn points(&self) -> Option<TexturedSampler<'_>> {
        self.0.points()
    }

    fn fits(&self) -> bool {
        self.0.fits()
    }

    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage> {
        self.0.over(part)
    }
}

/// The lights of a scene that emit.
///
/// Lights that emit nothing are dropped once, for the whole scene. Per shading point, lights that
/// face away or lie below the horizon are, and all lights where the material reflects nothing.
/// What visibility then finds (empty shafts, lights hidden by one occluder) is skipped by the
/// estimators. All of it is counted in [`PlanCounters`](linelit_estimators::PlanCounters); every
/// skip leaves the image as it is, bit for bit, or replaces an estimate by the exact value.
#[derive(Clone, Debug)]
pub struct Plan {
    facets: LightSet,
    /// Lights with exact spheres in place of their facets, if there are any.
    exact: Option<LightSet>,
}

/// Tables for picking one of the union, the same for all shading points; made when first asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    pub uniform: OnceLock<Option<Discrete>>,
    pub power: OnceLock<Option<Discrete>>,
    pub tree: OnceLock<LightTree>,
}

/// Lights, and tables for picking one of the union.
#[derive(Clone, Debug)]
pub(crate) struct LightSet {
    /// The lights; those that are sampled for themselves come first.
    lights: Vec<PlannedLight>,
    pub tables: Tables,
}

impl LightSet {
    fn new(lights: Vec<PlannedLight>) -> Self {
        let tables = Tables::default();
        Self { lights, tables }
    }

    /// The lights that are sampled for themselves, and the union of which one is picked.
    pub(crate) fn split(&self, choice: LightChoice) -> (&[PlannedLight], &[PlannedLight]) {
        match choice {
            LightChoice::All => (&self.lights, &[]),
            _ => (self.lights).split_at(self.lights.partition_point(|l| l.is_apart)),
        }
    }
}

impl Plan {
    /// The plan of the lights of a scene that emit.
    pub(crate) fn new(scene: &Scene, lights: Vec<PlannedLight>) -> Self {
        Self {
            exact: (!scene.round.is_empty()).then(|| LightSet::new(with_round(scene, &lights))),
            facets: LightSet::new(lights),
        }
    }

    /// The lights that emit, with spheres as the settings want them.
    #[must_use]
    pub fn lights_of(&self, spheres: Spheres) -> &[PlannedLight] {
        &self.set_of(spheres).lights
    }

    /// The lights that emit, and the tables for choosing among them.
    pub(crate) fn set_of(&self, spheres: Spheres) -> &LightSet {
        match (&self.exact, spheres) {
            (Some(set), Spheres::Exact) => set,
            _ => &self.facets,
        }
    }

    /// Changes a light of the scene; an exact sphere is the first of its facets. False if no light
    /// that emits has that number.
    pub(crate) fn change(&mut self, light: u32, change: impl Fn(&mut PlannedLight)) -> bool {
        let mut is_found = false;
        for set in std::iter::once(&mut self.facets).chain(&mut self.exact) {
            if let Some(planned) = set.lights.iter_mut().find(|l| l.index == light) {
                change(planned);
                is_found = true;
            }
            set.lights.sort_by_key(|l| (!l.is_apart, l.index));
            set.tables = Tables::default();
        }
        is_found
    }
}

/// Whether an estimator asks occluders by rays alone, whatever the light and the reflection: points
/// of one technique, each with a shadow ray.
pub(crate) fn asks_by_rays(estimator: &Estimator) -> bool {
    let by_rays = |technique| matches!(technique, Technique::Points(points) if !points.in_shaft);
    estimator.weights() == Weights::Alone
        && estimator.parts().iter().all(|part| by_rays(part.technique))
}

/// The lights of a scene that emit.
pub(crate) fn emitting(scene: &Scene) -> Vec<PlannedLight> {
    let textured = scene.lights.iter().filter(|l| l.map.is_some()).count();
    (scene.lights.iter().zip(0u32..))
        .filter(|(light, _)| light.light.power() > 0.0)
        .map(|(light, index)| PlannedLight {
            index,
            light: Arc::clone(&light.light),
            triangles: light.triangles.clone(),
            texture: texture(light, textured),
            profile: light.profile.clone(),
            estimator: None,
            is_apart: false,
            occlusion: OcclusionStats::FEW,
        })
        .collect()
}

/// The texture of one of `count` textured lights.
fn texture(light: &SceneLight, count: usize) -> Option<PlannedTexture> {
    let (Light::Area(area), Some(map)) = (&*light.light, &light.map) else {
        return None;
    };
    let texture = linelit_scene::EmissionTexture::new(map, &area.polygon, count)?;
    Some(PlannedTexture(Arc::new(texture)))
}

/// The lights with spheres and cylinders that emit outwards, and disks, in place of their facets.
fn with_round(scene: &Scene, lights: &[PlannedLight]) -> Vec<PlannedLight> {
    let exact = |facet: &PlannedLight| {
        let Some(round) = scene.whole_of(facet.index) else {
            return Some(facet.clone());
        };
        (round.lights.start == facet.index).then(|| PlannedLight {
            light: Arc::new(round.light.clone()),
            triangles: round.triangles.clone(),
            ..facet.clone()
        })
    };
    lights.iter().filter_map(exact).collect()
}
