//! Spheres and disks as a shading point sees them: a flat disk.
//!
//! A sphere of constant radiance is, seen from outside, the flat disk of its outline with the same
//! radiance: the circle in which the cone of directions touches it, r²/d from the centre towards
//! the shading point. What stands between the point and that disk hides both alike, but for what
//! is inside the sphere before the disk, which hides the disk only; where anything reaches there,
//! nothing is asked about the disk, and each point of the sphere has a shadow ray.

use crate::light::{Shape, on_plane};
use crate::techniques::points::round::{RoundPoints, Viewer};
use crate::techniques::points::{DrawPoints, Drawn, LightPoint, PointDensity};
use crate::techniques::{point_techniques, points::area::Area};
use crate::{PointBy, ShadingPoint};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_elementary::{cos, sin_cos};
use linelit_geometry::{DVec3, Frame, Segment, Triangle};
use linelit_lights::{Disk, DiskArea, Emission, Light, Sphere};
use linelit_visibility::{Shaft, ShaftClass};
use std::f64::consts::TAU;

/// Corners of the polygon around a disk that a shaft is asked for: 2.4 % more area than the disk.
pub(crate) const CORNERS: usize = 12;

/// A sphere or a disk as a shading point sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundView {
    /// The light, or the outline of the sphere, its normal towards the shading point.
    pub disk: Disk,
    pub sphere: Option<Sphere>,
    pub emission: Emission,
    /// The shading point.
    pub x: DVec3,
}

impl RoundView {
    /// `None` from inside a sphere, where there is no outline, and of a light of another kind.
    pub(crate) fn new(light: &Light, x: DVec3) -> Option<Self> {
        Some(match light {
            Light::Area(_) | Light::Linear(_) | Light::Cylinder(_) => return None,
            Light::Disk(light) => Self {
                disk: light.disk,
                sphere: None,
                emission: light.emission,
                x,
            },
            Light::Sphere(light) => Self {
                disk: outline(&light.sphere, x)?,
                sphere: Some(light.sphere),
                emission: Emission::one_sided(light.radiance),
                x,
            },
        })
    }

    /// What a technique draws from.
    pub(crate) fn points(
        &self,
        by: PointBy,
        normal: DVec3,
        cosines: Option<&TransformedCosines>,
    ) -> RoundPoints {
        let disk = &self.disk;
        let viewer = &Viewer {
            position: self.x,
            normal,
            cosines,
        };
        match &self.sphere {
            Some(sphere) => point_techniques! { dispatch [by, technique => {
                technique.on_sphere(sphere, viewer).or_else(|| Area.on_sphere(sphere, viewer))
            }] },
            None => point_techniques! { dispatch [by, technique => {
                technique.on_disk(disk, viewer).or_else(|| Area.on_disk(disk, viewer))
            }] },
        }
        .unwrap_or_else(|| DiskArea::new(disk).into())
    }

    /// Corners of a regular polygon around the disk.
    pub(crate) fn corners(&self, disk: &Disk) -> [DVec3; CORNERS] {
        let frame = Frame::from_normal(disk.normal);
        let radius = around_circle(disk.radius);
        turns().map(|(s, c)| disk.center + (frame.x * c + frame.y * s) * radius)
    }

    /// The point of the disk that is seen in the direction of a point of the light; `None` where it
    /// is on the far side of the sphere.
    fn flat(&self, at: &LightPoint) -> Option<LightPoint> {
        if self.sphere.is_none() {
            return Some(*at);
        }
        if at.cos_light <= 0.0 {
            return None;
        }
        let Disk { center, normal, .. } = self.disk;
        let on_disk = on_plane(center, normal, self.x, at.direction)?;
        let to_light = on_disk - self.x;
        Some(LightPoint::towards(on_disk, to_light, at.direction, self))
    }

    /// The point of the light that is seen in the direction of a point of the disk.
    pub(crate) fn lifted(&self, at: &LightPoint) -> LightPoint {
        let Some(sphere) = &self.sphere else {
            return *at;
        };
        let to_center = sphere.center - self.x;
        let along = to_center.dot(at.direction);
        let across = (to_center - at.direction * along).length();
        // A direction along the rim may miss by rounding: the nearest point is on it.
        let inside = ((sphere.radius - across) * (sphere.radius + across)).max(0.0);
        let to_light = at.direction * (along - inside.sqrt());
        LightPoint::towards(self.x + to_light, to_light, at.direction, sphere)
    }

    /// The chord through a point of the disk in a direction of its plane.
    pub(crate) fn chord(&self, point: DVec3, direction: DVec3) -> Segment {
        let Disk { center, radius, .. } = self.disk;
        let out = point - center;
        let across = out - direction * out.dot(direction);
        let offset = across.length().min(radius);
        let half = ((radius - offset) * (radius + offset)).sqrt();
        let middle = center + across;
        Segment::new(middle - direction * half, middle + direction * half)
    }

    /// Whether a shaft towards the disk tells what is visible of the light: always of a disk, of a
    /// sphere where nothing that was found reaches inside. A shaft that is blocked or too dense to
    /// keep does not tell what is in it.
    pub(crate) fn is_told_by(&self, shaft: &Shaft<'_>) -> bool {
        let Some(sphere) = &self.sphere else {
            return true;
        };
        let outside = |corners: [DVec3; 3]| {
            let [a, b, c] = corners;
            let nearest = Triangle::new(a, b, c).nearest(sphere.center);
            nearest.distance(sphere.center) >= sphere.radius
        };
        match (shaft.class(), shaft.candidate_corners()) {
            (ShaftClass::Blocked, _) | (_, None) => false,
            (_, Some(mut corners)) => corners.all(outside),
        }
    }

    /// The disk before all of a sphere that has its solid angle: what hides it hides the sphere.
    /// `None` for a disk.
    pub(crate) fn before(&self) -> Option<Disk> {
        let sphere = self.sphere?;
        let to_x = self.disk.normal;
        let distance = (self.x - sphere.center).dot(to_x);
        let nearest = distance - sphere.radius;
        let square = (distance - sphere.radius) * (distance + sphere.radius);
        (nearest > 0.0).then(|| Disk {
            center: sphere.center + to_x * sphere.radius,
            normal: to_x,
            radius: sphere.radius * nearest / square.sqrt(),
        })
    }
}

/// Sines and cosines of the turns of a regular polygon's corners.
#[allow(clippy::cast_precision_loss, reason = "few corners")]
pub(crate) fn turns() -> [(f64, f64); CORNERS] {
    std::array::from_fn(|k| sin_cos(TAU / CORNERS as f64 * k as f64))
}

/// How far the corners of such a polygon around a circle are from its centre: a little more than
/// around, since the rim is rounded.
#[allow(clippy::cast_precision_loss, reason = "few corners")]
pub(crate) fn around_circle(radius: f64) -> f64 {
    radius / cos(0.5 * (TAU / CORNERS as f64)) * (1.0 + 1e-9)
}

/// The circle in which the cone from `x` touches a sphere.
pub(crate) fn outline(sphere: &Sphere, x: DVec3) -> Option<Disk> {
    let to_x = x - sphere.center;
    let distance = to_x.length();
    if !(distance > sphere.radius && distance < f64::INFINITY) {
        return None;
    }
    let (normal, ratio) = (to_x / distance, sphere.radius / distance);
    let square = (distance - sphere.radius) * (distance + sphere.radius);
    Some(Disk {
        center: sphere.center + normal * (sphere.radius * ratio),
        normal,
        radius: ratio * square.sqrt(),
    })
}

impl Shape for RoundView {
    #[inline]
    fn normal(&self, _: DVec3) -> DVec3 {
        self.disk.normal
    }

    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3> {
        self.disk.meets(x, direction)
    }

    fn by_area(&self) -> impl DrawPoints<Self> {
        DiskArea::new(&self.disk)
    }
}

/// Points of a round light, as points of the disk that is seen.
#[derive(Clone, Debug)]
pub(crate) struct RoundSource {
    pub points: RoundPoints,
    pub view: RoundView,
}

impl DrawPoints<RoundView> for RoundSource {
    fn draw<R: Reflection>(&self, u: [f64; 2], view: &RoundView, point: &ShadingPoint<R>) -> Drawn {
        let (at, density) = match &view.sphere {
            Some(sphere) => self.points.draw(u, sphere, point)?,
            None => self.points.draw(u, &view.disk, point)?,
        };
        Some((view.flat(&at)?, density))
    }

    fn density<R: Reflection>(&self, at: &LightPoint, point: &ShadingPoint<R>) -> f64 {
        DrawPoints::<RoundView>::density(&self.points, &self.view.lifted(at), point)
    }
}
