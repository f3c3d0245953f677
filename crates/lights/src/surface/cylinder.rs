//! Cylinders as surfaces of lights, as their shading point sees them.

use super::lines::{LineDensity, LineFamily, LineSetup};
use super::points::{PointDensity, PointSource};
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

    fn points<'t>(&'t self, by: PointDensity, from: &Viewer<'_>) -> PointSource<'t> {
        match by {
            PointDensity::Area => PointSource::CylinderArea(CylinderArea::whole(self.cylinder())),
            PointDensity::VisibleArea => {
                let area = CylinderArea::visible(self.cylinder(), self.position());
                PointSource::CylinderArea(area)
            }
            PointDensity::ProjectedSolidAngle => {
                PointSource::CylinderLines(above(self, from, ChordMeasure::Projected))
            }
            PointDensity::SolidAngle
            | PointDensity::Proxy
            | PointDensity::Lobes
            | PointDensity::Texture => {
                PointSource::CylinderLines(above(self, from, ChordMeasure::SolidAngle))
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
        let measure = match (by, setup.offset) {
            (LineDensity::SolidAngle | LineDensity::Warped, _) => ChordMeasure::SolidAngle,
            (LineDensity::Projected, _) => ChordMeasure::Projected,
            (LineDensity::Area | LineDensity::Texture, OffsetDensity::Uniform) => {
                ChordMeasure::Uniform
            }
            (LineDensity::Area | LineDensity::Texture, OffsetDensity::Length) => {
                ChordMeasure::Length
            }
        };
        Some(LineFamily::Cylinder(above(self, from, measure)))
    }
}
