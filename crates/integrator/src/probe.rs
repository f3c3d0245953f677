//! How occluded lights are, asked from a grid of camera points.

use crate::{PlannedTexture, Renderer, Workspace};
use linelit_bsdf::Bsdf;
use linelit_estimators::{
    Buffers, Estimator, OcclusionProbe, OcclusionStats, Query, RandomNumbers,
};
use linelit_lights::{AreaLight, Light};
use linelit_samplers::SamplerKind;

/// Camera rays across and down.
const RAYS: u32 = 8;

/// As many for lines, whose direction is known from penumbrae alone.
const RAYS_FOR_LINES: u32 = 16;

/// The most lights that are looked at.
const MOST_LIGHTS: usize = 16;

/// Occlusion statistics of the lights of the plan; empty where there are too many to ask.
pub(crate) fn occlusion(renderer: &Renderer<'_>) -> Vec<OcclusionStats> {
    let mut probes = vec![OcclusionProbe::default(); renderer.plan().lights().len()];
    let found = over_grid(renderer, RAYS, |k, query, area, buffers| {
        probes[k].look(query, area, buffers);
    });
    if !found {
        return Vec::new();
    }
    over_grid(renderer, RAYS_FOR_LINES, |k, query, area, buffers| {
        probes[k].look_along_lines(query, area, buffers);
    });
    probes.into_iter().map(OcclusionProbe::stats).collect()
}

/// Visits the area lights, by their number in the plan, that reach points of a grid of so many rays
/// across and down; whether there are few enough to do so.
fn over_grid(
    renderer: &Renderer<'_>,
    rays: u32,
    mut visit: impl FnMut(usize, &Query<'_, Bsdf, PlannedTexture>, &AreaLight, &mut Buffers),
) -> bool {
    let lights = renderer.plan().lights();
    if lights.len() > MOST_LIGHTS {
        return false;
    }
    let estimator = Estimator::hybrid();
    let film = &renderer.scene().film;
    let mut workspace = Workspace::new();
    let along = |k: u32, size: u32| {
        let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * rays);
        u32::try_from(middle).unwrap_or(0)
    };
    for i in 0..rays * rays {
        let pixel = [along(i % rays, film.width), along(i / rays, film.height)];
        let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
            continue;
        };
        let buffers = &mut workspace.buffers;
        for (k, light) in lights.iter().enumerate() {
            let source = light.source();
            if let Light::Area(area) = &*light.light
                && source.reaches(&point, &mut buffers.samples.plan)
            {
                let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], light.index);
                let occluders = renderer.light_occluders();
                let query = Query::new(occluders, &source, &point, &estimator, numbers, 1);
                visit(k, &query, area, buffers);
            }
        }
    }
    true
}
