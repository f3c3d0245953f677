//! The lobes of a reflection over a linear light.

use super::{LinearSample, LtcSampler};
use crate::LinearPointTechnique;
use crate::density::{Pdf, ThinSolidAngle};
use linelit_geometry::finite::below_one;
use linelit_geometry::{DMat3, DVec3, Segment};
use linelit_shading::ltc::TransformedCosines;

/// The lobes of a reflection over a linear light, drawn from as one technique: each takes a share
/// of the samples in proportion to what it reflects of the unshadowed light.
///
/// It is no [`LinearPointTechnique`]: several lobes may lead to the same point, so that there is no
/// inverse.
#[derive(Clone, Copy, Debug)]
pub struct SegmentLobes {
    first: (LtcSampler, f64),
    others: [Option<(LtcSampler, f64)>; TransformedCosines::MAX],
    /// The radiance that the lobes reflect for each unit of radiance × radius, unshadowed.
    pub reflected: DVec3,
}

impl SegmentLobes {
    /// The per-light part for the shading point `x` with unit normal `normal`. `None` if no lobe
    /// reflects any of the light.
    #[must_use]
    pub fn new(
        light: &Segment,
        x: DVec3,
        normal: DVec3,
        cosines: &TransformedCosines,
    ) -> Option<Self> {
        let frame = cosines.frame;
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        let mut lobes = [None; TransformedCosines::MAX];
        let mut reflected = DVec3::ZERO;
        for (slot, lobe) in lobes.iter_mut().zip(cosines.lobes()) {
            if let Some(sampler) = LtcSampler::new(light, x, normal, to_world * lobe.map) {
                let part = lobe.albedo * sampler.integral();
                reflected += part;
                *slot = Some((sampler, part.element_sum())).filter(|(_, part)| *part > 0.0);
            }
        }
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

    /// A point from one random number in [0, 1), which is split for the choice of a lobe and
    /// rescaled, with the density of all lobes together.
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

    /// The density in m/sr with which [`SegmentLobes::sample`] gives the fraction `t` of the light.
    #[must_use]
    pub fn pdf(&self, t: f64) -> Pdf<ThinSolidAngle> {
        let lobes = std::iter::once(&self.first).chain(self.others.iter().flatten());
        let sum = lobes.map(|(lobe, share)| share * lobe.pdf(t).value()).sum();
        Pdf::new(sum)
    }
}
