//! The drawing of one point of a surface, whichever technique draws it.

use super::{LightPoint, Surface};
use crate::{PointColumns, PointTechnique, SurfaceMeasure};
use linelit_geometry::DVec3;

/// What draws points of a surface: a technique, or a mixture that follows a reflection or a
/// texture.
pub(crate) trait Draw {
    /// A point and its density.
    fn draw(&self, u: [f64; 2], surface: &Surface<'_>, x: DVec3) -> Option<(LightPoint, f64)>;

    /// Points side by side: [`PointTechnique::sample_into`].
    fn columns(&self, u: [&[[f64; 8]]; 2], out: PointColumns<'_>) -> Option<bool> {
        let _ = (u, out);
        None
    }

    /// The density per solid angle at any point of the light.
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
