//! `line-area`: lines on the area, points uniform in length.

use super::{LineMeasure, LineSetup};
use crate::EmissionTexture;
use crate::techniques::points::Polygon;
use linelit_geometry::ConvexPolygon;
use linelit_lights::LineSampler;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Area;

impl LineMeasure for Area {
    const NAME: &'static str = "line-area";

    type OnPolygon<'t> = LineSampler;

    fn on_polygon<T: EmissionTexture>(
        self,
        part: &Polygon<'_, T>,
        setup: LineSetup,
    ) -> Option<LineSampler> {
        Some(lines(part.polygon, setup))
    }
}

pub(super) fn lines(polygon: &ConvexPolygon, setup: LineSetup) -> LineSampler {
    LineSampler::new(polygon, setup.angle, setup.offset)
}
