//! This module samples lines on convex polygons, by length, by solid angle and by a texture, and
//! points on their visible parts.

pub(crate) mod by_angle;
pub(crate) mod by_length;
pub(crate) mod by_texture;
mod piece;
mod rectangle;
mod trapezoid;
