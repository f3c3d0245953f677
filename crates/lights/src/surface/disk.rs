//! Disks as surfaces of lights.

use super::points::{PointDensity as By, PointSource};
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

    #[inline(always)]
    fn points<'t>(&'t self, by: By, from: &Viewer<'_>) -> PointSource<'t> {
        let x = from.position;
        let by_angle = || PointSource::DiskCone(DiskCone::new(self, x));
        match by {
            By::Area | By::VisibleArea => PointSource::DiskArea(DiskArea::new(self)),
            By::SolidAngle | By::Proxy | By::Texture => by_angle(),
            By::ProjectedSolidAngle => {
                PointSource::DiskChords(DiskChords::new(self, 0.0, x, &[from.normal]))
            }
            By::Lobes => lobes(self, from).map_or_else(by_angle, PointSource::DiskLobes),
        }
    }
}
