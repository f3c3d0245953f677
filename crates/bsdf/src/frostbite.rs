//! This module holds Frostbite's standard material.

use crate::lobe::Model;
use crate::microfacet::{TrowbridgeReitz, half, schlick};
use crate::{Fresnel, LtcLobe};
use linelit_geometry::DVec3;
use linelit_geometry::finite::{fraction, nonnegative_vector};
use std::f64::consts::FRAC_1_PI;

/// Frostbite's standard material: Disney's diffuse reflection, renormalised, and GGX with Smith's
/// height-correlated masking. With the linear roughness r:
///
/// - f_d = ρ/π s(cos_i) s(cos_o) (1 − r + r/1.51), where s(c) = 1 + (F90 − 1)(1 − c)⁵ and F90 = r/2
///   + 2 r (ω_i·h)²;
/// - f_s = D(h) G(ω_i, ω_o) F(ω_i·h)/(4 cos_i cos_o) with α = r² and Schlick's F.
///
/// The model is reciprocal. **Energy**: the light that the second term reflects is not subtracted
/// from the first. For base colours ([`from_base_color`](Self::from_base_color)) the albedo is at
/// most 1.13, at the horizon; for independent ρ and F0 it is up to 2.
///
/// **Source**: Lagarde & de Rousiers 2014, "Moving Frostbite to PBR", sections 3.1.2–3.1.3, the
/// material of Peters 2021.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frostbite {
    /// The diffuse albedo ρ, by channel.
    pub diffuse: DVec3,
    /// The reflectance at normal incidence, by channel.
    pub f0: DVec3,
    /// The linear roughness r in [0, 1].
    roughness: f64,
    /// The microfacets, with D and G.
    pub(crate) facets: TrowbridgeReitz,
}

impl Frostbite {
    /// Makes the model from the diffuse albedo, F0 and the linear roughness.
    #[must_use]
    pub fn new(diffuse: DVec3, f0: DVec3, roughness: f64) -> Self {
        let roughness = fraction(roughness);
        Self {
            diffuse,
            f0,
            roughness,
            facets: TrowbridgeReitz::isotropic(roughness * roughness),
        }
    }

    /// Makes the model from a base colour c and metalness m: ρ = (1 − m) c, F0 = 0.04 (1 − m) + m
    /// c.
    #[must_use]
    pub fn from_base_color(color: DVec3, metalness: f64, roughness: f64) -> Self {
        let m = fraction(metalness);
        let f0 = DVec3::splat(0.04 * (1.0 - m)) + color * m;
        Self::new(color * (1.0 - m), f0, roughness)
    }

    /// Returns the linear roughness r.
    #[must_use]
    pub const fn roughness(&self) -> f64 {
        self.roughness
    }

    /// Returns f(ω_i, ω_o) in 1/sr, in the local frame; zero below the surface.
    #[must_use]
    pub fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let Some(h) = half(wi, wo) else {
            return DVec3::ZERO;
        };
        let cosine = wi.dot(h);
        let r = self.roughness;
        let f90 = 0.5 * r + 2.0 * r * cosine * cosine;
        let scatter = |c: f64| 1.0 + (f90 - 1.0) * schlick(c);
        let flat = scatter(wi.z) * scatter(wo.z) * renormalised(r) * FRAC_1_PI;
        let glossy = self.fresnel().at(cosine) * self.facets.reflection(h, wi, wo);
        nonnegative_vector(self.diffuse * flat + glossy)
    }

    /// Returns Schlick's F of the specular term.
    pub(crate) const fn fresnel(&self) -> Fresnel {
        Fresnel::Schlick {
            f0: self.f0,
            f90: 1.0,
        }
    }
}

/// Returns 1 − r + r/1.51, the factor that renormalises the diffuse term at the linear roughness r.
fn renormalised(r: f64) -> f64 {
    1.0 - r * (0.51 / 1.51)
}

impl Model for Frostbite {
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.value(wi, wo)
    }

    fn shares(&self, wo: DVec3) -> [DVec3; 2] {
        [self.diffuse, self.fresnel().at(wo.z)]
    }

    fn facets(&self) -> Option<TrowbridgeReitz> {
        Some(self.facets)
    }

    /// The diffuse part takes in F90 the mean of (ω_i·h)² = (1 + ω_i·ω_o)/2 over the cosine, and
    /// uses ∫ s(cos_i) cos_i/π = 1 + (F90 − 1)/21.
    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
        let r = self.roughness;
        let f90 = 0.5 * r + r * (1.0 + wo.z * (2.0 / 3.0));
        let scatter = (1.0 + (f90 - 1.0) * schlick(wo.z)) * (1.0 + (f90 - 1.0) / 21.0);
        (
            self.diffuse * (scatter * renormalised(r)),
            Some(self.facets.transformed_cosine(&self.fresnel(), wo)),
        )
    }

    /// Returns false: the model reflects light at grazing directions for any colours.
    fn is_black(&self) -> bool {
        false
    }
}
