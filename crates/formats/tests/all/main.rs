//! Tests of the readers of all formats, and of their messages.

mod bad;
mod broken_lights;
mod common;
mod cutouts;
mod far_away;
mod filtering;
mod formats;
#[cfg(feature = "gltf")]
mod gltf;
mod images;
mod lights;
mod limits;
mod memory;
mod obj_polygons;
mod parameters;
mod pbrt;
mod shapeless;
mod transforms;
