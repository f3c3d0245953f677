//! This module holds the traits that each shape of a light implements: its geometry as a surface,
//! and the light that it emits.

use crate::light::Emission;
use linelit_elementary::hypot;
use linelit_geometry::DVec3;

/// The geometry of a shape as the surface of a light.
pub trait Shape {
    /// Returns the unit normal at a point of the surface, on the side that emits.
    fn normal(&self, point: DVec3) -> DVec3;

    /// Returns the normal if it is the same everywhere.
    fn flat(&self) -> Option<DVec3> {
        None
    }

    /// Returns the first point where a ray from the shading point `x` meets the surface; `None`
    /// from inside.
    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3>;

    /// Whether a part of the surface may be above the horizon of the unit normal `n` at the shading
    /// point `x`. Shapes whose samplers discover this while they draw points return true.
    fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        let _ = (x, n);
        true
    }

    /// Returns half of the smaller extent: the width that Salesin & Jarosz 2019 recommend for
    /// smooth weights.
    fn half_width(&self) -> f64;

    /// Returns the product of `edge` over the distances of a point from each border that the
    /// shading point `x` sees. Distances are positive inside (Salesin & Jarosz 2019, eq. 23).
    fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64;
}

/// The properties that each kind of light with a surface has to define.
pub(crate) trait ShapeLight {
    /// Returns the emission of each point.
    fn emission(&self) -> Emission;

    /// Returns the area of one side.
    fn area(&self) -> f64;

    /// Returns the unit normal at a point of the surface, on the side that emits.
    fn normal(&self, point: DVec3) -> DVec3;

    /// Whether a part of the light lights a surface at `x` with the normal `n` when there are no
    /// occluders.
    fn can_light(&self, x: DVec3, n: DVec3) -> bool;

    /// Returns the middle of the part that `x` sees, and the fraction of the area that this part
    /// has in projection.
    fn middle(&self, x: DVec3) -> (DVec3, f64);

    /// Returns the light's position and size, and the directions in which it shines.
    fn extent(&self) -> Extent;

    /// Whether the shape has a size and a direction, and no coordinate is larger than `largest`.
    fn is_valid(&self, largest: f64) -> bool;
}

/// Whether all coordinates are numbers of at most the magnitude `largest`.
pub(crate) fn is_position(p: DVec3, largest: f64) -> bool {
    p.abs().cmple(DVec3::splat(largest)).all()
}

/// Whether a length is positive and at most `largest`.
pub(super) fn is_size(length: f64, largest: f64) -> bool {
    length > 0.0 && length <= largest
}

/// The position and size of a light, and the directions in which it shines, for groups of lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The smallest and the largest corner of a box around it.
    pub bounds: (DVec3, DVec3),
    /// The mean position of its points, weighted by area.
    pub mean: DVec3,
    /// The mean squared distance of its points from `mean`, in the square of the unit of length.
    /// For some shapes it is an approximation, since only the choice among lights depends on it.
    pub variance: f64,
    /// The normals of its points.
    pub normals: Normals,
}

/// The set of the normals of a light's points, on the sides that emit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Normals {
    /// Normals in all directions.
    Around,
    /// A single normal.
    One(DVec3),
    /// A normal and its opposite.
    Both(DVec3),
}

impl Normals {
    /// Returns the normals of a flat light.
    pub(crate) const fn of_flat(normal: DVec3, two_sided: bool) -> Self {
        if two_sided {
            Self::Both(normal)
        } else {
            Self::One(normal)
        }
    }
}

/// Returns the smallest and the largest coordinates of some points.
pub(crate) fn bounds_of(points: &[DVec3]) -> (DVec3, DVec3) {
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let with = |(lo, hi): (DVec3, DVec3), p: &DVec3| (lo.min(*p), hi.max(*p));
    points.iter().fold(nothing, with)
}

/// Returns the extent along each axis of a circle of radius one that is perpendicular to a unit
/// vector: √(1 − v²), without its cancellation.
pub(super) fn reach_across(v: DVec3) -> DVec3 {
    DVec3::new(hypot(v.y, v.z), hypot(v.x, v.z), hypot(v.x, v.y))
}

/// Returns the point where a ray meets a plane; `None` if the plane is behind the ray's origin or
/// parallel to it.
pub(super) fn on_plane(on_it: DVec3, normal: DVec3, x: DVec3, direction: DVec3) -> Option<DVec3> {
    let t = normal.dot(on_it - x) / normal.dot(direction);
    (t > 0.0 && t.is_finite()).then(|| x + direction * t)
}

/// Bounds a power or an area: the largest number where it overflows, so that the light is still
/// chosen, and zero where it is negative or not a number.
pub(crate) fn bounded(x: f64) -> f64 {
    if x > 0.0 { x.min(f64::MAX) } else { 0.0 }
}
