//! The plane of a shaft's light, in which the images of occluders are.

use crate::shaft::frame::LightFrame;
use linelit_geometry::{DMat3, DVec3};

/// The plane of a shaft's light. Places on it are pairs (p, q), affine coordinates of the light in
/// which it lies within [0, 1]².
#[derive(Clone, Copy, Debug)]
pub struct LightPlane<'a> {
    /// The light's corners; two for a linear light.
    pub corners: &'a [[f64; 2]],
    /// The place (0, 0) relative to the shading point, and the vectors along p and q.
    pub axes: [DVec3; 3],
}

impl LightFrame {
    /// The plane of the light.
    pub(crate) fn plane(&self) -> LightPlane<'_> {
        // The columns are where (P, Q, W) is (1, 0, 0), (0, 1, 0) and (0, 0, 1).
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
