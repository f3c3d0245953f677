//! One shading point and one light: what an estimator works on.

use crate::{
    EmissionTexture, Estimator, LightKind, LightSource, RandomNumbers, ShadingPoint, Technique,
    VisibilityBy,
};
use linelit_bsdf::{LtcMixture, Reflection};
use linelit_geometry::Margins;
use linelit_visibility::Occluders;

/// The most samples of a light for one shading point: they are all in memory at once.
pub const MOST_SAMPLES: u32 = 1 << 24;

/// One shading point and one light, and how the light from one to the other is estimated.
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
    /// The estimator.
    pub estimator: &'a Estimator,
    /// The number of samples, from 1 to [`MOST_SAMPLES`].
    pub samples: u32,
    /// Whether what has a closed form takes it where nothing is hidden, and what is wholly hidden
    /// takes no samples. Off, every sample is taken, as published.
    pub skip: bool,
    /// The way in which lines and points of a combination ask for visibility.
    pub ask: VisibilityBy,
    /// The distances from point and light within which an occluder hides nothing: for
    /// [`Query::new`] those of [`Margins::excluding`] the light's own triangles.
    pub margins: Margins,
}

impl<'a, R, T: EmissionTexture> Query<'a, R, T> {
    /// A query that skips what it can and shares one shaft. No samples count as one, and more than
    /// [`MOST_SAMPLES`] as that many.
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
    /// The transformed cosines of the reflection, if they are known and the estimator asks for
    /// them.
    pub(crate) fn cosines(&self) -> Option<LtcMixture> {
        let point = self.point;
        // Integrals that stand alone take a diffuse reflection itself.
        let is_taken = |technique: &Technique| match (technique, self.estimator.alone()) {
            (Technique::Lines(_), Some(_)) => match LightKind::of(self.light) {
                LightKind::Linear => point.known().closed_form().is_none(),
                _ => point.known().constant().is_none(),
            },
            _ => true,
        };
        let asks = |technique: &Technique| technique.asks_for_cosines() && is_taken(technique);
        let mut techniques = self.estimator.parts().iter().map(|part| &part.technique);
        // One ray to a light without size asks for nothing.
        (techniques.any(asks) && LightKind::of(self.light) != LightKind::Delta)
            .then(|| point.bsdf.transformed_cosines(point.outgoing, point.normal))?
    }
}
