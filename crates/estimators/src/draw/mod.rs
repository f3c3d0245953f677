//! Points and lines that are drawn on a light before their visibility is asked for.

pub(crate) mod block;
pub(crate) mod lines;

use crate::integrand::Integrand;
use linelit_bsdf::Reflection;
use linelit_lights::{EmissionTexture, LightPoint, PointColumns, PointSource, Surface};

/// A source of points of a light, ready for a shading point: a density on the surface, else
/// directions that the BSDF draws, of which those that meet the light count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'s, 't>(pub Option<&'s PointSource<'t>>);

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
        match self.0 {
            Some(source) => source.draw(u, surface, point.position),
            None => {
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
        self.0?.sample_into(u, out)
    }

    /// The density per solid angle at any point of the light.
    pub(crate) fn density<R: Reflection, T>(
        &self,
        at: &LightPoint,
        integrand: &Integrand<'_, R, T>,
    ) -> f64 {
        let point = integrand.point;
        match self.0 {
            Some(source) => source.density(at),
            None => point.bsdf.pdf(at.direction, point.outgoing, point.normal),
        }
    }
}
