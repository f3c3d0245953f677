//! Sources of points: a density on the light's surface, or the reflection's own directions.

use crate::integrand::Integrand;
use linelit_bsdf::Reflection;
use linelit_lights::{EmissionTexture, LightPoint, PointColumns, PointSource, Surface};

/// A source of points of a light, ready for a shading point.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source<'s, 't> {
    /// Points of the surface by a density.
    OnLight(&'s PointSource<'t>),
    /// Directions that the BSDF draws; those that meet the light count.
    Bsdf,
}

impl<'s, 't> From<&'s Option<Box<PointSource<'t>>>> for Source<'s, 't> {
    /// The BSDF where there is no density on the surface.
    fn from(source: &'s Option<Box<PointSource<'t>>>) -> Self {
        source.as_deref().map_or(Self::Bsdf, Self::OnLight)
    }
}

impl Source<'_, '_> {
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
