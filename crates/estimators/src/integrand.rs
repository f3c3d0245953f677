//! The integrand of the samples is the rest of the light: what a point of the light causes to be
//! reflected to the viewer, minus the known part, which consists of LTCs.

use crate::{EmissionTexture, LightSource, ShadingPoint};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::{DVec3, Frame};
use linelit_lights::{Emission, LightPoint};
use linelit_shading::ltc::Ltc;
use std::f64::consts::FRAC_1_PI;

/// The integrand L_e (f_r cos θ − g) per solid angle, as a function of a point of the light.
#[derive(Debug)]
pub(crate) struct Integrand<'a, R, T> {
    pub light: &'a LightSource<'a, T>,
    pub point: &'a ShadingPoint<R>,
    /// The known part, if there is one, which is subtracted.
    pub known: Option<Known<'a>>,
}

/// The known part g of an integrand, for a light of one radiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known<'a> {
    /// The LTCs that g consists of.
    pub cosines: &'a KnownLtc,
    /// The radiance that the light sends to the shading point.
    pub emitted: DVec3,
}

impl<R: Reflection, T: EmissionTexture> Integrand<'_, R, T> {
    /// Returns the value of the integrand at a point of the light, without visibility.
    #[inline]
    pub(crate) fn value(&self, at: &LightPoint) -> DVec3 {
        let emitted = self.light.emitted(at);
        let value = self.point.reflected(emitted, at.direction);
        let Some(known) = &self.known else {
            return value;
        };
        // The far side of a sphere emits nothing towards the point, and does not belong to the
        // known light.
        let cosine = self.point.cosine(at.direction);
        if cosine <= 0.0 || emitted == DVec3::ZERO {
            return DVec3::ZERO;
        }
        value - known.emitted * known.cosines.at(at.direction, cosine)
    }

    /// The emission times the reflection, if both are the same everywhere on a flat light and there
    /// is no known part; otherwise `None`.
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

/// The LTCs g(ω) that resemble a reflection times the cosine, f cos θ.
#[derive(Clone, Debug)]
pub(crate) struct KnownLtc {
    /// The frame of the surface.
    pub frame: Frame,
    /// The albedo of the untransformed cosine.
    pub diffuse: DVec3,
    /// The other LTCs, each with its albedo.
    pub lobes: Vec<(Ltc, DVec3)>,
}

impl Default for KnownLtc {
    /// The LTCs of a black reflection.
    fn default() -> Self {
        Self {
            frame: Frame::from_normal(DVec3::Z),
            diffuse: DVec3::ZERO,
            lobes: Vec::new(),
        }
    }
}

impl KnownLtc {
    /// Replaces these LTCs by the LTCs of a reflection.
    pub(crate) fn set(&mut self, cosines: &LtcMixture) {
        (self.frame, self.diffuse) = (cosines.frame, cosines.diffuse);
        self.lobes.clear();
        let lobes = cosines.lobes().iter();
        self.lobes
            .extend(lobes.map(|lobe| (Ltc::new(lobe.map, 1.0), lobe.albedo)));
    }

    /// Evaluates g(ω), given cos θ.
    pub(crate) fn at(&self, w: DVec3, cosine: f64) -> DVec3 {
        let local = self.frame.to_local(w);
        let lobes = self.lobes.iter();
        lobes.fold(self.diffuse * (cosine * FRAC_1_PI), |sum, (ltc, albedo)| {
            sum + *albedo * ltc.density(local)
        })
    }
}
