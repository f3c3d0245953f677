//! This module holds emission that varies over a light, and draws points in proportion to it.

use super::draw::Draw;
use super::{LightPoint, Surface};
use crate::Shape;
use crate::{ImportanceImage, PointTechnique, TexturedSampler};
use linelit_geometry::{ConvexPolygon, DVec3};

/// Emission that varies over an area light, and the density by which points are drawn in proportion
/// to it.
pub trait EmissionTexture {
    /// Returns the radiance at a point of the light, in W/(m²·sr), on the side that emits.
    fn radiance(&self, on_light: DVec3) -> DVec3;

    /// Returns a sampler of points in proportion to the emission, on the light or (see
    /// [`fits`](Self::fits)) around it. `None` where there is no such density: then points are
    /// uniform on the area.
    fn points(&self) -> Option<TexturedSampler<'_>> {
        None
    }

    /// Whether all points that [`points`](Self::points) draws lie on the light.
    fn fits(&self) -> bool {
        false
    }

    /// Returns the image over `part` if `part` is a parallelogram that the image covers exactly.
    fn over(&self, part: &ConvexPolygon) -> Option<&ImportanceImage> {
        let _ = part;
        None
    }
}

/// The type of the texture of lights without one; it has no values.
#[derive(Clone, Copy, Debug)]
pub enum NoTexture {}

impl EmissionTexture for NoTexture {
    fn radiance(&self, _: DVec3) -> DVec3 {
        match *self {}
    }
}

/// A technique that draws points of a polygon by the image of its texture.
#[derive(Clone, Debug)]
pub struct TexturedPoints<'t> {
    sampler: TexturedSampler<'t>,
    /// The light, if points of the image may fall outside it.
    light: Option<ConvexPolygon>,
}

impl<'t> TexturedPoints<'t> {
    /// Sets the technique up; `None` where the texture has no density.
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
