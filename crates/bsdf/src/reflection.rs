//! What an estimator asks of the reflection at a shading point.

use crate::{Lambert, Phong};
use linelit_geometry::DVec3;

/// The reflection of a surface at one point: implement it for a BSDF of your own, and every
/// estimator works on it.
///
/// Directions are unit vectors in the world: ω_i to the light, ω_o to the viewer, n the shading
/// normal on the viewer's side. Three methods are needed. Estimators that integrate over the
/// reflection in closed form ask [`closed_form`](Self::closed_form); where there is none they take
/// points of the visible part of the light instead.
pub trait Reflection {
    /// f(ω_i, ω_o) in 1/sr by channel, for ω_i above the surface. Finite and not negative.
    fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3;

    /// Draws ω_i from two uniform numbers in [0, 1). `None` where the draw fails: it counts as a
    /// sample of no light.
    ///
    /// The direction may lie below the surface: it then contributes nothing, and its density is
    /// still that of [`pdf`](Self::pdf).
    fn sample(&self, u: [f64; 2], wo: DVec3, n: DVec3) -> Option<DVec3>;

    /// The density of [`sample`](Self::sample) per solid angle; integrates to one less the share of
    /// draws that fail.
    fn pdf(&self, wi: DVec3, wo: DVec3, n: DVec3) -> f64;

    /// Whether nothing is reflected in any direction. `false` is always allowed.
    fn is_black(&self) -> bool {
        false
    }

    /// The reflection as a sum whose integrals over lines and polygons are known; `None`, the
    /// default, for any other.
    fn closed_form(&self) -> Option<ClosedForm> {
        None
    }

    /// The albedo of the diffuse part, by channel: what combined samples of linear lights weigh
    /// their diffuse share by (Peters 2021, section 4.2). Only the noise depends on it.
    fn diffuse_albedo(&self) -> DVec3 {
        self.closed_form().map_or(DVec3::ZERO, |c| c.diffuse.albedo)
    }

    /// A glossy lobe with a known linear transformation from the cosine, by which samples of
    /// linear lights follow it; `None`, the default, leaves them to the diffuse technique.
    fn glossy_lobe(&self) -> Option<GlossyLobe> {
        None
    }
}

/// A reflection that integrals in closed form know: f = k_d/π + k_s (k + 2)/(2π) max(0, ω_i·R)ᵏ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosedForm {
    /// The diffuse part.
    pub diffuse: Lambert,
    /// The lobe about the mirror direction, if there is one.
    pub lobe: Option<Phong>,
}

/// A glossy lobe with a known linear transformation from the cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GlossyLobe {
    /// The modified Phong lobe.
    Phong {
        /// What the lobe is multiplied with, by channel.
        scale: DVec3,
        /// The lobe.
        lobe: Phong,
    },
    /// GGX microfacets under Schlick's Fresnel term.
    Ggx {
        /// What the lobe is multiplied with, by channel.
        scale: DVec3,
        /// The linear roughness √α.
        roughness: f64,
        /// The reflectance at normal incidence, by channel.
        f0: DVec3,
    },
}
