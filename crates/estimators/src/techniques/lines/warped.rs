//! `line-warped`: lines nearly uniform in solid angle, offsets without iteration.

use super::{LineMeasure, LineSetup};
use crate::EmissionTexture;
use crate::techniques::points::Polygon;
use linelit_lights::{AngularLines, ChordMeasure, OffsetDensity};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Warped;

impl LineMeasure for Warped {
    const NAME: &'static str = "line-warped";

    type OnPolygon<'t> = AngularLines;

    fn on_polygon<T: EmissionTexture>(
        self,
        part: &Polygon<'_, T>,
        setup: LineSetup,
    ) -> Option<AngularLines> {
        let lines = AngularLines::by_warped_solid_angle(part.polygon, setup.angle, part.position);
        Some(lines)
    }

    fn on_cylinder(self, _: OffsetDensity) -> ChordMeasure {
        ChordMeasure::SolidAngle
    }
}
