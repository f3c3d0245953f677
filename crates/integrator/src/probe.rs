//! How occluded lights are, asked from a grid of camera points.

use crate::{Renderer, Workspace};
use linelit_estimators::{OcclusionProbe, OcclusionStats};
use linelit_lights::Light;

/// Camera rays across and down.
const RAYS: u32 = 8;

/// The most lights that are looked at.
const MOST_LIGHTS: usize = 16;

/// Occlusion statistics of the lights of the plan; empty where there are too many to ask.
pub(crate) fn occlusion(renderer: &Renderer<'_>) -> Vec<OcclusionStats> {
    let lights = renderer.plan().lights();
    if lights.len() > MOST_LIGHTS {
        return Vec::new();
    }
    let film = &renderer.scene().film;
    let mut workspace = Workspace::new();
    let mut probes = vec![OcclusionProbe::default(); lights.len()];
    let along = |k: u32, size: u32| {
        let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * RAYS);
        u32::try_from(middle).unwrap_or(0)
    };
    for i in 0..RAYS * RAYS {
        let pixel = [along(i % RAYS, film.width), along(i / RAYS, film.height)];
        let Some(point) = renderer.shading_point(pixel, &mut workspace) else {
            continue;
        };
        let buffers = &mut workspace.buffers;
        for (light, probe) in lights.iter().zip(&mut probes) {
            let Light::Area(area) = &*light.light else {
                continue;
            };
            let source = light.source();
            if source.reaches(&point, &mut buffers.samples.plan) {
                probe.look(renderer.occluders(), &source, area, point.position, buffers);
            }
        }
    }
    probes.into_iter().map(OcclusionProbe::stats).collect()
}
