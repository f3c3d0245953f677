//! `point-area`: points uniform on the area.

use super::round::{RoundPoints, Viewer};
use super::{PointDensity, Polygon};
use crate::{EmissionTexture, LinearOptions};
use linelit_geometry::DVec3;
use linelit_lights::linear::LinearTechnique;
use linelit_lights::{AreaSampler, CylinderArea, CylinderView, Disk, DiskArea, Sphere, SphereCap};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Area;

impl PointDensity for Area {
    const NAME: &'static str = "point-area";
    const HAS_VISIBILITY: bool = true;

    type OnPolygon<'t> = AreaSampler<'t>;

    fn on_polygon<'t, T: EmissionTexture>(self, light: &Polygon<'t, T>) -> Option<AreaSampler<'t>> {
        Some(AreaSampler::new(light.polygon))
    }

    fn on_sphere(self, sphere: &Sphere, _: &Viewer<'_>) -> Option<RoundPoints> {
        Some(SphereCap::whole(sphere).into())
    }

    fn on_disk(self, disk: &Disk, _: &Viewer<'_>) -> Option<RoundPoints> {
        Some(DiskArea::new(disk).into())
    }

    fn on_cylinder(self, seen: &CylinderView, _: &[DVec3; 2]) -> RoundPoints {
        CylinderArea::whole(seen.cylinder()).into()
    }

    fn on_linear(self) -> LinearOptions {
        LinearOptions::Technique(LinearTechnique::Area)
    }
}
