//! Shading points: where a camera ray meets the scene.

use linelit_bsdf::{Bsdf, Reflection};
use linelit_geometry::DVec3;
use linelit_scene::Bounce;

/// How far a shading point is lifted off its surface, relative to the size of its coordinates and
/// of its triangle: sixteen units of `f32` roundoff (6e-8), above what single-precision visibility
/// kernels can confuse.
pub const SURFACE_OFFSET: f64 = 16.0 * 5.96e-8;

/// Everything an estimator needs to know about a point of a surface.
#[derive(Clone, Debug)]
pub struct ShadingPoint {
    /// The point, lifted off its surface by [`SURFACE_OFFSET`] to the side of the viewer.
    pub position: DVec3,
    /// How far.
    pub lift: f64,
    /// Unit geometric normal, on the viewer's side.
    pub geometric_normal: DVec3,
    /// Unit shading normal, on the viewer's side of the surface.
    pub normal: DVec3,
    /// Unit direction to the viewer.
    pub outgoing: DVec3,
    /// The material at the point.
    pub bsdf: Bsdf,
    /// Where perfect mirrors and glass send the view on; empty for most.
    pub bounces: Vec<Bounce>,
    /// Radiance that the surface itself emits towards the viewer, W/(m²·sr).
    pub emitted: DVec3,
}

impl ShadingPoint {
    /// Whether the material's light has a closed form along a line and over a polygon.
    #[must_use]
    pub fn has_closed_form(&self) -> bool {
        self.bsdf.closed_form().is_some()
    }

    /// The cosine at the shading point towards `w` (unit): zero below the shading normal's or the
    /// geometric horizon.
    #[inline]
    #[must_use]
    pub fn cosine(&self, w: DVec3) -> f64 {
        if self.geometric_normal.dot(w) > 0.0 {
            self.normal.dot(w).max(0.0)
        } else {
            0.0
        }
    }
}
