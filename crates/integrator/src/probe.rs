//! Lights asked from a grid of camera points: how occluded they are.

use crate::world::World;
use crate::{PlannedLight, ShadingPoint, Workspace};
use linelit_estimators::{Buffers, Estimator, OcclusionProbe, Query, RandomNumbers};
use linelit_geometry::Margins;
use linelit_lights::Light;
use linelit_samplers::SamplerKind;

/// Camera rays across and down, for questions that cost much.
pub(crate) const RAYS: u32 = 8;

/// The most lights that are looked at.
const MOST_LIGHTS: usize = 16;

/// Notes how occluded the area lights are, unless there are too many to ask.
pub(crate) fn note_occlusion(world: &World<'_>, lights: &mut [PlannedLight]) {
    if lights.len() > MOST_LIGHTS {
        return;
    }
    let mut probes = vec![OcclusionProbe::default(); lights.len()];
    let estimator = Estimator::hybrid();
    // The direction of lines is known from penumbrae alone, for which it takes more rays.
    for (rays, along_lines) in [(RAYS, false), (2 * RAYS, true)] {
        over_grid(world, lights, rays, |k, point, buffers| {
            let Light::Area(area) = &*lights[k].light else {
                return;
            };
            let numbers = RandomNumbers::new(SamplerKind::Stratified, 0, [0, 0], lights[k].index);
            let source = lights[k].source();
            let mut query = Query::new(&world.shadows, &source, point, &estimator, numbers, 1);
            query.margins = Margins::DEFAULT;
            if along_lines {
                probes[k].look_along_lines(&query, area, buffers);
            } else {
                probes[k].look(&query, area, buffers);
            }
        });
    }
    for (light, probe) in lights.iter_mut().zip(probes) {
        light.occlusion = probe.stats();
    }
}

/// Visits the lights, by their number, that reach the points which a grid of so many camera rays
/// across and down meets.
pub(crate) fn over_grid(
    world: &World<'_>,
    lights: &[PlannedLight],
    rays: u32,
    mut visit: impl FnMut(usize, &ShadingPoint, &mut Buffers),
) {
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
            if light.source().reaches(&point, &mut buffers.counts.plan) {
                visit(k, &point, buffers);
            }
        }
    }
}
