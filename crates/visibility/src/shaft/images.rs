//! The images of a shaft's candidates in the plane of its light.

use crate::shaft::{frame::LightFrame, project::FlatTriangles};
use linelit_geometry::{DMat3, DVec3};

/// The images of a shaft's candidates on the light's plane, seen from the shading point.
///
/// Places on the plane are pairs (p, q), affine coordinates of the light in which it lies within
/// [0, 1]²; [`Images::place`] and [`Images::axes`] lead back to space.
#[derive(Clone, Copy, Debug)]
pub struct Images<'a> {
    frame: &'a LightFrame,
    flat: &'a FlatTriangles,
    /// The first of them that counts.
    first: usize,
    /// The place (0, 0) relative to the shading point, and the two axes.
    axes: [DVec3; 3],
}

impl<'a> Images<'a> {
    pub(crate) fn new(frame: &'a LightFrame, flat: &'a FlatTriangles, first: usize) -> Self {
        // The columns are where (P, Q, W) is (1, 0, 0), (0, 1, 0) and (0, 0, 1).
        let axes = || {
            let inverse = DMat3::from_cols(frame.p, frame.q, frame.w)
                .transpose()
                .inverse();
            [inverse.z_axis, inverse.x_axis, inverse.y_axis]
        };
        Self {
            frame,
            flat,
            first: first.min(flat.count),
            axes: frame.sides.map_or_else(axes, |sides| sides.axes),
        }
    }

    /// The light's corners; two for a linear light.
    #[must_use]
    pub fn light(&self) -> &'a [[f64; 2]] {
        &self.frame.corners[..self.frame.corner_count]
    }

    /// The image of each candidate or piece of a candidate, in either winding. They reach beyond
    /// the light; together they cover exactly what is hidden of it. An edge that two triangles of
    /// a mesh share has the same ends in both images, to the bit.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [[f64; 2]; 3]> + 'a {
        let flat = self.flat;
        (self.first..flat.count).map(move |i| flat.get(i))
    }

    /// The point of the light's plane at (p, q), relative to the shading point.
    #[must_use]
    pub fn place(&self, [p, q]: [f64; 2]) -> DVec3 {
        self.axes[0] + self.axes[1] * p + self.axes[2] * q
    }

    /// The place (0, 0) relative to the shading point, and the vectors along p and q.
    #[must_use]
    pub const fn axes(&self) -> [DVec3; 3] {
        self.axes
    }
}
