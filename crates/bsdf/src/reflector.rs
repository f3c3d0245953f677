//! This module holds a rough mirror.

use crate::lobe::Model;
use crate::microfacet::{TrowbridgeReitz, half};
use crate::{Fresnel, LtcLobe};
use linelit_geometry::DVec3;
use linelit_geometry::finite::nonnegative_vector;

/// A rough mirror: f = k D(h) G(ω_i, ω_o) F(ω_i·h)/(4 cos_i cos_o). It is reciprocal.
///
/// **Energy**: the albedo is at most k. Light that is reflected twice is neglected: at normal
/// incidence this loses 0.7 of the light for facets with α = 1, and a sixtieth for α = 0.1.
///
/// **Source**: Torrance & Sparrow 1967; Walter et al. 2007; Heitz 2014 (masking).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// The factor k by channel, which scales the reflection.
    pub reflectance: DVec3,
    /// The microfacets, with D and G.
    pub facets: TrowbridgeReitz,
    /// Fresnel's factor F.
    pub fresnel: Fresnel,
}

impl Reflector {
    /// Returns f(ω_i, ω_o) in 1/sr, in the local frame; zero below the surface.
    #[must_use]
    pub fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let Some(h) = half(wi, wo) else {
            return DVec3::ZERO;
        };
        let share = self.fresnel.at(wi.dot(h)) * self.facets.reflection(h, wi, wo);
        nonnegative_vector(self.reflectance * nonnegative_vector(share))
    }
}

impl Model for Reflector {
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.value(wi, wo)
    }

    fn shares(&self, wo: DVec3) -> [DVec3; 2] {
        [DVec3::ZERO, self.reflectance * self.fresnel.at(wo.z)]
    }

    fn facets(&self) -> Option<TrowbridgeReitz> {
        Some(self.facets)
    }

    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
        let lobe = self.facets.transformed_cosine(&self.fresnel, wo);
        (DVec3::ZERO, Some(lobe.scaled(self.reflectance)))
    }

    fn is_black(&self) -> bool {
        self.reflectance == DVec3::ZERO
    }
}
