//! This module samples a polygon uniformly by solid angle after a linear map, so that points follow
//! a linearly transformed cosine (LTC).

#[cfg(doc)]
use crate::AngularLines;
use crate::density::{Pdf, SolidAngle};
use crate::samples::PointSample;
use crate::{PointTechnique, SolidAngleSampler};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3};

/// Samples a convex polygon, as seen from x, uniformly by the solid angle of its image: the polygon
/// that the linear map M⁻¹ makes of it, clipped to the horizon z = 0. With ω the direction to a
/// point and c = M⁻¹ω/|M⁻¹ω|, the density is |det M⁻¹|/(|M⁻¹ω|³ Ω) where c.z > 0; Ω is the solid
/// angle of the image.
///
/// An LTC is this density times Ω c.z/π, so that the weights of samples vary by the cosine c.z
/// only. To follow the cosine as well, by [`AngularLines::by_projected_solid_angle`] of the image,
/// would take 17 times as long for each sample.
///
/// **Domain**: M maps cosine space, in which z is the axis of the cosine, to the world. There is no
/// sampler if the image of the light is not a polygon: if the image is seen edge-on, or its
/// coordinates are beyond the range of [`ConvexPolygon`]. **Source**: Heitz, Dupuy, Hill & Neubelt
/// 2016, for the map.
///
/// ```
/// use linelit_lights::geometry::{ConvexPolygon, DMat3, DVec3};
/// use linelit_lights::{PointTechnique, TransformedSampler};
/// let light = ConvexPolygon::parallelogram(DVec3::Z, DVec3::X, DVec3::Y).unwrap();
/// // A lobe a fifth as wide as the cosine.
/// let map = DMat3::from_diagonal(DVec3::new(0.2, 0.2, 1.0));
/// let sampler = TransformedSampler::new(&light, DVec3::ZERO, map).unwrap();
/// let sample = sampler.sample([0.3, 0.7]);
/// let u = sampler.invert(sample.point).unwrap();
/// assert!((u[0] - 0.3).abs() < 1e-13 && (u[1] - 0.7).abs() < 1e-13);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct TransformedSampler {
    image: SolidAngleSampler,
    x: DVec3,
    map: DMat3,
    inverse: DMat3,
    /// |det M⁻¹|.
    shrink: f64,
}

impl TransformedSampler {
    /// Sets the technique up for one light, the shading point `x` and a map. `None` if no part of
    /// the image is above its horizon, or the image is not a polygon.
    #[must_use]
    pub fn new(light: &ConvexPolygon, x: DVec3, map: DMat3) -> Option<Self> {
        let determinant = map.determinant();
        let inverse = map.inverse();
        let shrink = 1.0 / determinant.abs();
        if !(shrink > 0.0 && shrink <= f64::MAX && inverse.is_finite()) {
            return None;
        }
        let mut image = light.mapped(inverse, x)?;
        if image.vertices().iter().any(|v| v.z < 0.0) {
            image = image.clip(DVec3::ZERO, DVec3::Z)?;
        }
        let image = SolidAngleSampler::new(&image, DVec3::ZERO);
        (image.solid_angle() > 0.0).then_some(Self {
            image,
            x,
            map,
            inverse,
            shrink,
        })
    }

    /// Returns the polygon that the map makes of the light in cosine space, relative to the origin
    /// and clipped to the horizon there, to rounding. The integral of the LTC over the light is the
    /// integral of the cosine over this image.
    #[must_use]
    pub const fn image(&self) -> &ConvexPolygon {
        self.image.polygon()
    }

    /// Returns the density at the point of the light whose vector from the shading point is
    /// `to_light`, and whose mapped vector in cosine space is `image`.
    fn density(&self, to_light: DVec3, image: DVec3) -> Pdf<SolidAngle> {
        let stretch = to_light.length() / image.length();
        Pdf::new(self.shrink * stretch * stretch * stretch / self.image.solid_angle())
    }
}

impl PointTechnique for TransformedSampler {
    type Measure = SolidAngle;

    fn sample(&self, u: [f64; 2]) -> PointSample<SolidAngle> {
        let image = self.image.sample(u).point;
        let to_light = self.map * image;
        let point = self.x + to_light;
        if !point.is_finite() {
            return PointSample::none(self.x);
        }
        PointSample {
            point,
            pdf: self.density(to_light, image),
        }
    }

    fn pdf(&self, point: DVec3) -> Pdf<SolidAngle> {
        let to_light = point - self.x;
        let image = self.inverse * to_light;
        if image.z > 0.0 {
            self.density(to_light, image)
        } else {
            Pdf::ZERO
        }
    }

    fn invert(&self, point: DVec3) -> Option<[f64; 2]> {
        self.image.invert(self.inverse * (point - self.x))
    }
}
