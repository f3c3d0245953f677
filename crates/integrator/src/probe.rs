//! How occluded lights are, asked from a grid of camera points.

use crate::world::World;
use crate::{PlannedLight, PlannedTexture, Workspace};
use linelit_bsdf::Bsdf;
use linelit_estimators::{
    Buffers, Estimator, OcclusionProbe, OcclusionStats, Query, RandomNumbers,
};
use linelit_lights::{AreaLight, Light};
use linelit_samplers::SamplerKind;

/// Camera rays across and down.
const RAYS: u32 = 8;

/// Camera rays for lines, whose direction is known from penumbrae alone.
const RAYS_FOR_LINES: u32 = 2 * RAYS;

/// The most lights that are looked at.
const MOST_LIGHTS: usize = 16;

/// Occlusion statistics of the lights of the plan; empty where there are too many to ask.
pub(crate) fn occlusion(world: &World<'_>, lights: &[PlannedLight]) -> Vec<OcclusionStats> {
    if lights.len() > MOST_LIGHTS {
        return Vec::new();
    }
    let mut probes = vec![OcclusionProbe::default(); lights.len()];
    over_grid(world, lights, RAYS, |k, query, area, buffers| {
        probes[k].look(query, area, buffers);
    });
    over_grid(world, lights, RAYS_FOR_LINES, |k, query, area, buffers| {
        probes[k].look_along_lines(query, area, buffers);
    });
    probes.into_iter().map(OcclusionProbe::stats).collect()
}

/// Visits the area lights, by their number in the plan, that reach points of a grid of so many rays
/// across and down.
fn over_grid(
    world: &World<'_>,
    lights: &[PlannedLight],
    rays: u32,
    mut visit: impl FnMut(usize, &Query<'_, Bsdf, PlannedTexture>, &AreaLight, &mut Buffers),
) {
    let estimator = Estimator::hybrid();
    let film = &world.scene.film;
    let mut workspace = Workspace::new();
    let along = |k: u32, size: u32| {
        let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * rays);
        u32::try_from(middle).unwrap_or(0)
    };
    for i in 0..rays * rays {
        let pixel = [along(i % rays, film.width), along(i / rays, film.height)];
        let Some(point) = world.shading_point(pixel, &mut workspace) else {
            continue;
        };
        let buffers = &mut workspace.buffers;
        for (k, light) in lights.iter().enumerate() {
            let source = light.source();
            if let Light::Area(area) = &*light.light
                && source.reaches(&point, &mut buffers.samples.plan)
            {
                let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], light.index);
                let occluders = world.hiding();
                let query = Query::new(occluders, &source, &point, &estimator, numbers, 1);
                visit(k, &query, area, buffers);
            }
        }
    }
}
