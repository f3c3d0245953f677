//! This module samples points on spheres, disks and cylinders, by area, by visible area, by solid
//! angle and by projected solid angle, and lines along cylinders.

pub(crate) mod along;
pub(crate) mod chords;
pub(crate) mod cone;
pub(crate) mod cylinder;
pub(crate) mod cylinder_lines;
pub(crate) mod disk;
pub(crate) mod disk_cone;
pub(crate) mod projected;
pub(crate) mod sphere;
