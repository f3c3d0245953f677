//! `point-projected-solid-angle`: points uniform in the projected solid angle.

use super::round::{RoundPoints, Viewer};
use super::{PointDensity, Polygon};
use crate::EmissionTexture;
use linelit_geometry::DVec3;
use linelit_lights::{
    AngularLines, ChordMeasure, CylinderLines, CylinderView, Disk, DiskChords, PointsOnLines,
    Sphere, SphereProjected,
};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ProjectedSolidAngle;

impl PointDensity for ProjectedSolidAngle {
    const NAME: &'static str = "point-projected-solid-angle";

    type OnPolygon<'t> = PointsOnLines<AngularLines>;

    fn on_polygon<T: EmissionTexture>(
        self,
        light: &Polygon<'_, T>,
    ) -> Option<PointsOnLines<AngularLines>> {
        let (x, n) = (light.position, light.normal);
        let lines = AngularLines::by_projected_solid_angle(light.polygon, 0.0, x, n);
        Some(PointsOnLines(lines))
    }

    fn on_sphere(self, sphere: &Sphere, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        SphereProjected::new(sphere, viewer.position, viewer.normal).map(RoundPoints::from)
    }

    fn on_disk(self, disk: &Disk, viewer: &Viewer<'_>) -> Option<RoundPoints> {
        let (x, horizons) = (viewer.position, [viewer.normal]);
        Some(DiskChords::new(disk, 0.0, x, &horizons).into())
    }

    fn on_cylinder(self, seen: &CylinderView, horizons: &[DVec3; 2]) -> RoundPoints {
        CylinderLines::of(seen, horizons, ChordMeasure::Projected).into()
    }
}
