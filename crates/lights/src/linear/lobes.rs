//! This module samples a linear light by a reflection that is a sum of linearly transformed cosines
//! (LTCs).

use super::{LinearSample, LtcSampler};
use crate::LinearPointTechnique;
use crate::density::{Pdf, ThinSolidAngle};
use linelit_geometry::finite::below_one;
use linelit_geometry::{DMat3, DVec3, Segment};
use linelit_shading::ltc::LtcMixture;

/// The LTCs of a reflection over a linear light as one technique. Each LTC gets a fraction of the
/// samples in proportion to the light that it reflects without occluders.
///
/// It does not implement [`LinearPointTechnique`]: several LTCs may lead to the same point, so that
/// there is no inverse.
#[derive(Clone, Copy, Debug)]
pub struct SegmentLtc {
    first: (LtcSampler, f64),
    others: [Option<(LtcSampler, f64)>; LtcMixture::MAX],
    /// The radiance that the LTCs reflect for each unit of radiance × radius, without occluders.
    pub reflected: DVec3,
}

impl SegmentLtc {
    /// Sets the technique up for one light and the shading point `x` with the unit normal `normal`.
    /// `None` if no LTC reflects any of the light.
    #[must_use]
    pub fn new(light: &Segment, x: DVec3, normal: DVec3, cosines: &LtcMixture) -> Option<Self> {
        let frame = cosines.frame;
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        let mut lobes = [None; LtcMixture::MAX];
        let mut reflected = DVec3::ZERO;
        // Set up each LTC, and integrate it over the light.
        for (slot, lobe) in lobes.iter_mut().zip(cosines.lobes()) {
            if let Some(sampler) = LtcSampler::new(light, x, normal, to_world * lobe.map) {
                let part = lobe.albedo * sampler.integral();
                reflected += part;
                *slot = Some((sampler, part.element_sum())).filter(|(_, part)| *part > 0.0);
            }
        }
        // Normalize the fractions of the samples.
        let total = reflected.element_sum();
        for (_, share) in lobes.iter_mut().flatten() {
            *share /= total;
        }
        let first = lobes.iter_mut().find_map(Option::take)?;
        total.is_finite().then_some(Self {
            first,
            others: lobes,
            reflected,
        })
    }

    /// Samples a point from one random number in [0, 1), and returns it with the density of all
    /// LTCs together. The number chooses an LTC, and is rescaled for the sample.
    #[must_use]
    pub fn sample(&self, mut xi: f64) -> LinearSample {
        let mut drawn = &self.first;
        for next in self.others.iter().flatten() {
            if xi < drawn.1 {
                break;
            }
            xi -= drawn.1;
            drawn = next;
        }
        let sample = drawn.0.sample(below_one(xi / drawn.1));
        LinearSample {
            pdf: self.pdf(sample.t),
            ..sample
        }
    }

    /// Returns the density in m/sr with which [`SegmentLtc::sample`] gives the position `t` of
    /// the light.
    #[must_use]
    pub fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle> {
        let lobes = std::iter::once(&self.first).chain(self.others.iter().flatten());
        let sum = lobes.map(|(lobe, share)| share * lobe.pdf(t).value()).sum();
        Pdf::new(sum)
    }
}
