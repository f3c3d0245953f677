//! `line-projected`: lines, and points on them, uniform in projected solid angle.

use super::{LineMeasure, LineSetup};
use crate::EmissionTexture;
use crate::techniques::points::Polygon;
use linelit_lights::{AngularLines, ChordMeasure, OffsetDensity};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Projected;

impl LineMeasure for Projected {
    const NAME: &'static str = "line-projected";

    type OnPolygon<'t> = AngularLines;

    fn on_polygon<T: EmissionTexture>(
        self,
        part: &Polygon<'_, T>,
        setup: LineSetup,
    ) -> Option<AngularLines> {
        let (x, n) = (part.position, part.normal);
        let lines = AngularLines::by_projected_solid_angle(part.polygon, setup.angle, x, n);
        Some(lines)
    }

    fn on_cylinder(self, _: OffsetDensity) -> ChordMeasure {
        ChordMeasure::Projected
    }
}
