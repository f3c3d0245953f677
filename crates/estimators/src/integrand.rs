//! The integrand of the samples: the light that a point of the light sends to the viewer, less the
//! part that is known.

use crate::cosines::Cosines;
use crate::{EmissionTexture, LightSource, ShadingPoint};
use linelit_bsdf::Reflection;
use linelit_geometry::DVec3;
use linelit_lights::{Emission, LightPoint};

/// L_e (f_r cos θ − g) per solid angle, as a function of a point of the light.
#[derive(Debug)]
pub(crate) struct Integrand<'a, R, T> {
    pub light: &'a LightSource<'a, T>,
    pub point: &'a ShadingPoint<R>,
    /// The known part, if there is one.
    pub known: Option<Known<'a>>,
}

/// The known part g of an integrand, of a light of one radiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known<'a> {
    /// The transformed cosines.
    pub cosines: &'a Cosines,
    /// The radiance that the light sends to the shading point.
    pub emitted: DVec3,
}

impl<R: Reflection, T: EmissionTexture> Integrand<'_, R, T> {
    /// The value at a point that nothing hides.
    #[inline]
    pub(crate) fn value(&self, at: &LightPoint) -> DVec3 {
        let emitted = self.light.emitted(at);
        let value = self.point.reflected(emitted, at.direction);
        let Some(known) = &self.known else {
            return value;
        };
        // The far side of a sphere sends nothing, and is no part of the known light.
        let cosine = self.point.cosine(at.direction);
        if cosine <= 0.0 || emitted == DVec3::ZERO {
            return DVec3::ZERO;
        }
        value - known.emitted * known.cosines.at(at.direction, cosine)
    }

    /// Emission times reflection, where both are the same everywhere on a flat light and nothing of
    /// it is known.
    pub(crate) fn even(&self) -> Option<Emission> {
        if self.known.is_some() {
            return None;
        }
        let (emission, f) = self.light.even().zip(self.point.known().constant())?;
        Some(Emission {
            radiance: emission.radiance * f,
            ..emission
        })
    }
}
