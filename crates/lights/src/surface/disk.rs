//! This module holds the disk, the light that it makes, and its surface.

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
    /// The centre of the disk.
    pub center: DVec3,
    /// The unit normal, on the side that emits.
    pub normal: DVec3,
    /// The radius > 0, in scene units.
    pub radius: f64,
}

impl Disk {
    /// Returns the area πR²; `f64::MAX` where that overflows, and zero where it is not a number.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(PI * self.radius * self.radius)
    }
}

/// A disk that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskLight {
    /// The shape; its normal points to the side that emits.
    pub disk: Disk,
    /// The radiance that it emits, and from which sides.
    pub emission: Emission,
}

impl DiskLight {
    /// Whether the shading point `x` is on a side that emits, and not in the plane of the light.
    /// `margin` is the margin of [`AreaLight::faces`](crate::AreaLight::faces).
    #[must_use]
    pub fn faces(&self, x: DVec3, margin: f64) -> bool {
        let disk = &self.disk;
        self.emission
            .reaches(height(disk.normal, disk.center, disk.radius, x, margin))
    }
}

impl Disk {
    /// The number of corners of [`Disk::around`]. This polygon has 2.4 % more area than the disk.
    pub const CORNERS: usize = 12;

    /// Returns the corners of a regular polygon that encloses the disk.
    #[must_use]
    pub fn around(&self) -> [DVec3; Self::CORNERS] {
        let Frame { x, y, .. } = Frame::from_normal(self.normal);
        around_circle(self.radius, |radius, s, c| {
            self.center + (x * c + y * s) * radius
        })
    }
}

/// Returns the corners of the regular polygon that encloses the unit circle, which [`Disk::around`]
/// scales and moves onto the disk.
#[must_use]
pub fn around_unit_circle() -> [[f64; 2]; Disk::CORNERS] {
    around_circle(1.0, |radius, s, c| [c * radius, s * radius])
}

/// Makes the corners of a regular polygon that encloses a circle, from their distance from the
/// centre, and the sine and cosine of their angles. The distance is a little larger than around an
/// exact circle, since the rim is rounded.
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
        // Find the highest point of the disk above the tangent plane.
        let rise = radius * predicates::cross(n, normal).length();
        let height = n.dot(center - x);
        // If the normal is far from a unit vector, the rise may not be a number: test the centre,
        // too.
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
