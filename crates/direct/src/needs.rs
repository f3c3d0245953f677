//! This module says which parts of a scene an estimator uses, so that the others need not be
//! prepared.

use linelit_estimators::{Estimator, Technique, Weights};

/// Returns whether an estimator queries visibility by more than single shadow rays, for any light
/// and reflection. Points of one technique, with a shadow ray each, do not: for them it is enough
/// to build the hierarchy by
/// [`Occluders::build_for_rays`](linelit_visibility::Occluders::build_for_rays).
#[must_use]
pub fn needs_shafts(estimator: &Estimator) -> bool {
    let by_rays = |technique| matches!(technique, Technique::Points(points) if !points.in_shaft);
    estimator.weights() != Weights::Alone
        || !estimator.parts().iter().all(|part| by_rays(part.technique))
}

/// Returns whether an estimator uses the statistics of a light's occlusion
/// ([`Luminaire::occlusion`](crate::Luminaire::occlusion)). `hybrid` chooses its method by them,
/// and all lines take their direction from them, including the lines of `exact` where there is no
/// closed form.
#[must_use]
pub fn needs_occlusion(estimator: &Estimator) -> bool {
    let mut parts = estimator.parts().iter();
    parts.any(|part| matches!(part.technique, Technique::Lines(_)))
}
