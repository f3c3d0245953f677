//! The plain shapes of round lights: a position and an extent, without any light.
//!
//! What samples them is in `round`, what emits from them in `light`, and what makes them surfaces
//! of lights in `surface`. Polygons and segments are those of `linelit-geometry`.

use core::f64::consts::PI;
use linelit_geometry::{DVec3, Segment, predicates};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre.
    pub center: DVec3,
    /// Radius > 0, in scene units.
    pub radius: f64,
}

impl Sphere {
    /// 4πR²; zero where that is not finite.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(4.0 * PI * self.radius * self.radius)
    }

    /// Unit outward normal at a point of the surface.
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        predicates::normalize(point - self.center).unwrap_or(DVec3::ZERO)
    }

    /// A distance from `x` at which every direction has left the sphere, if that holds a scene:
    /// twice the way to its far side, so that no margin near the light cuts into it.
    pub(crate) fn beyond(&self, x: DVec3) -> f64 {
        let far = x.distance(self.center) + self.radius;
        // A scene without size has no occluders.
        2.0 * far.max(f64::MIN_POSITIVE.sqrt())
    }
}

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
    /// πR²; zero where that is not finite.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(PI * self.radius * self.radius)
    }
}

/// The side of a cylinder, without its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// The axis, from the middle of one end to that of the other.
    pub axis: Segment,
    /// Radius > 0, in scene units.
    pub radius: f64,
}

impl Cylinder {
    /// 2πR l; zero where that is not finite.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(2.0 * PI * self.radius * self.axis.length())
    }

    /// Unit outward normal at a point of the surface; zero on the axis.
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        let (out, along) = (point - self.axis.p0, self.axis.direction());
        predicates::normalize(out - along * out.dot(along)).unwrap_or(DVec3::ZERO)
    }
}

/// A power or an area: the largest number where it overflows, so that no light is lost, and zero
/// where it is negative or no number.
pub(crate) fn bounded(x: f64) -> f64 {
    if x > 0.0 { x.min(f64::MAX) } else { 0.0 }
}
