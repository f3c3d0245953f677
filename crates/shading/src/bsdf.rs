//! Reflection at a surface.

use linelit_geometry::DVec3;
use std::f64::consts::{FRAC_1_PI, PI};

/// A diffuse surface: f = k_d/π.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Albedo k_d, by channel.
    pub albedo: DVec3,
}

impl Lambert {
    /// The constant value k_d/π, 1/sr.
    #[must_use]
    pub fn value(&self) -> DVec3 {
        self.albedo * FRAC_1_PI
    }
}

/// The modified Phong lobe f = k_s (k + 2)/(2π) max(0, ω_i·R)ᵏ about the mirror direction R.
///
/// **Source**: Billen & Dutré 2016, eq. 9 (Lafortune & Willems 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// k_s, by channel: the albedo at normal incidence.
    pub specular: DVec3,
    /// The exponent k ≥ 0.
    pub exponent: f64,
}

impl Phong {
    /// The mirror direction R of the direction `wo` to the viewer.
    #[must_use]
    pub fn axis(wo: DVec3, n: DVec3) -> DVec3 {
        n * (2.0 * n.dot(wo)) - wo
    }

    /// k_s (k + 2)/(2π).
    #[must_use]
    pub fn scale(&self) -> DVec3 {
        self.specular * ((self.exponent + 2.0) / (2.0 * PI))
    }
}

/// Reflection of a surface, as what the estimators can do with it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Bsdf {
    /// Diffuse.
    Lambert(Lambert),
    /// Diffuse and a Phong lobe.
    Phong(Lambert, Phong),
}

impl Bsdf {
    /// f(ω_i, ω_o) in 1/sr, for unit directions on the side of the normal `n`.
    #[must_use]
    pub fn eval(&self, wi: DVec3, wo: DVec3, n: DVec3) -> DVec3 {
        match self {
            Self::Lambert(lambert) => lambert.value(),
            Self::Phong(lambert, phong) => {
                let cosine = Phong::axis(wo, n).dot(wi).max(0.0);
                lambert.value() + phong.scale() * cosine.powf(phong.exponent)
            }
        }
    }

    /// Whether it reflects nothing.
    #[must_use]
    pub fn is_black(&self) -> bool {
        match self {
            Self::Lambert(lambert) => lambert.albedo == DVec3::ZERO,
            Self::Phong(lambert, phong) => {
                lambert.albedo == DVec3::ZERO && phong.specular == DVec3::ZERO
            }
        }
    }
}
