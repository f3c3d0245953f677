//! This module holds diffuse reflection: Lambert's, and Oren and Nayar's.

use crate::lobe::Model;
use crate::peaks::{crossing, level};
use crate::{LtcLobe, Peaks};
use linelit_elementary::{atan2, hypot};
use linelit_geometry::finite::nonnegative_vector;
use linelit_geometry::{DVec3, Segment};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

/// A diffuse surface: f = k_d/π.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// The albedo k_d, by channel.
    pub albedo: DVec3,
}

impl Lambert {
    /// Returns the constant value k_d/π in 1/sr.
    #[must_use]
    pub fn value(&self) -> DVec3 {
        nonnegative_vector(self.albedo * FRAC_1_PI)
    }
}

/// The largest σ² of [`OrenNayar`], to which larger values are clamped; twice this number does not
/// overflow.
const MOST: f64 = 1e300;

/// A rough diffuse surface: f = k_d/π (A + B max(0, cos Δφ) sin α tan β), where α is the larger and
/// β the smaller angle of the two directions with the normal. The model is reciprocal.
///
/// **Energy**: the albedo is at most A + B/2, at the horizon, and therefore up to 1.0152 k_d (for σ
/// = 11.4°). Light that is reflected twice is neglected.
///
/// **Source**: Oren & Nayar 1994, the qualitative model (its equation 30).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrenNayar {
    /// The factor k_d, by channel; the albedo is close to it.
    pub albedo: DVec3,
    /// The constant A.
    a: f64,
    /// The constant B.
    b: f64,
}

impl OrenNayar {
    /// Makes the model for a standard deviation σ of the facets' slope angle, in radians: A = 1 −
    /// σ²/(2(σ² + 0.33)), B = 0.45 σ²/(σ² + 0.09).
    #[must_use]
    pub fn new(albedo: DVec3, sigma: f64) -> Self {
        let s = if sigma.is_finite() {
            // For larger σ the quotients are at their limits.
            (sigma * sigma).min(MOST)
        } else {
            0.0
        };
        Self {
            albedo,
            a: 1.0 - s / (2.0 * (s + 0.33)),
            b: 0.45 * s / (s + 0.09),
        }
    }

    /// Returns f(ω_i, ω_o) in 1/sr, in the local frame; zero below the surface.
    #[must_use]
    pub fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z <= 0.0 || wo.z < 0.0 {
            return DVec3::ZERO;
        }
        // sin α tan β cos Δφ = (sin_i sin_o cos Δφ)/max(cos_i, cos_o): no angle is needed.
        let tangential = (wi.x * wo.x + wi.y * wo.y).max(0.0);
        let rise = self.b * tangential / wi.z.max(wo.z);
        nonnegative_vector(self.albedo * ((self.a + rise) * FRAC_1_PI))
    }
}

impl Model for OrenNayar {
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        self.value(wi, wo)
    }

    fn shares(&self, _wo: DVec3) -> [DVec3; 2] {
        [self.albedo, DVec3::ZERO]
    }

    /// These are the kinks of max(0, cos Δφ) and of max(cos_i, cos_o).
    fn add_peaks(&self, line: &Segment, wo: DVec3, peaks: &mut Peaks) {
        peaks.add_kink(crossing(line, DVec3::new(wo.x, wo.y, 0.0)));
        level(line, wo, DVec3::Z).for_each(|t| peaks.add_kink(t));
    }

    /// This is the exact albedo, with sin α tan β cos_i integrated below and above θ_o.
    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
        let (cos, sin) = (wo.z, hypot(wo.x, wo.y));
        let below = 0.5 * sin * (atan2(sin, cos) - sin * cos);
        // This is tan (1 − sin³)/3 without the difference.
        let beyond = sin * cos * (1.0 + sin + sin * sin) / (3.0 * (1.0 + sin));
        let rise = self.b * (below + beyond) / FRAC_PI_2;
        (self.albedo * (self.a + rise), None)
    }

    fn is_black(&self) -> bool {
        self.albedo == DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::{assert_close, rng::SplitMix64};

    /// The model as printed, by its angles.
    fn printed(wi: DVec3, wo: DVec3, sigma: f64) -> f64 {
        let s = sigma * sigma;
        let (a, b) = (1.0 - 0.5 * s / (s + 0.33), 0.45 * s / (s + 0.09));
        let (ti, to) = (wi.z.acos(), wo.z.acos());
        let turn = wi.y.atan2(wi.x) - wo.y.atan2(wo.x);
        let (alpha, beta) = (ti.max(to), ti.min(to));
        (a + b * turn.cos().max(0.0) * alpha.sin() * beta.tan()) / std::f64::consts::PI
    }

    #[test]
    fn agrees_with_the_printed_form_and_is_reciprocal() {
        let mut random = SplitMix64::new(11);
        for _ in 0..2000 {
            let mut up = || {
                let w = DVec3::from_array(random.unit_vector());
                DVec3::new(w.x, w.y, w.z.abs().max(1e-3)).normalize()
            };
            let (wi, wo) = (up(), up());
            let model = OrenNayar::new(DVec3::ONE, 0.4);
            let got = model.value(wi, wo).x;
            // Near cos Δφ = 0 and near the pole, acos and atan2 cost the printed form ε/1e-3.
            assert_close!(got, printed(wi, wo, 0.4), rel = 1e-10, "{wi} {wo}");
            assert_close!(got, model.value(wo, wi).x, rel = 1e-14, "reciprocity");
        }
    }

    #[test]
    fn smooth_is_lambert() {
        let (w, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Z);
        let smooth = OrenNayar::new(DVec3::splat(0.5), 0.0);
        let lambert = Lambert {
            albedo: DVec3::splat(0.5),
        };
        assert_close!(
            smooth.value(w, v).x,
            lambert.value().x,
            rel = 1e-15,
            "the same product"
        );
    }
}
