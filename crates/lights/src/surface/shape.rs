//! The geometry of a light's surface, whatever its shape.

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

    /// Half the smaller extent: the width that Salesin & Jarosz 2019 recommend for smooth weights.
    fn half_width(&self) -> f64;

    /// The product of `edge` of the distances of a point from the borders that the shading point
    /// `x` sees, positive inside (Salesin & Jarosz 2019, eq. 23).
    fn border(&self, point: DVec3, x: DVec3, edge: impl Fn(f64) -> f64) -> f64;
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
