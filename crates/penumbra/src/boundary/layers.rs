//! [`Layers`]: how many projected triangles and how many layers of surfaces are over a point.

use std::ops::{Add, AddAssign, Neg};

/// The number of projected triangles and the number of layers of surfaces that hide a point of the
/// light, or the differences of these numbers between two points. A *layer* is one sheet of a
/// surface over the point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Layers {
    /// The number of projected triangles, which is always known.
    pub(super) images: i32,
    /// The number of layers of surfaces, of which only differences are known
    /// ([`LayerCount`](super::layer_counts::LayerCount)).
    pub(super) surfaces: i32,
}

impl Layers {
    pub(super) const fn of_images(images: i32) -> Self {
        Self {
            images,
            surfaces: 0,
        }
    }

    pub(super) const fn of_surfaces(surfaces: i32) -> Self {
        Self {
            images: 0,
            surfaces,
        }
    }
}

impl Add for Layers {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self {
            images: self.images + other.images,
            surfaces: self.surfaces + other.surfaces,
        }
    }
}

impl AddAssign for Layers {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Neg for Layers {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self {
            images: -self.images,
            surfaces: -self.surfaces,
        }
    }
}
