//! A plan has the lights of a scene that pictures need. It is made once for each scene.

use crate::Spheres;
use linelit_direct::{Luminaire, Luminaires, Texture};
use linelit_geometry::Margins;
use linelit_lights::Light;
use linelit_scene::{SceneDescription, SceneLight};
use std::sync::Arc;

/// The lights of a scene that emit light.
///
/// Lights that emit nothing are left out once, for the whole scene. At each shading point, lights
/// that face away or are below the horizon are left out, and on black materials all lights are.
/// What visibility queries then show (an empty shaft, or a light that one occluder hides) lets
/// estimators skip samples. All of this is counted in
/// [`PlanCounters`](linelit_estimators::PlanCounters). Whatever is skipped either leaves the image
/// unchanged, bit for bit, or replaces an estimate by its exact value.
#[derive(Clone, Debug)]
pub struct Plan {
    facets: Luminaires,
    /// The same lights, with exact spheres, disks and cylinders instead of their facets; `None` if
    /// there are no such shapes.
    exact: Option<Luminaires>,
}

impl Plan {
    /// Makes the plan of a scene. `look` measures the occlusion of the lights.
    pub(crate) fn new(scene: &SceneDescription, look: impl FnOnce(&mut [Luminaire])) -> Self {
        let indices = u32::try_from(scene.lights.len()).unwrap_or(u32::MAX);
        // Measure the occlusion once, for the lights in the form that most pictures use.
        let mut facets = emitting(scene);
        let mut exact = with_round(scene, &facets);
        look(&mut exact);
        if scene.round.is_empty() {
            return Self {
                facets: Luminaires::new(exact, indices),
                exact: None,
            };
        }
        // Copy it to the facets of the lights.
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

    /// The lights that emit, with round shapes in the form that is requested.
    #[must_use]
    pub fn lights_of(&self, spheres: Spheres) -> &[Luminaire] {
        self.set_of(spheres).as_slice()
    }

    /// The lights that emit, with round shapes in the form that is requested, and the tables for
    /// choosing among them.
    pub(crate) const fn set_of(&self, spheres: Spheres) -> &Luminaires {
        match (&self.exact, spheres) {
            (Some(set), Spheres::Exact) => set,
            _ => &self.facets,
        }
    }

    /// Changes the light with a number in the scene, in both forms; a round light has the number of
    /// its first facet. Returns `false` if no light that emits has this number.
    pub(crate) fn change(&mut self, light: u32, change: impl Fn(&mut Luminaire)) -> bool {
        let mut is_found = false;
        for set in std::iter::once(&mut self.facets).chain(&mut self.exact) {
            is_found |= set.change(light, &change);
        }
        is_found
    }
}

/// The lights of a scene that emit, with facets for round shapes.
fn emitting(scene: &SceneDescription) -> Vec<Luminaire> {
    let textured = scene.lights.iter().filter(|l| l.map.is_some()).count();
    (scene.lights.iter().zip(0u32..))
        .filter(|(light, _)| light.light.power() > 0.0)
        .map(|(light, index)| Luminaire {
            triangles: light.triangles.clone(),
            texture: texture(light, textured),
            profile: light.profile.clone(),
            // Files contain rounded numbers: a lamp may be mounted flush in a slanted ceiling.
            margins: Margins::DEFAULT,
            ..Luminaire::new(index, Arc::clone(&light.light))
        })
        .collect()
}

/// The texture of a light of which there are `count` with textures; `None` if the light has no
/// texture.
fn texture(light: &SceneLight, count: usize) -> Option<Texture> {
    let (Light::Area(area), Some(map)) = (&*light.light, &light.map) else {
        return None;
    };
    let texture = linelit_scene::EmissionTexture::new(map, &area.polygon, count)?;
    Some(Texture::new(texture))
}

/// The same lights, with exact shapes instead of the facets of disks, and of spheres and cylinders
/// that emit outwards.
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
