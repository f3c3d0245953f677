//! Disks, the lights that they make, and their surfaces.

use super::shape::{
    Extent, Normals, Shape, ShapeLight, bounded, is_position, is_size, on_plane, reach_across,
};
use crate::light::{Emission, height};
use linelit_elementary::{cos, sin_cos};
use linelit_geometry::{DVec3, Frame, predicates};
use std::f64::consts::{PI, TAU};

/// A flat disk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Centre.
    pub center: DVec3,
    /// Unit normal, the emitting side.
    pub normal: DVec3,
    /// Radius > 0, in scene units.
    pub radius: f64,
}

impl Disk {
    /// πR²; `f64::MAX` where that overflows, and zero where it is no number.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(PI * self.radius * self.radius)
    }
}

/// A disk that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskLight {
    /// The shape; its normal is the emitting side.
    pub disk: Disk,
    /// The light that it emits.
    pub emission: Emission,
}

impl DiskLight {
    /// Whether the shading point `x` is on a side that emits, and not in the light's plane: as
    /// [`AreaLight::faces`](crate::AreaLight::faces).
    #[must_use]
    pub fn faces(&self, x: DVec3, margin: f64) -> bool {
        let disk = &self.disk;
        self.emission
            .reaches(height(disk.normal, disk.center, disk.radius, x, margin))
    }
}

impl Disk {
    /// The number of corners of [`Disk::around`], which has 2.4 % more area than the disk.
    pub const CORNERS: usize = 12;

    /// The corners of a regular polygon around the disk.
    #[must_use]
    pub fn around(&self) -> [DVec3; Self::CORNERS] {
        let Frame { x, y, .. } = Frame::from_normal(self.normal);
        around_circle(self.radius, |radius, s, c| {
            self.center + (x * c + y * s) * radius
        })
    }
}

/// The corners of the regular polygon around the unit circle that [`Disk::around`] is of.
#[must_use]
pub fn around_unit_circle() -> [[f64; 2]; Disk::CORNERS] {
    around_circle(1.0, |radius, s, c| [c * radius, s * radius])
}

/// The corners of such a polygon from their distance from the centre, a little more than around
/// since the rim is rounded, and from the sines and cosines of their turns.
fn around_circle<P>(radius: f64, corner: impl Fn(f64, f64, f64) -> P) -> [P; Disk::CORNERS] {
    let turn = TAU / Disk::CORNERS as f64;
    let radius = radius / cos(0.5 * turn) * (1.0 + 1e-9);
    std::array::from_fn(|k| {
        let (s, c) = sin_cos(turn * k as f64);
        corner(radius, s, c)
    })
}

impl ShapeLight for DiskLight {
    #[inline]
    fn emission(&self) -> Emission {
        self.emission
    }

    fn area(&self) -> f64 {
        self.disk.area()
    }

    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.disk.normal
    }

    fn can_light(&self, x: DVec3, n: DVec3) -> bool {
        let Disk {
            center,
            normal,
            radius,
        } = self.disk;
        // The highest point of the disk over the tangent plane.
        let rise = radius * predicates::cross(n, normal).length();
        let height = n.dot(center - x);
        // The rise towards a normal that is far from a unit vector may be no number.
        self.emission.reaches(normal.dot(x - center)) && (height > 0.0 || height + rise > 0.0)
    }

    fn middle(&self, _: DVec3) -> (DVec3, f64) {
        (self.disk.center, 1.0)
    }

    fn extent(&self) -> Extent {
        let Disk {
            center,
            normal,
            radius,
        } = self.disk;
        let r = reach_across(normal) * radius;
        Extent {
            bounds: (center - r, center + r),
            mean: center,
            variance: 0.5 * radius * radius,
            normals: Normals::of_flat(normal, self.emission.two_sided),
        }
    }

    fn is_valid(&self, largest: f64) -> bool {
        let Disk {
            center,
            normal,
            radius,
        } = self.disk;
        is_position(center, largest) && is_size(radius, largest) && normal.is_normalized()
    }
}

impl Shape for Disk {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.normal
    }

    fn flat(&self) -> Option<DVec3> {
        Some(self.normal)
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let hit = on_plane(self.center, self.normal, x, direction)?;
        (hit.distance(self.center) <= self.radius).then_some(hit)
    }

    fn half_width(&self) -> f64 {
        self.radius
    }

    fn border(&self, point: DVec3, _: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        edge(self.radius - point.distance(self.center))
    }
}
