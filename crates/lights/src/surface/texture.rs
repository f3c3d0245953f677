//! Emission that varies over a light, and points drawn in proportion to it.

use super::draw::Draw;
use super::{LightPoint, Surface};
use crate::Shape;
use crate::{ImportanceImage, PointTechnique, TexturedSampler};
use linelit_geometry::{ConvexPolygon, DVec3};

/// Emission that varies over an area light, and what points are drawn in proportion to.
pub trait EmissionTexture {
    /// The radiance at a point of the light, W/(m²·sr), on the side that emits.
    fn radiance(&self, on_light: DVec3) -> DVec3;

    /// Points in proportion to the emission, on the light or (see [`fits`](Self::fits)) around it;
    /// `None` where there is no such density: points then are uniform on the area.
    fn points(&self) -> Option<TexturedSampler<'_>> {
        None
    }

    /// Whether all points that are drawn lie on the light.
    fn fits(&self) -> bool {
        false
    }

    /// The image over `part`, if that is a parallelogram that the image covers exactly.
    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage> {
        let _ = part;
        None
    }
}

/// The texture of lights that have none: there is no value of it.
#[derive(Clone, Copy, Debug)]
pub enum NoTexture {}

impl EmissionTexture for NoTexture {
    fn radiance(&self, _: DVec3) -> DVec3 {
        match *self {}
    }
}

/// Points of a polygon by the image of its texture.
#[derive(Clone, Debug)]
pub struct TexturedPoints<'t> {
    sampler: TexturedSampler<'t>,
    /// The light, where points of the image may fall beside it.
    light: Option<ConvexPolygon>,
}

impl<'t> TexturedPoints<'t> {
    /// `None` where the texture has no density.
    pub(super) fn new(texture: &'t impl EmissionTexture, light: &ConvexPolygon) -> Option<Self> {
        Some(Self {
            sampler: texture.points()?,
            light: (!texture.fits()).then_some(*light),
        })
    }
}

impl Draw for TexturedPoints<'_> {
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        let sample = self.sampler.sample(u);
        let on_light = match &self.light {
            Some(light) => light.meets(x, sample.point - x)?,
            None => sample.point,
        };
        let at = LightPoint::new(on_light, x, surface);
        Some((at, at.density(sample.pdf)))
    }

    fn density(&self, at: &LightPoint) -> f64 {
        at.density(self.sampler.pdf(at.point))
    }
}
