//! One rough lobe of a reflection, whichever its model.

use crate::microfacet::TrowbridgeReitz;
use crate::{Frostbite, GlossyLobe, OrenNayar, Phong, Reflector, Substrate};
use linelit_geometry::DVec3;

/// One model of reflection, in the local frame of the surface (normal +z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// Rough diffuse.
    OrenNayar(OrenNayar),
    /// About the mirror direction, by a power of the cosine.
    Phong(Phong),
    /// A rough mirror.
    Reflector(Reflector),
    /// Diffuse under a glossy coat.
    Substrate(Substrate),
    /// Frostbite's standard material.
    Frostbite(Frostbite),
}

impl Lobe {
    /// f(ω_i, ω_o), 1/sr; zero below the surface.
    pub(crate) fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        match self {
            Self::OrenNayar(lobe) => lobe.value(wi, wo),
            Self::Phong(lobe) if wi.z > 0.0 => lobe.value(mirrored(wo).dot(wi)),
            Self::Phong(_) => DVec3::ZERO,
            Self::Reflector(lobe) => lobe.value(wi, wo),
            Self::Substrate(lobe) => lobe.value(wi, wo),
            Self::Frostbite(lobe) => lobe.value(wi, wo),
        }
    }

    /// About how much of the light from ω_o is reflected diffusely and about the mirror direction,
    /// summed over channels: how often each is to be sampled.
    pub(crate) fn shares(&self, wo: DVec3) -> [DVec3; 2] {
        match self {
            Self::OrenNayar(lobe) => [lobe.albedo, DVec3::ZERO],
            Self::Phong(lobe) => [DVec3::ZERO, lobe.specular],
            Self::Reflector(lobe) => [DVec3::ZERO, lobe.reflectance * lobe.fresnel.at(wo.z)],
            Self::Substrate(lobe) => [lobe.diffuse * (DVec3::ONE - lobe.specular), lobe.coat(wo.z)],
            Self::Frostbite(lobe) => [lobe.diffuse, lobe.fresnel().at(wo.z)],
        }
    }

    /// Draws ω_i for the part about the mirror direction.
    pub(crate) fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        match self {
            Self::Phong(lobe) => Some(crate::about(mirrored(wo), lobe.sample_cosine(u[0]), u[1])),
            _ => self.facets()?.sample(wo, u),
        }
    }

    /// The density of [`sample`](Self::sample), per solid angle.
    pub(crate) fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        match self {
            Self::Phong(lobe) => lobe.pdf(mirrored(wo).dot(wi)),
            _ => self.facets().map_or(0.0, |facets| facets.pdf(wi, wo)),
        }
    }

    /// The microfacets, if it has some.
    fn facets(&self) -> Option<TrowbridgeReitz> {
        match self {
            Self::Reflector(lobe) => Some(lobe.facets),
            Self::Substrate(lobe) => Some(lobe.facets),
            Self::Frostbite(lobe) => Some(lobe.facets),
            Self::OrenNayar(_) | Self::Phong(_) => None,
        }
    }

    /// The albedo of the diffuse part, by channel.
    pub(crate) fn diffuse_albedo(&self) -> DVec3 {
        match self {
            Self::Frostbite(material) => material.diffuse,
            Self::OrenNayar(rough) => rough.albedo,
            Self::Substrate(coated) => coated.diffuse,
            Self::Phong(_) | Self::Reflector(_) => DVec3::ZERO,
        }
    }

    /// The part about the mirror direction, if its transformation from the cosine is known.
    pub(crate) fn glossy(&self, scale: DVec3) -> Option<GlossyLobe> {
        match self {
            Self::Frostbite(material) => Some(GlossyLobe::Ggx {
                scale,
                roughness: material.roughness(),
                f0: material.f0,
            }),
            Self::Phong(lobe) => Some(GlossyLobe::Phong { scale, lobe: *lobe }),
            Self::OrenNayar(_) | Self::Reflector(_) | Self::Substrate(_) => None,
        }
    }

    /// Whether it reflects nothing.
    pub(crate) fn is_black(&self) -> bool {
        let parts = match self {
            Self::OrenNayar(lobe) => [lobe.albedo, DVec3::ZERO],
            Self::Phong(lobe) => [DVec3::ZERO, lobe.specular],
            Self::Reflector(lobe) => [DVec3::ZERO, lobe.reflectance],
            // A coat without reflectance at normal incidence still reflects at a grazing one.
            Self::Substrate(_) | Self::Frostbite(_) => return false,
        };
        parts == [DVec3::ZERO; 2]
    }
}

/// The mirror direction of ω_o.
fn mirrored(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}
