//! Cylinders as surfaces of lights, as their shading point sees them.

use super::shape::Shape;
use crate::CylinderView;
use linelit_elementary::sin;
use linelit_geometry::DVec3;

impl Shape for CylinderView {
    #[inline]
    fn normal(&self, point: DVec3) -> DVec3 {
        self.normal(point)
    }

    fn meets(&self, _: DVec3, direction: DVec3) -> Option<DVec3> {
        self.meets(direction)
    }

    fn half_width(&self) -> f64 {
        let cylinder = self.cylinder();
        (0.5 * cylinder.axis.length()).min(cylinder.radius * sin(self.half_turn()))
    }

    fn border(&self, point: DVec3, _: DVec3, edge: impl Fn(f64) -> f64) -> f64 {
        let cylinder = self.cylinder();
        let from = [cylinder.axis.p0, cylinder.axis.p1].map(|end| point - end);
        let along = cylinder.axis.direction();
        let around = cylinder.radius * (self.half_turn() - self.azimuth(point).abs());
        let distances = [along.dot(from[0]), -along.dot(from[1]), around];
        distances.map(edge).iter().product()
    }
}
