//! This module finds the points of the scene that a grid of camera rays meets, from which lights
//! are probed.

use crate::world::World;
use crate::{ShadingPoint, Workspace};

/// The number of camera rays, across and down, whose points measure how much of the lights is
/// hidden.
pub(crate) const RAYS: u32 = 8;

/// The points that a grid of camera rays meets, with `rays` of them across and down.
pub(crate) fn grid(world: &World<'_>, rays: u32, workspace: &mut Workspace) -> Vec<ShadingPoint> {
    let film = &world.scene.film;
    let along = |k: u32, size: u32| {
        let middle = u64::from(2 * k + 1) * u64::from(size) / u64::from(2 * rays);
        u32::try_from(middle).unwrap_or(0)
    };
    let pixel = |i: u32| [along(i % rays, film.width), along(i / rays, film.height)];
    (0..rays * rays)
        .filter_map(|i| world.shading_point(pixel(i), workspace))
        .collect()
}
