//! Shading points: where a camera ray meets the scene.

use linelit_geometry::DVec3;
use linelit_scene::Bounce;
use std::ops::{Deref, DerefMut};

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
