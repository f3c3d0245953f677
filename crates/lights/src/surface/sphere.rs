//! This module holds the sphere, the light that it makes, and its surface.
//!
//! Seen from outside, a sphere of constant radiance looks like a flat disk of the same radiance:
//! the disk within its outline, the circle in which the cone of directions touches the sphere, at
//! the distance r²/d from the centre towards the shading point. Occluders between the point and
//! that disk hide both alike. The exceptions are occluders inside the sphere and in front of the
//! disk, which hide the disk only.

use super::disk::Disk;
use super::shape::{Extent, Normals, Shape, ShapeLight, bounded, is_position, is_size, on_plane};
use crate::light::Emission;
use core::f64::consts::PI;
use linelit_geometry::{DVec3, Triangle, predicates};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// The centre of the sphere.
    pub center: DVec3,
    /// The radius > 0, in scene units.
    pub radius: f64,
}

impl Sphere {
    /// Returns the area 4πR²; `f64::MAX` where that overflows, and zero where it is not a number.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(4.0 * PI * self.radius * self.radius)
    }

    /// Returns the unit outward normal at a point of the surface; zero at the centre.
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        predicates::normalize(point - self.center).unwrap_or(DVec3::ZERO)
    }

    /// Returns the bounds, mean and normals of the sphere as a light, for bounds of groups of
    /// lights.
    pub(crate) fn extent(&self) -> Extent {
        let (mean, r) = (self.center, DVec3::splat(self.radius));
        Extent {
            bounds: (mean - r, mean + r),
            mean,
            variance: self.radius * self.radius,
            normals: Normals::Around,
        }
    }

    /// Returns a distance from `x` at which every direction has left the sphere, for a sphere that
    /// holds a scene. It is twice the distance to the far side, so that no margin near the light
    /// reaches into the sphere.
    pub(crate) fn beyond(&self, x: DVec3) -> f64 {
        let far = x.distance(self.center) + self.radius;
        // A scene without a size has no occluders: any positive distance will do.
        2.0 * far.max(f64::MIN_POSITIVE.sqrt())
    }
}

/// A sphere that emits outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// The shape.
    pub sphere: Sphere,
    /// The emitted radiance in W/(m² sr), linear RGB.
    pub radiance: DVec3,
}

impl Sphere {
    /// Returns the disk within the circle in which the cone from `x` touches the sphere, with its
    /// normal towards `x`; `None` from inside.
    #[must_use]
    pub fn outline(&self, x: DVec3) -> Option<Disk> {
        let to_x = x - self.center;
        let distance = to_x.length();
        if !(distance > self.radius && distance < f64::INFINITY) {
            return None;
        }
        let (normal, ratio) = (to_x / distance, self.radius / distance);
        let square = (distance - self.radius) * (distance + self.radius);
        Some(Disk {
            center: self.center + normal * (self.radius * ratio),
            normal,
            radius: ratio * square.sqrt(),
        })
    }

    /// Returns a disk in front of the whole sphere that has the sphere's solid angle: an occluder
    /// that hides this disk hides the sphere. `None` from inside.
    #[must_use]
    pub fn before(&self, x: DVec3) -> Option<Disk> {
        let normal = self.outline(x)?.normal;
        let distance = (x - self.center).dot(normal);
        let nearest = distance - self.radius;
        let square = nearest * (distance + self.radius);
        (nearest > 0.0).then(|| Disk {
            center: self.center + normal * self.radius,
            normal,
            radius: self.radius * nearest / square.sqrt(),
        })
    }

    /// Whether no part of a triangle is inside the sphere: then the triangle hides the same of the
    /// sphere as of its outline.
    #[must_use]
    pub fn is_clear_of(&self, [a, b, c]: [DVec3; 3]) -> bool {
        let nearest = Triangle::new(a, b, c).nearest(self.center);
        nearest.distance(self.center) >= self.radius
    }
}

impl ShapeLight for SphereLight {
    #[inline]
    fn emission(&self) -> Emission {
        Emission::one_sided(self.radiance)
    }

    fn area(&self) -> f64 {
        self.sphere.area()
    }

    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.sphere.normal(point)
    }

    fn can_light(&self, x: DVec3, n: DVec3) -> bool {
        n.dot(self.sphere.center - x) + self.sphere.radius > 0.0
    }

    fn middle(&self, x: DVec3) -> (DVec3, f64) {
        let Sphere { center, radius } = self.sphere;
        (center + (x - center).normalize_or_zero() * radius, 0.25)
    }

    fn extent(&self) -> Extent {
        self.sphere.extent()
    }

    fn is_valid(&self, largest: f64) -> bool {
        is_position(self.sphere.center, largest) && is_size(self.sphere.radius, largest)
    }
}

impl Shape for Sphere {
    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.normal(point)
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        let to_center = self.center - x;
        let along = to_center.dot(direction);
        // Compute the distance of the ray from the centre without the cancellation of d² − along².
        let across = (to_center - direction * along).length();
        if along <= 0.0 || across > self.radius {
            return None;
        }
        let inside = ((self.radius - across) * (self.radius + across)).sqrt();
        (along > inside).then(|| x + direction * (along - inside))
    }

    fn half_width(&self) -> f64 {
        self.radius
    }

    /// Returns the value for the outline, at the point that is seen in the same direction; 1 from
    /// inside.
    fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        let Some(outline) = self.outline(x) else {
            return 1.0;
        };
        let direction = (point - x).normalize_or_zero();
        let seen = on_plane(outline.center, outline.normal, x, direction);
        seen.map_or(0.0, |seen| outline.border(seen, x, edge))
    }
}
