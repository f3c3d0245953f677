//! A query is what an estimator works on: one shading point, one light, and the occluders between
//! them.

use crate::{
    EmissionTexture, Estimator, LightKind, LightSource, RandomNumbers, ShadingPoint, Technique,
    VisibilityBy,
};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::Margins;
use linelit_visibility::Occluders;

/// The most samples of one light for one shading point. All of them are in memory at the same time.
pub const MOST_SAMPLES: u32 = 1 << 24;

/// One shading point, one light and the occluders between them, and how the light that reaches the
/// viewer is to be estimated.
#[derive(Debug)]
pub struct Query<'a, R, T> {
    /// The triangles that may hide the light.
    pub occluders: &'a Occluders,
    /// The light.
    pub light: &'a LightSource<'a, T>,
    /// The shading point.
    pub point: &'a ShadingPoint<R>,
    /// The random numbers.
    pub numbers: RandomNumbers,
    /// The estimator that is used.
    pub estimator: &'a Estimator,
    /// The number of samples, from 1 to [`MOST_SAMPLES`].
    pub samples: u32,
    /// Whether samples are left out where they are not needed: the light is integrated in closed
    /// form where nothing hides it, and is zero where it is wholly hidden. If this is `false`,
    /// every sample is taken, as published.
    pub skip: bool,
    /// The way in which lines and points of a combination query visibility.
    pub ask: VisibilityBy,
    /// The distances from the shading point and from the light within which occluders hide nothing.
    /// [`Query::new`] takes [`Margins::excluding`] the light's own triangles.
    pub margins: Margins,
}

impl<'a, R, T: EmissionTexture> Query<'a, R, T> {
    /// A query that leaves out samples where it can and shares one shaft. The number of samples is
    /// clamped to the range from 1 to [`MOST_SAMPLES`].
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
            samples: match samples {
                0 => 1,
                1..=MOST_SAMPLES => samples,
                _ => MOST_SAMPLES,
            },
            skip: true,
            ask: VisibilityBy::Shaft,
            margins: Margins::excluding(&light.triangles),
        }
    }
}

impl<R: Reflection, T> Query<'_, R, T> {
    /// The LTCs of the reflection, if they exist and the estimator uses them.
    pub(crate) fn cosines(&self) -> Option<LtcMixture> {
        let point = self.point;
        // Integrals that stand alone treat a diffuse reflection directly.
        let is_taken = |technique: &Technique| match (technique, self.estimator.alone()) {
            (Technique::Lines(_), Some(_)) => match LightKind::of(self.light) {
                LightKind::Linear => point.known().closed_form().is_none(),
                _ => point.known().constant().is_none(),
            },
            _ => true,
        };
        let asks = |technique: &Technique| technique.asks_for_cosines() && is_taken(technique);
        let mut techniques = self.estimator.parts().iter().map(|part| &part.technique);
        // A delta light has one direction and no integral.
        (techniques.any(asks) && LightKind::of(self.light) != LightKind::Delta)
            .then(|| point.bsdf.transformed_cosines(point.outgoing, point.normal))?
    }
}
