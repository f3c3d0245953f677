//! This module holds the delta lights: point lights and parallel light. Each has no size, so that a
//! shading point sees it in one direction only: one shadow ray decides whether it is visible, and
//! there is no point to sample.
#![allow(
    clippy::disallowed_types,
    reason = "lights share the tables of luminaires"
)]

use crate::{Profile, Sphere};
use core::f64::consts::PI;
use linelit_geometry::DVec3;
use std::sync::Arc;

/// A point that emits light, such as a lamp that is small compared with its distance.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// The position of the light.
    pub position: DVec3,
    /// The radiant intensity in W/sr, linear RGB.
    pub intensity: DVec3,
    /// A factor of the intensity that depends on the direction, for spots, goniometric lights and
    /// IES luminaires.
    pub profile: Option<Arc<Profile>>,
}

/// Parallel light, as from a star: its direction and its irradiance are the same everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct DistantLight {
    /// The unit vector towards the light.
    pub direction: DVec3,
    /// The irradiance of a surface that faces the light, in W/m², linear RGB.
    pub irradiance: DVec3,
    /// A ball that holds the scene. Shadow rays towards the light end outside the ball, and the
    /// light's power is the power that falls on the ball.
    pub scene: Sphere,
}

/// The light that arrives at a shading point from a delta light, along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaSample {
    /// The vector from the shading point to the light; for light from infinity, to a point beyond
    /// the scene.
    pub to_light: DVec3,
    /// The unit vector along `to_light`.
    pub direction: DVec3,
    /// The irradiance of a surface that faces the light, in W/m². Negative channels are zero; a
    /// light whose irradiance is not finite arrives nowhere.
    pub irradiance: DVec3,
}

impl PointLight {
    /// Returns the direction and the irradiance with which the light arrives at the shading point
    /// `x`; `None` if `x` is the light's position, and where no light arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<DeltaSample> {
        let to_light = self.position - x;
        let distance = to_light.length();
        let direction = to_light / distance;
        // Divided twice, so that no square overflows or underflows before the intensity is scaled.
        let factor = self.profile.as_ref();
        let factor = factor.map_or(DVec3::ONE, |profile| profile.factor(-direction));
        DeltaSample::new(
            to_light,
            direction,
            self.intensity * factor / distance / distance,
        )
    }

    /// Returns the emitted power by channel in W: 4π times the intensity times the mean of the
    /// profile.
    pub(crate) fn power(&self) -> DVec3 {
        let mean = self.profile.as_ref().map_or(DVec3::ONE, |p| p.mean());
        self.intensity * (mean * (4.0 * PI))
    }
}

impl DistantLight {
    /// Returns the direction and the irradiance with which the light arrives at the shading point
    /// `x`; `None` where the irradiance is zero or not finite.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<DeltaSample> {
        let to_light = self.direction * self.scene.beyond(x);
        DeltaSample::new(to_light, self.direction, self.irradiance)
    }

    /// Returns the power by channel, in W, that falls on the ball which holds the scene: π R² times
    /// the irradiance, for the ball's radius R.
    pub(crate) fn power(&self) -> DVec3 {
        self.irradiance * (PI * self.scene.radius * self.scene.radius)
    }
}

impl DeltaSample {
    fn new(to_light: DVec3, direction: DVec3, irradiance: DVec3) -> Option<Self> {
        let carries = irradiance.is_finite()
            && irradiance.max_element() > 0.0
            && direction.is_finite()
            && to_light.is_finite();
        carries.then(|| Self {
            to_light,
            direction,
            irradiance: irradiance.max(DVec3::ZERO),
        })
    }
}
