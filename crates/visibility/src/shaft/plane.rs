//! [`LightPlane`]: the plane of a shaft's light with its coordinates (p, q), in which projections
//! of occluders are given.

use crate::shaft::frame::LightFrame;
use linelit_geometry::{DMat3, DVec3};

/// The plane of a shaft's light. Points on it are pairs (p, q): affine coordinates in which the
/// light is within [0, 1]².
#[derive(Clone, Copy, Debug)]
pub struct LightPlane<'a> {
    /// The light's corners in (p, q); two for a linear light.
    pub corners: &'a [[f64; 2]],
    /// The point (0, 0) relative to the shading point, and the vectors of one unit of p and of q.
    pub axes: [DVec3; 3],
}

impl LightFrame {
    /// Returns the plane of the light.
    pub(crate) fn plane(&self) -> LightPlane<'_> {
        // The columns of the inverse are the points where (P, Q, W) is (1, 0, 0), (0, 1, 0) and (0,
        // 0, 1).
        let axes = || {
            let inverse = DMat3::from_cols(self.p, self.q, self.w)
                .transpose()
                .inverse();
            [inverse.z_axis, inverse.x_axis, inverse.y_axis]
        };
        LightPlane {
            corners: &self.corners[..self.corner_count],
            axes: self.sides.map_or_else(axes, |sides| sides.axes),
        }
    }
}
