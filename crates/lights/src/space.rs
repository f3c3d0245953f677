//! This module holds the space in which the directions of a light are given. It is the only module
//! in which a light's transform, with its reflections and uneven scales, meets the light's profile
//! or image.

use linelit_geometry::{DMat3, DVec3, Frame};

/// The linear map between directions of the world and directions of a light's own space.
///
/// To look a direction up, the inverse of the light's transform is applied to it, and the result is
/// normalized, as in pbrt. A reflection mirrors the light's emission, and an uneven scale stretches
/// it: a cone becomes an elliptic one. A uniform scale changes no direction.
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

    /// Makes the space of a light from the linear part of its transform to the world; `None` if
    /// this maps space to a plane, a line or a point, or is not finite.
    #[must_use]
    pub fn new(to_world: DMat3) -> Option<Self> {
        let columns = to_world.to_cols_array();
        let largest = columns.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        if !(largest >= f64::MIN_POSITIVE && to_world.is_finite()) {
            return None;
        }
        // Scale the largest element to one, so that no product overflows.
        let scaled = to_world * (1.0 / largest);
        // Recognize rotations and uniform scales: the columns are orthogonal and equally long.
        let squares = scaled.transpose() * scaled;
        let square = squares.x_axis.x;
        let off = squares - DMat3::from_diagonal(DVec3::splat(square));
        let off = off.to_cols_array().into_iter().map(f64::abs);
        // Such matrices are orthonormal to some 20 roundings in each element.
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
        // Accept any other matrix whose determinant is not too small for its columns.
        let [x, y, z] = [scaled.x_axis, scaled.y_axis, scaled.z_axis].map(DVec3::length);
        // With this limit squares and cubes of the inverse do not overflow, either.
        let is_flat = scaled.determinant().abs() <= (1e-14 * (x * y * z)).max(1e-60);
        (!is_flat).then(|| Self {
            to_world: scaled,
            to_light: scaled.inverse(),
            is_rigid: false,
        })
    }

    /// Returns the space of a light in a group that `outer` transforms: this space maps the light's
    /// directions to the group's, and `outer` maps the group's directions to the world's.
    #[must_use]
    pub fn within(&self, outer: &Self) -> Self {
        Self {
            to_world: outer.to_world * self.to_world,
            to_light: self.to_light * outer.to_light,
            is_rigid: self.is_rigid && outer.is_rigid,
        }
    }

    /// Whether the map keeps all angles: it is a rotation, or a rotation with a reflection, without
    /// an uneven scale.
    #[must_use]
    pub const fn is_rigid(&self) -> bool {
        self.is_rigid
    }

    /// Returns the matrix of the map from the world to this space.
    pub(crate) const fn matrix(&self) -> DMat3 {
        self.to_light
    }

    /// Returns the unit vector in this space that belongs to a unit vector of the world.
    #[inline]
    #[must_use]
    pub fn to_light(&self, w: DVec3) -> DVec3 {
        normalized(self.to_light * w, self.is_rigid)
    }

    /// Returns the unit vector of the world that belongs to a unit vector in this space.
    #[inline]
    #[must_use]
    pub fn to_world(&self, w: DVec3) -> DVec3 {
        normalized(self.to_world * w, self.is_rigid)
    }

    /// Returns the unit normal in this space of the plane whose unit normal in the world is `n`.
    #[must_use]
    pub(crate) fn normal_to_light(&self, n: DVec3) -> DVec3 {
        normalized(self.to_world.transpose() * n, self.is_rigid)
    }

    /// Returns the factor by which the map to this space enlarges the solid angle about a unit
    /// vector of the world: |det M| / |M w|³ for the map M.
    #[must_use]
    pub fn stretch(&self, w: DVec3) -> f64 {
        if self.is_rigid {
            return 1.0;
        }
        let length = (self.to_light * w).length();
        self.to_light.determinant().abs() / (length * length * length)
    }

    /// Returns a frame in the world for a surface with the unit normal `n`. Its x axis is the
    /// tangent next to this space's x axis, and its y axis points the other way if the light's
    /// transform is a reflection. Angles in it are angles of the world, also under an uneven scale.
    pub(crate) fn on_surface(&self, n: DVec3) -> Frame {
        let mut frame = Frame::from_normal_and_tangent(n, self.to_world.x_axis);
        if self.to_world.determinant() < 0.0 {
            frame.y = -frame.y;
        }
        frame
    }
}

impl From<Frame> for LightSpace {
    /// Makes the space whose axes in the world are the axes of a frame.
    fn from(frame: Frame) -> Self {
        let to_world = DMat3::from_cols(frame.x, frame.y, frame.z);
        Self {
            to_world,
            to_light: to_world.transpose(),
            is_rigid: true,
        }
    }
}

/// Returns `v` if it is known to be a unit vector, and normalizes it otherwise.
#[inline]
fn normalized(v: DVec3, is_unit: bool) -> DVec3 {
    if is_unit { v } else { v / v.length() }
}
