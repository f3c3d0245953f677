//! Sources of points: a density on the light's surface, or the reflection's own directions.

use crate::PointBy;
use crate::integrand::Integrand;
use linelit_bsdf::Reflection;
use linelit_lights::{
    AreaSampler, EmissionTexture, LightPoint, PointColumns, PointSource, Surface, Viewer,
};

/// A source of points of a light, ready for a shading point.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "a few of them live on the stack")]
pub(crate) enum Source<'t> {
    /// Points of the surface by a density.
    OnLight(PointSource<'t>),
    /// Directions that the BSDF draws; those that meet the light count.
    Bsdf,
}

impl<'t> Source<'t> {
    /// Points on a surface, which may be a part of the light.
    #[inline(always)]
    pub(crate) fn new<T: EmissionTexture>(
        by: PointBy,
        surface: Surface<'t>,
        texture: Option<&'t T>,
        viewer: &Viewer<'_>,
    ) -> Self {
        // A source is large, and is copied if another function makes it: the cheapest is made here.
        if let (PointBy::Area, Surface::Polygon(polygon)) = (by, surface) {
            return Self::OnLight(PointSource::Area(AreaSampler::new(polygon)));
        }
        match by.on_surface() {
            Some(density) => Self::OnLight(PointSource::new(density, surface, texture, viewer)),
            None => Self::Bsdf,
        }
    }

    /// A point from two random numbers and its density per solid angle; `None` where the draw
    /// misses the light.
    #[inline]
    pub(crate) fn draw<R: Reflection, T: EmissionTexture>(
        &self,
        u: [f64; 2],
        surface: &Surface<'_>,
        integrand: &Integrand<'_, R, T>,
    ) -> Option<(LightPoint, f64)> {
        let point = integrand.point;
        match self {
            Self::OnLight(source) => source.draw(u, surface, point.position),
            Self::Bsdf => {
                let (x, n) = (point.position, point.normal);
                let direction = point.bsdf.sample(u, point.outgoing, n)?;
                let on_light = surface.meets(x, direction)?;
                let at = LightPoint::towards(on_light, on_light - x, direction, surface);
                Some((at, point.bsdf.pdf(direction, point.outgoing, n)))
            }
        }
    }

    /// Points from eight pairs of random numbers a row, with their densities, per area if the
    /// answer is `true`, else per solid angle; `None` where points are no function of the numbers
    /// and the source alone.
    pub(crate) fn sample_into(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        match self {
            Self::OnLight(source) => source.sample_into(u, out),
            Self::Bsdf => None,
        }
    }

    /// The density per solid angle at any point of the light.
    pub(crate) fn density<R: Reflection, T>(
        &self,
        at: &LightPoint,
        integrand: &Integrand<'_, R, T>,
    ) -> f64 {
        let point = integrand.point;
        match self {
            Self::OnLight(source) => source.density(at),
            Self::Bsdf => point.bsdf.pdf(at.direction, point.outgoing, point.normal),
        }
    }
}
