//! This module holds a diffuse base under a glossy coat.

use crate::facet_cosine::UNMASKED;
use crate::lobe::Model;
use crate::microfacet::{TrowbridgeReitz, half, schlick};
use crate::peaks::{level, ridges};
use crate::{Fresnel, LtcLobe, Peaks};
use linelit_geometry::finite::nonnegative_vector;
use linelit_geometry::{DVec3, Segment};
use std::f64::consts::PI;

/// A diffuse base under a glossy coat:
/// f = 28 R_d/(23π) (1 − R_s)(1 − (1 − cos_i/2)⁵)(1 − (1 − cos_o/2)⁵)
///   + D(h)/(4 ω_i·h max(cos_i, cos_o)) (R_s + (1 − R_s)(1 − ω_i·h)⁵). It is reciprocal.
///
/// **Energy**: the albedo is at most one for α ≤ 1. The coat has no masking: rougher coats of high
/// R_s reflect more light than they receive at grazing views (α = 1.6, R_s = 1: up to 1.4).
///
/// **Source**: Ashikhmin & Shirley 2000, eqs. 4–5, with Trowbridge and Reitz's D as pbrt-v3 has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Substrate {
    /// R_d, the albedo of the base, by channel.
    pub diffuse: DVec3,
    /// R_s, the coat's reflectance at normal incidence, by channel.
    pub specular: DVec3,
    /// The microfacets, with D.
    pub facets: TrowbridgeReitz,
}

impl Substrate {
    /// Returns f(ω_i, ω_o) in 1/sr, in the local frame; zero below the surface.
    #[must_use]
    pub fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        let Some(h) = half(wi, wo) else {
            return DVec3::ZERO;
        };
        let base = self.diffuse
            * (DVec3::ONE - self.specular)
            * (28.0 / (23.0 * PI) * through(wi.z) * through(wo.z));
        let cosine = wi.dot(h);
        let shape = self.facets.density(h) / (4.0 * cosine * wi.z.max(wo.z));
        nonnegative_vector(base + self.coat(cosine) * shape)
    }

    /// Returns the Fresnel reflectance of the coat.
    pub(crate) fn coat(&self, cosine: f64) -> DVec3 {
        self.specular + (DVec3::ONE - self.specular) * schlick(cosine)
    }
}

/// Returns 1 − (1 − c/2)⁵.
fn through(cosine: f64) -> f64 {
    // It is expanded, so that there is no cancellation at grazing angles.
    let x = 0.5 * cosine;
    x * (5.0 - x * (10.0 - x * (10.0 - x * (5.0 - x))))
}

impl Model for Substrate {
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.value(wi, wo)
    }

    fn shares(&self, wo: DVec3) -> [DVec3; 2] {
        [self.diffuse * (DVec3::ONE - self.specular), self.coat(wo.z)]
    }

    fn facets(&self) -> Option<TrowbridgeReitz> {
        Some(self.facets)
    }

    /// These are the peaks of D, and the kink of max(cos_i, cos_o).
    fn add_peaks(&self, line: &Segment, wo: DVec3, peaks: &mut Peaks) {
        ridges(line, wo, self.facets, peaks);
        level(line, wo, DVec3::Z).for_each(|t| peaks.add_kink(t));
    }

    /// The base has the albedo R_d (1 − R_s)(1 − (1 − cos_o/2)⁵), since ∫ 28/23 (1 − (1 −
    /// cos_i/2)⁵) cos_i/π is one; the coat is a lobe.
    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
        let base = self.diffuse * (DVec3::ONE - self.specular) * through(wo.z);
        let coat = Fresnel::Schlick {
            f0: self.specular,
            f90: 1.0,
        };
        (base, Some(UNMASKED.lobe(&self.facets, &coat, wo)))
    }

    /// A coat without reflectance at normal incidence still reflects at a grazing one.
    fn is_black(&self) -> bool {
        false
    }
}
