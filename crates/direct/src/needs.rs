//! Which parts of a scene an estimator makes use of, so that the others need not be prepared.

use linelit_estimators::{Estimator, Technique, Weights};

/// Whether an estimator looks for occluders by more than single shadow rays, for any light and
/// reflection. Points of one technique, each with its shadow ray, do not: for them a hierarchy
/// built by [`Occluders::build_for_rays`](linelit_visibility::Occluders::build_for_rays) is enough.
#[must_use]
pub fn needs_shafts(estimator: &Estimator) -> bool {
    let by_rays = |technique| matches!(technique, Technique::Points(points) if !points.in_shaft);
    estimator.weights() != Weights::Alone
        || !estimator.parts().iter().all(|part| by_rays(part.technique))
}

/// Whether an estimator makes use of the statistics of a light's occlusion
/// ([`Luminaire::occlusion`](crate::Luminaire::occlusion)): `hybrid` chooses by them, and lines
/// take their direction from them, also those that `exact` takes where there is no closed form.
#[must_use]
pub fn needs_occlusion(estimator: &Estimator) -> bool {
    let mut parts = estimator.parts().iter();
    parts.any(|part| matches!(part.technique, Technique::Lines(_)))
}
