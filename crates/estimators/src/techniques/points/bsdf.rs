//! `point-bsdf`: directions drawn from the reflection.

use super::round::{RoundPoints, Viewer};
use super::{DrawPoints, Drawn, LightPoint, PointDensity, Polygon};
use crate::light::Shape;
use crate::{EmissionTexture, ShadingPoint};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{CylinderView, Disk, Sphere};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bsdf;

impl PointDensity for Bsdf {
    const NAME: &'static str = "point-bsdf";

    type OnPolygon<'t> = Directions;

    fn on_polygon<T: EmissionTexture>(self, _: &Polygon<'_, T>) -> Option<Directions> {
        Some(Directions)
    }

    fn on_sphere(self, _: &Sphere, _: &Viewer<'_>) -> Option<RoundPoints> {
        Some(Directions.into())
    }

    fn on_disk(self, _: &Disk, _: &Viewer<'_>) -> Option<RoundPoints> {
        Some(Directions.into())
    }

    fn on_cylinder(self, _: &CylinderView, _: &[DVec3; 2]) -> RoundPoints {
        Directions.into()
    }
}

/// Directions of the shading point's reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Directions;

impl<S: Shape> DrawPoints<S> for Directions {
    fn draw<R: Reflection>(&self, u: [f64; 2], surface: &S, point: &ShadingPoint<R>) -> Drawn {
        let (x, n) = (point.position, point.normal);
        let direction = point.bsdf.sample(u, point.outgoing, n)?;
        let on_light = surface.meets(x, direction)?;
        let at = LightPoint::towards(on_light, on_light - x, direction, surface);
        Some((at, point.bsdf.pdf(direction, point.outgoing, n)))
    }

    fn density<R: Reflection>(&self, at: &LightPoint, point: &ShadingPoint<R>) -> f64 {
        point.bsdf.pdf(at.direction, point.outgoing, point.normal)
    }
}
