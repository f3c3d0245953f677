//! This module samples disks uniformly by area, through the concentric map.

use crate::{Area, Disk, Pdf, PointSample, PointTechnique};
use core::f64::consts::FRAC_PI_4;
use linelit_elementary::{atan, hypot, sin_cos};
use linelit_geometry::finite::{below_one, fraction};
use linelit_geometry::{DVec3, Frame};

/// Samples a disk uniformly by area: density 1/(πR²) everywhere.
///
/// Shirley & Chiu's concentric map (1997) preserves neighbourhoods and shapes, so that stratified
/// numbers give stratified points. `invert` returns `None` for points that are outside the disk by
/// more than 64 ε of their coordinates.
///
/// ```
/// use linelit_lights::geometry::DVec3;
/// use linelit_lights::{Disk, DiskArea, PointTechnique};
/// let by_area = DiskArea::new(&Disk { center: DVec3::Z, normal: DVec3::Z, radius: 1.0 });
/// let u = by_area.invert(by_area.sample([0.2, 0.9]).point).unwrap();
/// assert!((u[0] - 0.2).abs() < 1e-15 && (u[1] - 0.9).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DiskArea {
    disk: Disk,
    frame: Frame,
    density: Pdf<Area>,
}

impl DiskArea {
    /// Sets the technique up for one light.
    #[must_use]
    pub fn new(disk: &Disk) -> Self {
        let frame = Frame::from_normal(disk.normal);
        // If this bound is finite, so are all points.
        let bound = disk.center.abs() + 2.0 * disk.radius.abs() + frame.x + frame.y;
        Self {
            disk: *disk,
            frame,
            density: PointSample::at(bound, Pdf::new(1.0 / disk.area())).pdf,
        }
    }
}

impl PointTechnique for DiskArea {
    type Measure = Area;

    #[inline]
    fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let [a, b] = u.map(|u| 2.0 * fraction(u) - 1.0);
        let (r, (s, c)) = if a.abs() > b.abs() {
            (a, sin_cos(FRAC_PI_4 * (b / a)))
        } else if b.abs() > 0.0 {
            let (s, c) = sin_cos(FRAC_PI_4 * (a / b));
            (b, (c, s))
        } else {
            (0.0, (0.0, 1.0))
        };
        let across = self.frame.x * c + self.frame.y * s;
        let point = self.disk.center + across * (r * self.disk.radius);
        PointSample {
            point,
            pdf: self.density,
        }
    }

    fn pdf(&self, _point: DVec3) -> Pdf<Area> {
        self.density
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let v = (point - self.disk.center) / self.disk.radius;
        let (x, y) = (v.dot(self.frame.x), v.dot(self.frame.y));
        let r = hypot(x, y);
        let slack = 64.0 * f64::EPSILON * (1.0 + point.abs().max_element() / self.disk.radius);
        if !(r <= 1.0 + slack && slack < f64::INFINITY) {
            return None;
        }
        let (a, b) = if x.abs() > y.abs() {
            let r = r.copysign(x);
            (r, r * atan(y / x) / FRAC_PI_4)
        } else if y.abs() > 0.0 {
            let r = r.copysign(y);
            (r * atan(x / y) / FRAC_PI_4, r)
        } else {
            (0.0, 0.0)
        };
        Some([a, b].map(|t| below_one(0.5 * (t + 1.0))))
    }
}
