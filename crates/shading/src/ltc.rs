//! Linearly transformed cosines over a polygon and along a line, in closed form.
//!
//! A linear map M takes the cosine lobe cos θ/π to a lobe shaped like a glossy reflection times the
//! receiver's cosine; integrals over the lobe are Lambert integrals over the light mapped by M⁻¹.
//! Which map fits which reflection is for `linelit-bsdf` to say.
//!
//! **Source**: Heitz, Dupuy, Hill & Neubelt 2016; for lines Heitz & Hill 2017 and Peters 2021, eq.
//! 5.

use crate::exact::{area_vector, direction};
use crate::{cylinder, horizon, polygon};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use std::f64::consts::PI;

/// A lobe: a linearly transformed cosine and the part of the light that it reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ltc {
    /// M, from the cosine's space to the surface's local frame.
    to_world: DMat3,
    /// M⁻¹.
    to_cosine: DMat3,
    /// The directional albedo: ∫ f cos dω.
    pub albedo: f64,
}

impl Ltc {
    /// The lobe of a map M (invertible) and an albedo.
    #[must_use]
    pub fn new(to_world: DMat3, albedo: f64) -> Self {
        Self {
            to_world,
            to_cosine: to_world.inverse(),
            albedo,
        }
    }

    /// M, from the cosine's space to the surface's local frame: what a sampler of the lobe needs.
    #[must_use]
    pub const fn map(&self) -> DMat3 {
        self.to_world
    }

    /// M⁻¹, to the cosine's space.
    #[must_use]
    pub const fn to_cosine(&self) -> DMat3 {
        self.to_cosine
    }

    /// The density of the lobe in a unit direction of the local frame, per solid angle; it
    /// integrates to one over the sphere. Times the albedo it stands for f cos. Zero for a map
    /// without an inverse.
    #[must_use]
    pub fn density(&self, w: DVec3) -> f64 {
        let c = self.to_cosine * w;
        let r2 = c.length_squared();
        nonnegative((c.z.max(0.0) / (r2 * r2)) * self.to_cosine.determinant().abs() / PI)
    }

    /// The radiance reflected for each unit of radiance of a polygon (vertices relative to the
    /// shading point, in world space; at most [`ConvexPolygon::CAPACITY`]).
    ///
    /// **Formula**: albedo/π times [`polygon::irradiance`] of the polygon mapped by M⁻¹, clipped to
    /// the horizon before the map (and to the cosine's own after).
    #[must_use]
    pub fn polygon(&self, frame: &Frame, vertices: &[DVec3]) -> f64 {
        self.over(frame, vertices, polygon::irradiance)
    }

    /// [`polygon`](Self::polygon) with the absolute error of [`polygon::irradiance_by_edges`].
    #[must_use]
    pub fn polygon_by_edges(&self, frame: &Frame, vertices: &[DVec3]) -> f64 {
        self.over(frame, vertices, polygon::irradiance_by_edges)
    }

    fn over(
        &self,
        frame: &Frame,
        vertices: &[DVec3],
        irradiance: impl Fn(&[DVec3], DVec3) -> f64,
    ) -> f64 {
        let mut mapped = [DVec3::ZERO; ConvexPolygon::CAPACITY + 2];
        let count = polygon::clip_to_horizon(vertices, frame.z, &mut mapped);
        for v in &mut mapped[..count] {
            *v = self.to_cosine * frame.to_local(*v);
        }
        nonnegative(self.albedo / PI * irradiance(&mapped[..count], DVec3::Z))
    }

    /// The radiance reflected for each unit of radiance × radius of a thin cylinder, 1/length.
    ///
    /// **Formula**: albedo/π times [`cylinder::irradiance`] of the line mapped by M⁻¹, divided by
    /// the change of its radius, |Mᵀ(s × l0)|/|s × l0| (s the line's direction, l0 a point of it).
    #[must_use]
    pub fn line(&self, frame: &Frame, p0: DVec3, p1: DVec3) -> f64 {
        let Some(clipped) = horizon::clip_segment(p0, p1, frame.z) else {
            return 0.0;
        };
        let local = |p: DVec3| frame.to_local(p);
        let side = direction(local(area_vector(p0, p1)));
        let width = (self.to_world.transpose() * side).length();
        if !(width > 0.0) {
            return 0.0;
        }
        let [a, b] = [clipped.p0, clipped.p1].map(|p| self.to_cosine * local(p));
        nonnegative(self.albedo / PI * cylinder::irradiance(a, b, DVec3::Z) / width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_testkit::assert_close;
    use linelit_testkit::quadrature::gauss_legendre;

    /// A lobe as wide as `width`, leaning from the viewer and up.
    fn tilted(width: f64, skew: f64) -> (Ltc, Frame) {
        let n = DVec3::new(0.3, -0.2, 0.9).normalize();
        let x = DVec3::new(1.3 * width, 0.0, 0.2 * width);
        let map = DMat3::from_cols(x, DVec3::Y * width, DVec3::new(skew, 0.0, 1.0));
        (Ltc::new(map, 0.7), Frame::from_normal(n))
    }

    /// The closed form over a light against 40 × 40 Gauss nodes of the density on it.
    #[test]
    fn polygon_is_the_integral_of_the_density() {
        let rule = gauss_legendre(40);
        for (width, skew) in [(0.2, -0.4), (0.4, -1.5), (0.9, 0.3)] {
            let (ltc, frame) = tilted(width, skew);
            let (o, u, v) = (frame.z * 2.0 + frame.x * -0.5, frame.x * 0.7, frame.y * 0.6);
            let quad = [o, o + u, o + u + v, o + v];
            let normal = u.cross(v);
            let inside = |s: f64, t: f64| {
                let p = o + u * s + v * t;
                let r = p.length();
                ltc.albedo * ltc.density(frame.to_local(p / r)) * normal.dot(p).abs() / (r * r * r)
            };
            let want = rule.integrate_2d([0.0, 1.0], [0.0, 1.0], inside);
            assert_close!(
                ltc.polygon(&frame, &quad),
                want,
                rel = 1e-11,
                "smooth over the light: 1e-13"
            );
        }
    }

    /// A strip of width 2R facing the shading point, R → 0: the relative difference falls like R².
    #[test]
    fn line_is_the_limit_of_a_thin_strip() {
        let (ltc, frame) = tilted(0.4, -0.6);
        let (p0, p1) = (frame.z + frame.x * -0.8, frame.z * 1.5 + frame.y * 0.4);
        let side = p0.cross(p1).normalize();
        for radius in [1e-2, 1e-3, 1e-4] {
            let r = side * radius;
            let strip = ltc.polygon(&frame, &[p0 - r, p1 - r, p1 + r, p0 + r]) / radius;
            assert_close!(
                ltc.line(&frame, p0, p1),
                strip,
                rel = 20.0 * radius * radius + 1e-10,
                "second order in the width"
            );
        }
    }
}
