//! Points of spheres and disks.

pub(crate) mod disk;
pub(crate) mod disk_cone;
pub(crate) mod sphere;
pub(crate) mod sphere_projected;
