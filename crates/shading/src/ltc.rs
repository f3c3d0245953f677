//! This module integrates linearly transformed cosines (LTCs) over a polygon and along a line, in
//! closed form.
//!
//! A linear map M transforms the cosine lobe cos θ/π to a lobe with the shape of a glossy
//! reflection times the receiver's cosine. Integrals over the lobe are Lambert integrals over the
//! light mapped by M⁻¹. The maps that fit reflections are in `linelit-bsdf`.
//!
//! **Source**: Heitz, Dupuy, Hill & Neubelt 2016; for lines Heitz & Hill 2017 and Peters 2021, eq.
//! 5.

use crate::exact::{area_vector, direction};
use crate::{cylinder, horizon, polygon};
use linelit_geometry::finite::nonnegative;
use linelit_geometry::{ConvexPolygon, DMat3, DVec3, Frame};
use std::f64::consts::PI;

/// A linearly transformed cosine with the fraction of the light that it reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ltc {
    /// The map M, from the cosine's space to the surface's local frame.
    to_world: DMat3,
    /// The map M⁻¹.
    to_cosine: DMat3,
    /// The directional albedo: ∫ f cos dω.
    pub albedo: f64,
}

impl Ltc {
    /// Makes the LTC of a map M, which must be invertible, and an albedo.
    #[must_use]
    pub fn new(to_world: DMat3, albedo: f64) -> Self {
        Self {
            to_world,
            to_cosine: to_world.inverse(),
            albedo,
        }
    }

    /// Returns the map M, from the cosine's space to the surface's local frame, which a sampler
    /// needs.
    #[must_use]
    pub const fn map(&self) -> DMat3 {
        self.to_world
    }

    /// Returns the map M⁻¹, to the cosine's space.
    #[must_use]
    pub const fn to_cosine(&self) -> DMat3 {
        self.to_cosine
    }

    /// Returns the density of the lobe in a unit direction of the local frame, per solid angle; it
    /// integrates to one over the sphere. The density times the albedo approximates f cos. It is
    /// zero for a map without an inverse.
    #[must_use]
    pub fn density(&self, w: DVec3) -> f64 {
        let c = self.to_cosine * w;
        let r2 = c.length_squared();
        nonnegative((c.z.max(0.0) / (r2 * r2)) * self.to_cosine.determinant().abs() / PI)
    }

    /// Returns the radiance reflected for each unit of radiance of a polygon, whose vertices are
    /// relative to the shading point, in world space, and at most [`ConvexPolygon::CAPACITY`] in
    /// number.
    ///
    /// **Formula**: albedo/π times [`polygon::irradiance`] of the polygon mapped by M⁻¹, clipped to
    /// the horizon before the map (and to the cosine's own after).
    #[must_use]
    pub fn polygon(&self, frame: &Frame, vertices: &[DVec3]) -> f64 {
        self.over(frame, vertices, polygon::irradiance)
    }

    /// Computes [`polygon`](Self::polygon) with the absolute error of
    /// [`polygon::irradiance_by_edges`].
    #[must_use]
    pub fn polygon_by_edges(&self, frame: &Frame, vertices: &[DVec3]) -> f64 {
        self.over(frame, vertices, polygon::irradiance_by_edges)
    }

    /// Integrates over a polygon: it is clipped to the horizon, and mapped to the cosine's space.
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

    /// Returns the radiance reflected for each unit of radiance × radius of a thin cylinder, in
    /// 1/length.
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

/// A lobe of a reflection times the receiver's cosine, approximated by a cosine under a linear map
/// M: albedo · p(ω) with p(ω) = max(0, c.z)/π |det M⁻¹|/|c|⁴ and c = M⁻¹ω.
///
/// **Source**: Heitz, Dupuy, Hill & Neubelt 2016.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LtcLobe {
    /// The map M, from the cosine's space (whose axis is z) to the local frame of the surface
    /// (whose normal is z); it must be invertible.
    pub map: DMat3,
    /// The approximate integral ∫ f cos dω of the lobe over the hemisphere, by channel.
    pub albedo: DVec3,
}

impl LtcLobe {
    /// Returns p(ω), the density of the lobe in a unit direction of the local frame, per solid
    /// angle; it integrates to one over the sphere. It is zero for a map without an inverse.
    #[must_use]
    pub fn density(&self, w: DVec3) -> f64 {
        Ltc::new(self.map, 1.0).density(w)
    }

    /// Returns the lobe with its albedo multiplied by a colour.
    #[must_use]
    pub fn scaled(self, scale: DVec3) -> Self {
        Self {
            albedo: self.albedo * scale,
            ..self
        }
    }
}

/// An approximation of a reflection times the receiver's cosine, for one outgoing direction, by a
/// sum of linearly transformed cosines (LTCs): the cosine itself, and further lobes.
///
/// Samples of lights are drawn and weighted by it, so that its accuracy affects only the noise. It
/// may be zero where the reflection is not; combine it with a technique that is positive there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LtcMixture {
    /// The local frame of the maps: z is the normal.
    pub frame: Frame,
    /// The albedo of the part that the cosine itself represents, by channel.
    pub diffuse: DVec3,
    lobes: [LtcLobe; Self::MAX],
    count: usize,
}

impl LtcMixture {
    /// The largest number of lobes in addition to the cosine itself.
    pub const MAX: usize = 8;

    /// Makes the cosine itself, in a local frame whose z is the normal, without further lobes.
    #[must_use]
    pub const fn new(frame: Frame, diffuse: DVec3) -> Self {
        Self {
            frame,
            diffuse,
            lobes: [LtcLobe {
                map: DMat3::IDENTITY,
                albedo: DVec3::ZERO,
            }; Self::MAX],
            count: 0,
        }
    }

    /// Adds a lobe unless it is black. A lobe beyond [`Self::MAX`], or one whose map is singular or
    /// not finite, is added to the cosine itself.
    pub fn add(&mut self, lobe: LtcLobe) {
        if lobe.albedo == DVec3::ZERO {
            return;
        }
        let determinant = lobe.map.determinant();
        let usable = determinant.is_finite() && determinant.abs() > 0.0;
        match self.lobes.get_mut(self.count) {
            Some(slot) if usable => {
                *slot = lobe;
                self.count += 1;
            }
            _ => self.diffuse += lobe.albedo,
        }
    }

    /// Returns the lobes without the cosine itself; if there are no lobes, the value does not
    /// change.
    #[must_use]
    pub const fn lobes_alone(mut self) -> Self {
        if self.count > 0 {
            self.diffuse = DVec3::ZERO;
        }
        self
    }

    /// Returns the lobes, without the cosine itself.
    #[must_use]
    pub fn lobes(&self) -> &[LtcLobe] {
        &self.lobes[..self.count]
    }
}
