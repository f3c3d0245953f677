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

/// A lobe of a reflection times the receiver's cosine, as a cosine under a linear map M: about
/// albedo · p(ω) with p(ω) = max(0, c.z)/π |det M⁻¹|/|c|⁴ and c = M⁻¹ω.
///
/// **Source**: Heitz, Dupuy, Hill & Neubelt 2016.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedCosine {
    /// M, from the cosine's space (its axis is z) to the local frame of the surface (its normal is
    /// z); invertible.
    pub map: DMat3,
    /// About ∫ f cos dω of the lobe over the hemisphere, by channel.
    pub albedo: DVec3,
}

impl TransformedCosine {
    /// p(ω), the density of the lobe in a unit direction of the local frame, per solid angle; it
    /// integrates to one over the sphere. Zero for a map without an inverse.
    #[must_use]
    pub fn density(&self, w: DVec3) -> f64 {
        Ltc::new(self.map, 1.0).density(w)
    }

    /// The lobe of a reflection scaled by a colour.
    #[must_use]
    pub fn scaled(self, scale: DVec3) -> Self {
        Self {
            albedo: self.albedo * scale,
            ..self
        }
    }
}

/// An approximation of a reflection times the receiver's cosine, from one direction, by a sum of
/// linearly transformed cosines: the cosine itself, and lobes.
///
/// It is what samples of lights are drawn by and weighed with, so only noise depends on how near it
/// is. It may be zero where the reflection is not: combine it with a technique that is not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformedCosines {
    /// The local frame of the maps: z is the normal.
    pub frame: Frame,
    /// The albedo of what the cosine itself stands for, by channel.
    pub diffuse: DVec3,
    lobes: [TransformedCosine; Self::MAX],
    count: usize,
}

impl TransformedCosines {
    /// The most lobes beside the cosine itself.
    pub const MAX: usize = 8;

    /// The cosine itself, in a local frame with the normal as z, and no lobe.
    #[must_use]
    pub const fn new(frame: Frame, diffuse: DVec3) -> Self {
        Self {
            frame,
            diffuse,
            lobes: [TransformedCosine {
                map: DMat3::IDENTITY,
                albedo: DVec3::ZERO,
            }; Self::MAX],
            count: 0,
        }
    }

    /// Adds a lobe, unless it is black; one too many, or one whose map is of no numbers or flat,
    /// counts as the cosine itself.
    pub fn add(&mut self, lobe: TransformedCosine) {
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

    /// These without the cosine itself, unless there are no lobes.
    #[must_use]
    pub const fn lobes_alone(mut self) -> Self {
        if self.count > 0 {
            self.diffuse = DVec3::ZERO;
        }
        self
    }

    /// The lobes beside the cosine itself.
    #[must_use]
    pub fn lobes(&self) -> &[TransformedCosine] {
        &self.lobes[..self.count]
    }
}
