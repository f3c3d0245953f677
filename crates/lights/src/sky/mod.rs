//! This module holds light from infinity with a solid angle: environments and suns, and their
//! radiance by direction.
//!
//! How a shading point sees a sky, and how points of it are drawn, is in `surface/sky.rs`.
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

/// Light from all directions of a sky, or from a disk at infinity.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// The radiance as a function of the direction.
    pub emission: SkyEmission,
    /// An opening outside of which the sky is black. Light passes it against its normal, which
    /// points into the room.
    pub portal: Option<ConvexPolygon>,
    /// A ball that holds the scene: shadow rays end outside it, and the light's power is the power
    /// that enters it.
    pub scene: Sphere,
}

/// The radiance of a sky in W/(m² sr), linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum SkyEmission {
    /// A radiance that is the same from all directions.
    Constant(DVec3),
    /// A sun: a disk with one radiance.
    Sun {
        /// The unit vector towards its centre.
        direction: DVec3,
        /// Half of the angle under which it is seen, in radians, in (0, π/2].
        half_angle: f64,
        /// The radiance.
        radiance: DVec3,
    },
    /// An image of all directions.
    Image(Arc<SkyImage>),
}

impl Sky {
    /// Returns the radiance that arrives at `x` from the unit direction `w` when there are no
    /// occluders.
    #[must_use]
    pub fn radiance(&self, x: DVec3, w: DVec3) -> DVec3 {
        if !self.shows(x, w) {
            return DVec3::ZERO;
        }
        self.along(w)
    }

    /// Returns the radiance from a direction that is known to be within the sun's disk (if this is
    /// a sun) and to pass through the portal (if there is one).
    #[inline]
    #[must_use]
    pub fn along(&self, w: DVec3) -> DVec3 {
        match &self.emission {
            SkyEmission::Constant(radiance) | SkyEmission::Sun { radiance, .. } => *radiance,
            SkyEmission::Image(image) => image.radiance(w),
        }
    }

    /// Whether the direction `w` is within the sun's disk (if this is a sun), and the ray from `x`
    /// in this direction passes through the portal (if there is one).
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

    /// Returns the mean radiance over the directions that emit: the directions of a sun, or all.
    #[must_use]
    pub fn mean(&self) -> DVec3 {
        match &self.emission {
            SkyEmission::Constant(radiance) | SkyEmission::Sun { radiance, .. } => *radiance,
            SkyEmission::Image(image) => image.mean(),
        }
    }

    /// Returns the solid angle of the directions that emit, without regard to a portal.
    #[must_use]
    pub fn solid_angle(&self) -> f64 {
        match self.emission {
            SkyEmission::Sun { half_angle, .. } => 2.0 * PI * cap_height(half_angle),
            _ => 4.0 * PI,
        }
    }

    /// Returns the power by channel, in W, that enters the ball which holds the scene: π R² ∫ L dω.
    pub(crate) fn power(&self) -> DVec3 {
        let across = PI * self.scene.radius * self.scene.radius;
        self.mean() * (self.solid_angle() * across)
    }

    /// Returns the memory of the image in bytes; zero without an image.
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

/// Returns 1 − cos of an angle, without cancellation.
pub(crate) fn cap_height(angle: f64) -> f64 {
    let half = sin(0.5 * angle);
    2.0 * half * half
}

/// Returns 1 − cos of the angle between unit vectors, without cancellation.
pub(crate) fn below_cap(axis: DVec3, w: DVec3) -> f64 {
    0.5 * (w - axis).length_squared()
}
