//! Shading points: where a camera ray meets the scene.

use linelit_geometry::DVec3;
use linelit_scene::Bounce;
use std::ops::{Deref, DerefMut};

/// The distance by which a shading point is lifted off its surface, relative to its largest
/// coordinate plus the size of its triangle: 2⁻⁴⁶, which is 128 units of `f64` roundoff.
///
/// A point that is interpolated between the corners in `f64` lies within 10 units of the triangle's
/// plane: products, sums and weights that add up to one but for rounding take 8, the coordinates
/// that visibility is asked in 2. The rest keeps the triangle itself from hiding any light above
/// its horizon: the signed volume that tells the point's side is rounded too.
pub const SURFACE_OFFSET: f64 = 128.0 * 0.5 * f64::EPSILON;

/// A point of the scene that a ray meets: what estimators ask about it (it derefs to that), and
/// what a picture shows beside the lights' light.
#[derive(Clone, Debug)]
pub struct ShadingPoint {
    /// Position, normals, direction to the viewer, reflection.
    pub shading: linelit_estimators::ShadingPoint,
    /// Index into the scene's materials.
    pub material: u32,
    /// Distance of the position from the surface.
    pub lift: f64,
    /// Directions in which perfect mirrors and glass send the view on; empty for most.
    pub bounces: Vec<Bounce>,
    /// Radiance that the surface itself emits towards the viewer, W/(m²·sr).
    pub emitted: DVec3,
}

impl ShadingPoint {
    /// Whether the material's light has a closed form along a line and over a polygon.
    #[must_use]
    pub fn has_closed_form(&self) -> bool {
        self.shading.known().closed_form().is_some()
    }
}

impl Deref for ShadingPoint {
    type Target = linelit_estimators::ShadingPoint;

    fn deref(&self) -> &Self::Target {
        &self.shading
    }
}

impl DerefMut for ShadingPoint {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.shading
    }
}
