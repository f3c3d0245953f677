//! Light from infinity with a solid angle: environments and suns, and their radiance by direction.
//!
//! What a shading point sees of one, and the points that are drawn of it, are in `surface/sky.rs`.
#![allow(
    clippy::disallowed_types,
    reason = "lights share the image of an environment"
)]

mod image;

pub use image::{SkyError, SkyImage};

use crate::{Shape, Sphere};
use core::f64::consts::PI;
use linelit_elementary::sin;
use linelit_geometry::{ConvexPolygon, DVec3};
use std::sync::Arc;

/// Light from all directions of a sky, or from a disk of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// The radiance by direction.
    pub emission: SkyEmission,
    /// An opening outside of which the sky is black. Light passes it from behind: against its
    /// normal, which points into the room.
    pub portal: Option<ConvexPolygon>,
    /// A ball that holds the scene: shadow rays leave it, and the light's power is what enters it.
    pub scene: Sphere,
}

/// The radiance of a sky, W/(m² sr), linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum SkyEmission {
    /// The same from all directions.
    Constant(DVec3),
    /// A disk of one radiance, as a sun is.
    Sun {
        /// The unit vector towards its centre.
        direction: DVec3,
        /// Half of the angle that it is seen under, in radians: in (0, π/2].
        half_angle: f64,
        /// The radiance.
        radiance: DVec3,
    },
    /// An image of all directions.
    Image(Arc<SkyImage>),
}

impl Sky {
    /// The radiance that arrives at `x` from the unit direction `w`, where nothing hides the sky.
    #[must_use]
    pub fn radiance(&self, x: DVec3, w: DVec3) -> DVec3 {
        if !self.shows(x, w) {
            return DVec3::ZERO;
        }
        self.along(w)
    }

    /// The radiance from a direction of the sun, and through the portal.
    #[inline]
    #[must_use]
    pub fn along(&self, w: DVec3) -> DVec3 {
        match &self.emission {
            SkyEmission::Constant(radiance) | SkyEmission::Sun { radiance, .. } => *radiance,
            SkyEmission::Image(image) => image.radiance(w),
        }
    }

    /// Whether the direction is of the sun, and through the portal.
    pub(crate) fn shows(&self, x: DVec3, w: DVec3) -> bool {
        let in_sun = match self.emission {
            SkyEmission::Sun {
                direction,
                half_angle,
                ..
            } => below_cap(direction, w) <= cap_height(half_angle),
            _ => true,
        };
        let through =
            |portal: &ConvexPolygon| portal.normal().dot(w) < 0.0 && portal.meets(x, w).is_some();
        in_sun && self.portal.as_ref().is_none_or(through)
    }

    /// The mean radiance over the directions that emit: those of a sun, or all.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        match &self.emission {
            SkyEmission::Constant(radiance) | SkyEmission::Sun { radiance, .. } => *radiance,
            SkyEmission::Image(image) => image.mean(),
        }
    }

    /// The solid angle of the directions that emit, as if there were no portal.
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        match self.emission {
            SkyEmission::Sun { half_angle, .. } => 2.0 * PI * cap_height(half_angle),
            _ => 4.0 * PI,
        }
    }

    /// The power by channel that enters the ball which holds the scene, π R² ∫ L dω in W.
    pub(crate) fn power(&self) -> DVec3 {
        let across = PI * self.scene.radius * self.scene.radius;
        self.mean() * (self.solid_angle() * across)
    }

    /// Bytes that its image takes.
    #[must_use]
    pub fn memory(&self) -> usize {
        match &self.emission {
            SkyEmission::Constant(_) | SkyEmission::Sun { .. } => 0,
            SkyEmission::Image(image) => image.memory(),
        }
    }

    /// Whether light can arrive at `x` above the horizon of the normal `n`.
    #[must_use]
    pub fn is_above(&self, x: DVec3, n: DVec3) -> bool {
        if let Some(portal) = &self.portal {
            let behind = portal.normal().dot(x - portal.vertices()[0]) > 0.0;
            return behind && portal.vertices().iter().any(|v| n.dot(*v - x) > 0.0);
        }
        match self.emission {
            SkyEmission::Sun {
                direction,
                half_angle,
                ..
            } => n.dot(direction) > -sin(half_angle),
            _ => true,
        }
    }
}

/// 1 − cos of an angle, without cancellation.
pub(crate) fn cap_height(angle: f64) -> f64 {
    let half = sin(0.5 * angle);
    2.0 * half * half
}

/// 1 − cos of the angle between unit vectors, without cancellation.
pub(crate) fn below_cap(axis: DVec3, w: DVec3) -> f64 {
    0.5 * (w - axis).length_squared()
}
