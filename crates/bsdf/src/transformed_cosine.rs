//! This module approximates reflections with closed forms by sums of linearly transformed cosines
//! (LTCs).

use crate::{ClosedForm, ClosedLobe};
use linelit_elementary::exp_m1;
use linelit_geometry::{DMat3, DVec3, Frame};
use linelit_shading::ltc::{LtcLobe, LtcMixture};
use std::f64::consts::{PI, TAU};

impl ClosedForm<'_> {
    /// Returns the diffuse part as the cosine itself, and each lobe as an LTC.
    #[must_use]
    pub fn transformed_cosines(self, wo: DVec3, n: DVec3) -> LtcMixture {
        let frame = Frame::from_normal(n);
        let mut sum = LtcMixture::new(frame, self.diffuse.albedo);
        for lobe in self.lobes(wo, n) {
            sum.add(lobe.transformed_cosine(&frame));
        }
        sum
    }
}

impl ClosedLobe {
    /// Returns the lobe as an LTC in a local frame: the cosine about the lobe's axis, shrunk across
    /// the axis so that it is as high as the lobe and has the same integral. Lobes that are wider
    /// than the cosine are approximated by the cosine. The albedo is the lobe's, except that the
    /// part below the horizon is neglected.
    pub(crate) fn transformed_cosine(&self, frame: &Frame) -> LtcLobe {
        // Integrate over the sphere, without and (for powers) with the cosine about the axis.
        let (axis, whole, with_cosine) = match self {
            Self::Power { axis, exponent, .. } => {
                (axis, TAU / (exponent + 1.0), TAU / (exponent + 2.0))
            }
            Self::Gaussian {
                axis, sharpness, ..
            } => {
                // Flat Gaussians are treated like the flattest one that differs from a constant.
                let sharpness = sharpness.max(f64::EPSILON);
                let whole = -TAU / sharpness * exp_m1(-2.0 * sharpness);
                (axis, whole, whole.min(PI))
            }
        };
        let axis = frame.to_local(*axis);
        let about = Frame::from_normal(axis);
        let across = (whole / PI).sqrt().min(1.0);
        LtcLobe {
            map: DMat3::from_cols(about.x * across, about.y * across, about.z),
            albedo: self.scale() * (with_cosine * axis.z.max(0.0)),
        }
    }
}
