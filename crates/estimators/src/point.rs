//! The point whose light is estimated.

use linelit_bsdf::{Bsdf, Reflection};
use linelit_geometry::{DVec3, Vector3};

/// A point of a surface, what it reflects and who looks at it.
///
/// `R` is the reflection: [`Bsdf`] or any type that implements [`Reflection`]. All vectors are in
/// the world and of unit length.
#[derive(Clone, Debug)]
pub struct ShadingPoint<R = Bsdf> {
    /// The point, lifted off its surface towards the viewer by more than `f32` rounding.
    pub position: DVec3,
    /// The geometric normal, on the viewer's side.
    pub geometric_normal: DVec3,
    /// The shading normal, on the viewer's side of the surface.
    pub normal: DVec3,
    /// The direction to the viewer.
    pub outgoing: DVec3,
    /// The reflection at the point.
    pub bsdf: R,
}

impl<R> ShadingPoint<R> {
    /// The normals of the horizons that cut lights, the shading normal first.
    pub(crate) const fn horizons(&self) -> [DVec3; 2] {
        [self.normal, self.geometric_normal]
    }
}

impl<R: Reflection> ShadingPoint<R> {
    /// A point of a flat surface: the geometric normal is the shading normal. `position` must be
    /// lifted off the surface if the surface is among the occluders.
    #[must_use]
    pub fn new(
        position: impl Vector3,
        normal: impl Vector3,
        outgoing: impl Vector3,
        bsdf: R,
    ) -> Self {
        let normal = normal.dvec3();
        Self {
            position: position.dvec3(),
            geometric_normal: normal,
            normal,
            outgoing: outgoing.dvec3(),
            bsdf,
        }
    }

    /// The cosine at the shading point towards the unit vector `w`: zero below the horizon of the
    /// shading normal or of the geometric one.
    #[inline]
    #[must_use]
    pub fn cosine(&self, w: DVec3) -> f64 {
        if self.geometric_normal.dot(w) > 0.0 {
            self.normal.dot(w).max(0.0)
        } else {
            0.0
        }
    }

    /// Radiance that is reflected to the viewer of the radiance `emitted` from the unit direction
    /// `w`, per solid angle: L f_r cos θ.
    #[inline]
    #[must_use]
    pub fn reflected(&self, emitted: DVec3, w: DVec3) -> DVec3 {
        let cosine = self.cosine(w);
        if cosine <= 0.0 {
            return DVec3::ZERO;
        }
        emitted * self.bsdf.eval(w, self.outgoing, self.normal) * cosine
    }
}
