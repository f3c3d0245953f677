//! A shading point is a point where a camera ray, or its reflection, meets a surface of the scene.

use linelit_geometry::DVec3;
use linelit_scene::Bounce;
use std::ops::{Deref, DerefMut};

/// A point of the scene that a ray meets. It has what estimators need, to which it dereferences,
/// and what a picture shows in addition to the light of the scene's lights.
#[derive(Clone, Debug)]
pub struct ShadingPoint {
    /// The position, the normals, the direction to the viewer, and the reflection.
    pub shading: linelit_estimators::ShadingPoint,
    /// The index of the material among the scene's materials.
    pub material: u32,
    /// The distance by which the position is lifted off the surface.
    pub lift: f64,
    /// The directions in which a perfect mirror or glass reflects or refracts the view; empty for
    /// most surfaces.
    pub bounces: Vec<Bounce>,
    /// The radiance that the surface itself emits towards the viewer, W/(m²·sr).
    pub emitted: DVec3,
}

impl ShadingPoint {
    /// Returns whether the material's reflected light has a closed form along lines, and over
    /// polygons unless it has Gaussian lobes.
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
