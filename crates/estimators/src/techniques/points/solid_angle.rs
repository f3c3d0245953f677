//! `point-solid-angle`: points uniform in the solid angle.

use super::{PointDensity, Polygon};
use crate::{EmissionTexture, LinearOptions};
use linelit_lights::SolidAngleSampler;
use linelit_lights::linear::LinearTechnique;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolidAngle;

impl PointDensity for SolidAngle {
    const NAME: &'static str = "point-solid-angle";
    const HAS_VISIBILITY: bool = true;

    type OnPolygon<'t> = SolidAngleSampler;

    fn on_polygon<T: EmissionTexture>(self, light: &Polygon<'_, T>) -> Option<SolidAngleSampler> {
        Some(SolidAngleSampler::new(light.polygon, light.position))
    }

    fn on_linear(self) -> LinearOptions {
        LinearOptions::Technique(LinearTechnique::ClippedSolidAngle)
    }
}
