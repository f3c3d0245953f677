//! [`PlaneFrame`]: two-dimensional coordinates in the plane of a light.

use crate::{DVec2, DVec3, Frame};
use linelit_elementary::{atan2, sin_cos};

/// An origin and an orthonormal frame: `x` and `y` span the plane, and `z` is its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFrame {
    /// The point with plane coordinates (0, 0).
    pub origin: DVec3,
    /// The axes of the plane, and its normal.
    pub axes: Frame,
}

impl PlaneFrame {
    /// Creates the frame of the plane through `origin` with the unit normal `normal`; the frame's x
    /// axis is along `tangent`.
    #[must_use]
    pub fn new(origin: DVec3, normal: DVec3, tangent: DVec3) -> Self {
        let axes = Frame::from_normal_and_tangent(normal, tangent);
        Self { origin, axes }
    }

    /// Returns the frame with its axes rotated by `angle_rad` radians, counter-clockwise about the
    /// normal; unchanged if the angle is not finite.
    #[must_use]
    pub fn turned(&self, angle_rad: f64) -> Self {
        if angle_rad == 0.0 || !angle_rad.is_finite() {
            return *self;
        }
        let (sin, cos) = sin_cos(angle_rad);
        let Frame { x, y, z } = self.axes;
        let axes = Frame {
            x: x * cos + y * sin,
            y: y * cos - x * sin,
            z,
        };
        Self {
            origin: self.origin,
            axes,
        }
    }

    /// Returns the plane coordinates of the foot of the perpendicular from a point to the plane.
    #[inline]
    #[must_use]
    pub fn to_plane(&self, p: DVec3) -> DVec2 {
        let d = p - self.origin;
        DVec2::new(self.axes.x.dot(d), self.axes.y.dot(d))
    }

    /// Returns the point in space with these plane coordinates.
    #[inline]
    #[must_use]
    pub fn from_plane(&self, q: DVec2) -> DVec3 {
        self.origin + self.axes.x * q.x + self.axes.y * q.y
    }

    /// Returns the angle in radians, counter-clockwise about the normal, from the x axis of `other`
    /// to the x axis of this frame, for two frames of one plane. Adding it to the angle of a
    /// direction in this frame gives the direction's angle in the other frame.
    #[must_use]
    pub fn turn_from(&self, other: &Self) -> f64 {
        let x = self.axes.x;
        atan2(x.dot(other.axes.y), x.dot(other.axes.x))
    }

    /// The signed distance of a point from the plane, positive on the normal's side.
    #[inline]
    #[must_use]
    pub fn height(&self, p: DVec3) -> f64 {
        self.axes.z.dot(p - self.origin)
    }
}
