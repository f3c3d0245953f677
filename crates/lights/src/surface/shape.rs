//! A light's surface, and the light that it emits, whatever its shape.

use crate::light::Emission;
use linelit_elementary::hypot;
use linelit_geometry::DVec3;

/// A shape as the surface of a light.
pub trait Shape {
    /// The unit normal at one of its points, on the side that emits.
    fn normal(&self, point: DVec3) -> DVec3;

    /// The normal, if it is the same everywhere.
    fn flat(&self) -> Option<DVec3> {
        None
    }

    /// The place where a ray from the shading point `x` meets it first; none from inside.
    fn meets(&self, x: DVec3, direction: DVec3) -> Option<DVec3>;

    /// Whether some of it may be above the horizon of the unit normal `n` at the shading point `x`;
    /// true of what finds out as it draws its points.
    fn may_rise_above(&self, x: DVec3, n: DVec3) -> bool {
        let _ = (x, n);
        true
    }

    /// Half the smaller extent: the width that Salesin & Jarosz 2019 recommend for smooth weights.
    fn half_width(&self) -> f64;

    /// The product of `edge` of the distances of a point from the borders that the shading point
    /// `x` sees, positive inside (Salesin & Jarosz 2019, eq. 23).
    fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64;
}

/// A shape that emits: what each kind of light with a surface says of itself.
pub(crate) trait ShapeLight {
    /// The emission of each point.
    fn emission(&self) -> Emission;

    /// The area of one side.
    fn area(&self) -> f64;

    /// The unit normal at one of its points, on the side that emits.
    fn normal(&self, point: DVec3) -> DVec3;

    /// Whether some of it lights a surface at `x` with the normal `n`, if nothing hides it.
    fn can_light(&self, x: DVec3, n: DVec3) -> bool;

    /// The middle of the part that `x` sees, and the fraction of the area that it stands for.
    fn middle(&self, x: DVec3) -> (DVec3, f64);

    /// Where it is, and where it shines.
    fn extent(&self) -> Extent;

    /// Whether its shape has a size and a direction, and no coordinate beyond `largest`.
    fn is_valid(&self, largest: f64) -> bool;
}

/// Whether no coordinate is beyond `largest`, and all are numbers.
pub(crate) fn is_position(p: DVec3, largest: f64) -> bool {
    p.abs().cmple(DVec3::splat(largest)).all()
}

/// Whether a length is positive and at most `largest`.
pub(super) fn is_size(length: f64, largest: f64) -> bool {
    length > 0.0 && length <= largest
}

/// Where a light is, and the directions in which it shines, for groups of lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// The least and the largest corner of a box around it.
    pub bounds: (DVec3, DVec3),
    /// The mean position of its points, weighted by area.
    pub mean: DVec3,
    /// The mean squared distance of its points from `mean`, in the square of the unit of length;
    /// for some shapes an approximation, which only the choice among lights depends on.
    pub variance: f64,
    /// The normals of its points.
    pub normals: Normals,
}

/// The normals of a light's points, on the sides that emit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Normals {
    /// All directions.
    Around,
    /// One direction.
    One(DVec3),
    /// A direction and its opposite.
    Both(DVec3),
}

impl Normals {
    /// The normals of a flat light.
    pub(crate) const fn of_flat(normal: DVec3, two_sided: bool) -> Self {
        if two_sided {
            Self::Both(normal)
        } else {
            Self::One(normal)
        }
    }
}

/// The least and the largest coordinates of points.
pub(crate) fn bounds_of(points: &[DVec3]) -> (DVec3, DVec3) {
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let with = |(lo, hi): (DVec3, DVec3), p: &DVec3| (lo.min(*p), hi.max(*p));
    points.iter().fold(nothing, with)
}

/// How far a circle of radius one across a unit vector reaches along each axis: √(1 − v²), without
/// its cancellation.
pub(super) fn reach_across(v: DVec3) -> DVec3 {
    DVec3::new(hypot(v.y, v.z), hypot(v.x, v.z), hypot(v.x, v.y))
}

/// The place where a ray meets a plane ahead of it.
pub(super) fn on_plane(on_it: DVec3, normal: DVec3, x: DVec3, direction: DVec3) -> Option<DVec3> {
    let t = normal.dot(on_it - x) / normal.dot(direction);
    (t > 0.0 && t.is_finite()).then(|| x + direction * t)
}

/// A power or an area: the largest number where it overflows, so that no light is lost, and zero
/// where it is negative or no number.
pub(crate) fn bounded(x: f64) -> f64 {
    if x > 0.0 { x.min(f64::MAX) } else { 0.0 }
}
