//! `point-visible-area`: points uniform on the part that faces the shading point.

use super::area::Area;
use super::round::{RoundPoints, Viewer};
use super::{PointDensity, Polygon};
use crate::{EmissionTexture, LinearOptions};
use linelit_geometry::DVec3;
use linelit_lights::{AreaSampler, CylinderArea, CylinderView, Disk, Sphere, SphereCap};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VisibleArea;

impl PointDensity for VisibleArea {
    const NAME: &'static str = "point-visible-area";

    type OnPolygon<'t> = AreaSampler<'t>;

    fn on_polygon<'t, T: EmissionTexture>(self, light: &Polygon<'t, T>) -> Option<AreaSampler<'t>> {
        Area.on_polygon(light)
    }

    fn on_sphere(self, sphere: &Sphere, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        Some(SphereCap::visible(sphere, viewer.position).into())
    }

    fn on_disk(self, disk: &Disk, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        Area.on_disk(disk, viewer)
    }

    fn on_cylinder(self, seen: &CylinderView, _: &[DVec3; 2]) -> RoundPoints {
        CylinderArea::visible(seen.cylinder(), seen.position()).into()
    }

    fn on_linear(self) -> LinearOptions {
        Area.on_linear()
    }
}
