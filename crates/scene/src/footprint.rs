//! What a pixel covers: of the directions that a camera looks into, and of a texture.

use crate::texture::UvMapping;
use linelit_geometry::{DVec2, DVec3};

/// The rays through the film one sample further right and one further down, beside some ray: what
/// the ray stands for lies between (Igehy 1999, *Tracing ray differentials*; Pharr, Jakob and
/// Humphreys, *Physically Based Rendering*, 3rd edition, §10.1). Where the rays meet mirrors, to
/// first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferential {
    /// The origins of the two rays.
    pub origins: [DVec3; 2],
    /// The directions of the two rays, not of unit length.
    pub directions: [DVec3; 2],
}

/// A place on a texture, and how far the pixel around it reaches: the parallelogram of `dx` and
/// `dy`, whose sides are a pixel long (of several samples in a pixel, what one stands for).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Texture coordinates.
    pub uv: DVec2,
    /// The change of the coordinates from one pixel to the next across.
    pub dx: DVec2,
    /// The change of the coordinates from one pixel to the next down.
    pub dy: DVec2,
}

impl From<DVec2> for Footprint {
    /// A place without extent.
    fn from(uv: DVec2) -> Self {
        Self::point(uv)
    }
}

impl Footprint {
    /// A place without extent.
    #[must_use]
    pub const fn point(uv: DVec2) -> Self {
        Self {
            uv,
            dx: DVec2::ZERO,
            dy: DVec2::ZERO,
        }
    }

    /// Whether it has no extent.
    #[must_use]
    pub fn is_point(&self) -> bool {
        self.dx == DVec2::ZERO && self.dy == DVec2::ZERO
    }

    /// Returns a footprint of the same extent, shifted by `by`.
    #[must_use]
    pub fn shifted(&self, by: DVec2) -> Self {
        Self {
            uv: self.uv + by,
            ..*self
        }
    }

    /// Maps the footprint to an image or a checkerboard, cut off beyond 1e8 repetitions.
    #[must_use]
    pub fn mapped(&self, mapping: &UvMapping) -> Self {
        const MOST: DVec2 = DVec2::splat(1e8);
        let change = |change| {
            let mapped = mapping.apply_to_change(change);
            if mapped.is_nan() {
                MOST
            } else {
                mapped.clamp(-MOST, MOST)
            }
        };
        Self {
            uv: mapping.apply(self.uv),
            dx: change(self.dx),
            dy: change(self.dy),
        }
    }

    /// The larger change of each coordinate.
    pub(crate) fn reach(&self) -> DVec2 {
        self.dx.abs().max(self.dy.abs())
    }
}
