//! Disks as surfaces of lights.

use super::points::{PointDensity, PointSource};
use super::{Shape, Viewer, on_plane};
use crate::mixture::DiskLobes;
use crate::{Disk, DiskArea, DiskChords, DiskCone};
use linelit_elementary::{cos, sin_cos};
use linelit_geometry::{DVec3, Frame};
use std::f64::consts::TAU;

impl Disk {
    /// The number of corners of [`Disk::around`], which has 2.4 % more area than the disk.
    pub const CORNERS: usize = 12;

    /// The corners of a regular polygon around the disk.
    #[must_use]
    pub fn around(&self) -> [DVec3; Self::CORNERS] {
        let frame = Frame::from_normal(self.normal);
        let radius = around_circle(self.radius);
        turns().map(|(s, c)| self.center + (frame.x * c + frame.y * s) * radius)
    }
}

/// The corners of the regular polygon around the unit circle that [`Disk::around`] is of.
#[must_use]
pub fn around_unit_circle() -> [[f64; 2]; Disk::CORNERS] {
    let radius = around_circle(1.0);
    turns().map(|(s, c)| [c * radius, s * radius])
}

/// Sines and cosines of the turns of the polygon's corners.
#[allow(clippy::cast_precision_loss, reason = "few corners")]
fn turns() -> [(f64, f64); Disk::CORNERS] {
    std::array::from_fn(|k| sin_cos(TAU / Disk::CORNERS as f64 * k as f64))
}

/// The distance of the corners of such a polygon around a circle from its centre: a little more
/// than around, since the rim is rounded.
#[allow(clippy::cast_precision_loss, reason = "few corners")]
fn around_circle(radius: f64) -> f64 {
    radius / cos(0.5 * (TAU / Disk::CORNERS as f64)) * (1.0 + 1e-9)
}

/// The lobes of the viewer's reflection over a disk, where points can be drawn by them.
pub(super) fn lobes(disk: &Disk, from: &Viewer<'_>) -> Option<DiskLobes> {
    let cosines = from.cosines.filter(|cosines| !cosines.lobes().is_empty())?;
    DiskLobes::new(disk, from.position, cosines)
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

    fn points<'t>(&'t self, by: PointDensity, from: &Viewer<'_>) -> PointSource<'t> {
        let x = from.position;
        let by_angle = || PointSource::DiskCone(DiskCone::new(self, x));
        match by {
            PointDensity::Area | PointDensity::VisibleArea => {
                PointSource::DiskArea(DiskArea::new(self))
            }
            PointDensity::SolidAngle | PointDensity::Proxy | PointDensity::Texture => by_angle(),
            PointDensity::ProjectedSolidAngle => {
                PointSource::DiskChords(DiskChords::new(self, 0.0, x, &[from.normal]))
            }
            PointDensity::Lobes => lobes(self, from).map_or_else(by_angle, PointSource::DiskLobes),
        }
    }
}
