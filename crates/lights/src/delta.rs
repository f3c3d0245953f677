//! Lights without size: points and parallel light. One direction leads to each, so that one shadow
//! ray answers for it and no point of it can be drawn.
#![allow(
    clippy::disallowed_types,
    reason = "lights share the tables of luminaires"
)]

use crate::{Profile, Sphere};
use core::f64::consts::PI;
use linelit_geometry::DVec3;
use std::sync::Arc;

/// A point that emits: a lamp that is small for its distance.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// The place.
    pub position: DVec3,
    /// Radiant intensity in W/sr, linear RGB.
    pub intensity: DVec3,
    /// The factor of the intensity by direction: spots, goniometers and IES luminaires.
    pub profile: Option<Arc<Profile>>,
}

/// Parallel light, as from a star: the same everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct DistantLight {
    /// The unit vector towards the light.
    pub direction: DVec3,
    /// Irradiance of a surface that faces the light, W/m², linear RGB.
    pub irradiance: DVec3,
    /// A ball that holds the scene. Its shadow rays leave the ball, and its power is what falls on
    /// the ball.
    pub scene: Sphere,
}

/// The light that arrives at a shading point along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// The place that the light comes from, relative to the shading point; of light from
    /// infinity, a place beyond the scene.
    pub to_light: DVec3,
    /// The unit vector there.
    pub direction: DVec3,
    /// Irradiance of a surface that faces it, W/m²; infinite, NaN and negative values are zero.
    pub irradiance: DVec3,
}

impl PointLight {
    /// The light at `x`; `None` at the light itself, and where nothing arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<Beam> {
        let to_light = self.position - x;
        let distance = to_light.length();
        let direction = to_light / distance;
        // Divided twice, so that no square overflows or underflows before the intensity is scaled.
        let factor = self.profile.as_ref();
        let factor = factor.map_or(DVec3::ONE, |profile| profile.factor(-direction));
        Beam::new(
            to_light,
            direction,
            self.intensity * factor / distance / distance,
        )
    }

    /// Emitted power by channel, 4π I in W, times the profile's mean.
    pub(crate) fn power(&self) -> DVec3 {
        let mean = self.profile.as_ref().map_or(DVec3::ONE, |p| p.mean());
        self.intensity * (mean * (4.0 * PI))
    }
}

impl DistantLight {
    /// The light at `x`; `None` where nothing arrives.
    #[must_use]
    pub fn beam(&self, x: DVec3) -> Option<Beam> {
        let to_light = self.direction * self.scene.beyond(x);
        Beam::new(to_light, self.direction, self.irradiance)
    }

    /// The power by channel that falls on the ball which holds the scene, π R² E in W.
    pub(crate) fn power(&self) -> DVec3 {
        self.irradiance * (PI * self.scene.radius * self.scene.radius)
    }
}

impl Beam {
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
