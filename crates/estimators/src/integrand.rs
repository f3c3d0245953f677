//! The integrand of the samples: the light that a point of the light sends to the viewer, less the
//! part that is known, by transformed cosines.

use crate::{EmissionTexture, LightSource, ShadingPoint};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Emission, LightPoint};
use linelit_shading::ltc::Ltc;
use std::f64::consts::FRAC_1_PI;

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
    pub cosines: &'a KnownLtc,
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

/// The transformed cosines g(ω) that look like a reflection times the cosine, f cos θ.
#[derive(Clone, Debug)]
pub(crate) struct KnownLtc {
    /// The surface's frame.
    pub frame: Frame,
    /// The albedo of the cosine itself.
    pub diffuse: DVec3,
    /// The others, each with its albedo.
    pub lobes: Vec<(Ltc, DVec3)>,
}

impl Default for KnownLtc {
    /// The cosines of a black reflection.
    fn default() -> Self {
        Self {
            frame: Frame::from_normal(DVec3::Z),
            diffuse: DVec3::ZERO,
            lobes: Vec::new(),
        }
    }
}

impl KnownLtc {
    /// Sets them to those of a reflection.
    pub(crate) fn set(&mut self, cosines: &LtcMixture) {
        (self.frame, self.diffuse) = (cosines.frame, cosines.diffuse);
        self.lobes.clear();
        let lobes = cosines.lobes().iter();
        self.lobes
            .extend(lobes.map(|lobe| (Ltc::new(lobe.map, 1.0), lobe.albedo)));
    }

    /// g(ω), where `cosine` is cos θ.
    pub(crate) fn at(&self, w: DVec3, cosine: f64) -> DVec3 {
        let local = self.frame.to_local(w);
        let lobes = self.lobes.iter();
        lobes.fold(self.diffuse * (cosine * FRAC_1_PI), |sum, (ltc, albedo)| {
            sum + *albedo * ltc.density(local)
        })
    }
}
