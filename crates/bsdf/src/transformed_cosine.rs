//! Reflections as sums of linearly transformed cosines.

use crate::{ClosedForm, ClosedLobe};
use linelit_elementary::exp_m1;
use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_shading::ltc::{TransformedCosine, TransformedCosines};
use std::f64::consts::{PI, TAU};

impl ClosedForm<'_> {
    /// The diffuse part as the cosine itself, and each lobe.
    #[must_use]
    pub fn transformed_cosines(self, wo: DVec3, n: DVec3) -> TransformedCosines {
        let frame = Frame::from_normal(n);
        let mut sum = TransformedCosines::new(frame, self.diffuse.albedo);
        for lobe in self.lobes(wo, n) {
            sum.add(lobe.transformed_cosine(&frame));
        }
        sum
    }
}

impl ClosedLobe {
    /// The lobe in a local frame: the cosine about its axis, shrunk across it to be as high as the
    /// lobe of the same integral (wider ones stay the cosine), with the albedo that it has but for
    /// what is below the horizon.
    pub(crate) fn transformed_cosine(&self, frame: &Frame) -> TransformedCosine {
        // Its integrals over the sphere, without and (of powers) with the cosine about its axis.
        let (axis, whole, with_cosine) = match self {
            Self::Power { axis, exponent, .. } => {
                (axis, TAU / (exponent + 1.0), TAU / (exponent + 2.0))
            }
            Self::Gaussian {
                axis, sharpness, ..
            } => {
                // Flat ones like the flattest that is told from them.
                let sharpness = sharpness.max(f64::EPSILON);
                let whole = -TAU / sharpness * exp_m1(-2.0 * sharpness);
                (axis, whole, whole.min(PI))
            }
        };
        let axis = frame.to_local(*axis);
        let about = Frame::from_normal(axis);
        let across = (whole / PI).sqrt().min(1.0);
        TransformedCosine {
            map: DMat3::from_cols(about.x * across, about.y * across, about.z),
            albedo: self.scale() * (with_cosine * axis.z.max(0.0)),
        }
    }
}
