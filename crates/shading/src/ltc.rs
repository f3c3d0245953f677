//! Linearly transformed cosines: GGX reflection over a polygon and along a line, in closed form.
//!
//! A linear map M takes the cosine lobe cos θ/π to a lobe shaped like a glossy reflection times the
//! receiver's cosine; integrals over the lobe are Lambert integrals over the light mapped by M⁻¹.
//! The maps are fitted by `cargo xtask fit-ltc`, over roughness and inclination, once for the lobe
//! without Fresnel reflectance and once for its grazing part, whose sum with the weights F0 and 1 −
//! F0 is the reflection.
//!
//! **Error**: that of the fit, not of the arithmetic: see [`FIT_ERROR`]. Another quadrature of the
//! table as it is used (`cargo xtask fit-ltc --verify`) finds an L1 error of 0.01 to 0.05 where the
//! view is 14° off the normal, 0.1 to 0.3 at 64°, and 0.13 to 0.58 at 84°: there GGX is cut off by
//! the horizon, in the middle of its peak, which a transformed cosine cannot be.
//!
//! **Source**: Heitz, Dupuy, Hill & Neubelt 2016; for lines Heitz & Hill 2017 and Peters 2021, eq.
//! 5.

use crate::ltc_table::{SIZE, TABLE};
use crate::{cylinder, horizon, polygon};
use linelit_geometry::finite::{fraction, nonnegative};
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use std::f64::consts::PI;

pub use crate::ltc_table::FIT_ERROR;

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
        let mut mapped = [DVec3::ZERO; ConvexPolygon::CAPACITY + 2];
        let count = polygon::clip_to_horizon(vertices, frame.z, &mut mapped);
        for v in &mut mapped[..count] {
            *v = self.to_cosine * frame.to_local(*v);
        }
        nonnegative(self.albedo / PI * polygon::irradiance(&mapped[..count], DVec3::Z))
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
        let side = local(crate::exact::area_vector(p0, p1)).normalize_or_zero();
        let width = (self.to_world.transpose() * side).length();
        if !(width > 0.0) {
            return 0.0;
        }
        let [a, b] = [clipped.p0, clipped.p1].map(|p| self.to_cosine * local(p));
        nonnegative(self.albedo / PI * cylinder::irradiance(a, b, DVec3::Z) / width)
    }
}

/// Isotropic GGX reflection as two lobes: what is reflected whatever the angle (weight F0), and the
/// rise towards grazing angles by Schlick's (1 − cos)⁵ (weight 1 − F0). So F0 needs no axis of the
/// table and its dependence is exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxLobes {
    lobes: [Ltc; 2],
}

impl GgxLobes {
    /// The fitted lobes: `roughness` from 0 to 1 (α = roughness²; below [`MIN_ROUGHNESS`] treated
    /// like it), the cosine of the view direction, and the reflectance `f0` at normal incidence of
    /// one channel.
    ///
    /// The local frame has z along the normal and x towards the viewer
    /// ([`Frame::from_normal_and_tangent`] of the normal and ω_o).
    ///
    /// ```
    /// use linelit_shading::ltc::GgxLobes;
    /// let mirror = GgxLobes::new(0.3, 0.8, 1.0);
    /// assert!(mirror.albedo() > 0.98 && mirror.albedo() < 1.0);
    /// ```
    #[must_use]
    pub fn new(roughness: f64, cosine: f64, f0: f64) -> Self {
        let (row, f0) = (lookup(roughness, cosine), fraction(f0));
        let lobe = |entries: &[f64], albedo: f64| {
            let to_world = DMat3::from_cols(
                DVec3::new(entries[0], 0.0, entries[1]),
                DVec3::new(0.0, entries[2], 0.0),
                DVec3::new(entries[3], 0.0, 1.0),
            );
            Ltc::new(to_world, albedo)
        };
        Self {
            lobes: [
                lobe(&row[2..6], f0 * row[0]),
                lobe(&row[6..10], (1.0 - f0) * row[1]),
            ],
        }
    }

    /// The lobes: of weight F0, and of weight 1 − F0.
    #[must_use]
    pub const fn lobes(&self) -> &[Ltc; 2] {
        &self.lobes
    }

    /// The directional albedo.
    #[must_use]
    pub fn albedo(&self) -> f64 {
        self.lobes[0].albedo + self.lobes[1].albedo
    }

    /// What stands for f cos, 1/sr, in a unit direction of the local frame.
    #[must_use]
    pub fn value(&self, w: DVec3) -> f64 {
        nonnegative(self.lobes.iter().map(|l| l.albedo * l.density(w)).sum())
    }

    /// The radiance reflected for each unit of radiance of a polygon; see [`Ltc::polygon`].
    #[must_use]
    pub fn polygon(&self, frame: &Frame, vertices: &[DVec3]) -> f64 {
        nonnegative(self.lobes.iter().map(|l| l.polygon(frame, vertices)).sum())
    }

    /// The radiance reflected for each unit of radiance × radius of a thin cylinder, 1/length; see
    /// [`Ltc::line`].
    #[must_use]
    pub fn line(&self, frame: &Frame, p0: DVec3, p1: DVec3) -> f64 {
        nonnegative(self.lobes.iter().map(|l| l.line(frame, p0, p1)).sum())
    }
}

/// A row of the table: albedo without Fresnel, albedo of its grazing part, and four matrix entries
/// of each (columns first: m00, m20, m11, m02, with m22 = 1), interpolated.
fn lookup(roughness: f64, cosine: f64) -> [f64; 10] {
    let cells = f64::from(u16::try_from(SIZE - 1).unwrap_or(1));
    let place = |x: f64| {
        let x = fraction(x) * cells;
        let cell = x.floor().min(cells - 1.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to SIZE − 2"
        )]
        let index = cell as usize;
        (index, x - cell)
    };
    let (i, s) = place((roughness - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS));
    let (j, t) = place((1.0 - fraction(cosine)).sqrt());
    let at = |i: usize, j: usize, k: usize| f64::from(TABLE[i * SIZE + j][k]);
    std::array::from_fn(|k| {
        (at(i, j, k) * (1.0 - t) + at(i, j + 1, k) * t) * (1.0 - s)
            + (at(i + 1, j, k) * (1.0 - t) + at(i + 1, j + 1, k) * t) * s
    })
}

/// The smallest roughness of the table; smaller ones are treated like it.
pub const MIN_ROUGHNESS: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;
    use linelit_bsdf::microfacet::TrowbridgeReitz;
    use linelit_bsdf::{Fresnel, Reflector};
    use linelit_testkit::assert_close;
    use linelit_testkit::quadrature::gauss_legendre;

    fn tilted(roughness: f64, cosine: f64, f0: f64) -> (GgxLobes, Frame) {
        let n = DVec3::new(0.3, -0.2, 0.9).normalize();
        let tangent = n.cross(DVec3::X).normalize();
        let wo = n * cosine + tangent * (1.0 - cosine * cosine).sqrt();
        (
            GgxLobes::new(roughness, cosine, f0),
            Frame::from_normal_and_tangent(n, wo),
        )
    }

    /// The closed form over a light against 40 × 40 Gauss nodes of the density on it.
    #[test]
    fn polygon_is_the_integral_of_the_density() {
        let rule = gauss_legendre(40);
        for (roughness, cosine) in [(0.3, 0.9), (0.5, 0.4), (1.0, 0.7)] {
            let (ltc, frame) = tilted(roughness, cosine, 0.5);
            let (o, u, v) = (frame.z * 2.0 + frame.x * -0.5, frame.x * 0.7, frame.y * 0.6);
            let quad = [o, o + u, o + u + v, o + v];
            let normal = u.cross(v);
            let inside = |s: f64, t: f64| {
                let p = o + u * s + v * t;
                let r = p.length();
                ltc.value(frame.to_local(p / r)) * normal.dot(p).abs() / (r * r * r)
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
        let (ltc, frame) = tilted(0.6, 0.5, 0.2);
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

    /// The lobe against GGX itself, over the hemisphere: within the published error of the fit.
    #[test]
    fn lobes_are_as_near_to_ggx_as_published() {
        let rule = gauss_legendre(64);
        for (roughness, cosine) in [(0.4, 0.95), (0.55, 0.5), (0.8, 0.3), (0.95, 0.8)] {
            let ggx = Reflector {
                reflectance: DVec3::ONE,
                facets: TrowbridgeReitz::isotropic(roughness * roughness),
                fresnel: Fresnel::Schlick {
                    f0: DVec3::splat(0.3),
                    f90: 1.0,
                },
            };
            let ltc = GgxLobes::new(roughness, cosine, 0.3);
            let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let gap = |z: f64, phi: f64| {
                let r = (1.0 - z * z).sqrt();
                let w = DVec3::new(r * phi.cos(), r * phi.sin(), z);
                (ltc.value(w) - ggx.value(w, wo).x * z).abs()
            };
            let l1 = 2.0 / ltc.albedo() * rule.integrate_2d([0.0, 1.0], [0.0, PI], gap);
            assert!(
                l1 < FIT_ERROR,
                "roughness {roughness} cosine {cosine}: {l1}"
            );
        }
    }
}
