//! Disks, uniform by area through the concentric map.

use crate::density::{Area, Pdf};
use crate::light::power;
use crate::polygon::area::PointSample;
use crate::polygon::fan::{below_one, unit};
use core::f64::consts::{FRAC_PI_4, PI};
use linelit_geometry::{DVec3, Frame};

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
        power(PI * self.radius * self.radius)
    }

    /// A point from two random numbers in [0, 1): Shirley & Chiu's concentric map (1997), which
    /// keeps neighbours and shapes, so that stratified numbers stay stratified.
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> PointSample<Area> {
        let [a, b] = u.map(|u| 2.0 * unit(u) - 1.0);
        let (r, (s, c)) = if a.abs() > b.abs() {
            (a, (FRAC_PI_4 * (b / a)).sin_cos())
        } else if b.abs() > 0.0 {
            let (s, c) = (FRAC_PI_4 * (a / b)).sin_cos();
            (b, (c, s))
        } else {
            (0.0, (0.0, 1.0))
        };
        let frame = Frame::from_normal(self.normal);
        let point = self.center + (frame.x * c + frame.y * s) * (r * self.radius);
        PointSample::at(point, self.pdf(self.center))
    }

    /// The density at a point, which is taken to lie on the disk: 1/(πR²).
    #[must_use]
    pub fn pdf(&self, _point: DVec3) -> Pdf<Area> {
        Pdf::new(1.0 / self.area())
    }

    /// The random numbers that give `point`; `None` outside the disk by more than 64 ε of its
    /// coordinates.
    #[must_use]
    pub fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        let frame = Frame::from_normal(self.normal);
        let v = (point - self.center) / self.radius;
        let (x, y) = (v.dot(frame.x), v.dot(frame.y));
        let r = x.hypot(y);
        let slack = 64.0 * f64::EPSILON * (1.0 + point.abs().max_element() / self.radius);
        if !(r <= 1.0 + slack && slack < f64::INFINITY) {
            return None;
        }
        let (a, b) = if x.abs() > y.abs() {
            let r = r.copysign(x);
            (r, r * (y / x).atan() / FRAC_PI_4)
        } else if y.abs() > 0.0 {
            let r = r.copysign(y);
            (r * (x / y).atan() / FRAC_PI_4, r)
        } else {
            (0.0, 0.0)
        };
        Some([a, b].map(|t| below_one(0.5 * (t + 1.0))))
    }
}
