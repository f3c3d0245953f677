//! This module holds Trowbridge–Reitz (GGX) microfacets: their distribution, masking, and sampling
//! by visible normals.
//!
//! **Symbols**, all in the local frame of the surface (normal +z): ω_o points to the viewer, ω_i to
//! the light, h = (ω_i + ω_o)/|…|, and α is the width of the distribution of slopes.
//!
//! **Source**: Trowbridge & Reitz 1975; Walter et al. 2007 (GGX); Heitz 2014 (height-correlated
//! Smith masking, anisotropy); Heitz 2018 (sampling of visible normals), in the form of Dupuy &
//! Benyoub 2023 (a spherical cap); Schlick 1994.

use crate::facet_cosine::MASKED;
use crate::{Fresnel, LtcLobe};
use linelit_elementary::sin_cos;
use linelit_geometry::DVec3;
use linelit_geometry::finite::{fraction, nonnegative};
use std::f64::consts::{PI, TAU};

/// A Trowbridge–Reitz distribution of microfacets with Smith's height-correlated masking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrowbridgeReitz {
    /// The widths α along x and y.
    alpha: [f64; 2],
}

/// Returns (1 − c)⁵, Schlick's interpolation between F0 and one; 0 for NaN.
#[must_use]
pub fn schlick(cosine: f64) -> f64 {
    let m = fraction(1.0 - cosine);
    let m2 = m * m;
    m2 * m2 * m
}

/// The root of the mean square of sample weights, k²/α_y (see [`TrowbridgeReitz::bends`]), from
/// which on a lobe counts as bent. Lobes that do not count as bent have less than 8 (of 20,000
/// pairs of widths and views), however wide they are.
const BENT: f64 = 0.25;

impl TrowbridgeReitz {
    /// The smallest α; smaller values are clamped to it. A narrower reflector looks like a mirror
    /// for all light sources, and directions of unit length would not resolve its lobe to many
    /// digits.
    pub const MIN_ALPHA: f64 = 1e-4;

    /// The largest α; larger values are clamped to it.
    pub const MAX_ALPHA: f64 = 1e4;

    /// Makes the distribution with α along x and y, clamped to the range from
    /// [`MIN_ALPHA`](Self::MIN_ALPHA) to [`MAX_ALPHA`](Self::MAX_ALPHA).
    #[must_use]
    pub fn new(alpha: [f64; 2]) -> Self {
        let alpha = alpha.map(|a| {
            // NaN becomes the narrowest α.
            if a > Self::MIN_ALPHA {
                a.min(Self::MAX_ALPHA)
            } else {
                Self::MIN_ALPHA
            }
        });
        Self { alpha }
    }

    /// Makes the distribution with the same α in all directions.
    #[must_use]
    pub fn isotropic(alpha: f64) -> Self {
        Self::new([alpha; 2])
    }

    /// Returns α along x and y.
    #[must_use]
    pub const fn alpha(&self) -> [f64; 2] {
        self.alpha
    }

    /// Whether the distribution is the same in all directions.
    #[must_use]
    #[allow(clippy::float_cmp, reason = "any difference makes a direction")]
    pub fn is_isotropic(&self) -> bool {
        self.alpha[0] == self.alpha[1]
    }

    /// Returns D(h) = 1/(π αx αy ((hx/αx)² + (hy/αy)² + hz²)²), the density of normals per solid
    /// angle; its integral with hz over the hemisphere is one.
    #[inline]
    #[must_use]
    pub fn density(&self, h: DVec3) -> f64 {
        let [a, b] = self.alpha;
        let (x, y) = (h.x / a, h.y / b);
        let e = x * x + y * y + h.z * h.z;
        nonnegative(1.0 / (PI * a * b * e * e))
    }

    /// Returns cos √(1 + α² tan²) = √(cos² + (αx wx)² + (αy wy)²). Smith's Λ is (this/cos − 1)/2.
    #[inline]
    fn reach(&self, w: DVec3) -> f64 {
        let [a, b] = self.alpha;
        DVec3::new(a * w.x, b * w.y, w.z).length()
    }

    /// Returns D(h) G(ω_i, ω_o)/(4 cos_i cos_o) with G = 1/(1 + Λ_i + Λ_o), in 1/sr, for directions
    /// above the surface with the half vector h.
    ///
    /// The cosines cancel: it is D/(2 (cos_o s_i + cos_i s_o)) with s = cos √(1 + α² tan²), which
    /// is finite at grazing angles.
    #[inline]
    #[must_use]
    pub fn reflection(&self, h: DVec3, wi: DVec3, wo: DVec3) -> f64 {
        let below = 2.0 * (wo.z * self.reach(wi) + wi.z * self.reach(wo));
        if below > 0.0 {
            nonnegative(self.density(h) / below)
        } else {
            0.0
        }
    }

    /// Returns the density of [`sample`](Self::sample): D_visible(h)/(4 ω_o·h), per solid angle.
    #[inline]
    #[must_use]
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        let Some(h) = half(wi, wo) else {
            return 0.0;
        };
        nonnegative(self.density(h) / (2.0 * (wo.z + self.reach(wo))))
    }

    /// Whether one α is more than twice the other.
    pub(crate) fn is_stretched(&self) -> bool {
        let [a, b] = self.alpha;
        a > 2.0 * b || b > 2.0 * a
    }

    /// Whether the light that is reflected for ω_o in the local frame lies along a curve, which no
    /// LTC can follow.
    ///
    /// If α_x is far smaller than α_y, normals lie about the plane of y and the surface's normal,
    /// and all reflected directions have about the same ω_x, so that they lie on a circle. At the
    /// distance t α_y from the mirror direction this circle is t² α_y² |ω_x| away from its tangent,
    /// where the lobe and its fit are t α_x ω_z wide. This is k t of these widths, with k = α_y²
    /// |ω_x|/(α_x ω_z). Both the lobe and the fit fall off with the fourth power, and the part of
    /// the lobe beyond t with t⁻². Samples by the fit therefore have a mean square of weights of
    /// about k⁴/α_y².
    pub(crate) fn bends(&self, wo: DVec3) -> bool {
        let [a, b] = self.alpha;
        let (narrow, wide, along) = if a < b { (a, b, wo.x) } else { (b, a, wo.y) };
        let wide = wide.min(1.0);
        self.is_stretched() && wide * (wide * along).powi(2) > BENT * (narrow * wo.z).powi(2)
    }

    /// Returns D G F cos_i/(4 cos_i cos_o) for ω_o in the local frame as an LTC, with the albedo
    /// for Fresnel's F. It is positive above the surface and zero below.
    #[must_use]
    pub fn transformed_cosine(&self, fresnel: &Fresnel, wo: DVec3) -> LtcLobe {
        MASKED.lobe(self, fresnel, wo)
    }

    /// Draws ω_i by reflecting ω_o at a visible normal; `None` where it falls below the surface, so
    /// that the density integrates to less than one.
    #[must_use]
    pub fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        if wo.z < 0.0 {
            return None;
        }
        let [a, b] = self.alpha;
        let stretched = DVec3::new(a * wo.x, b * wo.y, wo.z).try_normalize()?;
        // Draw a direction in a cap about the stretched view; its sum with the view is the normal.
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        let (s, c) = sin_cos(TAU * u[0]);
        let cap = DVec3::new(radius * c, radius * s, z) + stretched;
        let h = DVec3::new(a * cap.x, b * cap.y, cap.z.max(0.0)).try_normalize()?;
        let wi = (h * (2.0 * h.dot(wo)) - wo).try_normalize()?;
        (wi.z > 0.0 && wi.is_finite()).then_some(wi)
    }
}

/// Returns the half vector of two directions above the surface. `None` also for opposite directions
/// (both at the horizon), whose sum is rounding.
pub(crate) fn half(wi: DVec3, wo: DVec3) -> Option<DVec3> {
    if wi.z <= 0.0 || wo.z < 0.0 {
        return None;
    }
    let sum = wi + wo;
    let length = sum.length();
    (length > 1e-8).then(|| sum / length)
}
