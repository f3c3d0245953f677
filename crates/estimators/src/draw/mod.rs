//! Points and lines are drawn on a light here, before their visibility is queried.

pub(crate) mod block;
pub(crate) mod lines;

use crate::integrand::Integrand;
use linelit_bsdf::Reflection;
use linelit_lights::{EmissionTexture, LightPoint, PointColumns, PointSource, Surface};

/// A source of points on a light, set up for a shading point: a density on the surface, or, without
/// one, directions from the BSDF, of which those that hit the light contribute.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'s, 't>(pub Option<&'s PointSource<'t>>);

impl Source<'_, '_> {
    /// Draws a point by two random numbers. Returns it with its density per solid angle; `None` if
    /// a direction misses the light.
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

    /// Draws points by random numbers, eight in each row, together with their densities. The
    /// densities are per area if the result is `true`, else per solid angle. `None` if the points
    /// depend on more than the numbers and the source, as directions from the BSDF do.
    pub(crate) fn sample_into(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        self.0?.sample_into(u, out)
    }

    /// The density per solid angle of this source at any point of the light.
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
