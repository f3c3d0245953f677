//! The lights that a scene, and those that a shading point, needs.

use crate::Spheres;
use linelit_direct::{Luminaire, Luminaires, Texture};
use linelit_geometry::Margins;
use linelit_lights::Light;
use linelit_scene::{SceneDescription, SceneLight};
use std::sync::Arc;

/// The lights of a scene that emit.
///
/// Lights that emit nothing are dropped once, for the whole scene. Per shading point, lights that
/// face away or lie below the horizon are, and all lights where the material reflects nothing.
/// What visibility then finds (empty shafts, lights hidden by one occluder) is skipped by the
/// estimators. All of it is counted in [`PlanCounters`](linelit_estimators::PlanCounters); every
/// skip leaves the image as it is, bit for bit, or replaces an estimate by the exact value.
#[derive(Clone, Debug)]
pub struct Plan {
    facets: Luminaires,
    /// Lights with exact spheres in place of their facets, if there are any.
    exact: Option<Luminaires>,
}

impl Plan {
    /// The plan of the lights of a scene that emit. `look` measures the occlusion of lights.
    pub(crate) fn new(scene: &SceneDescription, look: impl FnOnce(&mut [Luminaire])) -> Self {
        let indices = u32::try_from(scene.lights.len()).unwrap_or(u32::MAX);
        // Look once, at the lights as most pictures take them.
        let mut facets = emitting(scene);
        let mut exact = with_round(scene, &facets);
        look(&mut exact);
        if scene.round.is_empty() {
            return Self {
                facets: Luminaires::new(exact, indices),
                exact: None,
            };
        }
        for facet in &mut facets {
            if let Ok(k) = exact.binary_search_by_key(&facet.index, |light| light.index) {
                facet.occlusion = exact[k].occlusion;
            }
        }
        Self {
            facets: Luminaires::new(facets, indices),
            exact: Some(Luminaires::new(exact, indices)),
        }
    }

    /// The lights that emit, with spheres as the settings want them.
    #[must_use]
    pub fn lights_of(&self, spheres: Spheres) -> &[Luminaire] {
        self.set_of(spheres).as_slice()
    }

    /// The lights that emit, with the tables for choosing among them.
    pub(crate) const fn set_of(&self, spheres: Spheres) -> &Luminaires {
        match (&self.exact, spheres) {
            (Some(set), Spheres::Exact) => set,
            _ => &self.facets,
        }
    }

    /// Changes a light of the scene; an exact sphere is the first of its facets. False if no light
    /// that emits has that number.
    pub(crate) fn change(&mut self, light: u32, change: impl Fn(&mut Luminaire)) -> bool {
        let mut is_found = false;
        for set in std::iter::once(&mut self.facets).chain(&mut self.exact) {
            is_found |= set.change(light, &change);
        }
        is_found
    }
}

/// The lights of a scene that emit.
fn emitting(scene: &SceneDescription) -> Vec<Luminaire> {
    let textured = scene.lights.iter().filter(|l| l.map.is_some()).count();
    (scene.lights.iter().zip(0u32..))
        .filter(|(light, _)| light.light.power() > 0.0)
        .map(|(light, index)| Luminaire {
            triangles: light.triangles.clone(),
            texture: texture(light, textured),
            profile: light.profile.clone(),
            // Files are rounded: a lamp may be mounted flush in a slanted ceiling.
            margins: Margins::DEFAULT,
            ..Luminaire::new(index, Arc::clone(&light.light))
        })
        .collect()
}

/// The texture of one of `count` textured lights.
fn texture(light: &SceneLight, count: usize) -> Option<Texture> {
    let (Light::Area(area), Some(map)) = (&*light.light, &light.map) else {
        return None;
    };
    let texture = linelit_scene::EmissionTexture::new(map, &area.polygon, count)?;
    Some(Texture::new(texture))
}

/// The lights with spheres and cylinders that emit outwards, and disks, in place of their facets.
fn with_round(scene: &SceneDescription, lights: &[Luminaire]) -> Vec<Luminaire> {
    let exact = |facet: &Luminaire| {
        let Some(round) = scene.whole_of(facet.index) else {
            return Some(facet.clone());
        };
        (round.lights.start == facet.index).then(|| Luminaire {
            light: Arc::new(round.light.clone()),
            triangles: round.triangles.clone(),
            ..facet.clone()
        })
    };
    lights.iter().filter_map(exact).collect()
}
