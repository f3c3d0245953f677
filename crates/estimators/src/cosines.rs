//! The transformed cosines of a reflection, ready for integrals.

use linelit_bsdf::TransformedCosines;
use linelit_geometry::{DVec3, Frame};
use linelit_shading::ltc::Ltc;
use std::f64::consts::FRAC_1_PI;

/// The transformed cosines g(ω) that look like a reflection times the cosine, f cos θ.
#[derive(Clone, Debug)]
pub(crate) struct Cosines {
    /// The surface's frame.
    pub frame: Frame,
    /// The albedo of the cosine itself.
    pub diffuse: DVec3,
    /// The others, each with its albedo.
    pub lobes: Vec<(Ltc, DVec3)>,
}

impl Default for Cosines {
    /// The cosines of a black reflection.
    fn default() -> Self {
        Self {
            frame: Frame::from_normal(DVec3::Z),
            diffuse: DVec3::ZERO,
            lobes: Vec::new(),
        }
    }
}

impl Cosines {
    /// Sets them to those of a reflection.
    pub(crate) fn set(&mut self, cosines: &TransformedCosines) {
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
