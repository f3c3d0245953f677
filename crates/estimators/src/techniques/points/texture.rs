//! `point-texture`: points in proportion to the texture of a light.

use super::area::Area;
use super::{DrawPoints, Drawn, LightPoint, PointDensity, Polygon};
use crate::light::Shape;
use crate::{EmissionTexture, LinearOptions, ShadingPoint};
use linelit_bsdf::Reflection;
use linelit_geometry::ConvexPolygon;
use linelit_lights::{PointTechnique, TexturedSampler};

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Texture;

impl PointDensity for Texture {
    const NAME: &'static str = "point-texture";
    const STANDS_ALONE: bool = false;

    type OnPolygon<'t> = TexturedPoints<'t>;

    fn on_polygon<'t, T: EmissionTexture>(
        self,
        light: &Polygon<'t, T>,
    ) -> Option<TexturedPoints<'t>> {
        let texture = light.texture?;
        Some(TexturedPoints {
            sampler: texture.points()?,
            light: (!texture.fits()).then_some(*light.polygon),
        })
    }

    fn on_linear(self) -> LinearOptions {
        Area.on_linear()
    }
}

/// Points by an image.
#[derive(Clone, Debug)]
pub(crate) struct TexturedPoints<'t> {
    sampler: TexturedSampler<'t>,
    /// The light, where points of the image may fall beside it.
    light: Option<ConvexPolygon>,
}

impl<S: Shape> DrawPoints<S> for TexturedPoints<'_> {
    fn draw<R: Reflection>(&self, u: [f64; 2], surface: &S, point: &ShadingPoint<R>) -> Drawn {
        let (sample, x) = (self.sampler.sample(u), point.position);
        let on_light = match &self.light {
            Some(light) => light.meets(x, sample.point - x)?,
            None => sample.point,
        };
        let at = LightPoint::new(on_light, x, surface);
        Some((at, at.density(sample.pdf)))
    }

    fn density<R: Reflection>(&self, at: &LightPoint, _: &ShadingPoint<R>) -> f64 {
        at.density(self.sampler.pdf(at.point))
    }
}
