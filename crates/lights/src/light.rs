//! What emits, and how much: plain data.

use crate::shapes::{Cylinder, Disk, Sphere, bounded};
use crate::{Beam, DistantLight, PointLight, Sky};
use core::f64::consts::PI;
use linelit_geometry::{ConvexPolygon, DVec3, Segment};

/// Emission of a surface light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Emitted radiance in W/(m² sr), linear RGB, the same in all directions of the emitting
    /// side(s).
    pub radiance: DVec3,
    /// Whether both sides emit; otherwise only the side that the normal points to.
    pub two_sided: bool,
}

impl Emission {
    /// One-sided emission of constant radiance in W/(m² sr).
    #[must_use]
    pub const fn one_sided(radiance: DVec3) -> Self {
        Self {
            radiance,
            two_sided: false,
        }
    }

    /// Whether anything is sent to a receiver, where `side` is positive on the side that the normal
    /// points to: not behind a one-sided light, nor in its plane.
    fn reaches(&self, side: f64) -> bool {
        side > 0.0 || (self.two_sided && side < 0.0)
    }

    /// Radiance towards a receiver, where `side` is positive on the side that the normal points to:
    /// zero behind a one-sided light and in its plane.
    #[must_use]
    pub fn towards(&self, side: f64) -> DVec3 {
        if self.reaches(side) {
            self.radiance
        } else {
            DVec3::ZERO
        }
    }
}

/// The signed height of `x` over the plane of a light that is about `size` large and has the unit
/// normal `normal` at `at`: zero within `margin` of the distance or the size, and within rounding.
fn height(normal: DVec3, at: DVec3, size: f64, x: DVec3, margin: f64) -> f64 {
    let from = x - at;
    let height = normal.dot(from);
    let reach = from.abs().max_element().max(size);
    // Far above the plane, as most points are, nothing else is looked at.
    if height.abs() > 1e-5 * reach && margin <= 1e-5 {
        return height;
    }
    // Eight roundings of the coordinates, and some of the distance.
    let coordinates = x.abs().max(at.abs()).max_element();
    let rounding = 4.0 * f64::EPSILON * coordinates;
    if height.abs() > margin.max(1e-12) * reach + rounding {
        height
    } else {
        0.0
    }
}

/// A convex planar polygon (triangle, quad, …) that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    /// The shape; its normal is the emitting side.
    pub polygon: ConvexPolygon,
    /// The light that it emits.
    pub emission: Emission,
}

impl AreaLight {
    /// Whether the shading point `x` is on a side that emits, and not in the light's plane.
    ///
    /// What a point in the plane receives is anything between nothing and half a space, and every
    /// technique would make something else of it: it is nothing. In the plane is what lies within
    /// `margin`, a fraction of the distance or of the light's size, at least 10⁻¹².
    #[must_use]
    pub fn faces(&self, x: DVec3, margin: f64) -> bool {
        let (normal, corners) = (self.polygon.normal(), self.polygon.vertices());
        let size = (corners[2] - corners[0]).abs().max_element();
        self.emission
            .reaches(height(normal, corners[0], size, x, margin))
    }
}

/// A linear light: a Lambertian cylinder whose radius goes to zero while radiance × radius stays
/// finite (Nishita et al. 1985; Peters 2021, §3.1). No surface sample and no ray can ever hit it,
/// so BSDF sampling contributes nothing and its own techniques have the MIS weight 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearLight {
    /// The axis.
    pub segment: Segment,
    /// Radiance times radius in W/(m sr), linear RGB.
    pub radiance_radius: DVec3,
}

/// A sphere that emits outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// The shape.
    pub sphere: Sphere,
    /// Emitted radiance in W/(m² sr), linear RGB.
    pub radiance: DVec3,
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
    /// [`AreaLight::faces`].
    #[must_use]
    pub fn faces(&self, x: DVec3, margin: f64) -> bool {
        let disk = &self.disk;
        self.emission
            .reaches(height(disk.normal, disk.center, disk.radius, x, margin))
    }
}

/// The side of a cylinder that emits outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderLight {
    /// The shape.
    pub cylinder: Cylinder,
    /// Emitted radiance in W/(m² sr), linear RGB.
    pub radiance: DVec3,
}

/// A light of any kind that the renderer can sample.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "lights are few")]
pub enum Light {
    /// A polygon.
    Area(AreaLight),
    /// A line.
    Linear(LinearLight),
    /// A sphere.
    Sphere(SphereLight),
    /// A disk.
    Disk(DiskLight),
    /// A cylinder.
    Cylinder(CylinderLight),
    /// A point.
    Point(PointLight),
    /// Parallel light.
    Distant(DistantLight),
    /// An environment, or a sun.
    Sky(Sky),
}

impl Light {
    /// Returns the emission of each point; in place of radiance, of linear lights radiance times
    /// radius, of points intensity, of parallel light irradiance, and of skies the mean radiance.
    #[inline]
    #[must_use]
    pub fn emission(&self) -> Emission {
        match self {
            Self::Area(l) => l.emission,
            Self::Linear(l) => Emission::one_sided(l.radiance_radius),
            Self::Sphere(l) => Emission::one_sided(l.radiance),
            Self::Disk(l) => l.emission,
            Self::Cylinder(l) => Emission::one_sided(l.radiance),
            Self::Point(l) => Emission::one_sided(l.intensity),
            Self::Distant(l) => Emission::one_sided(l.irradiance),
            Self::Sky(l) => Emission::one_sided(l.mean()),
        }
    }

    /// The light of a source without size at the point `x`, if it is one and light arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<Beam> {
        match self {
            Self::Point(l) => l.beam(x),
            Self::Distant(l) => l.beam(x),
            Self::Area(_) | Self::Linear(_) | Self::Sphere(_) => None,
            Self::Disk(_) | Self::Cylinder(_) | Self::Sky(_) => None,
        }
    }

    /// Sets the ball that holds the scene, of light from infinity; other lights have none.
    pub const fn set_scene(&mut self, ball: Sphere) {
        match self {
            Self::Distant(l) => l.scene = ball,
            Self::Sky(l) => l.scene = ball,
            Self::Area(_) | Self::Linear(_) | Self::Sphere(_) => {}
            Self::Disk(_) | Self::Cylinder(_) | Self::Point(_) => {}
        }
    }

    /// Emitted power in W, averaged over the channels: π A L for each side that emits, where the
    /// area A of a linear light is that of the cylinder's surface, 2πR l. A point's is 4π I, and
    /// that of light from infinity what falls on the ball that holds the scene. Of every kind of
    /// light, it is `f64::MAX` where it overflows, and zero where it is negative or no number.
    #[must_use]
    pub fn power(&self) -> f64 {
        let (factor, emission) = self.power_factors();
        bounded(factor * (emission.element_sum() / 3.0))
    }

    /// Emitted power in W of each channel, linear RGB; their mean is [`Light::power`].
    #[must_use]
    pub fn power_by_channel(&self) -> DVec3 {
        let (factor, emission) = self.power_factors();
        (factor * emission).map(bounded)
    }

    /// A measure of the light and its emission, whose product is the power.
    fn power_factors(&self) -> (f64, DVec3) {
        let emission = self.emission();
        let sides = if emission.two_sided { 2.0 } else { 1.0 };
        let surface = match self {
            Self::Area(l) => sides * PI * l.polygon.area(),
            Self::Linear(l) => 2.0 * PI.powi(2) * l.segment.length(),
            Self::Sphere(l) => PI * l.sphere.area(),
            Self::Disk(l) => sides * PI * l.disk.area(),
            Self::Cylinder(l) => PI * l.cylinder.area(),
            Self::Point(l) => return (1.0, l.power()),
            Self::Distant(l) => return (1.0, l.power()),
            Self::Sky(l) => return (1.0, l.power()),
        };
        (surface, emission.radiance)
    }
}
