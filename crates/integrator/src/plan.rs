//! What a scene, and what a shading point, does not need.

use crate::selection::Tables;
use crate::{Estimator, ShadingPoint, Spheres};
use linelit_geometry::DVec3;
use linelit_lights::{AreaLight, Light, Sphere, SphereLight};
use linelit_scene::{EmissionTexture, EmissiveSphere, Scene, SceneLight};
use std::fmt;
use std::ops::{AddAssign, Range};
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
    /// What an area light emits where, if not the same everywhere.
    pub texture: Option<Arc<EmissionTexture>>,
    /// The estimator of this light, if it has one of its own.
    pub estimator: Option<Estimator>,
    /// What stands before it.
    pub crowd: Crowd,
}

/// What stands before a light, seen from a few points that the camera sees: geometry alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crowd {
    /// Whether there is so much that looking for all of it at once seldom pays.
    pub dense: bool,
    /// Triangles in between that may hide a part of it, on average over points; none where nothing
    /// or all of it is hidden.
    pub candidates: f64,
    /// Edges that bound what is hidden, for each triangle in between: up to three if triangles are
    /// loose, few in meshes.
    pub edges: f64,
}

impl Default for Crowd {
    /// Few triangles, all loose.
    fn default() -> Self {
        Self {
            dense: false,
            candidates: 1.0,
            edges: 3.0,
        }
    }
}

/// What is left to do once everything that cannot matter is dropped; built once per scene.
///
/// Per scene it drops lights that emit nothing. Per shading point it drops lights that face away
/// or lie below the horizon, and all lights where the material reflects nothing. What visibility
/// then finds (empty shafts, lights hidden by one occluder) is skipped by the estimators. All of
/// it is counted in [`PlanCounters`]; every skip leaves the image as it is, bit for bit, or
/// replaces an estimate by the exact value.
#[derive(Clone, Debug)]
pub struct Plan {
    lights: Vec<PlannedLight>,
    tables: Tables,
    /// The same with exact spheres in place of their facets, if there are any.
    round: Option<(Vec<PlannedLight>, Tables)>,
    dark_lights: usize,
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
                crowd: Crowd::default(),
            })
            .collect();
        Self {
            dark_lights: scene.lights.len() - lights.len(),
            round: round(scene, &lights).map(|lights| (lights, Tables::default())),
            tables: Tables::default(),
            lights,
        }
    }

    /// The lights that emit, with spheres as the settings want them.
    #[must_use]
    pub fn lights_of(&self, spheres: Spheres) -> &[PlannedLight] {
        match (&self.round, spheres) {
            (Some((lights, _)), Spheres::Exact) => lights,
            _ => &self.lights,
        }
    }

    /// What choosing among those lights needs.
    pub(crate) fn tables_of(&self, spheres: Spheres) -> &Tables {
        match (&self.round, spheres) {
            (Some((_, tables)), Spheres::Exact) => tables,
            _ => &self.tables,
        }
    }

    /// The lights that emit, spheres as facets.
    #[must_use]
    pub fn lights(&self) -> &[PlannedLight] {
        &self.lights
    }

    /// Notes what stands before the lights.
    pub(crate) fn set_crowds(&mut self, crowds: &[Crowd]) {
        let mut round = self
            .round
            .iter_mut()
            .flat_map(|(lights, _)| lights)
            .peekable();
        for (light, crowd) in self.lights.iter_mut().zip(crowds) {
            light.crowd = *crowd;
            // The same lights in the same order, without the facets of spheres after the first.
            if let Some(same) = round.next_if(|r| r.index == light.index) {
                same.crowd = *crowd;
            }
        }
    }

    /// Gives a light of the scene an estimator of its own, or none; an exact sphere has that of the
    /// first of its facets.
    pub(crate) fn set_estimator(&mut self, light: u32, estimator: Option<Estimator>) {
        let round = self.round.iter_mut().flat_map(|(lights, _)| lights);
        for planned in self.lights.iter_mut().chain(round) {
            if planned.index == light {
                planned.estimator = estimator;
            }
        }
    }

    /// Lights of the scene that emit nothing.
    #[must_use]
    pub const fn dark_lights(&self) -> usize {
        self.dark_lights
    }

    /// Whether `light` can reach the point at all; counts why not.
    pub(crate) fn reaches(
        light: &PlannedLight,
        point: &ShadingPoint,
        counters: &mut PlanCounters,
    ) -> bool {
        counters.point_lights += 1;
        match &*light.light {
            Light::Area(area) => {
                if !area.faces(point.position) {
                    counters.facing_away += 1;
                    return false;
                }
                above_horizon(point, area_vertices(area), counters)
            }
            Light::Linear(line) => {
                above_horizon(point, &[line.segment.p0, line.segment.p1], counters)
            }
            // Their samplers ask for the horizon themselves.
            Light::Sphere(_) | Light::Disk(_) => true,
        }
    }
}

/// The texture of one of `count` textured lights.
fn texture(light: &SceneLight, count: usize) -> Option<Arc<EmissionTexture>> {
    let (Light::Area(area), Some(map)) = (&*light.light, &light.map) else {
        return None;
    };
    EmissionTexture::new(map, &area.polygon, count).map(Arc::new)
}

/// The lights with spheres that emit outwards in place of their facets; `None` without such spheres.
fn round(scene: &Scene, lights: &[PlannedLight]) -> Option<Vec<PlannedLight>> {
    let outward = |s: &&EmissiveSphere| !s.inward && !s.emission.two_sided;
    let spheres: Vec<_> = scene.spheres.iter().filter(outward).collect();
    if spheres.is_empty() {
        return None;
    }
    let stands_for = |l: &PlannedLight| spheres.iter().find(|s| s.lights.contains(&l.index));
    let mut out = Vec::new();
    for light in lights {
        match stands_for(light) {
            None => out.push(light.clone()),
            Some(sphere) if sphere.lights.start == light.index => out.push(PlannedLight {
                index: light.index,
                light: Arc::new(Light::Sphere(SphereLight {
                    sphere: Sphere {
                        center: sphere.center,
                        radius: sphere.radius,
                    },
                    radiance: sphere.emission.radiance,
                })),
                triangles: sphere.triangles.clone(),
                texture: None,
                estimator: None,
                crowd: Crowd::default(),
            }),
            Some(_) => {}
        }
    }
    Some(out)
}

fn area_vertices(light: &AreaLight) -> &[DVec3] {
    light.polygon.vertices()
}

/// Whether any vertex is above both horizons. A convex light has its highest point at a vertex.
fn above_horizon(point: &ShadingPoint, vertices: &[DVec3], counters: &mut PlanCounters) -> bool {
    let highest = |n: DVec3| {
        let height = |v: &DVec3| n.dot(*v - point.position);
        vertices
            .iter()
            .map(height)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let above = highest(point.geometric_normal) > 0.0 && highest(point.normal) > 0.0;
    if !above {
        counters.below_horizon += 1;
    }
    above
}

/// How often what was skipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlanCounters {
    /// Shading points estimated.
    pub points: u64,
    /// Shading points whose material reflects nothing: no light was looked at.
    pub black_materials: u64,
    /// Pairs of shading point and light that were looked at.
    pub point_lights: u64,
    /// Pairs dropped because the light faces away.
    pub facing_away: u64,
    /// Pairs dropped because the light is below the horizon.
    pub below_horizon: u64,
    /// Pairs with nothing between point and light: no visibility was sampled.
    pub unoccluded: u64,
    /// Pairs where the light is wholly hidden: nothing was sampled.
    pub hidden: u64,
    /// Pairs where the light was integrated in closed form without any sample.
    pub closed_form: u64,
    /// Pairs in penumbra whose visible part was integrated in closed form.
    pub exact_penumbrae: u64,
    /// Pairs in penumbra that `exact` handed to line samples.
    pub exact_fallbacks: u64,
    /// Line samples that are wholly hidden.
    pub hidden_lines: u64,
    /// Lines asked for their density at a point of another technique.
    pub density_lines: u64,
}

impl PlanCounters {
    /// Names and values, for reports.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, u64); 12] {
        [
            ("shading points", self.points),
            ("points on black materials, skipped", self.black_materials),
            ("(point, light) pairs", self.point_lights),
            ("pairs skipped: light faces away", self.facing_away),
            ("pairs skipped: light below the horizon", self.below_horizon),
            (
                "pairs without any occluder: no visibility sampled",
                self.unoccluded,
            ),
            (
                "pairs with the light wholly hidden: nothing sampled",
                self.hidden,
            ),
            ("pairs in closed form: no samples", self.closed_form),
            ("penumbra pairs in closed form", self.exact_penumbrae),
            (
                "penumbra pairs handed by exact to lines",
                self.exact_fallbacks,
            ),
            ("line samples wholly hidden", self.hidden_lines),
            (
                "lines through points of other techniques, for their density",
                self.density_lines,
            ),
        ]
    }
}

impl AddAssign for PlanCounters {
    fn add_assign(&mut self, other: Self) {
        self.points += other.points;
        self.black_materials += other.black_materials;
        self.point_lights += other.point_lights;
        self.facing_away += other.facing_away;
        self.below_horizon += other.below_horizon;
        self.unoccluded += other.unoccluded;
        self.hidden += other.hidden;
        self.closed_form += other.closed_form;
        self.exact_penumbrae += other.exact_penumbrae;
        self.exact_fallbacks += other.exact_fallbacks;
        self.hidden_lines += other.hidden_lines;
        self.density_lines += other.density_lines;
    }
}

impl fmt::Display for PlanCounters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, value) in self.rows() {
            writeln!(f, "{value:>14}  {name}")?;
        }
        Ok(())
    }
}
