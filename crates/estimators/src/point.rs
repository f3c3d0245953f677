//! The point whose light is estimated.

use linelit_bsdf::{Bsdf, Known, Reflection};
use linelit_geometry::{DVec3, Vector3, predicates};
use linelit_lights::Viewer;

/// The distance by which a shading point is lifted off its surface, relative to its largest
/// coordinate plus the size of its triangle: 2⁻⁴⁶, which is 128 units of `f64` roundoff.
///
/// A point that is interpolated between the corners in `f64` lies within 10 units of the triangle's
/// plane: products, sums and weights that add up to one but for rounding take 8, the coordinates
/// that visibility is asked in 2. The rest keeps the triangle itself from hiding any light above
/// its horizon: the signed volume that tells the point's side is rounded too.
pub const SURFACE_OFFSET: f64 = 128.0 * 0.5 * f64::EPSILON;

/// A point of a surface with its reflection and the direction to its viewer.
///
/// `R` is the reflection: [`Bsdf`] or any type that implements [`Reflection`]. All vectors are in
/// the world and of unit length: [`ShadingPoint::new`] sees to it; of fields that are set by hand
/// `estimate` asserts it in debug builds.
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

/// A shading point without its reflection: all that light in closed form asks of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub position: DVec3,
    pub normal: DVec3,
    pub geometric_normal: DVec3,
    pub outgoing: DVec3,
}

impl Receiver {
    /// The normals of the horizons that cut lights, the shading normal first.
    pub(crate) const fn horizons(&self) -> [DVec3; 2] {
        [self.normal, self.geometric_normal]
    }

    /// Whether the surface's own horizon is another than that of the shading normal.
    pub(crate) fn has_two_horizons(&self) -> bool {
        self.normal != self.geometric_normal
    }

    /// The receiver as shapes of lights ask for it, without transformed cosines.
    pub(crate) const fn viewer(&self) -> Viewer<'static> {
        Viewer {
            position: self.position,
            normal: self.normal,
            geometric_normal: self.geometric_normal,
            cosines: None,
        }
    }
}

impl<R> ShadingPoint<R> {
    /// Asserts in debug builds that the normals and the direction to the viewer are unit vectors,
    /// to the rounding of single numbers; or zero, as those of a degenerate surface are.
    pub(crate) fn assert_unit_vectors(&self) {
        let is_unit = |v: DVec3| v == DVec3::ZERO || (v.length_squared() - 1.0).abs() < 1e-5;
        let vectors = [self.normal, self.geometric_normal, self.outgoing];
        debug_assert!(
            vectors.into_iter().all(is_unit),
            "unit vectors: {vectors:?}"
        );
    }

    /// The point without its reflection.
    pub(crate) const fn receiver(&self) -> Receiver {
        Receiver {
            position: self.position,
            normal: self.normal,
            geometric_normal: self.geometric_normal,
            outgoing: self.outgoing,
        }
    }
}

impl<R: Reflection> ShadingPoint<R> {
    /// A point of a flat surface: the geometric normal is the shading normal. `position` must be
    /// lifted off the surface if the surface is among the occluders. `normal` and `outgoing` may be
    /// of any length but zero, and are made unit vectors.
    ///
    /// ```
    /// use linelit_estimators::ShadingPoint;
    /// use linelit_estimators::bsdf::{Bsdf, Lambert};
    /// use linelit_estimators::geometry::DVec3;
    /// let bsdf = Bsdf::Lambert(Lambert { albedo: DVec3::ONE });
    /// let point = ShadingPoint::new([0.0; 3], [0.0, 0.0, 2.0], [0.0, 4.0, 0.0], bsdf);
    /// assert_eq!([point.normal, point.outgoing], [DVec3::Z, DVec3::Y]);
    /// ```
    #[must_use]
    pub fn new(
        position: impl Vector3,
        normal: impl Vector3,
        outgoing: impl Vector3,
        bsdf: R,
    ) -> Self {
        let normal = unit(normal.dvec3());
        Self {
            position: position.dvec3(),
            geometric_normal: normal,
            normal,
            outgoing: unit(outgoing.dvec3()),
            bsdf,
        }
    }

    /// The part of the reflection that integrals in closed form know.
    pub fn known(&self) -> Known<'_> {
        self.bsdf.known(self.outgoing, self.normal)
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

/// The unit vector along `v`, which keeps its bits where it is one to rounding; zero of zero.
fn unit(v: DVec3) -> DVec3 {
    if (v.length_squared() - 1.0).abs() <= 8.0 * f64::EPSILON {
        v
    } else {
        predicates::normalize(v).unwrap_or(DVec3::ZERO)
    }
}
