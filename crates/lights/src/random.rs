//! With the feature `rand`, this module makes every technique a distribution of the crate `rand`.

use crate::linear::LinearSample;
use crate::{LineSample, LineTechnique, LinearPointTechnique, PointSample, PointTechnique};
use rand::distr::Distribution;
use rand::{Rng, RngExt};

/// A technique as a [`Distribution`]: it takes its random numbers from a generator.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DVec3};
/// use linelit_lights::{AreaSampler, PointSample, PointTechnique, Random};
/// use rand::distr::Distribution;
/// /// Gives ½, ½, …
/// struct Middle;
/// impl rand::rand_core::TryRng for Middle {
///     type Error = std::convert::Infallible;
///     fn try_next_u32(&mut self) -> Result<u32, Self::Error> { Ok(1 << 31) }
///     fn try_next_u64(&mut self) -> Result<u64, Self::Error> { Ok(1 << 63) }
///     fn try_fill_bytes(&mut self, _: &mut [u8]) -> Result<(), Self::Error> { Ok(()) }
/// }
/// let quad = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).unwrap();
/// let technique = AreaSampler::new(&quad);
/// let drawn: PointSample<_> = Random(&technique).sample(&mut Middle);
/// assert_eq!(drawn, technique.sample([0.5, 0.5]));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Random<'a, T>(pub &'a T);

impl<T: PointTechnique> Distribution<PointSample<T::Measure>> for Random<'_, T> {
    fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> PointSample<T::Measure> {
        self.0.sample(rng.random())
    }
}

impl<T: LineTechnique> Distribution<LineSample> for Random<'_, T> {
    fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> LineSample {
        self.0.sample(rng.random())
    }
}

impl<T: LinearPointTechnique> Distribution<LinearSample> for Random<'_, T> {
    fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> LinearSample {
        self.0.sample(rng.random())
    }
}
