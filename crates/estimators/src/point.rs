//! A shading point is the point whose direct light is estimated, with its reflection and the
//! direction to its viewer.

use linelit_bsdf::{Bsdf, Known, Reflection};
use linelit_geometry::{DVec3, Vector3, predicates};
use linelit_lights::Viewer;

/// The distance by which a shading point is lifted off its surface, relative to its largest
/// coordinate plus the size of its triangle: 2⁻⁴⁶, which is 128 units of `f64` roundoff.
///
/// A point that is interpolated between the corners in `f64` lies within 10 units of the triangle's
/// plane: 8 units come from products, sums and weights that add up to one but for rounding, and 2
/// from the coordinates in which visibility is queried. With the other units, the triangle itself
/// hides no light above its horizon; the signed volume by which the point's side is found is
/// rounded, too.
pub const SURFACE_OFFSET: f64 = 128.0 * 0.5 * f64::EPSILON;

/// A point of a surface with its reflection and the direction to its viewer.
///
/// `R` is the reflection: [`Bsdf`] or any type that implements [`Reflection`]. All vectors are in
/// world space and of unit length. [`ShadingPoint::new`] normalizes them; if the fields are set by
/// hand, `estimate` asserts their lengths in debug builds.
#[derive(Clone, Debug)]
pub struct ShadingPoint<R = Bsdf> {
    /// The point, which is lifted off its surface towards the viewer, for example by
    /// [`SURFACE_OFFSET`].
    pub position: DVec3,
    /// The geometric normal, on the viewer's side of the surface.
    pub geometric_normal: DVec3,
    /// The shading normal, on the viewer's side of the surface.
    pub normal: DVec3,
    /// The direction to the viewer.
    pub outgoing: DVec3,
    /// The reflection at the point.
    pub bsdf: R,
}

/// A shading point without its reflection, as closed forms need it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receiver {
    pub position: DVec3,
    pub normal: DVec3,
    pub geometric_normal: DVec3,
    pub outgoing: DVec3,
}

impl Receiver {
    /// The normals of the two horizons that clip lights, the shading normal first.
    pub(crate) const fn horizons(&self) -> [DVec3; 2] {
        [self.normal, self.geometric_normal]
    }

    /// Returns whether the geometric normal differs from the shading normal, so that there are two
    /// horizons.
    pub(crate) fn has_two_horizons(&self) -> bool {
        self.normal != self.geometric_normal
    }

    /// The receiver as the shapes of lights take it, without LTCs.
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
    /// to single precision. Zero vectors, which a degenerate surface has, are allowed, too.
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
    /// A point of a flat surface, where the geometric normal is also the shading normal. If the
    /// surface is among the occluders, `position` must be lifted off it. `normal` and `outgoing`
    /// are normalized; they may have any length but zero.
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

    /// The part of the reflection that has integrals in closed form, and what is known of the rest.
    pub fn known(&self) -> Known<'_> {
        self.bsdf.known(self.outgoing, self.normal)
    }

    /// The cosine between the shading normal and the unit vector `w`, or zero if `w` is below the
    /// horizon of the shading normal or of the geometric normal.
    #[inline]
    #[must_use]
    pub fn cosine(&self, w: DVec3) -> f64 {
        if self.geometric_normal.dot(w) > 0.0 {
            self.normal.dot(w).max(0.0)
        } else {
            0.0
        }
    }

    /// The radiance that is reflected to the viewer, per solid angle, if the radiance `emitted`
    /// arrives from the unit direction `w`: L f_r cos θ.
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

/// The unit vector along `v`. A vector that is a unit vector up to rounding keeps its bits, and a
/// zero vector remains zero.
fn unit(v: DVec3) -> DVec3 {
    if (v.length_squared() - 1.0).abs() <= 8.0 * f64::EPSILON {
        v
    } else {
        predicates::normalize(v).unwrap_or(DVec3::ZERO)
    }
}
