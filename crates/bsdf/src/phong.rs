//! This module holds the modified Phong lobe.

use crate::lobe::Model;
use crate::{ClosedLobe, LtcLobe, Peaks};
use linelit_elementary::pow;
use linelit_geometry::finite::{nonnegative, nonnegative_vector};
use linelit_geometry::{DVec3, Frame, Segment};
use std::f64::consts::TAU;

/// The modified Phong lobe f = k_s (k + 2)/(2π) (ω_i·R)ᵏ about the mirror direction R, where
/// ω_i·R > 0, and zero elsewhere; with k = 0 (the limit for k → 0) it is constant on the half-space
/// of R.
/// It is reciprocal. **Energy**: the albedo is k_s at normal incidence and less elsewhere, by the
/// part below the surface.
///
/// **Source**: Billen & Dutré 2016, eq. 9 (Lafortune & Willems 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// k_s by channel, the albedo at normal incidence.
    pub specular: DVec3,
    /// The exponent k ≥ 0.
    pub exponent: f64,
}

impl Phong {
    /// Returns the mirror direction R of the direction `wo` to the viewer.
    #[must_use]
    pub fn axis(wo: DVec3, n: DVec3) -> DVec3 {
        n * (2.0 * n.dot(wo)) - wo
    }

    /// Returns k_s (k + 2)/(2π).
    #[must_use]
    pub fn scale(&self) -> DVec3 {
        nonnegative_vector(self.specular * nonnegative((self.exponent + 2.0) / TAU))
    }

    /// Returns f for a cosine ω_i·R.
    #[must_use]
    pub fn value(&self, cosine: f64) -> DVec3 {
        // Test this first: zero to the power of zero would be one.
        if cosine <= 0.0 {
            return DVec3::ZERO;
        }
        nonnegative_vector(self.scale() * pow(cosine, self.exponent))
    }

    /// Returns the density (k + 1)/(2π) (ω_i·R)ᵏ per solid angle; zero unless ω_i·R > 0.
    #[must_use]
    pub fn pdf(&self, cosine: f64) -> f64 {
        if cosine <= 0.0 {
            return 0.0;
        }
        nonnegative((self.exponent + 1.0) / TAU * pow(cosine, self.exponent))
    }

    /// Returns the cosine ω_i·R for a uniform random number.
    pub(crate) fn sample_cosine(&self, u: f64) -> f64 {
        pow(1.0 - u, 1.0 / (self.exponent + 1.0))
    }
}

impl Model for Phong {
    fn value(&self, wi: DVec3, wo: DVec3) -> DVec3 {
        if wi.z > 0.0 {
            self.value(mirrored(wo).dot(wi))
        } else {
            DVec3::ZERO
        }
    }

    fn shares(&self, _wo: DVec3) -> [DVec3; 2] {
        [DVec3::ZERO, self.specular]
    }

    fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<DVec3> {
        Some(crate::about(mirrored(wo), self.sample_cosine(u[0]), u[1]))
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        self.pdf(mirrored(wo).dot(wi))
    }

    fn add_peaks(&self, line: &Segment, wo: DVec3, peaks: &mut Peaks) {
        peaks.add_power(line, mirrored(wo), self.exponent);
    }

    fn cosines(&self, wo: DVec3) -> (DVec3, Option<LtcLobe>) {
        let lobe = ClosedLobe::Power {
            scale: self.scale(),
            axis: mirrored(wo),
            exponent: self.exponent,
        };
        let frame = Frame::from_normal(DVec3::Z);
        (DVec3::ZERO, Some(lobe.transformed_cosine(&frame)))
    }

    fn is_black(&self) -> bool {
        self.specular == DVec3::ZERO
    }
}

/// Returns the mirror direction of ω_o.
fn mirrored(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}
