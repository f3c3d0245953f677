//! Cylinders as surfaces of lights, as their shading point sees them.

use super::lines::{LineDensity, LineFamily, LineSetup};
use super::points::{PointDensity as By, PointSource};
use super::{Shape, Viewer};
use crate::{ChordMeasure, CylinderArea, CylinderLines, CylinderView, OffsetDensity};
use linelit_elementary::sin;
use linelit_geometry::DVec3;

/// Lines of a measure above both horizons of a viewer.
fn above(view: &CylinderView, from: &Viewer<'_>, measure: ChordMeasure) -> CylinderLines {
    CylinderLines::of(view, &[from.normal, from.geometric_normal], measure)
}

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

    #[inline(always)]
    fn points<'t>(&'t self, by: By, from: &Viewer<'_>) -> PointSource<'t> {
        let by_area = PointSource::CylinderArea;
        let by_lines = |measure| PointSource::CylinderLines(above(self, from, measure));
        match by {
            By::Area => by_area(CylinderArea::whole(self.cylinder())),
            By::VisibleArea => by_area(CylinderArea::visible(self.cylinder(), self.position())),
            By::ProjectedSolidAngle => by_lines(ChordMeasure::Projected),
            By::SolidAngle | By::Proxy | By::Lobes | By::Texture => {
                by_lines(ChordMeasure::SolidAngle)
            }
        }
    }

    /// Along the axis, whatever the direction asked for.
    fn lines<'t>(
        &'t self,
        by: LineDensity,
        setup: LineSetup,
        from: &Viewer<'_>,
    ) -> Option<LineFamily<'t>> {
        let measure = match by {
            LineDensity::SolidAngle | LineDensity::Warped => ChordMeasure::SolidAngle,
            LineDensity::Projected => ChordMeasure::Projected,
            LineDensity::Area | LineDensity::Texture => match setup.offset {
                OffsetDensity::Uniform => ChordMeasure::Uniform,
                OffsetDensity::Length => ChordMeasure::Length,
            },
        };
        Some(LineFamily::Cylinder(above(self, from, measure)))
    }
}
