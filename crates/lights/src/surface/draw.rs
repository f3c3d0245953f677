//! This module draws one point of a surface, by any technique, and returns it with its direction
//! and its density per solid angle.

use super::{LightPoint, Surface};
use crate::{PointColumns, PointTechnique, SurfaceMeasure};
use linelit_geometry::DVec3;

/// A sampler of points on a light's surface: one technique, or a mixture of techniques that follows
/// a reflection or a texture.
pub(crate) trait Draw {
    /// Draws the point for two random numbers, as seen from the shading point `x`, with its density
    /// per solid angle; `None` where the sample misses the light.
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)>;

    /// Draws many points at once, in columns of eight, as [`PointTechnique::sample_into`] does, and
    /// returns whether the densities are per area; `None` if the sampler cannot do that.
    fn columns(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        let _ = (u, out);
        None
    }

    /// Returns the density per solid angle with which a point of the light is drawn.
    fn density(&self, at: &LightPoint) -> f64;
}

impl<P: PointTechnique> Draw for P {
    #[inline]
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)> {
        let sample = PointTechnique::sample(self, u);
        let to_light = sample.point - x;
        let direction = if P::Measure::IS_LOCAL {
            to_light / to_light.length()
        } else {
            to_light.normalize_or_zero()
        };
        let at = LightPoint::towards(sample.point, to_light, direction, surface);
        Some((at, at.density(sample.pdf)))
    }

    fn columns(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        self.sample_into(u, out);
        Some(P::Measure::IS_LOCAL)
    }

    #[inline]
    fn density(&self, at: &LightPoint) -> f64 {
        at.density(self.pdf(at.point))
    }
}
