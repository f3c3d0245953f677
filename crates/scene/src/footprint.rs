//! This module has the extent of a pixel, that is, how far it is from one pixel to the next, in two
//! forms: as neighbouring camera rays ([`RayDifferential`]), and as a parallelogram on a texture
//! ([`Footprint`]), over which lookups are filtered.

use crate::texture::UvMapping;
use linelit_geometry::{DVec2, DVec3};

/// The two rays next to a camera ray, through the film one sample to the right and one sample down
/// (Igehy 1999, *Tracing ray differentials*; Pharr, Jakob and Humphreys, *Physically Based
/// Rendering*, 3rd edition, §10.1). They bound the extent that the ray represents. After mirrors
/// and glass they are correct to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayDifferential {
    /// The origins of the two rays.
    pub origins: [DVec3; 2],
    /// The directions of the two rays, not of unit length.
    pub directions: [DVec3; 2],
}

/// A point of a texture with the extent of the pixel around it: a parallelogram with the sides `dx`
/// and `dy`, each the distance to the next pixel. With several samples in a pixel, it is the
/// extent of one sample.
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
    /// Creates a point without extent.
    fn from(uv: DVec2) -> Self {
        Self::point(uv)
    }
}

impl Footprint {
    /// Creates a point without extent.
    #[must_use]
    pub const fn point(uv: DVec2) -> Self {
        Self {
            uv,
            dx: DVec2::ZERO,
            dy: DVec2::ZERO,
        }
    }

    /// Returns whether the footprint has no extent.
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

    /// Maps the footprint to the coordinates of an image or a checkerboard. Its extent is clamped
    /// to 1e8 repetitions.
    #[must_use]
    pub fn mapped(&self, mapping: &UvMapping) -> Self {
        /// The largest extent of a footprint along each coordinate, in repetitions of the image;
        /// larger footprints are clamped to it.
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

    /// Returns the larger of the changes across and down, for each coordinate.
    pub(crate) fn reach(&self) -> DVec2 {
        self.dx.abs().max(self.dy.abs())
    }
}
