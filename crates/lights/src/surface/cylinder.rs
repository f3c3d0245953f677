//! This module holds the cylinder, the light that it makes, and its surface as a shading point sees
//! it.

use super::shape::{
    Extent, Normals, Shape, ShapeLight, bounded, bounds_of, is_position, is_size, reach_across,
};
use crate::CylinderView;
use crate::light::Emission;
use linelit_elementary::sin;
use linelit_geometry::{DVec3, Segment, predicates};
use std::f64::consts::{FRAC_1_PI, PI};

/// The side of a cylinder, without its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// The axis, from the middle of one end to the middle of the other.
    pub axis: Segment,
    /// The radius > 0, in scene units.
    pub radius: f64,
}

impl Cylinder {
    /// Returns the area 2πR l; `f64::MAX` where that overflows, and zero where it is not a number.
    #[must_use]
    pub fn area(&self) -> f64 {
        bounded(2.0 * PI * self.radius * self.axis.length())
    }

    /// Returns the unit outward normal at a point of the surface; zero on the axis.
    #[must_use]
    pub fn normal(&self, point: DVec3) -> DVec3 {
        let (out, along) = (point - self.axis.p0, self.axis.direction());
        predicates::normalize(out - along * out.dot(along)).unwrap_or(DVec3::ZERO)
    }
}

/// A light that is the side of a cylinder and emits outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderLight {
    /// The shape.
    pub cylinder: Cylinder,
    /// The emitted radiance in W/(m² sr), linear RGB.
    pub radiance: DVec3,
}

impl ShapeLight for CylinderLight {
    #[inline]
    fn emission(&self) -> Emission {
        Emission::one_sided(self.radiance)
    }

    fn area(&self) -> f64 {
        self.cylinder.area()
    }

    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.cylinder.normal(point)
    }

    fn can_light(&self, x: DVec3, n: DVec3) -> bool {
        // The highest point of each end is above its middle by `rise`.
        let Cylinder { axis, radius } = self.cylinder;
        let rise = radius * predicates::cross(n, axis.direction()).length();
        let heights = [axis.p0, axis.p1].map(|p| n.dot(p - x));
        heights.iter().any(|h| *h > 0.0 || h + rise > 0.0)
    }

    fn middle(&self, x: DVec3) -> (DVec3, f64) {
        let towards = self.cylinder.normal(x) * self.cylinder.radius;
        (self.cylinder.axis.at(0.5) + towards, FRAC_1_PI)
    }

    fn extent(&self) -> Extent {
        let Cylinder { axis, radius } = self.cylinder;
        let (lo, hi) = bounds_of(&[axis.p0, axis.p1]);
        let r = reach_across(axis.direction()) * radius;
        Extent {
            bounds: (lo - r, hi + r),
            mean: axis.at(0.5),
            variance: axis.vector().length_squared() / 12.0 + radius * radius,
            normals: Normals::Around,
        }
    }

    fn is_valid(&self, largest: f64) -> bool {
        let Cylinder { axis, radius } = self.cylinder;
        let has_ends = [axis.p0, axis.p1].iter().all(|p| is_position(*p, largest));
        has_ends && axis.length() > 0.0 && is_size(radius, largest)
    }
}

impl Shape for CylinderView {
    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.normal(point)
    }

    fn meets(&self, _: DVec3, direction: DVec3) -> Option<DVec3> {
        self.meets(direction)
    }

    #[inline]
    fn may_rise_above(&self, _: DVec3, n: DVec3) -> bool {
        self.heights(n)[1] > 0.0
    }

    fn half_width(&self) -> f64 {
        let cylinder = self.cylinder();
        (0.5 * cylinder.axis.length()).min(cylinder.radius * sin(self.half_turn()))
    }

    fn border(&self, point: DVec3, _: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        // Multiply the factors for the distances from both ends and from the visible border.
        let cylinder = self.cylinder();
        let from = [cylinder.axis.p0, cylinder.axis.p1].map(|end| point - end);
        let along = cylinder.axis.direction();
        let around = cylinder.radius * (self.half_turn() - self.azimuth(point).abs());
        let distances = [along.dot(from[0]), -along.dot(from[1]), around];
        distances.map(edge).iter().product()
    }
}
