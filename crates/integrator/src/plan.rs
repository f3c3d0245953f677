//! What a scene, and what a shading point, does not need.

use crate::Spheres;
use crate::selection::Tables;
use linelit_estimators::{EmissionTexture, Estimator, LightSource, OcclusionStats};
use linelit_geometry::{ConvexPolygon, DVec3};
use linelit_lights::{ImportanceImage, Light, TexturedSampler};
use linelit_scene::{Scene, SceneLight};
use std::ops::Range;
use std::sync::Arc;

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
    /// The estimator of this light, if it has one of its own.
    pub estimator: Option<Estimator>,
    /// Whether it is sampled for itself where one of the other lights is picked for each sample.
    pub is_apart: bool,
    /// How occluded the light usually is; chooses the strategy of `hybrid`.
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

/// Lights and decisions that remain once all that cannot matter is dropped; built once per scene.
///
/// Per scene it drops lights that emit nothing. Per shading point it drops lights that face away or
/// lie below the horizon, and all lights where the material reflects nothing. What visibility then
/// finds (empty shafts, lights hidden by one occluder) is skipped by the estimators. All of it is
/// counted in [`PlanCounters`](linelit_estimators::PlanCounters); every skip leaves the image as it
/// is, bit for bit, or replaces an estimate by the exact value.
#[derive(Clone, Debug)]
pub struct Plan {
    lights: LightSet,
    /// Lights with exact spheres in place of their facets, if there are any.
    with_spheres: Option<LightSet>,
    dark_lights: usize,
}

/// Lights, and tables for picking one of the union.
#[derive(Clone, Debug)]
pub(crate) struct LightSet {
    /// Those apart first.
    lights: Vec<PlannedLight>,
    apart: usize,
    pub tables: Tables,
}

impl LightSet {
    fn new(lights: Vec<PlannedLight>) -> Self {
        Self {
            lights,
            apart: 0,
            tables: Tables::default(),
        }
    }

    /// Those that are sampled for themselves, and the union of which one is picked.
    pub(crate) fn split(&self) -> (&[PlannedLight], &[PlannedLight]) {
        self.lights.split_at(self.apart)
    }

    fn set_apart(&mut self, light: u32, is_apart: bool) {
        for planned in self.lights.iter_mut().filter(|l| l.index == light) {
            planned.is_apart = is_apart;
        }
        self.lights.sort_by_key(|l| (!l.is_apart, l.index));
        self.apart = self.lights.iter().filter(|l| l.is_apart).count();
        self.tables = Tables::default();
    }
}

impl Plan {
    /// The plan of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let all = scene.lights.iter().zip(0u32..);
        let textured = scene.lights.iter().filter(|l| l.map.is_some()).count();
        let lights: Vec<_> = all
            .filter(|(light, _)| light.light.power() > 0.0)
            .map(|(light, index)| PlannedLight {
                index,
                light: Arc::clone(&light.light),
                triangles: light.triangles.clone(),
                texture: texture(light, textured),
                estimator: None,
                is_apart: false,
                occlusion: OcclusionStats::default(),
            })
            .collect();
        Self {
            dark_lights: scene.lights.len() - lights.len(),
            with_spheres: with_spheres(scene, &lights).map(LightSet::new),
            lights: LightSet::new(lights),
        }
    }

    /// The lights that emit, with spheres as the settings want them.
    #[must_use]
    pub fn lights_of(&self, spheres: Spheres) -> &[PlannedLight] {
        &self.set_of(spheres).lights
    }

    /// The same, and the tables for choosing among them.
    pub(crate) fn set_of(&self, spheres: Spheres) -> &LightSet {
        match (&self.with_spheres, spheres) {
            (Some(set), Spheres::Exact) => set,
            _ => &self.lights,
        }
    }

    /// The lights that emit, spheres as facets.
    #[must_use]
    pub fn lights(&self) -> &[PlannedLight] {
        &self.lights.lights
    }

    /// Notes how occluded the lights are.
    pub(crate) fn set_occlusion(&mut self, stats: &[OcclusionStats]) {
        let others = self.with_spheres.iter_mut();
        let mut others = others.flat_map(|set| &mut set.lights).peekable();
        for (light, stats) in self.lights.lights.iter_mut().zip(stats) {
            light.occlusion = *stats;
            // The same lights in the same order, without the facets of spheres after the first.
            if let Some(same) = others.next_if(|r| r.index == light.index) {
                same.occlusion = *stats;
            }
        }
    }

    /// Gives a light of the scene an estimator of its own, or none; an exact sphere has that of the
    /// first of its facets.
    pub(crate) fn set_estimator(&mut self, light: u32, estimator: Option<Estimator>) {
        let others = self.with_spheres.iter_mut().flat_map(|set| &mut set.lights);
        for planned in self.lights.lights.iter_mut().chain(others) {
            if planned.index == light {
                planned.estimator = estimator;
            }
        }
    }

    /// Takes a light of the scene out of the union that one light is picked of, or puts it back.
    pub(crate) fn set_apart(&mut self, light: u32, is_apart: bool) {
        for set in std::iter::once(&mut self.lights).chain(&mut self.with_spheres) {
            set.set_apart(light, is_apart);
        }
    }

    /// Lights of the scene that emit nothing.
    #[must_use]
    pub const fn dark_lights(&self) -> usize {
        self.dark_lights
    }
}

/// The texture of one of `count` textured lights.
fn texture(light: &SceneLight, count: usize) -> Option<PlannedTexture> {
    let (Light::Area(area), Some(map)) = (&*light.light, &light.map) else {
        return None;
    };
    let texture = linelit_scene::EmissionTexture::new(map, &area.polygon, count)?;
    Some(PlannedTexture(Arc::new(texture)))
}

/// The lights with spheres and cylinders that emit outwards, and disks, in place of their facets;
/// `None` without such lights.
fn with_spheres(scene: &Scene, lights: &[PlannedLight]) -> Option<Vec<PlannedLight>> {
    let exact = |facet: &PlannedLight| {
        let mut round = scene.round.iter().filter(|round| round.outward);
        let Some(round) = round.find(|round| round.lights.contains(&facet.index)) else {
            return Some(facet.clone());
        };
        (round.lights.start == facet.index).then(|| PlannedLight {
            light: Arc::new(round.light),
            triangles: round.triangles.clone(),
            ..facet.clone()
        })
    };
    (!scene.round.is_empty()).then(|| lights.iter().filter_map(exact).collect())
}
