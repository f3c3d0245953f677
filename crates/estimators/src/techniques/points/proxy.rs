//! `point-proxy`: points by the unit-distance triangle of Shirley & Wang 1991.

use super::{PointDensity, Polygon};
use crate::{EmissionTexture, LinearOptions};
use linelit_lights::ProxySampler;
use linelit_lights::linear::LinearTechnique;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Proxy;

impl PointDensity for Proxy {
    const NAME: &'static str = "point-proxy";
    const HAS_VISIBILITY: bool = true;

    type OnPolygon<'t> = ProxySampler;

    fn on_polygon<T: EmissionTexture>(self, light: &Polygon<'_, T>) -> Option<ProxySampler> {
        Some(ProxySampler::new(light.polygon, light.position))
    }

    fn on_linear(self) -> LinearOptions {
        LinearOptions::Technique(LinearTechnique::ClippedSolidAngle)
    }
}
