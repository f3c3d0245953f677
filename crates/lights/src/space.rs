//! The space in which the directions of a light are given: the one place where a light's
//! transform, with its reflections and its uneven scales, meets its profile or its image.

use linelit_geometry::{DMat3, DVec3, Frame};

/// The linear map between directions of the world and those of a light's own space.
///
/// A direction is looked up where the inverse of the light's transform takes it, made a unit vector
/// (as in pbrt). A reflection mirrors what the light sends, and an uneven scale stretches it: a
/// cone becomes an elliptic one. Uniform scales change no direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpace {
    to_world: DMat3,
    to_light: DMat3,
    /// Whether both matrices are orthonormal.
    is_rigid: bool,
}

impl LightSpace {
    /// The space of the world itself.
    pub const WORLD: Self = Self {
        to_world: DMat3::IDENTITY,
        to_light: DMat3::IDENTITY,
        is_rigid: true,
    };

    /// The space of a light by the linear part of its transform to the world; `None` where that
    /// flattens space or is not finite.
    #[must_use]
    pub fn new(to_world: DMat3) -> Option<Self> {
        let columns = to_world.to_cols_array();
        let largest = columns.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        if !(largest >= f64::MIN_POSITIVE && to_world.is_finite()) {
            return None;
        }
        // No product of scaled elements overflows.
        let scaled = to_world * (1.0 / largest);
        let squares = scaled.transpose() * scaled;
        let square = squares.x_axis.x;
        let off = squares - DMat3::from_diagonal(DVec3::splat(square));
        let off = off.to_cols_array().into_iter().map(f64::abs);
        // Rotations and uniform scales are orthonormal to some 20 roundings each.
        if off.fold(0.0, f64::max) <= 1e-12 * square {
            let by = square.sqrt();
            let to_world = match (largest * by - 1.0).abs() <= 1e-12 {
                true => to_world,
                false => scaled * (1.0 / by),
            };
            return Some(Self {
                to_world,
                to_light: to_world.transpose(),
                is_rigid: true,
            });
        }
        let [x, y, z] = [scaled.x_axis, scaled.y_axis, scaled.z_axis].map(DVec3::length);
        // Squares and cubes of the inverse do not overflow, either.
        let is_flat = scaled.determinant().abs() <= (1e-14 * (x * y * z)).max(1e-60);
        (!is_flat).then(|| Self {
            to_world: scaled,
            to_light: scaled.inverse(),
            is_rigid: false,
        })
    }

    /// This space where the directions that it takes for those of the world are those of `outer`.
    #[must_use]
    pub fn within(&self, outer: &Self) -> Self {
        Self {
            to_world: outer.to_world * self.to_world,
            to_light: self.to_light * outer.to_light,
            is_rigid: self.is_rigid && outer.is_rigid,
        }
    }

    /// Whether the map keeps all angles: it is a rotation, which may mirror, without an uneven
    /// scale.
    #[must_use]
    pub const fn is_rigid(&self) -> bool {
        self.is_rigid
    }

    /// The matrix of the map from the world to this space.
    pub(crate) const fn matrix(&self) -> DMat3 {
        self.to_light
    }

    /// The unit vector in this space along a unit vector of the world.
    #[inline]
    #[must_use]
    pub fn to_light(&self, w: DVec3) -> DVec3 {
        normalized(self.to_light * w, self.is_rigid)
    }

    /// The unit vector of the world along a unit vector in this space.
    #[inline]
    #[must_use]
    pub fn to_world(&self, w: DVec3) -> DVec3 {
        normalized(self.to_world * w, self.is_rigid)
    }

    /// The unit normal in this space of the plane that has a unit normal of the world.
    #[must_use]
    pub(crate) fn normal_to_light(&self, n: DVec3) -> DVec3 {
        normalized(self.to_world.transpose() * n, self.is_rigid)
    }

    /// The solid angle in this space over the solid angle in the world, about a unit vector of the
    /// world: |det M| / |M w|³ of the map M to this space.
    #[must_use]
    pub fn stretch(&self, w: DVec3) -> f64 {
        if self.is_rigid {
            return 1.0;
        }
        let length = (self.to_light * w).length();
        self.to_light.determinant().abs() / (length * length * length)
    }

    /// The frame of a surface in the world whose unit normal is `n`: its x axis is as near to this
    /// space's as the surface allows, and its y axis is on the other side under a reflection.
    /// Angles are those of the world, under an uneven scale, too.
    pub(crate) fn on_surface(&self, n: DVec3) -> Frame {
        let mut frame = Frame::from_normal_and_tangent(n, self.to_world.x_axis);
        if self.to_world.determinant() < 0.0 {
            frame.y = -frame.y;
        }
        frame
    }
}

impl From<Frame> for LightSpace {
    /// The space whose axes in the world are those of a frame.
    fn from(frame: Frame) -> Self {
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        Self {
            to_world,
            to_light: to_world.transpose(),
            is_rigid: true,
        }
    }
}

/// A vector that is a unit vector already, or is made one.
#[inline]
fn normalized(v: DVec3, is_unit: bool) -> DVec3 {
    if is_unit { v } else { v / v.length() }
}
