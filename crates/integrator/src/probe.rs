//! Points of the scene that a grid of camera rays meets, from which lights are looked at.

use crate::world::World;
use crate::{ShadingPoint, Workspace};

/// Camera rays across and down whose points tell how hidden the lights are.
pub(crate) const RAYS: u32 = 8;

/// The points that a grid of camera rays, that many across and down, meets.
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
