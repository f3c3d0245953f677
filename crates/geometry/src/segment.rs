//! [`Segment`]: the straight line between two points, the geometry of a line sample.

use crate::{DVec3, Vector3, predicates};

/// A segment from `p0` to `p1`, with a parameter t that runs from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// The end with t = 0.
    pub p0: DVec3,
    /// The end with t = 1.
    pub p1: DVec3,
}

impl<V: Vector3> From<[V; 2]> for Segment {
    #[inline]
    fn from([p0, p1]: [V; 2]) -> Self {
        Self::new(p0.dvec3(), p1.dvec3())
    }
}

impl Segment {
    /// Creates the segment between two points.
    #[inline]
    #[must_use]
    pub const fn new(p0: DVec3, p1: DVec3) -> Self {
        Self { p0, p1 }
    }

    /// The vector `p1 − p0`.
    #[inline]
    #[must_use]
    pub fn vector(&self) -> DVec3 {
        self.p1 - self.p0
    }

    /// The length in scene units.
    #[inline]
    #[must_use]
    pub fn length(&self) -> f64 {
        predicates::length(self.vector())
    }

    /// The unit direction from `p0` to `p1`; zero if the segment has no length or is not finite.
    #[inline]
    #[must_use]
    pub fn direction(&self) -> DVec3 {
        predicates::normalize(self.vector()).unwrap_or(DVec3::ZERO)
    }

    /// Returns the point at parameter `t`. It is computed from the nearer end, so that both ends
    /// are exact.
    #[inline]
    #[must_use]
    pub fn at(&self, t: f64) -> DVec3 {
        if t <= 0.5 {
            self.p0 + self.vector() * t
        } else {
            self.p1 - self.vector() * (1.0 - t)
        }
    }

    /// Returns the part of the segment between the parameters `lo` and `hi`, from `lo` to `hi`.
    #[inline]
    #[must_use]
    pub fn piece(&self, lo: f64, hi: f64) -> Self {
        Self::new(self.at(lo), self.at(hi))
    }

    /// Returns the segment with its direction reversed.
    #[inline]
    #[must_use]
    pub const fn reversed(&self) -> Self {
        Self::new(self.p1, self.p0)
    }

    /// Returns the segment with coordinates relative to the point `x`, as closed forms expect them.
    #[inline]
    #[must_use]
    pub fn relative_to(&self, x: DVec3) -> Self {
        Self::new(self.p0 - x, self.p1 - x)
    }
}
