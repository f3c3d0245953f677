//! One shading point and one light: what an estimator works on.

use crate::techniques::points::LightPoint;
use crate::{
    EmissionTexture, Estimator, LightSource, RandomNumbers, ShadingPoint, Stream, Technique,
};
use linelit_bsdf::{Reflection, TransformedCosines};
use linelit_geometry::{DVec3, Margins};
use linelit_samplers::SampleSet;
use linelit_visibility::{LightCorners, Occluders, Scratch, ShaftQuery};

/// One shading point and one light, and how the light from one to the other is estimated.
#[derive(Debug)]
pub struct Query<'a, R, T> {
    /// What may stand between.
    pub occluders: &'a Occluders,
    /// The light.
    pub light: &'a LightSource<'a, T>,
    /// The shading point.
    pub point: &'a ShadingPoint<R>,
    /// Where random numbers come from.
    pub numbers: RandomNumbers,
    /// The estimator.
    pub estimator: &'a Estimator,
    /// How many samples are taken.
    pub samples: u32,
    /// Whether what has a closed form takes it where nothing is hidden, and what is wholly hidden
    /// takes no samples. Off, every sample is taken, as published.
    pub skip: bool,
    /// How the lines and points of a combination ask for visibility.
    pub queries: Queries,
    /// How near to the point or to the light an occluder hides nothing.
    pub margins: Margins,
}

/// How the lines and points of a combination ask for visibility.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Queries {
    /// One shaft answers all (`docs/decisions/008-one-shaft-for-combinations.md`).
    #[default]
    OneShaft,
    /// Each line and each point has a traversal of its own, as published.
    SeparateRays,
}

impl<R, T> Clone for Query<'_, R, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R, T> Copy for Query<'_, R, T> {}

impl<'a, R, T: EmissionTexture> Query<'a, R, T> {
    /// A query that skips what it can and shares one shaft.
    #[must_use]
    pub const fn new(
        occluders: &'a Occluders,
        light: &'a LightSource<'a, T>,
        point: &'a ShadingPoint<R>,
        estimator: &'a Estimator,
        numbers: RandomNumbers,
        samples: u32,
    ) -> Self {
        Self {
            occluders,
            light,
            point,
            numbers,
            estimator,
            samples: if samples == 0 { 1 } else { samples },
            skip: true,
            queries: Queries::OneShaft,
            margins: Margins::DEFAULT,
        }
    }

    /// With another number of samples.
    pub(crate) const fn with_samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// With so many samples in place of one.
    pub(crate) const fn times(self, factor: u32) -> Self {
        self.with_samples(self.samples.saturating_mul(factor))
    }

    /// With about so many samples in place of one: a power of two, of which points are best.
    pub(crate) const fn about_times(self, factor: u32) -> Self {
        self.with_samples(nearest_power_of_two(self.samples.saturating_mul(factor)))
    }

    /// The samples of a technique that stands alone.
    pub(crate) fn numbers(&self) -> SampleSet {
        self.numbers.points(Stream::Samples, self.samples)
    }

    /// The question what is between the point and corners of the light, or of its outline.
    pub(crate) fn shaft<'b>(&self, corners: impl Into<LightCorners<'b>>) -> ShaftQuery<'b> {
        ShaftQuery {
            point: self.point.position,
            light: corners.into(),
            exclude: self.light.triangles.clone(),
            margins: self.margins,
        }
    }

    /// What the point of the light sends to the viewer if nothing stands between, per solid angle:
    /// L f_r cos θ.
    #[inline]
    pub(crate) fn unshadowed(&self, at: &LightPoint) -> DVec3
    where
        R: Reflection,
    {
        self.point.reflected(self.light.emitted(at), at.direction)
    }

    /// What the reflection looks like, if it is known and one of the techniques asks.
    pub(crate) fn cosines_for<'b>(
        &self,
        techniques: impl IntoIterator<Item = &'b Technique>,
    ) -> Option<TransformedCosines>
    where
        R: Reflection,
    {
        let (point, mut techniques) = (self.point, techniques.into_iter());
        if techniques.any(Technique::asks_for_cosines) {
            point.cosines()
        } else {
            None
        }
    }

    /// A bit for each of up to [`FAN`](linelit_visibility::FAN) points of the light, given relative
    /// to the shading point, that nothing stands before.
    pub(crate) fn free(&self, to_light: &[DVec3], scratch: &mut Scratch) -> u64 {
        let fan = self
            .occluders
            .shadow_rays(self.point.position, to_light, self.margins);
        let own = &self.light.triangles;
        fan.all() & !self.occluders.any_hits(&fan, own, scratch)
    }
}

/// The power of two that is nearest by logarithm; 2³¹ at most, and 1 at least.
const fn nearest_power_of_two(n: u32) -> u32 {
    let below = 1_u32 << (n | 1).ilog2();
    let [square, limit] = [n as u64 * n as u64, 2 * below as u64 * below as u64];
    if square > limit && below < 1 << 31 {
        2 * below
    } else {
        below
    }
}

#[cfg(test)]
mod tests {
    use super::nearest_power_of_two;

    #[test]
    fn nearest_powers_of_two() {
        let nearest = |n: u32| {
            f64::from(n.max(1))
                .log2()
                .round()
                .exp2()
                .min(f64::from(1 << 30) * 2.0)
        };
        for n in (0..3000).chain([1 << 30, 1_518_500_249, 1_518_500_250, 1 << 31, u32::MAX]) {
            let got = f64::from(nearest_power_of_two(n));
            assert!((got - nearest(n)).abs() < 0.5, "{n}: {got}");
        }
    }
}
